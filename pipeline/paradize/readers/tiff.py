"""Reads tags of the first directory of a TIFF or BigTIFF.

Source: Adobe, "TIFF 6.0", 1992, section 2; BigTIFF as libtiff 4 writes it (8-byte offsets and counts).
"""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Mapping
from typing import Any, BinaryIO, TypeAlias

Values: TypeAlias = "tuple[float, ...] | bytes"

MAX_ENTRIES = 4096
_TEXT = 2
_HEADER_BYTES = 16  # bytes
_ORDERS = {b"II": "<", b"MM": ">"}
# Of TIFF and BigTIFF: struct codes of an offset and of the number of entries, bytes of an entry and of the
# value in it, offset of the first directory's offset.
_VERSIONS = {42: ("I", "H", 12, 4, 4), 43: ("Q", "Q", 20, 8, 8)}
_CODES = {1: "B", 3: "H", 4: "I", 6: "b", 8: "h", 9: "i", 11: "f", 12: "d", 16: "Q", 17: "q", 18: "Q"}


def first_directory(file: BinaryIO, wanted: Collection[int]) -> Mapping[int, Values]:
    """The wanted tags that the file has: numbers, or the bytes of a text. Reads nothing else. Raises
    struct.error where the file is truncated, ValueError where it is not a TIFF."""
    file_size = file.seek(0, os.SEEK_END)

    def read(code: str, offset: int) -> tuple[Any, ...]:
        size = struct.calcsize(code)
        if offset + size > file_size:
            raise struct.error
        file.seek(offset)
        return struct.unpack(code, file.read(size))

    if file_size < _HEADER_BYTES or (order := _ORDERS.get(read("2s", 0)[0])) is None:
        raise ValueError("no TIFF")
    (version,) = read(f"{order}H", 2)
    if version not in _VERSIONS:
        raise ValueError("no TIFF")
    offset_code, count_code, entry_size, value_bytes, header_offset = _VERSIONS[version]
    (offset,) = read(order + offset_code, header_offset)
    (count,) = read(order + count_code, offset)
    offset += struct.calcsize("=" + count_code)
    tags: dict[int, Values] = {}
    for k in range(min(count, MAX_ENTRIES)):
        entry = offset + k * entry_size
        tag, kind = read(order + "HH", entry)
        (length,) = read(order + offset_code, entry + 4)
        if tag not in wanted or tag in tags or (kind not in _CODES and kind != _TEXT):
            continue
        start = entry + entry_size - value_bytes
        code = f"{order}{length}{_CODES.get(kind, 's')}"
        if length * struct.calcsize("=" + _CODES.get(kind, "c")) > value_bytes:
            (start,) = read(order + offset_code, start)
        values = read(code, start)
        tags[tag] = values[0] if kind == _TEXT else values
    return tags

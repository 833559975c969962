"""The first directory of a TIFF or BigTIFF: the values of its tags.

Source: Adobe, "TIFF 6.0", 1992, section 2; BigTIFF as libtiff 4 writes it (offsets and counts of 8 bytes).
"""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Mapping
from typing import Any, BinaryIO, TypeAlias

Values: TypeAlias = "tuple[float, ...] | bytes"

MOST_ENTRIES = 4096
_TEXT = 2
_LEAST = 16  # bytes of a header
_ORDERS = {b"II": "<", b"MM": ">"}
# Of TIFF and BigTIFF: codes of a place and of the number of entries, bytes of an entry and of a value in it,
# where the place of the first directory stands.
_VERSIONS = {42: ("I", "H", 12, 4, 4), 43: ("Q", "Q", 20, 8, 8)}
_CODES = {1: "B", 3: "H", 4: "I", 6: "b", 8: "h", 9: "i", 11: "f", 12: "d", 16: "Q", 17: "q", 18: "Q"}


def first_directory(file: BinaryIO, wanted: Collection[int]) -> Mapping[int, Values]:
    """The wanted tags that are there: numbers, or the bytes of a text. Reads these alone. Raises struct.error
    where the file ends before they do, ValueError for what is no TIFF."""
    whole = file.seek(0, os.SEEK_END)

    def read(code: str, at: int) -> tuple[Any, ...]:
        size = struct.calcsize(code)
        if at + size > whole:
            raise struct.error
        file.seek(at)
        return struct.unpack(code, file.read(size))

    if whole < _LEAST or (order := _ORDERS.get(read("2s", 0)[0])) is None:
        raise ValueError("no TIFF")
    (version,) = read(f"{order}H", 2)
    if version not in _VERSIONS:
        raise ValueError("no TIFF")
    place, count_code, entry_size, room, head = _VERSIONS[version]
    (at,) = read(order + place, head)
    (count,) = read(order + count_code, at)
    at += struct.calcsize("=" + count_code)
    found: dict[int, Values] = {}
    for k in range(min(count, MOST_ENTRIES)):
        entry = at + k * entry_size
        tag, kind = read(order + "HH", entry)
        (length,) = read(order + place, entry + 4)
        if tag not in wanted or tag in found or (kind not in _CODES and kind != _TEXT):
            continue
        start = entry + entry_size - room
        code = f"{order}{length}{_CODES.get(kind, 's')}"
        if length * struct.calcsize("=" + _CODES.get(kind, "c")) > room:
            (start,) = read(order + place, start)
        values = read(code, start)
        found[tag] = values[0] if kind == _TEXT else values
    return found

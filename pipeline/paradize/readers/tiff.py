"""The first directory of a TIFF or BigTIFF: the values of its tags.

Source: Adobe, "TIFF 6.0", 1992, section 2; BigTIFF as libtiff 4 writes it (offsets and counts of 8 bytes).
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Mapping
from typing import TypeAlias

Values: TypeAlias = "tuple[float, ...] | bytes"

MOST_ENTRIES = 4096
_TEXT = 2
_CODES = {1: "B", 3: "H", 4: "I", 6: "b", 8: "h", 9: "i", 11: "f", 12: "d", 16: "Q", 17: "q", 18: "Q"}


def byte_order(data: bytes) -> str | None:
    """ "<" or ">" as struct has it; None for what is no TIFF."""
    order = {b"II": "<", b"MM": ">"}.get(data[:2])
    if order is None or len(data) < 16 or struct.unpack_from(f"{order}H", data, 2)[0] not in (42, 43):
        return None
    return order


def first_directory(data: bytes, wanted: Collection[int]) -> Mapping[int, Values]:
    """The wanted tags that are there: numbers, or the bytes of a text. Raises struct.error where the file
    ends before they do, ValueError for what is no TIFF."""
    order = byte_order(data)
    if order is None:
        raise ValueError("no TIFF")
    big = struct.unpack_from(f"{order}H", data, 2)[0] == 43
    place, count_code, entry_size, room = ("Q", "Q", 20, 8) if big else ("I", "H", 12, 4)
    (at,) = struct.unpack_from(order + place, data, 8 if big else 4)
    (count,) = struct.unpack_from(order + count_code, data, at)
    at += struct.calcsize("=" + count_code)
    found: dict[int, Values] = {}
    for k in range(min(count, MOST_ENTRIES)):
        entry = at + k * entry_size
        tag, kind = struct.unpack_from(order + "HH", data, entry)
        (length,) = struct.unpack_from(order + place, data, entry + 4)
        if tag not in wanted or tag in found or (kind not in _CODES and kind != _TEXT):
            continue
        start = entry + entry_size - room
        size = length * struct.calcsize("=" + _CODES.get(kind, "c"))
        if size > room:
            (start,) = struct.unpack_from(order + place, data, start)
        if start + size > len(data):
            raise struct.error
        text = kind == _TEXT
        found[tag] = (
            bytes(data[start : start + size])
            if text
            else struct.unpack_from(f"{order}{length}{_CODES[kind]}", data, start)
        )
    return found

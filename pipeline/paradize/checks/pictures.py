"""Rules for a PNG: it is complete, and a normal map holds unit vectors.

Source: W3C, "Portable Network Graphics (PNG) Specification (Third Edition)", 2025: chunks and their CRC.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from paradize.checks.rules import Finding
from paradize.errors import FormatError
from paradize.formats.png import decode_png

SIGNATURE = b"\x89PNG\r\n\x1a\n"
# Rounding to 8 bits gives 0.007; pictures that were once JPEG have a few hundredths.
_OFF = 0.1


def check_picture(data: bytes, file: str) -> Iterator[Finding]:
    """The findings in a PNG's bytes; file: its path, whose name says what it holds ("..._normal.png")."""
    damage = _damage(data)
    if damage is not None:
        yield Finding("PZ102", file, *damage)
        return
    if not file.endswith("_normal.png"):
        return
    try:
        pixels = decode_png(Path(file))
    except FormatError as error:
        yield Finding("PZ102", file, error.what, error.place or "")
        return
    if pixels.shape[2] < 3:
        yield Finding("PZ102", file, f"{pixels.shape[2]} channels, a normal map has three")
        return
    vectors = pixels[:, :, :3].astype(np.float32) * np.float32(2 / np.iinfo(pixels.dtype).max) - 1
    off = np.abs(np.sqrt((vectors * vectors).sum(axis=2)) - 1) > _OFF
    if off.any():
        row, column = divmod(int(np.argmax(off)), off.shape[1])
        length = float(np.sqrt((vectors[row, column] ** 2).sum()))
        yield Finding("PZ203", file, f"length {length:.3f}", f"texel ({column}, {row})", int(off.sum()))


def _damage(data: bytes) -> tuple[str, str] | None:
    """The fault in the chunks of a PNG and its place; None if they are complete."""
    if data[:8] != SIGNATURE:
        return "is not a PNG", "byte 0"
    at, seen = 8, []
    while at + 12 <= len(data):
        length, name = struct.unpack_from(">I4s", data, at)
        end = at + 12 + length
        if end > len(data):
            return "cut short", f"byte {at}"
        if zlib.crc32(data[at + 4 : end - 4]) != struct.unpack_from(">I", data, end - 4)[0]:
            return f"a chunk {name.decode('latin-1')!r} does not match its checksum", f"byte {at}"
        seen.append(name)
        if name == b"IEND":
            missing = [need for need in (b"IHDR", b"IDAT") if need not in seen]
            return ("holds no picture", f"byte {at}") if missing else None
        at = end
    return "cut short", f"byte {at}"

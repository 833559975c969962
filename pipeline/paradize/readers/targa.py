"""Checks that a Targa file is complete: OpenImageIO returns pixels of a truncated one without an error.

Source: Truevision Inc., "TGA File Format Specification, Version 2.0", 1991.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from paradize.errors import SourceError
from paradize.files import read_file

if TYPE_CHECKING:
    from pathlib import Path

_MEND = "save or export it again"


def check_targa(path: Path) -> None:
    """Raises SourceError if the file ends before its last texel, or a run extends beyond the picture."""
    data = read_file(path)
    if len(data) < 18:
        raise SourceError(f"{len(data)} bytes; the header of a Targa file has 18", file=path, mend=_MEND)
    id_length, _, kind = data[0], data[1], data[2]
    palette_size, palette_bits = struct.unpack_from("<HB", data, 5)
    width, height, bits = struct.unpack_from("<HHB", data, 12)
    texel_bytes = (bits + 7) // 8
    start = 18 + id_length + (palette_size * ((palette_bits + 7) // 8) if data[1] else 0)
    texels = width * height
    plain_end = start + texels * texel_bytes
    end = _run_length_end(data, start, texels, texel_bytes) if kind & 8 else plain_end
    if end > len(data):
        what = f"truncated: {len(data)} bytes; {width} x {height} texels need more"
        raise SourceError(what, file=path, mend=_MEND)


def _run_length_end(data: bytes, offset: int, texels: int, texel_bytes: int) -> int:
    """The end of the run-length coded texels; beyond the data where they are truncated."""
    size = len(data)
    while texels > 0:
        if offset >= size:
            return size + 1
        head = data[offset]
        count = (head & 127) + 1
        offset += 1 + (texel_bytes if head & 128 else count * texel_bytes)
        texels -= count
    return offset

"""Reads Windows bitmaps whose header says by masks where the bits of a channel lie, from 1 to 32 of them.

Pillow 13 decodes some layouts of 32 bits and two of 16. These two keep its rounding where they have no
alpha: they are left to it. Source: Microsoft, "BITMAPV5HEADER structure", documentation of Windows GDI.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError
from paradize.files import open_file
from paradize.readers.damage import damaged
from paradize.readers.limits import require_size

if TYPE_CHECKING:
    from pathlib import Path

_BYTES = 70  # of a header up to its masks
_MASKS, _FOUR_MASKS = 3, 6  # packings; the first has alpha only under the longer headers
_PLAIN, _NAMES_ALPHA = 40, 56  # bytes of a header that has a packing, and of one that names alpha's mask
_LEFT = [0xF800, 0x7E0, 0x1F], [0x7C00, 0x3E0, 0x1F]  # to Pillow, of 16 bits


def read_masked_bitmap(path: Path, head: bytes, color_space: str | None) -> Image | None:
    """The picture, of 16 bits a channel where one has more than 8; None for any other file. head: its first
    70 bytes or more.

    Raises SourceError where the file is cut or beyond the limits, and for a mask with a gap.
    """
    if len(head) < _BYTES or not head.startswith(b"BM"):
        return None
    start, size, columns, rows = struct.unpack_from("<IIii", head, 10)
    bits, packing = struct.unpack_from("<HI", head, 28)
    *masks, alpha = struct.unpack_from("<4I", head, 54)
    if size < _PLAIN or packing not in (_MASKS, _FOUR_MASKS) or bits not in (16, 32) or not any(masks):
        return None
    if alpha and (packing == _FOUR_MASKS or size >= _NAMES_ALPHA):
        masks.append(alpha)
    if bits == 16 and masks in _LEFT:
        return None
    ones = [mask >> (mask & -mask).bit_length() - 1 if mask else 0 for mask in masks]
    if broken := [mask for mask, most in zip(masks, ones, strict=True) if most & (most + 1) or mask >> bits]:
        what = f"the mask of a channel is {broken[0]:#x}; its bits must lie side by side, in {bits} bits"
        raise SourceError(what, file=path, mend="save it as PNG")
    height, texel = abs(rows), np.dtype(f"<u{bits // 8}")
    if columns <= 0 or not height:
        raise damaged(f"{columns} x {height} texels", path)
    deep = max(ones) > 0xFF
    require_size(columns, height, len(masks) * (2 if deep else 1), path)
    row = (columns * bits + 31) // 32 * 4  # bytes: rows begin at multiples of four
    with open_file(path) as file:
        file.seek(start)
        data = file.read(row * height)
    if len(data) < row * height:
        raise damaged("the file ends before its picture does", path)
    texels = np.frombuffer(data, texel).reshape(height, -1)[:, :columns]
    texels = texels if rows < 0 else texels[::-1]  # the lowest row first, unless the height says otherwise
    top = 0xFFFF if deep else 0xFF
    values = np.zeros((height, columns, len(masks)), np.uint16 if deep else np.uint8)
    for channel, (mask, most) in enumerate(zip(masks, ones, strict=True)):
        if mask:
            share = (texels & mask) >> (mask & -mask).bit_length() - 1
            values[:, :, channel] = (share.astype(np.uint64) * top + most // 2) // most
    return Image(values, color_space or "srgb", 16 if deep else 8, top)

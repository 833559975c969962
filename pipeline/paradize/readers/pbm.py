"""Bitmaps of text (PBM), of which OpenImageIO reads only those with blanks between the digits.

Source: J. Poskanzer, the manual page of pbm.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Image
from paradize.files import read_file
from paradize.readers.damage import damaged
from paradize.readers.limits import require_size
from paradize.readers.pnm import header_numbers, without_comments

if TYPE_CHECKING:
    from pathlib import Path


def read_text_bitmap(path: Path, head: bytes, color_space: str | None) -> Image | None:
    """The bitmap, black where a digit is 1; None for any other file.

    Raises SourceError where it lacks texels, holds others than 0 and 1, or is beyond the limits.
    """
    if not head.startswith(b"P1"):
        return None
    data = read_file(path)
    size, position = header_numbers(data, 2)
    if len(size) < 2 or 0 in size:
        raise damaged("its header names no width and height", path)
    columns, rows = size
    require_size(columns, rows, 1, path)
    digits = np.frombuffer(without_comments(data[position:]).translate(None, b" \t\r\n\v\f"), np.uint8)
    if len(digits) < rows * columns:
        raise damaged(f"{len(digits)} values; its header promises {rows * columns}", path)
    texels = digits[: rows * columns].reshape(rows, columns, 1) - np.uint8(ord("0"))
    if int(texels.max()) > 1:
        raise damaged("a texel is neither 0 nor 1", path)
    return Image(255 * (1 - texels), color_space or "srgb", 8, 255)

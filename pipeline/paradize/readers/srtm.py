"""Reads raw SRTM tiles (`.hgt`): squares of heights in metres, 2 bytes each, signed, big-endian.

Source: NASA/USGS, "SRTM Topography", section 2.0: 1201 or 3601 pixels on a side; -32768 is no data.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError
from paradize.files import read_file

if TYPE_CHECKING:
    from pathlib import Path

MAX_SIDE = 16385
VOID = -32768.0


def read_srtm(path: Path) -> Image:
    """The tile's heights (h, w, 1) float32 in metres, voids unchanged. Raises SourceError for a file that is
    not a square of 2 to MAX_SIDE pixels on a side, or cannot be read."""
    try:
        data = read_file(path)
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror}", file=path) from error
    side = math.isqrt(len(data) // 2)
    if side * side * 2 != len(data) or not 2 <= side <= MAX_SIDE:
        raise SourceError(
            f"has {len(data)} bytes; a .hgt file has 2 for each pixel of a square, 2 to {MAX_SIDE} on a side",
            file=path,
            mend="download it again: it may be truncated",
        )
    raw = np.frombuffer(data, ">i2")
    return Image(raw.reshape(side, side, 1).astype(np.float32), "data", 16)

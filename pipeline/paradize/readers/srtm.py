"""A raw SRTM tile (`.hgt`): heights in metres, signed, 2 bytes a pixel, big-endian, as many rows as columns.

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
    """The tile's metres (h, w, 1) float32, voids as they are. Raises SourceError for a file that is no square
    of 2 to MAX_SIDE pixels on a side, or that cannot be read."""
    try:
        data = read_file(path)
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror}", file=path) from error
    side = math.isqrt(len(data) // 2)
    if side * side * 2 != len(data) or not 2 <= side <= MAX_SIDE:
        raise SourceError(
            f"has {len(data)} bytes; a .hgt file has 2 for each pixel of a square, 2 to {MAX_SIDE} on a side",
            file=path,
            mend="fetch it again: it may be cut",
        )
    raw = np.frombuffer(data, ">i2")
    return Image(raw.reshape(side, side, 1).astype(np.float32), "data", 16)

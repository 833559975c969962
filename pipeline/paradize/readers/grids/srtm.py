"""Reads raw SRTM tiles (`.hgt`): heights in metres, 2 bytes each, signed, big-endian.

Sources: NASA/USGS, "SRTM Topography", section 2.0: squares of 1201 or 3601 pixels on a side; -32768 is no
data. GDAL, "SRTMHGT driver": also 1801 x 3601, for the far north.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError

if TYPE_CHECKING:
    from pathlib import Path

_VOID = -32768.0
_NORTHERN = (3601, 1801)  # rows, columns


def read_srtm(data: bytes, path: Path, max_side: int) -> Image:
    """The tile's heights (h, w, 1) float32 in metres, voids unchanged. Raises SourceError for data that are
    neither a square of 2 to max_side pixels on a side nor 1801 x 3601."""
    rows = columns = math.isqrt(len(data) // 2)
    if len(data) == 2 * _NORTHERN[0] * _NORTHERN[1]:
        rows, columns = _NORTHERN
    if rows * columns * 2 != len(data) or not 2 <= rows <= max_side:
        shapes = f"a square, 2 to {max_side} on a side, or of {_NORTHERN[1]} x {_NORTHERN[0]}"
        what = f"has {len(data)} bytes; a .hgt file has 2 for each pixel of {shapes}"
        raise SourceError(what, file=path, mend="download it again: it may be truncated")
    raw = np.frombuffer(data, ">i2")
    return Image(raw.reshape(rows, columns, 1).astype(np.float32), "data", 16, nodata=_VOID)

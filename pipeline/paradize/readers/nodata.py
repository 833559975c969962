"""Pixels without a height: where a file says so, and what its neighbours would put there.

Filling: a pyramid of means gives each hole its coarse shape, and at every level its pixels relax towards the
mean of their four neighbours (a membrane). Sums in a fixed order: the same bits on every CPU.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from pathlib import Path

_GDAL_NODATA = 42113  # the TIFF tag that names a file's no-data value, as text
_ROUNDS = 24


def declared_nodata(path: Path) -> float | None:
    """The no-data value that a classic TIFF declares in GDAL's tag; None for other files and for none."""
    try:
        with path.open("rb") as stream:
            head = stream.read(8)
            order = {b"II": "<", b"MM": ">"}.get(head[:2])
            if order is None or struct.unpack(order + "H", head[2:4])[0] != 42:
                return None
            stream.seek(struct.unpack(order + "I", head[4:8])[0])
            (count,) = struct.unpack(order + "H", stream.read(2))
            for _ in range(count):
                entry = stream.read(12)
                tag, _, length = struct.unpack(order + "HHI", entry[:8])
                if tag != _GDAL_NODATA:
                    continue
                if length > 4:
                    stream.seek(struct.unpack(order + "I", entry[8:])[0])
                text = stream.read(min(length, 64)) if length > 4 else entry[8 : 8 + length]
                return float(text.rstrip(b"\0 ").decode("ascii"))
    except (OSError, struct.error, ValueError):
        return None
    return None


def fill_nodata(heights: npt.NDArray[np.float64], known: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
    """The heights (h, w) with every pixel that is not `known` (h, w) put on a membrane through its
    surroundings. At least one pixel must be known; known pixels stay as they are."""
    if known.all():
        return heights
    rows, columns = heights.shape
    padded = np.zeros((rows + rows % 2, columns + columns % 2))
    weight = np.zeros(padded.shape)
    padded[:rows, :columns] = np.where(known, heights, 0.0)
    weight[:rows, :columns] = known
    total, count = (
        ((a[0::2, 0::2] + a[0::2, 1::2]) + a[1::2, 0::2]) + a[1::2, 1::2] for a in (padded, weight)
    )
    coarse = fill_nodata(total / np.maximum(count, 1.0), count > 0.0)
    filled = np.where(known, heights, np.repeat(np.repeat(coarse, 2, axis=0), 2, axis=1)[:rows, :columns])
    row, column = np.nonzero(~known)
    up, down = np.maximum(row - 1, 0), np.minimum(row + 1, rows - 1)
    left, right = np.maximum(column - 1, 0), np.minimum(column + 1, columns - 1)
    for _ in range(_ROUNDS):
        mean = filled[up, column] + filled[down, column] + filled[row, left] + filled[row, right]
        filled[row, column] = 0.25 * mean
    return filled

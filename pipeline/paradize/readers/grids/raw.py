"""Reads raw heights (`.raw`, `.r16`, `.r32`), as Unity, Unreal, World Machine and Gaea write them: the
numbers of a square, row by row, and nothing else.

The file says neither its size nor its order of bytes. A square of integers of 16 bits has 2 s^2 bytes, one of
floats 4 s^2; no file has both. Of the two orders of bytes the one counts in which neighbouring integers
differ less, or floats have the size of heights. A note says what was taken.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

_MEND = "save the heights as a PNG or TIFF of 16 bits and one grey channel, which every terrain tool writes"
_LESS = 0.5  # share of the other order's doubt that tells the order


def read_raw(data: bytes, path: Path, max_side: int) -> Image:
    """Heights (s, s, 1): uint16 integers, or float32 metres. Raises SourceError for data that are no square
    of 2 to max_side pixels on a side."""
    half, quarter = math.isqrt(len(data) // 2), math.isqrt(len(data) // 4)
    floats = len(data) == 4 * quarter * quarter and path.suffix.lower() != ".r16"
    side = quarter if floats else half
    if (not floats and len(data) != 2 * half * half) or not 2 <= side <= max_side:
        what = (
            f"has {len(data)} bytes; only squares of 2 to {max_side} pixels on a side are read of raw heights"
        )
        raise SourceError(f"{what}, with 2 bytes a pixel (integers) or 4 (floats)", file=path, mend=_MEND)
    letters = "f4" if floats else "u2"
    low, high = (np.frombuffer(data, order + letters).reshape(side, side) for order in "<>")
    doubt = _doubt(low), _doubt(high)
    swapped = doubt[1] < _LESS * doubt[0]
    kind = "floats (metres)" if floats else "unsigned integers of 16 bits"
    order = f"{'high' if swapped else 'low'} byte first"
    sure = swapped or doubt[0] < _LESS * doubt[1]
    why = "guessed from its size and its numbers" if sure else "guessed from its size; the order is not sure"
    note = f"raw heights, read as {side} x {side} {kind}, {order} ({why}); the first row lies north, at -Z"
    values = (high if swapped else low)[:, :, None]
    if floats:
        return Image(values.astype(np.float32), "data", 32, notes=(note,))
    return Image(values.astype(np.uint16), "data", 16, 65535, notes=(note,))


def _doubt(values: npt.NDArray[np.generic]) -> float:
    """How little numbers look like heights: of integers the mean difference of neighbours in a row as a share
    of their range, of floats the share that is neither 0 nor of a size that heights have."""
    with np.errstate(invalid="ignore"):  # in the wrong order some are signalling NaN
        rows = values[:: max(1, len(values) // 64)].astype(np.float64)
    if values.dtype.kind == "f":
        sizes = np.abs(rows)
        return float(np.mean(~((sizes == 0.0) | ((sizes >= 1e-6) & (sizes <= 1e7)))))
    return float(np.abs(np.diff(rows, axis=1)).mean() / max(np.ptp(rows), 1.0))

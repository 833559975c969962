"""Finds the pixels that triangles cover, in numpy, triangles of similar size together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    F64 = npt.NDArray[np.float64]
    I64 = npt.NDArray[np.int64]

_AT_ONCE = 1 << 17  # pixels tested in one batch: a megabyte of each value, which a cache holds
_EDGE = 1e-6  # of a triangle: a pixel on its edge belongs to it


def covered_pixels(x: F64, y: F64, shape: tuple[int, int]) -> Iterator[tuple[I64, I64, F64, F64]]:
    """Yields batches (pixel, triangle, b, c), each (k,): the pixels whose centres triangles cover, row by row
    in a picture of `shape` (rows, columns), and the weights of the triangle's corners 1 and 2 there; that of
    corner 0 is 1 - b - c.

    x, y: (m, 3) corners in pixels from the centre of the first one, y downwards. Triangles without area cover
    nothing.
    """
    rows, columns = shape
    left, top = (
        np.clip(np.ceil(v.min(axis=1) - _EDGE), 0, side).astype(np.int64)
        for v, side in ((x, columns), (y, rows))
    )
    right, bottom = (
        np.clip(np.floor(v.max(axis=1) + _EDGE), -1, side - 1).astype(np.int64)
        for v, side in ((x, columns), (y, rows))
    )
    span = np.maximum(right - left, bottom - top) + 1
    span[(right < left) | (bottom < top)] = 0
    side = 1
    while (span >= side).any():  # each tests fewer than 2 side x 2 side pixels
        chosen = np.flatnonzero((span >= side) & (span < 2 * side))
        step = max(1, _AT_ONCE // (4 * side * side))
        for first in range(0, len(chosen), step):
            part = chosen[first : first + step]
            offsets = np.arange(2 * side - 1)
            i = left[part, None, None] + offsets[None, None, :]
            j = top[part, None, None] + offsets[None, :, None]
            ax, bx, cx = (x[part, k, None, None] for k in range(3))
            ay, by, cy = (y[part, k, None, None] for k in range(3))
            area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
            safe = np.where(area == 0.0, np.inf, area)
            b = ((i - ax) * (cy - ay) - (cx - ax) * (j - ay)) / safe
            c = ((bx - ax) * (j - ay) - (i - ax) * (by - ay)) / safe
            inside = (b >= -_EDGE) & (c >= -_EDGE) & (b + c <= 1.0 + _EDGE) & (area != 0.0)
            inside &= (i < columns) & (j < rows)
            pixels = np.broadcast_to(j * columns + i, inside.shape)[inside]
            owners = np.broadcast_to(part[:, None, None], inside.shape)[inside]
            yield pixels, owners, b[inside], c[inside]
        side *= 2

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
_NO_AREA = 1e-12  # pixels, twice a triangle's area


def covered_pixels(x: F64, y: F64, shape: tuple[int, int]) -> Iterator[tuple[I64, I64, F64, F64]]:
    """Yields batches (pixel, triangle, b, c), each (k,): the pixels whose centres triangles cover, row by row
    in a picture of `shape` (rows, columns), and the weights of the triangle's corners 1 and 2 there; that of
    corner 0 is 1 - b - c.

    x, y: (3, m) corners in pixels from the centre of the first one, y downwards. Triangles without area cover
    nothing.
    """
    rows, columns = shape
    left, top = (np.clip(np.ceil(v.min(axis=0) - _EDGE), 0, side) for v, side in ((x, columns), (y, rows)))
    right, bottom = (
        np.clip(np.floor(v.max(axis=0) + _EDGE), -1, side - 1) for v, side in ((x, columns), (y, rows))
    )
    span = np.maximum(right - left, bottom - top) + 1
    (ax, bx, cx), (ay, by, cy) = x, y
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    span[(right < left) | (bottom < top) | (np.abs(area) < _NO_AREA)] = 0
    side = 1
    while (span >= side).any():  # each tests fewer than 2 side x 2 side pixels
        chosen = np.flatnonzero((span >= side) & (span < 2 * side))
        step = max(1, _AT_ONCE // (4 * side * side))
        offsets = np.arange(2.0 * side - 1.0)
        # numpy's inner loop runs over the last axis: that of the triangles where these are many.
        many = side <= 16
        across, down = (offsets[:, None], offsets[:, None, None]) if many else (offsets, offsets[:, None])
        for first in range(0, len(chosen), step):
            part = chosen[first : first + step]
            part = part if many else part[:, None, None]
            i, j = left[part] + across, top[part] + down
            (ax, bx, cx), (ay, by, cy), whole = x[:, part], y[:, part], area[part]
            b = (i - ax) * ((cy - ay) / whole) - (j - ay) * ((cx - ax) / whole)
            c = (j - ay) * ((bx - ax) / whole) - (i - ax) * ((by - ay) / whole)
            inside = (b >= -_EDGE) & (c >= -_EDGE) & (b + c <= 1.0 + _EDGE) & (i < columns) & (j < rows)
            owners = np.broadcast_to(part, inside.shape)[inside]
            yield (j * columns + i)[inside].astype(np.int64), owners, b[inside], c[inside]
        side *= 2

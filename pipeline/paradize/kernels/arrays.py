"""Checks arrays and converts them for the native modules, which trust them. Raises ValueError for others."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

Float = TypeVar("Float", np.float32, np.float64)
_MOST_INDEX = 0xFFFFFFFF


def finite_rows(
    values: npt.ArrayLike,
    width: int,
    dtype: type[Float],
    *,
    count: int | None = None,
    name: str = "values",
) -> npt.NDArray[Float]:
    """Finite floats (count, width); None: any number of rows. name: of the values, for the message."""
    rows = np.ascontiguousarray(values, dtype)
    if rows.ndim != 2 or rows.shape[1] != width or count not in (None, len(rows)):
        expected = "n" if count is None else count
        raise ValueError(f"{name}: expected ({expected}, {width}) floats, got {rows.shape}")
    if not np.isfinite(rows).all():
        raise ValueError(f"{name} are not finite")
    return rows


def to_indices(values: npt.ArrayLike) -> npt.NDArray[np.uint32]:
    """Whole numbers of any shape from 0 to 2^32 - 1, copied only where necessary. numpy would cut 1.5
    to 1, make a number of NaN, and wrap 2^32 to 0."""
    given = np.asarray(values)
    if given.dtype != np.uint32 and given.size:
        if given.dtype.kind not in "iu":
            raise ValueError(f"expected whole numbers, got {given.dtype}")
        low, high = int(given.min()), int(given.max())
        if low < 0 or high > _MOST_INDEX:
            raise ValueError(f"index {low if low < 0 else high}, expected 0 to {_MOST_INDEX}")
    return np.ascontiguousarray(given, np.uint32)


def triangle_rows(values: npt.ArrayLike, vertices: int, *, least: int = 0) -> npt.NDArray[np.uint32]:
    """Indices (m, 3) of so many vertices. least: the smallest m."""
    triangles = to_indices(values)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) < least:
        raise ValueError(f"expected (m, 3) indices, got {triangles.shape}")
    if triangles.size and int(triangles.max()) >= vertices:
        raise ValueError(f"index {int(triangles.max())} of {vertices} vertices")
    return triangles

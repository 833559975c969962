"""Indices as the kernels take them. numpy would cut 1.5 to 1, make a number of NaN, and wrap 2^32 to 0."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

_MOST = 0xFFFFFFFF


def to_indices(values: npt.ArrayLike) -> npt.NDArray[np.uint32]:
    """Returns whole numbers of any shape as uint32; copied only where necessary. Raises ValueError for other
    numbers, and for those outside 0 to 2^32 - 1."""
    given = np.asarray(values)
    if given.dtype != np.uint32 and given.size:
        if given.dtype.kind not in "iu":
            raise ValueError(f"expected whole numbers, got {given.dtype}")
        low, high = int(given.min()), int(given.max())
        if low < 0 or high > _MOST:
            raise ValueError(f"index {low if low < 0 else high}, expected 0 to {_MOST}")
    return np.ascontiguousarray(given, np.uint32)

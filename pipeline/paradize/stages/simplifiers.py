"""The library that simplifies meshes, behind checks: what goes in is sound, what comes out is looked at.

It does not check its input. Callers pass only what `validate` passed: finite positions and indices in range,
no index twice in a triangle, centred on the origin and scaled to a diagonal of 1. On such input it returns;
nothing else of its own was ever seen with it, so it runs in this process.
"""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

import numpy as np
from meshoptimizer import SIMPLIFY_ERROR_ABSOLUTE
from meshoptimizer._loader import find_library

from paradize.errors import BakeError

if TYPE_CHECKING:
    import numpy.typing as npt

# How far meshoptimizer may go on its own, of a diagonal of 1; the bake measures and decides.
_REACH = 0.25


def _attribute_simplifier() -> Any:
    """meshopt_simplifyWithAttributes with its true signature: the Python package (0.2.30a0) declares none,
    so that its own wrapper fails on the error's type and would cut sizes to 32 bits."""
    call = ctypes.CDLL(find_library()).meshopt_simplifyWithAttributes
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    call.argtypes = [
        *(pointer, pointer, size),  # destination, indices, their count
        *(pointer, size, size),  # positions, vertices, bytes a vertex
        *(pointer, size, pointer, size),  # attributes, bytes a vertex, weights, attributes a vertex
        *(
            pointer,
            size,
            ctypes.c_float,
            ctypes.c_uint,
            pointer,
        ),  # locks, target, error, options, error found
    ]
    call.restype = size
    return call


_simplify_with_attributes = _attribute_simplifier()


def meshopt_simplify(
    points: npt.NDArray[np.float64],
    triangles: npt.NDArray[np.uint32],
    attributes: npt.NDArray[np.float32],
    weights: npt.NDArray[np.float32],
    locked: npt.NDArray[np.uint8],
    target: int,
) -> npt.NDArray[np.uint32]:
    """meshoptimizer's choice of about `target` triangles (k, 3) over the same vertices.

    points: (n, 3) of diagonal 1; attributes: (n, a) with weights (a,), a from 1 to 32; locked: (n,) 1 where
    a vertex stays. Raises BakeError where the result is not triangles of these vertices.
    """
    indices = np.ascontiguousarray(triangles.reshape(-1), np.uint32)
    positions = np.ascontiguousarray(points, np.float32)
    attributes = np.ascontiguousarray(attributes, np.float32)
    weights = np.ascontiguousarray(weights, np.float32)
    locked = np.ascontiguousarray(locked, np.uint8)
    count, width = attributes.shape
    if positions.shape != (count, 3) or locked.shape != (count,) or not 1 <= width == len(weights) <= 32:
        raise BakeError(f"positions {positions.shape}, attributes {attributes.shape}, locks {locked.shape}")
    if len(indices) == 0 or int(indices.max()) >= count or not np.isfinite(positions).all():
        raise BakeError("the simplifier is given only sound meshes")
    out = np.zeros(len(indices), np.uint32)
    found = int(
        _simplify_with_attributes(
            *(out.ctypes.data, indices.ctypes.data, len(indices)),
            *(positions.ctypes.data, count, 12),
            *(attributes.ctypes.data, width * 4, weights.ctypes.data, width),
            *(locked.ctypes.data, min(target * 3, len(indices)), _REACH, SIMPLIFY_ERROR_ABSOLUTE, None),
        )
    )
    if found % 3 or found > len(indices) or (found and int(out[:found].max()) >= count):
        raise BakeError(f"meshoptimizer returned {found} indices, not triangles of the mesh")
    return out[:found].reshape(-1, 3).copy()

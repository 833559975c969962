"""Checked numpy face of OpenMesh: a second count of a surface's edges, and its simplifier.

Wrong shapes and values raise ValueError. OpenMesh holds manifolds only. BUILT tells whether the kernels were
built with it: `make setup` does; elsewhere the build takes it where CMake finds it, and does without where
not. Calls then raise RuntimeError.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

BUILT = find_spec("paradize.kernels.openmesh._openmesh") is not None
if TYPE_CHECKING or BUILT:
    from paradize.kernels.openmesh import _openmesh

VERSION = ".".join(str(_openmesh.VERSION >> shift & 0xFF) for shift in (16, 8, 0)) if BUILT else None
F64 = npt.NDArray[np.float64]
U32 = npt.NDArray[np.uint32]


def count(positions: npt.ArrayLike, triangles: npt.ArrayLike) -> tuple[int, int, int]:
    """OpenMesh's count of a mesh's triangles, edges and border edges. Where the surface is no manifold it
    counts fewer triangles than there are."""
    mesh = _mesh(positions, triangles)
    return _openmesh.count(*mesh)


def simplify(positions: npt.ArrayLike, triangles: npt.ArrayLike, target: int) -> tuple[U32, U32]:
    """The mesh with about `target` triangles: (k,) uint32 source vertex of each vertex that is left, and
    (j, 3) uint32 triangles of those. No vertex moves: its position and attributes are its source's.

    Edges collapse into one of their ends, the least quadric error first, until `target` triangles are left or
    each collapse would turn a triangle over or make the surface no manifold. A border may recede. Positions
    alone decide: vertices that are doubled at a seam come apart. Raises ValueError where the surface is no
    manifold.
    """
    if target < 1:
        raise ValueError(f"a mesh of {target} triangles is asked for")
    mesh = _mesh(positions, triangles)
    return _openmesh.simplify(*mesh, target)


def _mesh(positions: npt.ArrayLike, triangles: npt.ArrayLike) -> tuple[F64, U32]:
    """The arrays as the kernel takes them."""
    if not BUILT:
        raise RuntimeError("Paradize was built without OpenMesh: install libopenmesh-dev and build it again")
    places = np.ascontiguousarray(positions, np.float64)
    corners = np.ascontiguousarray(triangles, np.uint32)
    for name, rows in (("positions", places), ("triangles", corners)):
        if rows.ndim != 2 or rows.shape[1] != 3:
            raise ValueError(f"{name} have shape {rows.shape}, not (n, 3)")
    if not np.isfinite(places).all():
        raise ValueError("positions are not finite")
    return places, corners

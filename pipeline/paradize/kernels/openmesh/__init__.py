"""Python interface of OpenMesh: an independent count of edges, and its simplifier.

Wrong shapes and values raise ValueError. OpenMesh supports manifolds only. BUILT: whether the kernels were
built with OpenMesh. `make setup` does; other builds do where CMake finds it. Without it calls raise
RuntimeError.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from paradize.kernels.arrays import finite_rows, triangle_rows

BUILT = find_spec("paradize.kernels.openmesh._openmesh") is not None
if TYPE_CHECKING or BUILT:
    from paradize.kernels.openmesh import _openmesh

VERSION = ".".join(str(_openmesh.VERSION >> shift & 0xFF) for shift in (16, 8, 0)) if BUILT else None
F64 = npt.NDArray[np.float64]
U32 = npt.NDArray[np.uint32]


def count(positions: npt.ArrayLike, triangles: npt.ArrayLike) -> tuple[int, int, int]:
    """OpenMesh's count of triangles, edges and border edges. For a surface that is not a manifold it counts
    fewer triangles than there are."""
    mesh = _mesh(positions, triangles)
    return _openmesh.count(*mesh)


def simplify(positions: npt.ArrayLike, triangles: npt.ArrayLike, target: int) -> tuple[U32, U32]:
    """Simplifies a mesh to about `target` triangles. Returns (k,) uint32, the source vertex of each remaining
    vertex, and (j, 3) uint32 triangles of the remaining vertices. No vertex moves; positions and attributes
    are the source's.

    Edges collapse into one of their ends, the smallest quadric error first, until `target` triangles remain
    or each collapse would flip a triangle or make the surface non-manifold. Borders may recede. Only
    positions count: vertices that are doubled at a seam may separate. Raises ValueError where the surface is
    not a manifold.
    """
    if target < 1:
        raise ValueError(f"target {target}, expected at least 1")
    mesh = _mesh(positions, triangles)
    return _openmesh.simplify(*mesh, target)


def _mesh(positions: npt.ArrayLike, triangles: npt.ArrayLike) -> tuple[F64, U32]:
    """Checks the arrays and converts them for the kernel."""
    if not BUILT:
        raise RuntimeError("Paradize was built without OpenMesh: install libopenmesh-dev and build it again")
    points = finite_rows(positions, 3, np.float64)
    return points, triangle_rows(triangles, len(points))

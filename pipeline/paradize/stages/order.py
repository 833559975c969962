"""Reorders triangles and vertices so that a mesh draws quickly. Nothing else of the mesh changes.

In three steps: triangles of each group are ordered for the vertex cache of the GPU; then so that surfaces in
front are drawn before hidden ones, as far as the cache gets at most 5 % worse; then vertices are numbered in
the order of their first use. meshoptimizer does the first two. A check compares its triangles with the ones
that it was given.

Sources: T. Forsyth, "Linear-Speed Vertex Cache Optimisation", 2006; P.
Sander, D. Nehab and J. Barczak, "Fast triangle reordering for vertex locality and reduced overdraw", 2007.
"""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

import numpy as np
from meshoptimizer._loader import find_library

from paradize.data import Group, Mesh
from paradize.errors import BakeError
from paradize.kernels.mesh import number_corners

if TYPE_CHECKING:
    import numpy.typing as npt

# How much worse the cache may become (1: not at all) so that fewer pixels are drawn twice.
_OVERDRAW_THRESHOLD = 1.05


def _declared(name: str, *arguments: Any) -> Any:
    """Returns a function of meshoptimizer with its signature declared. The Python package (0.2.30a0) declares
    none, so sizes would be cut to 32 bits."""
    call = getattr(ctypes.CDLL(find_library()), name)
    call.argtypes, call.restype = arguments, None
    return call


_pointer, _size = ctypes.c_void_p, ctypes.c_size_t
_vertex_cache = _declared("meshopt_optimizeVertexCache", _pointer, _pointer, _size, _size)
_overdraw = _declared(
    "meshopt_optimizeOverdraw",
    *(_pointer, _pointer, _size, _pointer, _size, _size, ctypes.c_float),
)


def draw_order(mesh: Mesh) -> Mesh:
    """Returns the mesh with triangles and vertices in an order that is quick to draw.

    Each group keeps its triangles, and each triangle the cyclic order of its corners. Unused vertices are
    left out. Raises BakeError if an index is out of range or if the library returns other triangles.
    """
    count = len(mesh.positions)
    if len(mesh.triangles) == 0 or int(mesh.triangles.max()) >= count:
        raise BakeError("the mesh to reorder has no triangles, or an index beyond its vertices")
    groups = mesh.groups or (Group("", "", 0, len(mesh.triangles)),)
    points = _centred(mesh.positions)
    parts = [_ordered(mesh.triangles[g.first : g.first + g.count], points) for g in groups]
    triangles = np.concatenate(parts)
    source, numbers = _first_use(triangles, count)
    return mesh.with_vertices(source, numbers)


def _centred(positions: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Returns the positions centred on the origin and scaled to sides of at most 1, so that their squares
    neither underflow nor overflow."""
    wide = positions.astype(np.float64)
    low, high = wide.min(axis=0), wide.max(axis=0)
    side = float((high - low).max())
    return np.ascontiguousarray((wide - (low + high) / 2) / (side if side > 0 else 1.0), np.float32)


def _ordered(triangles: npt.NDArray[np.uint32], points: npt.NDArray[np.float32]) -> npt.NDArray[np.uint32]:
    """Returns one group's triangles (k, 3), k > 0, in their new order. The library gets only the vertices of
    the group, so that many small groups cost no more than one large group."""
    if 3 * len(triangles) < len(points):
        index, first = number_corners(triangles.reshape(-1), np.zeros((triangles.size, 1), np.float32))
        used = triangles.reshape(-1)[first]
    else:
        used, index = _first_use(triangles, len(points))
    indices = np.ascontiguousarray(index.reshape(-1), np.uint32)
    own = np.ascontiguousarray(points[used])
    cached, out = np.empty_like(indices), np.empty_like(indices)
    _vertex_cache(cached.ctypes.data, indices.ctypes.data, len(indices), len(used))
    if int(cached.max()) >= len(used):
        raise BakeError("meshoptimizer returned an index beyond the vertices")
    _overdraw(
        *(out.ctypes.data, cached.ctypes.data, len(indices)),
        *(own.ctypes.data, len(used), 12, _OVERDRAW_THRESHOLD),
    )
    if int(out.max()) >= len(used) or _fingerprint(out) != _fingerprint(indices):
        raise BakeError("meshoptimizer returned other triangles than it was given")
    return used[out].reshape(-1, 3)


def _first_use(
    triangles: npt.NDArray[np.uint32], count: int
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """Returns the used vertices in the order of their first use, and the triangles with these new numbers.
    count: number of all vertices."""
    corners = triangles.reshape(-1)
    first = np.full(count, len(corners), np.int64)
    first[corners[::-1]] = np.arange(len(corners) - 1, -1, -1)  # the last assignment wins: the first use
    is_first = np.zeros(len(corners) + 1, np.bool_)
    is_first[first] = True
    used = corners[is_first[:-1]]
    numbers = np.zeros(count, np.uint32)
    numbers[used] = np.arange(len(used), dtype=np.uint32)
    return used, numbers[triangles]


def _fingerprint(indices: npt.NDArray[np.uint32]) -> int:
    """Returns a hash of a set of triangles: the sum of 64 mixed bits of each. It depends neither on the order
    of the triangles nor on which corner is first, but on the direction in which corners turn."""
    corners = indices.reshape(-1, 3).astype(np.uint64)
    mixed = np.zeros(len(corners), np.uint64)
    with np.errstate(over="ignore"):
        for k in range(3):  # the sum over three rotations is the same whichever corner is first
            key = corners[:, k] + np.uint64(0x9E3779B97F4A7C15)
            for step in (1, 2):
                key = _mix(key) ^ corners[:, (k + step) % 3]
            mixed = mixed + _mix(key)
        return int(_mix(mixed).sum(dtype=np.uint64))


def _mix(x: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """A bijection of 64 bits: the finaliser of SplitMix64 (G. Steele, D. Lea and C. Flood, "Fast splittable
    pseudorandom number generators", 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))

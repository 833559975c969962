"""The order in which triangles and vertices stand: nothing of the mesh changes but that.

Within each group triangles are put in an order that the card's vertex cache likes, then in one in which what
hides comes before what is hidden, as far as the cache loses at most a twentieth; then vertices stand in the
order of their first use. Done by meshoptimizer, behind checks: what comes out must be the same triangles.
Sources: T. Forsyth, "Linear-Speed Vertex Cache Optimisation", 2006; P. Sander, D. Nehab and J. Barczak, "Fast
triangle reordering for vertex locality and reduced overdraw", 2007.
"""

from __future__ import annotations

import ctypes
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from meshoptimizer._loader import find_library

from paradize.data import Group, Mesh
from paradize.errors import BakeError
from paradize.kernels.mesh import number_corners
from paradize.stages.split import ATTRIBUTES

if TYPE_CHECKING:
    import numpy.typing as npt

# How much worse than the best the cache may do so that less is drawn twice.
_OVERDRAW_THRESHOLD = 1.05


def _declared(name: str, *arguments: Any) -> Any:
    """A function of meshoptimizer with its true signature: the Python package (0.2.30a0) declares none, so
    that sizes would be cut to 32 bits."""
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
    """The same mesh with triangles and vertices in an order that is quick to draw.

    Each group keeps its triangles, each triangle its corners in their cyclic order; vertices that no triangle
    uses are left out. Raises BakeError where an index lies beyond the vertices, or where the library returns
    other triangles than it was given.
    """
    count = len(mesh.positions)
    if len(mesh.triangles) == 0 or int(mesh.triangles.max()) >= count:
        raise BakeError("only sound meshes are put in order")
    groups = mesh.groups or (Group("", "", 0, len(mesh.triangles)),)
    points = _centred(mesh.positions)
    parts = [_ordered(mesh.triangles[g.first : g.first + g.count], points) for g in groups]
    triangles = np.concatenate(parts)
    source, numbers = _first_use(triangles, count)
    arrays = {
        name: None if (values := getattr(mesh, name)) is None else np.ascontiguousarray(values[source])
        for name in ("positions", *ATTRIBUTES)
    }
    return replace(mesh, **arrays, triangles=numbers)  # type: ignore[arg-type]


def _centred(positions: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Positions about the origin with sides of at most 1: their squares neither vanish nor overflow."""
    wide = positions.astype(np.float64)
    low, high = wide.min(axis=0), wide.max(axis=0)
    side = float((high - low).max())
    return np.ascontiguousarray((wide - (low + high) / 2) / (side if side > 0 else 1.0), np.float32)


def _ordered(triangles: npt.NDArray[np.uint32], points: npt.NDArray[np.float32]) -> npt.NDArray[np.uint32]:
    """One group's triangles (k, 3), k > 0; the numbers of its own vertices only go into the library, so that
    many small groups over many vertices cost no more than one large one."""
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
    """The vertices that triangles use, of `count`, in the order of their first use; and the triangles with
    these numbered so."""
    corners = triangles.reshape(-1)
    first = np.full(count, len(corners), np.int64)
    first[corners[::-1]] = np.arange(len(corners) - 1, -1, -1)  # of several the last one stays: the first use
    is_first = np.zeros(len(corners) + 1, np.bool_)
    is_first[first] = True
    used = corners[is_first[:-1]]
    numbers = np.zeros(count, np.uint32)
    numbers[used] = np.arange(len(used), dtype=np.uint32)
    return used, numbers[triangles]


def _fingerprint(indices: npt.NDArray[np.uint32]) -> int:
    """A number that the set of triangles decides, whatever their order and whichever corner is first, but
    not their turn: the sum of 64 well-mixed bits of each."""
    corners = indices.reshape(-1, 3).astype(np.uint64)
    mixed = np.zeros(len(corners), np.uint64)
    with np.errstate(over="ignore"):
        for k in range(3):  # the sum over the three turns is the same whichever corner is first
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

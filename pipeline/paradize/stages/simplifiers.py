"""The libraries that simplify meshes, behind checks of what goes in and of what comes out.

None checks its input. Callers pass only what `validate` passed: finite positions and indices in range,
no index twice in a triangle, centred on the origin and scaled to a diagonal of 1. On such input they return;
nothing else of their own was ever seen with it, so they run in this process. fast-simplification keeps its
mesh in global state: one call at a time.
"""

from __future__ import annotations

import ctypes
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from meshoptimizer import SIMPLIFY_ERROR_ABSOLUTE
from meshoptimizer._loader import find_library

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.kernels import openmesh
from paradize.kernels.mesh import number_rows

if TYPE_CHECKING:
    import numpy.typing as npt

# How far meshoptimizer may go on its own, of a diagonal of 1; the bake measures and decides.
_REACH = 0.25
# fast-simplification's thresholds are absolute: the diagonal that they are tried with, and how far it may go,
# the most careful first.
_FAST_DIAGONAL = 3.5
_FAST_STEPS = (3, 5, 7, 10)
_NEAR = 1.1  # times the triangles that were asked for


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


def fast_simplify(
    points: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32], target: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
    """fast-simplification's (k, 3) points and (j, 3) triangles, about `target` of them; none may be left.

    points: (n, 3) of diagonal 1, one for each place. Vertices move. Raises BakeError where the result is not
    a mesh.
    """
    import fast_simplification  # here: only who asks for it waits for its loading

    _require_sound(points, triangles)
    best: tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]] | None = None
    for step in _FAST_STEPS:
        found, kept = fast_simplification.simplify(
            _FAST_DIAGONAL * points, triangles.astype(np.int32), target_count=target, agg=step
        )
        made = _checked("fast-simplification", np.asarray(found, np.float64) / _FAST_DIAGONAL, kept)
        if best is None or len(made[1]) < len(best[1]):
            best = made
        if len(best[1]) <= _NEAR * target:
            break
    assert best is not None
    return best


def openmesh_simplify(
    points: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32], target: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
    """OpenMesh's points and triangles, as of fast_simplify; no vertex moves. Raises BakeError for what is no
    manifold."""
    _require_sound(points, triangles)
    try:
        vertex, kept = openmesh.simplify(points, triangles, target)
    except ValueError as error:
        raise BakeError(f"simplifier 'openmesh': {error}") from error
    if len(vertex) and int(vertex.max()) >= len(points):
        raise BakeError(f"OpenMesh returned vertex {int(vertex.max())} of {len(points)}")
    return _checked("OpenMesh", points[vertex], kept)


# Those that know positions alone: a mesh's other attributes are taken from its surface again.
POSITIONS_ONLY = {"fast-simplification": fast_simplify, "openmesh": openmesh_simplify}


def require_simplifier(name: str, mesh: Mesh) -> None:
    """Raises BakeError where the simplifier of that name cannot do a validated mesh."""
    if name not in POSITIONS_ONLY:
        return
    mend = "take the simplifier 'paradize' or 'meshoptimizer'"
    if len(mesh.groups) > 1:
        what = f"{len(mesh.groups)} materials, of which {name!r} does not keep the borders: 1 at most"
        raise BakeError(f"simplifier: {what}", mend=mend)
    if name != "openmesh":
        return
    if not openmesh.BUILT:
        raise BakeError("simplifier: Paradize was built without OpenMesh", mend=mend)
    places, first = number_rows(mesh.positions)
    held = openmesh.count(mesh.positions[first], places[mesh.triangles])[0]
    if held != len(mesh.triangles):
        what = f"the surface is no manifold: 'openmesh' holds {held} of its {len(mesh.triangles)} triangles"
        raise BakeError(f"simplifier: {what}", mend=mend)


def simplifier_version(name: str) -> str | None:
    """The version of the library behind a simplifier; None for our own."""
    if name == "openmesh":
        return openmesh.VERSION
    return None if name == "paradize" else version(name)


def _require_sound(points: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32]) -> None:
    if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise BakeError(f"points {points.shape}, triangles {triangles.shape}")
    if not len(triangles) or int(triangles.max()) >= len(points) or not np.isfinite(points).all():
        raise BakeError("the simplifier is given only sound meshes")


def _checked(
    library: str, points: npt.NDArray[np.float64], triangles: npt.NDArray[Any]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
    """What a library returned, without triangles that name a vertex twice. Raises BakeError where it is no
    mesh."""
    if not np.isfinite(points).all():
        raise BakeError(f"{library} returned positions that are not finite")
    if len(triangles) and not 0 <= int(triangles.min()) <= int(triangles.max()) < len(points):
        raise BakeError(f"{library} returned indices beyond its {len(points)} vertices")
    a, b, c = triangles.reshape(-1, 3).T
    kept = triangles.reshape(-1, 3)[(a != b) & (b != c) & (c != a)]
    return points, np.ascontiguousarray(kept, np.uint32)

"""The libraries that see only positions: fast-simplification and OpenMesh. Attributes are taken from the
source again.

Neither checks its input. Callers pass only what `validate` passed: finite positions, indices in range, no
index twice in a triangle, centred on the origin and scaled to a diagonal of 1. On such input both return, so
they run in this process. fast-simplification keeps its mesh in global state: one call at a time.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.kernels import openmesh
from paradize.kernels.mesh import number_rows
from paradize.stages.lod.surface import MISSED_TARGET, Simplified, areas, normalised, used_only
from paradize.stages.reproject import take_attributes

if TYPE_CHECKING:
    import numpy.typing as npt

# fast-simplification has absolute thresholds. The mesh is scaled to this diagonal, and its steps of
# aggressiveness are tried in this order, the most careful first.
_FAST_DIAGONAL = 3.5
_FAST_STEPS = (3, 5, 7, 10)


def simplify_positions(mesh: Mesh, target: int, original: Mesh, method: str) -> Simplified:
    """Simplifies the original surface, welded by position, and takes attributes from it again."""
    require_simplifier(method, original)
    points, unit, centre = normalised(original.positions)
    places, first = number_rows(original.positions)
    found, triangles = POSITIONS_ONLY[method](points[first], places[original.triangles], target)
    triangles = triangles[areas(found, triangles) > 0]
    if len(triangles) == 0:
        return Simplified(mesh, "nothing would be left")
    bare = Mesh(
        (found * unit + centre).astype(np.float32),
        triangles,
        groups=tuple(replace(group, first=0, count=len(triangles)) for group in original.groups),
        origin=original.origin,
    )
    result = take_attributes(original, bare, ("normals", "uvs", "uvs1"), one_chart=original.uvs is not None)
    note = ""
    if len(triangles) > MISSED_TARGET * target:
        note = f"{len(triangles)} triangles where {target} were asked: {method!r} comes no nearer"
    return Simplified(used_only(result), note, seams_kept=original.uvs is None)


def fast_simplify(
    points: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32], target: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
    """Returns points (k, 3) and about `target` triangles (j, 3), possibly none, by fast-simplification.

    points: (n, 3) of diagonal 1, one for each place. Vertices move. Raises BakeError if the result is no
    mesh.
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
        if len(best[1]) <= MISSED_TARGET * target:
            break
    assert best is not None
    return best


def openmesh_simplify(
    points: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32], target: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
    """Does the same by OpenMesh. No vertex moves. Raises BakeError if the surface is not a manifold."""
    _require_sound(points, triangles)
    try:
        vertex, kept = openmesh.simplify(points, triangles, target)
    except ValueError as error:
        raise BakeError(f"simplifier 'openmesh': {error}") from error
    if len(vertex) and int(vertex.max()) >= len(points):
        raise BakeError(f"OpenMesh returned vertex {int(vertex.max())} of {len(points)}")
    return _checked("OpenMesh", points[vertex], kept)


# The simplifiers that see only positions.
POSITIONS_ONLY = {"fast-simplification": fast_simplify, "openmesh": openmesh_simplify}


def require_simplifier(name: str, mesh: Mesh) -> None:
    """Raises BakeError if the named simplifier cannot handle a validated mesh."""
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
        what = (
            f"the surface is not a manifold: 'openmesh' holds {held} of its {len(mesh.triangles)} triangles"
        )
        raise BakeError(f"simplifier: {what}", mend=mend)


def _require_sound(points: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32]) -> None:
    if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise BakeError(f"points {points.shape}, triangles {triangles.shape}")
    if not len(triangles) or int(triangles.max()) >= len(points) or not np.isfinite(points).all():
        raise BakeError("the simplifier is given only sound meshes")


def _checked(
    library: str, points: npt.NDArray[np.float64], triangles: npt.NDArray[Any]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
    """Returns a library's result without triangles that use a vertex twice. Raises BakeError if it is no
    mesh."""
    if not np.isfinite(points).all():
        raise BakeError(f"{library} returned positions that are not finite")
    if len(triangles) and not 0 <= int(triangles.min()) <= int(triangles.max()) < len(points):
        raise BakeError(f"{library} returned indices beyond its {len(points)} vertices")
    a, b, c = triangles.reshape(-1, 3).T
    kept = triangles.reshape(-1, 3)[(a != b) & (b != c) & (c != a)]
    return points, np.ascontiguousarray(kept, np.uint32)

"""The simplifier of meshoptimizer, with attributes. Vertices stay where they are. It does not check its
input: callers pass what `validate` passed, centred on the origin with a diagonal of 1."""

from __future__ import annotations

import ctypes
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from meshoptimizer import SIMPLIFY_ERROR_ABSOLUTE
from meshoptimizer._loader import find_library

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.kernels.mesh import number_rows, topology
from paradize.stages.lod.surface import (
    KEPT_AREAS,
    MISSED_TARGET,
    NEAR_TARGET,
    Simplified,
    areas,
    image_scale,
    joined_vertices,
    normalised,
    used_only,
)
from paradize.stages.reproject import take_attributes, with_groups

if TYPE_CHECKING:
    import numpy.typing as npt

# Weights of a change of a unit normal by 1, and of a texture that slides by its own size, beside a distance
# of one diagonal.
_NORMAL_WEIGHT = 0.02
_UV_WEIGHT = 0.2
_ROUNDS = 8
# The largest error that meshoptimizer may estimate, in diagonals. The bake measures the true one and decides.
_REACH = 0.25


def simplify_meshoptimizer(
    mesh: Mesh, target: int, original: Mesh, released: tuple[str, ...], uv_weight: float
) -> Simplified:
    joined, vertex_group = joined_vertices(mesh, released)
    points, _, _ = normalised(joined.positions)
    attributes, weights = _attributes(joined, points, released, uv_weight)
    places, first = number_rows(joined.positions)
    island = topology(places[joined.triangles], len(first)).island[places]
    area = np.bincount(island[joined.triangles[:, 0]], areas(points, joined.triangles), minlength=len(points))
    best: tuple[npt.NDArray[np.uint32], int] | None = None
    for kept_area in KEPT_AREAS:
        locked = np.zeros(len(points), np.uint8)
        triangles = joined.triangles
        for _ in range(_ROUNDS):
            # Parts that stay whole do not make the others lose more than their share.
            whole = int(locked[joined.triangles[:, 0]].sum())
            share = whole + (len(joined.triangles) - whole) * target // len(joined.triangles)
            goal = max(target, share) if whole else target
            triangles = meshopt_simplify(points, joined.triangles, attributes, weights, locked, goal)
            triangles = triangles[areas(points, triangles) > 0]  # two sides of a seam can meet in one place
            left = np.bincount(island[triangles[:, 0]], areas(points, triangles), minlength=len(points))
            lost = (left < kept_area * area)[island] & (locked == 0)
            if not lost.any():
                break
            locked[lost] = 1
        if best is None or len(triangles) < len(best[0]):
            best = triangles, int(locked.sum())
        if len(best[0]) <= NEAR_TARGET * target:
            break
    assert best is not None
    triangles, kept = best
    if len(triangles) == 0:
        return Simplified(mesh, "nothing would be left")
    group_of = vertex_group[triangles[:, 0]]
    if (vertex_group[triangles] != group_of[:, None]).any():
        raise BakeError("the simplifier joined triangles of two materials")
    result = with_groups(replace(joined, triangles=triangles, groups=()), group_of, mesh.all_groups)
    if released:
        result = take_attributes(original, result, released, one_chart="uvs" in released)
    result = used_only(result)
    note = ""
    if len(triangles) > MISSED_TARGET * target:
        why = (
            f"{kept} vertices belong to parts that would vanish"
            if kept
            else "seams and borders hold the rest"
        )
        note = f"{len(triangles)} triangles where {target} were asked: {why}"
    seams_kept = mesh.uvs is None or "uvs" not in released
    return Simplified(result, note, seams_kept)


def _attributes(
    mesh: Mesh, points: npt.NDArray[np.float64], released: tuple[str, ...], uv_weight: float
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Returns attributes (n, k) in diagonals, and their weights. A texture that slid counts by the distance
    that it slid on the surface."""
    columns: list[npt.NDArray[np.float32]] = []
    weights: list[float] = []
    if mesh.normals is not None and "normals" not in released:
        columns.append(mesh.normals)
        weights += [_NORMAL_WEIGHT] * 3
    for name in ("uvs", "uvs1"):
        uvs = getattr(mesh, name)
        if uvs is None or name in released:
            continue
        columns.append(
            ((uvs.astype(np.float64) - uvs[:1]) * image_scale(mesh, points, uvs)).astype(np.float32)
        )
        weights += [uv_weight * _UV_WEIGHT] * 2
    if not columns:
        return np.zeros((len(points), 1), np.float32), np.zeros(1, np.float32)
    values = np.concatenate(columns, axis=1)
    return np.ascontiguousarray(np.where(np.isfinite(values), values, 0), np.float32), np.array(
        weights, np.float32
    )


def _attribute_simplifier() -> Any:
    """Returns meshopt_simplifyWithAttributes with its signature declared. The Python package (0.2.30a0)
    declares none: its own wrapper fails on the type of the error and would cut sizes to 32 bits."""
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
    """Returns about `target` triangles (k, 3) over the same vertices, chosen by meshoptimizer.

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

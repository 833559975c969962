"""Our own simplifier, quadric edge collapse (`kernels/simplify/collapse.hpp`). Vertices move, and their
attributes with them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import ATTRIBUTES, Mesh
from paradize.kernels.mesh import number_rows, topology
from paradize.kernels.simplify import simplify
from paradize.stages.lod.surface import (
    KEPT_AREAS,
    MISSED_TARGET,
    NEAR_TARGET,
    Simplified,
    image_scale,
    joined_vertices,
    normalised,
    used_only,
)
from paradize.stages.reproject import group_of as triangle_groups
from paradize.stages.reproject import take_attributes, with_groups

if TYPE_CHECKING:
    import numpy.typing as npt

# Small weights: attributes follow the vertices without cost to the shape, and decide only between collapses
# of nearly the same error.
_MOVED_WEIGHTS = {"normals": 0.001, "uvs": 0.05, "uvs1": 0.05}


def simplify_collapse(
    mesh: Mesh, target: int, original: Mesh, released: tuple[str, ...], variant: float, uv_weight: float
) -> Simplified:
    """Simplifies by edge collapse. Vertices move to where the error is least, and their attributes with them.
    A vertex that does not move keeps its exact position."""
    joined, _ = joined_vertices(mesh, released)
    points, unit, centre = normalised(joined.positions)
    names, columns, weights = [], [], []
    for name, weight in _MOVED_WEIGHTS.items():
        values = getattr(joined, name)
        if values is None or name in released:
            continue
        names.append(name)
        columns.append(values)
        scale = 1.0 if name == "normals" else uv_weight * image_scale(joined, points, values)
        weights += [variant * weight * scale] * values.shape[1]
    places, _ = number_rows(joined.positions)
    best = None
    for kept_area in KEPT_AREAS:
        found = simplify(
            points,
            joined.triangles,
            target=target,
            attributes=np.concatenate(columns, axis=1) if columns else None,
            weights=weights if columns else None,
            unit=0 if "normals" in names else None,
            seams=places,
            groups=triangle_groups(mesh),
            kept_area=kept_area,
        )
        if best is None or len(found.triangles) < len(best.triangles):
            best = found
        del found  # as large as the mesh
        if len(best.triangles) <= NEAR_TARGET * target:
            break
    assert best is not None
    if len(best.triangles) == 0:
        return Simplified(mesh, "nothing would be left")
    moved = (best.positions != points[best.vertex]).any(axis=1)
    positions = np.where(
        moved[:, None], best.positions * unit + centre, joined.positions[best.vertex]
    ).astype(np.float32)
    # The result may have more vertices than before, so each attribute is interpolated, copied or left out.
    arrays: dict[str, npt.NDArray[np.float32] | None] = dict.fromkeys(ATTRIBUTES)
    arrays["positions"] = positions
    if joined.colors is not None:
        arrays["colors"] = np.ascontiguousarray(joined.colors[best.vertex])
    at = 0
    for name in names:
        values = getattr(joined, name)
        width = values.shape[1]
        mixed = best.attributes[:, at : at + width]
        at += width
        arrays[name] = mixed if name == "normals" else _inside(joined, values, best.vertex, mixed)
    result = with_groups(
        replace(joined, triangles=best.triangles, groups=(), **arrays),  # type: ignore[arg-type]
        triangle_groups(mesh)[best.triangle],
        mesh.all_groups,
    )
    if released:
        result = take_attributes(original, result, released, one_chart="uvs" in released)
    note = ""
    if len(best.triangles) > MISSED_TARGET * target:
        why = "seams, borders and parts that would vanish hold the rest"
        note = f"{len(best.triangles)} triangles where {target} were asked: {why}"
    return Simplified(used_only(result), note, mesh.uvs is None or "uvs" not in released)


def _inside(
    mesh: Mesh,
    uvs: npt.NDArray[np.float32],
    source: npt.NDArray[np.uint32],
    found: npt.NDArray[np.float32],
) -> npt.NDArray[np.float32]:
    """Returns texture coordinates (k, 2) clamped to the rectangle of the chart that each comes from, because
    the best fit may lie in another chart of the image. source: (k,) vertices of `mesh`."""
    component = topology(mesh.triangles, len(mesh.positions)).component
    chart = np.zeros(len(mesh.positions), np.uint32)
    chart[mesh.triangles.reshape(-1)] = np.repeat(component, 3)
    order = np.argsort(chart, kind="stable")
    starts = np.flatnonzero(np.diff(chart[order], prepend=np.uint32(0xFFFFFFFF)))
    first = np.zeros(len(order), np.int64)
    first[starts] = 1
    of = np.empty(len(order), np.int64)
    of[order] = np.cumsum(first) - 1
    low = np.minimum.reduceat(uvs[order], starts, axis=0)[of[source]]
    high = np.maximum.reduceat(uvs[order], starts, axis=0)[of[source]]
    return np.ascontiguousarray(np.clip(found, low, high))

"""A mesh with fewer triangles, by one of four simplifiers: `paradize` (our own quadric edge collapse,
`kernels/simplify/collapse.hpp`) and `meshoptimizer`, both with attributes, `fast-simplification` and
`openmesh`, which know positions alone.

Halving ten models of 280 to 1,800 triangles, ours came nearer to the source than meshoptimizer 0.22 by RMS on
nine; by the 99th percentile of normals on four, and less near on four: tier `exact` (`refine.py`) measures
both. Of large meshes: `tests/bench/README.md`. For the other two the mesh is welded by position, and texture
coordinates and normals are taken from the source's surface again: texture seams are let go, borders may
recede, and thin parts may vanish.

The mesh is centred on the origin with a diagonal of 1. Surfaces stay closed at texture seams and borders
between materials: vertices are joined only where position, texture coordinate and material agree, and what
lies on such a border moves along it or not at all. Parts that would lose most of their area (leaves, cards,
ropes) are kept whole.

Sources: M. Garland and P. Heckbert, "Surface simplification using quadric error metrics", 1997; H. Hoppe,
"New quadric metric for simplifying meshes with appearance attributes", 1999.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import fsum
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.kernels.mesh import number_corners, number_rows, topology
from paradize.kernels.simplify import simplify as collapse
from paradize.stages.reproject import group_of as triangle_groups
from paradize.stages.reproject import groups_of, take_attributes, with_groups
from paradize.stages.simplifiers import POSITIONS_ONLY, meshopt_simplify, require_simplifier
from paradize.stages.split import ATTRIBUTES

if TYPE_CHECKING:
    import numpy.typing as npt

METHODS = ("paradize", "meshoptimizer")  # with attributes: seams and borders of materials are kept
SIMPLIFIERS = (*METHODS, *POSITIONS_ONLY)
RATIO = 0.5  # triangles of a level, of those of the level before
LEAST_TRIANGLES = 4
# Weights of a changed unit normal and of a texture that slides by its own size on the surface, both of the
# diagonal. The exact tier tries the others too, and what is measured decides.
_NORMAL_WEIGHT = 0.02
_UV_WEIGHT = 0.2
# Where vertices move their attributes follow at no cost to the shape; these only break ties that are seen.
_MOVED_WEIGHTS = {"normals": 0.001, "uvs": 0.05, "uvs1": 0.05}
VARIANTS = (1.0, 0.25, 0.06)
_LARGEST_IMAGE = 4.0  # of the diagonal: no image is stretched to more
# A part that would keep less than this of its area from one level to the next stays as it was. The first
# bound that lets a level come near its triangles holds: a jetty of boxes has nothing to give under the
# first.
_KEPT_AREA = (0.75, 0.5, 0.25)
_NEAR = 1.2
# Hard edges, then seams, everywhere leave nothing to collapse: where a level is not reached with them they
# are let go, and taken from the original surface again.
_RELEASED = (("normals",), ("normals", "uvs", "uvs1"))
_ROUNDS = 8


@dataclass(frozen=True)
class Level:
    """A simplified mesh; `note` says why it has more triangles than were asked for, and is empty otherwise.

    seams_kept: triangles end at texture seams still; where not, the texture is stretched beside some.
    """

    mesh: Mesh
    note: str
    seams_kept: bool = True


def simplify(
    mesh: Mesh,
    target: int,
    method: str = "paradize",
    *,
    original: Mesh | None = None,
    variant: float = 1.0,
    hold: float = 1.0,
) -> Level:
    """A mesh of about `target` triangles (1 or more), from a validated mesh with normals; `original` is the
    surface that attributes come from (default: the mesh itself); what knows positions alone starts from it.
    variant: what our weights of attributes beside positions are multiplied with, more than 0. hold: the same
    of both methods with attributes for texture
    coordinates alone.

    Tangents are left out: they are made anew for each level. Raises BakeError for an unknown method or
    where the library returns something that is not a mesh.
    """
    if method not in SIMPLIFIERS:
        raise BakeError(f"no simplifier {method!r}", mend=f"use one of {', '.join(SIMPLIFIERS)}")
    mesh = replace(mesh, tangents=None)
    original = mesh if original is None else replace(original, tangents=None)
    if method in POSITIONS_ONLY:
        return _simplify_positions(mesh, target, original, method)

    def attempt(released: tuple[str, ...]) -> Level:
        if method == "meshoptimizer":
            return _simplify_meshoptimizer(mesh, target, original, released, hold)
        return _simplify_own(mesh, target, original, released, variant, hold)

    best = attempt(())
    for released in _RELEASED:
        if not best.note or len(best.mesh.triangles) <= _NEAR * target:
            break
        level = attempt(released)
        if len(level.mesh.triangles) < 0.95 * len(best.mesh.triangles):
            best = level
    return best


def _normalised(positions: npt.NDArray[np.float32], diagonal: float) -> tuple[npt.NDArray[np.float64], float]:
    """Positions moved to the origin and scaled to the given diagonal; and metres per unit."""
    wide = positions.astype(np.float64)
    low, high = wide.min(axis=0), wide.max(axis=0)
    x, y, z = (float(side) for side in high - low)
    largest = max(x, y, z)
    if not largest > 0:
        raise BakeError("the mesh has no extent")
    x, y, z = x / largest, y / largest, z / largest
    unit = largest * float(np.sqrt(x * x + y * y + z * z)) / diagonal
    return (wide - (low + high) / 2) / unit, unit


def _areas(positions: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32]) -> npt.NDArray[np.float64]:
    corners = positions[triangles]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    n = [a[:, k - 2] * b[:, k - 1] - a[:, k - 1] * b[:, k - 2] for k in range(3)]
    return np.asarray(0.5 * np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]))


def _used_only(mesh: Mesh) -> Mesh:
    """Vertices that a triangle uses, in the order of their first use."""
    index, first = number_corners(mesh.triangles.reshape(-1), np.zeros((mesh.triangles.size, 1), np.float32))
    arrays = _taken(mesh, mesh.triangles.reshape(-1)[first])
    return replace(mesh, **arrays, triangles=index.reshape(-1, 3))  # type: ignore[arg-type]


def _taken(mesh: Mesh, source: npt.NDArray[np.uint32]) -> dict[str, npt.NDArray[np.float32] | None]:
    """What the mesh's vertices carry, in the order of `source`; its own arrays where that is theirs."""
    own = len(source) == len(mesh.positions) and bool((source == np.arange(len(source))).all())
    return {
        name: values
        if (values := getattr(mesh, name)) is None or own
        else np.ascontiguousarray(values[source])
        for name in ("positions", *ATTRIBUTES)
    }


def _joined(mesh: Mesh, released: tuple[str, ...]) -> tuple[Mesh, npt.NDArray[np.uint32]]:
    """Vertices joined where position, group and all attributes but the released ones agree; and the group of
    each vertex."""
    base = mesh.triangles.reshape(-1)
    columns = [mesh.positions[base], np.repeat(triangle_groups(mesh), 3)[:, None].astype(np.float32)]
    for name in ("uvs", "uvs1", "normals"):
        values = getattr(mesh, name)
        if values is not None and name not in released:
            columns.append(values[base])
    index, first = number_rows(np.concatenate(columns, axis=1))
    del columns
    source = base[first]
    arrays = _taken(mesh, source)
    joined = replace(mesh, **arrays, triangles=index.reshape(-1, 3))  # type: ignore[arg-type]
    return joined, np.repeat(triangle_groups(mesh), 3)[first]


# --- meshoptimizer ---


def _simplify_meshoptimizer(
    mesh: Mesh, target: int, original: Mesh, released: tuple[str, ...], hold: float
) -> Level:
    joined, vertex_group = _joined(mesh, released)
    points, _ = _normalised(joined.positions, 1.0)
    attributes, weights = _attributes(joined, points, released, hold)
    places, first = number_rows(joined.positions)
    island = topology(places[joined.triangles], len(first)).island[places]
    area = np.bincount(
        island[joined.triangles[:, 0]], _areas(points, joined.triangles), minlength=len(points)
    )
    best: tuple[npt.NDArray[np.uint32], int] | None = None
    for kept_area in _KEPT_AREA:
        locked = np.zeros(len(points), np.uint8)
        triangles = joined.triangles
        for _ in range(_ROUNDS):
            # What stays whole does not press the rest below its share.
            whole = int(locked[joined.triangles[:, 0]].sum())
            share = whole + (len(joined.triangles) - whole) * target // len(joined.triangles)
            goal = max(target, share) if whole else target
            triangles = meshopt_simplify(points, joined.triangles, attributes, weights, locked, goal)
            triangles = triangles[_areas(points, triangles) > 0]  # two sides of a seam can meet in one place
            left = np.bincount(island[triangles[:, 0]], _areas(points, triangles), minlength=len(points))
            lost = (left < kept_area * area)[island] & (locked == 0)
            if not lost.any():
                break
            locked[lost] = 1
        if best is None or len(triangles) < len(best[0]):
            best = triangles, int(locked.sum())
        if len(best[0]) <= _NEAR * target:
            break
    assert best is not None
    triangles, kept = best
    if len(triangles) == 0:
        return Level(mesh, "nothing would be left")
    group_of = vertex_group[triangles[:, 0]]
    if (vertex_group[triangles] != group_of[:, None]).any():
        raise BakeError("the simplifier joined triangles of two materials")
    result = with_groups(replace(joined, triangles=triangles, groups=()), group_of, groups_of(mesh))
    if released:
        result = take_attributes(original, result, released, one_chart="uvs" in released)
    result = _used_only(result)
    note = ""
    if len(triangles) > 1.1 * target:
        why = (
            f"{kept} vertices belong to parts that would vanish"
            if kept
            else "seams and borders hold the rest"
        )
        note = f"{len(triangles)} triangles where {target} were asked: {why}"
    seams_kept = mesh.uvs is None or "uvs" not in released
    return Level(result, note, seams_kept)


def _attributes(
    mesh: Mesh, points: npt.NDArray[np.float64], released: tuple[str, ...], hold: float
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Attributes (n, k) in units of the diagonal's length, and their weights: a slid texture counts as far
    as it slid."""
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
            ((uvs.astype(np.float64) - uvs[:1]) * _image_scale(mesh, points, uvs)).astype(np.float32)
        )
        weights += [hold * _UV_WEIGHT] * 2
    if not columns:
        return np.zeros((len(points), 1), np.float32), np.zeros(1, np.float32)
    values = np.concatenate(columns, axis=1)
    return np.ascontiguousarray(np.where(np.isfinite(values), values, 0), np.float32), np.array(
        weights, np.float32
    )


def _image_scale(mesh: Mesh, points: npt.NDArray[np.float64], uvs: npt.NDArray[np.float32]) -> float:
    """How far 1 in texture coordinates reaches on the surface, on the mean; 0 where it cannot be said."""
    flat = np.concatenate([uvs.astype(np.float64), np.zeros((len(uvs), 1))], axis=1)
    surface, image = fsum(_areas(points, mesh.triangles)), fsum(_areas(flat, mesh.triangles))
    extent = float((flat.max(axis=0) - flat.min(axis=0)).max())
    scale = float(np.sqrt(surface / image)) if image > 0 and np.isfinite(image) else 0.0
    # Palettes have next to no area in the image: the bound keeps them from outweighing all else.
    return min(scale, _LARGEST_IMAGE / extent) if extent > 0 else 0.0


# --- libraries that know positions alone ---


def _simplify_positions(mesh: Mesh, target: int, original: Mesh, method: str) -> Level:
    """The original surface, welded by position, simplified by a library; attributes are taken from it."""
    require_simplifier(method, original)
    points, unit = _normalised(original.positions, 1.0)
    places, first = number_rows(original.positions)
    found, triangles = POSITIONS_ONLY[method](points[first], places[original.triangles], target)
    triangles = triangles[_areas(found, triangles) > 0]
    if len(triangles) == 0:
        return Level(mesh, "nothing would be left")
    wide = original.positions.astype(np.float64)
    centre = (wide.min(axis=0) + wide.max(axis=0)) / 2
    bare = Mesh(
        (found * unit + centre).astype(np.float32),
        triangles,
        groups=tuple(replace(group, first=0, count=len(triangles)) for group in original.groups),
        origin=original.origin,
    )
    result = take_attributes(original, bare, ("normals", "uvs", "uvs1"), one_chart=original.uvs is not None)
    note = ""
    if len(triangles) > 1.1 * target:
        note = f"{len(triangles)} triangles where {target} were asked: {method!r} comes no nearer"
    return Level(_used_only(result), note, seams_kept=original.uvs is None)


# --- paradize ---


def _simplify_own(
    mesh: Mesh, target: int, original: Mesh, released: tuple[str, ...], variant: float, hold: float
) -> Level:
    """Vertices move to where the error is least, and their attributes with them. What did not move keeps its
    bits."""
    joined, _ = _joined(mesh, released)
    points, unit = _normalised(joined.positions, 1.0)
    names, columns, weights = [], [], []
    for name, weight in _MOVED_WEIGHTS.items():
        values = getattr(joined, name)
        if values is None or name in released:
            continue
        names.append(name)
        columns.append(values)
        scale = 1.0 if name == "normals" else hold * _image_scale(joined, points, values)
        weights += [variant * weight * scale] * values.shape[1]
    places, _ = number_rows(joined.positions)
    best = None
    for kept_area in _KEPT_AREA:
        found = collapse(
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
        if len(best.triangles) <= _NEAR * target:
            break
    assert best is not None
    if len(best.triangles) == 0:
        return Level(mesh, "nothing would be left")
    wide = joined.positions.astype(np.float64)
    centre = (wide.min(axis=0) + wide.max(axis=0)) / 2
    moved = (best.positions != points[best.vertex]).any(axis=1)
    positions = np.where(
        moved[:, None], best.positions * unit + centre, joined.positions[best.vertex]
    ).astype(np.float32)
    # Vertices can be more than there were: every attribute is either mixed, taken along or left out.
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
        groups_of(mesh),
    )
    if released:
        result = take_attributes(original, result, released, one_chart="uvs" in released)
    note = ""
    if len(best.triangles) > 1.1 * target:
        why = "seams, borders and parts that would vanish hold the rest"
        note = f"{len(best.triangles)} triangles where {target} were asked: {why}"
    return Level(_used_only(result), note, mesh.uvs is None or "uvs" not in released)


def _inside(
    mesh: Mesh,
    uvs: npt.NDArray[np.float32],
    source: npt.NDArray[np.uint32],
    found: npt.NDArray[np.float32],
) -> npt.NDArray[np.float32]:
    """Texture coordinates (k, 2) held inside the rectangle of the chart that each came from: the place that
    fits best may lie beyond it, where the image shows another chart. source: (k,) vertices of `mesh`."""
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

"""Validates a mesh: drops degenerate, doubled and unused elements, refuses invalid values, and reports.

It runs before every mesh library. Afterwards all values are finite, all indices are in range, and no triangle
uses a vertex twice. OpenMesh would crash or drop faces otherwise. Where the surface is a manifold, OpenMesh
counts its edges again; a different count is an error of ours.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import ATTRIBUTES, Group, Mesh
from paradize.errors import BakeError, SourceError
from paradize.kernels import openmesh
from paradize.kernels.mesh import Occurrences, Topology, number_rows, topology
from paradize.vectors import cross, doubled_areas_2d

if TYPE_CHECKING:
    import numpy.typing as npt

# OpenMesh needs about 300 bytes for each triangle. Larger meshes are not counted twice.
_MOST_COUNTED_TWICE = 500_000


@dataclass(frozen=True)
class Report:
    """The findings of validation, and what it dropped. Triangles are numbered as in the input mesh.

    kept: (m,) bool, which triangles of the input are in the output, in the same order. topology: of the
    result, with vertices joined by position.
    """

    kept: npt.NDArray[np.bool_]
    degenerate: int
    first_degenerate: int | None
    doubled: int
    first_doubled: int | None
    unused_vertices: int
    zero_area_uvs: int
    first_zero_area_uv: int | None
    topology: Topology
    counted_twice: bool

    @property
    def closed(self) -> bool:
        """Whether the surface is a closed, consistently wound manifold."""
        found = self.topology
        return not (found.border.count or found.non_manifold.count or found.turned.count)


def validate_mesh(
    mesh: Mesh, file: object = None, mapped: Collection[str] | None = None
) -> tuple[Mesh, Report]:
    """Drops triangles and vertices that no tool can use, and reports what is odd about the others. Their
    positions do not change. mapped: the materials that have maps, whose triangles need an area in the texture
    (None: all).

    Dropped: triangles without area (two corners at one position, or all on a line), triangles that repeat the
    vertices of an earlier one of their material in the same direction, vertices that no triangle uses.
    Raises SourceError if arrays do not fit, a value is not finite, or nothing is left.
    """
    _require_arrays(mesh, file)
    flat = _flat(mesh)
    doubled = _doubled(mesh, flat)
    kept = ~(flat | doubled)
    if not kept.any():
        raise SourceError(
            f"all {len(mesh.triangles)} triangles are degenerate",
            file=file,
            mend="export a model with a surface",
        )
    sound, unused = _keep(mesh, kept)
    places, first = number_rows(sound.positions)
    welded = places[sound.triangles]
    found = topology(welded, len(first))
    counted = _count_again(sound, welded, first, found, file)
    no_area = _zero_area_uv(mesh) & kept if mesh.uvs is not None else np.zeros(len(kept), np.bool_)
    if mapped is not None:
        no_area &= np.repeat([g.material in mapped for g in mesh.groups], [g.count for g in mesh.groups])
    return sound, Report(
        kept=kept,
        degenerate=int(flat.sum()),
        first_degenerate=_first(flat),
        doubled=int(doubled.sum()),
        first_doubled=_first(doubled),
        unused_vertices=unused,
        zero_area_uvs=int(no_area.sum()),
        first_zero_area_uv=_first(no_area),
        topology=found,
        counted_twice=counted,
    )


def repairs(report: Report, lines: npt.NDArray[np.uint32] | None = None) -> dict[str, dict[str, int | None]]:
    """Counts of dropped and odd elements by name, with the place of the first one. `triangle` is a number of
    the input mesh; `line` is the line of its face in the source file. lines: (m,) line of each triangle."""
    kept = np.flatnonzero(report.kept)
    found = report.topology

    def entry(count: int, triangle: int | None) -> dict[str, int | None]:
        line = None if lines is None or triangle is None else int(lines[triangle])
        return {"count": count, "triangle": triangle, "line": line}

    def of_result(place: Occurrences) -> dict[str, int | None]:
        return entry(place.count, None if place.triangle is None else int(kept[place.triangle]))

    return {
        "degenerate": entry(report.degenerate, report.first_degenerate),
        "doubled": entry(report.doubled, report.first_doubled),
        "unused_vertices": entry(report.unused_vertices, None),
        "zero_area_uvs": entry(report.zero_area_uvs, report.first_zero_area_uv),
        "non_manifold_edges": of_result(found.non_manifold),
        "turned_edges": of_result(found.turned),
        "bow_ties": of_result(found.bow_tie),
        "border_edges": of_result(found.border),
    }


_SENTENCES = {  # of one, of several
    "degenerate": ("degenerate triangle dropped", "degenerate triangles dropped"),
    "doubled": (
        "triangle that repeats an earlier one dropped",
        "triangles that repeat an earlier one dropped",
    ),
    "unused_vertices": ("vertex without a triangle left out", "vertices without a triangle left out"),
    "zero_area_uvs": ("triangle without area in the texture", "triangles without area in the texture"),
    "non_manifold_edges": ("edge with more than two triangles", "edges with more than two triangles"),
    "turned_edges": (
        "edge whose two triangles are wound against each other",
        "edges whose two triangles are wound against each other",
    ),
}


def messages(report: Report, lines: npt.NDArray[np.uint32] | None = None) -> list[str]:
    """The report as sentences. Leaves out what a sound mesh may have: a border, bow ties."""
    sentences = []
    for name, found in repairs(report, lines).items():
        if name in _SENTENCES and found["count"]:
            place = f"triangle {found['triangle']}" if found["line"] is None else f"line {found['line']}"
            first = "" if found["triangle"] is None else f" (first: {place})"
            sentence = _SENTENCES[name][int(found["count"] > 1)]
            sentences.append(f"{found['count']} {sentence}{first}")
    return sentences


def _first(mask: npt.NDArray[np.bool_]) -> int | None:
    return int(mask.argmax()) if mask.any() else None


def _require_arrays(mesh: Mesh, file: object) -> None:
    count = len(mesh.positions)
    if mesh.positions.shape != (count, 3) or mesh.triangles.ndim != 2 or mesh.triangles.shape[1] != 3:
        raise SourceError(f"positions {mesh.positions.shape}, triangles {mesh.triangles.shape}", file=file)
    if len(mesh.triangles) == 0 or count == 0:
        raise SourceError("no triangles", file=file)
    if int(mesh.triangles.max()) >= count:
        at = int((mesh.triangles >= count).any(axis=1).argmax())
        raise SourceError(
            f"index {int(mesh.triangles.max())} of {count} vertices", file=file, place=f"triangle {at}"
        )
    arrays = {"positions": (mesh.positions, 3)}
    arrays |= {name: (getattr(mesh, name), width) for name, width in ATTRIBUTES.items()}
    for name, (values, width) in arrays.items():
        if values is None:
            continue
        if values.shape != (count, width):
            raise SourceError(f"{name} are {values.shape}, expected ({count}, {width})", file=file)
        if not np.isfinite(values).all():
            at = int((~np.isfinite(values)).any(axis=1).argmax())
            raise SourceError(f"{name} are not finite", file=file, place=f"vertex {at}")
    covered = 0
    for group in mesh.groups:
        if group.first != covered or group.count < 0:
            raise SourceError(f"group {group.name!r} does not start at triangle {covered}", file=file)
        covered += group.count
    if mesh.groups and covered != len(mesh.triangles):
        raise SourceError(f"groups cover {covered} of {len(mesh.triangles)} triangles", file=file)


def _flat(mesh: Mesh) -> npt.NDArray[np.bool_]:
    """Returns which triangles have an area of exactly zero, computed in float64 from normalized edges."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    a = corners[:, 1] - corners[:, 0]
    b = corners[:, 2] - corners[:, 0]
    size = np.maximum(np.abs(a).max(axis=1), np.abs(b).max(axis=1))
    scale = np.where(size > 0, size, 1.0)[:, None]
    a, b = a / scale, b / scale
    return np.asarray((cross(a, b) == 0).all(axis=1))


def _doubled(mesh: Mesh, flat: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Returns which triangles have the vertices of an earlier kept one, in the same direction, and its
    material: another material is a layer that may be blended, as decals are."""
    triangles = mesh.triangles.astype(np.int64)
    turn = triangles.argmin(axis=1)
    rows = np.arange(len(triangles))
    key = np.stack([triangles[rows, (turn + k) % 3] for k in range(3)], axis=1)
    numbers = {name: i for i, name in enumerate(dict.fromkeys(group.material for group in mesh.all_groups))}
    for group in mesh.all_groups:
        key[group.first : group.first + group.count, 0] += numbers[group.material] * len(mesh.positions)
    # Triangles without area match none: each gets a key of its own.
    key[flat] = np.stack([-1 - rows[flat]] * 3, axis=1)
    order = np.lexsort((rows, key[:, 2], key[:, 1], key[:, 0]))
    ordered = key[order]
    again = np.zeros(len(triangles), np.bool_)
    again[order[1:]] = (ordered[1:] == ordered[:-1]).all(axis=1)
    return again


def _keep(mesh: Mesh, kept: npt.NDArray[np.bool_]) -> tuple[Mesh, int]:
    """The mesh with only the kept triangles and the vertices that they use, in their old order."""
    triangles = mesh.triangles[kept]
    used = np.zeros(len(mesh.positions), np.bool_)
    used[triangles] = True
    number = (np.cumsum(used) - 1).astype(np.uint32)
    before = np.concatenate([[0], np.cumsum(kept)])
    groups: list[Group] = []
    for group in mesh.all_groups:
        first, stop = int(before[group.first]), int(before[group.first + group.count])
        if stop > first:
            groups.append(Group(group.name, group.material, first, stop - first))
    sound = mesh.with_vertices(np.flatnonzero(used), number[triangles])
    return replace(sound, groups=tuple(groups)), int((~used).sum())


def _zero_area_uv(mesh: Mesh) -> npt.NDArray[np.bool_]:
    assert mesh.uvs is not None
    corners = mesh.uvs[mesh.triangles].astype(np.float64)
    return np.asarray(doubled_areas_2d(corners) == 0)


def _count_again(
    mesh: Mesh, welded: npt.NDArray[np.uint32], first: npt.NDArray[np.uint32], found: Topology, file: object
) -> bool:
    """Compares our counts with OpenMesh's, and raises BakeError if they differ.

    Returns False if OpenMesh did not count: the surface is not a manifold, it has too many triangles, or
    Paradize was built without OpenMesh. It runs in this process, because it crashes only on indices and
    values that validation refuses.
    """
    odd = found.non_manifold.count or found.turned.count or found.bow_tie.count
    if odd or len(welded) > _MOST_COUNTED_TWICE or not openmesh.BUILT:
        return False
    theirs = openmesh.count(mesh.positions[first], welded)
    ours = (len(welded), found.edges, found.border.count)
    if theirs != ours:
        raise BakeError(f"OpenMesh counts faces, edges, border {theirs}, we count {ours}", file=file)
    return True

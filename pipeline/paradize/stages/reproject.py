"""Takes attributes and groups of a simplified mesh from the nearest places of the original surface."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Group, Mesh
from paradize.kernels.mesh import number_rows, project, topology
from paradize.stages.split import split_by
from paradize.vectors import lengths

if TYPE_CHECKING:
    import numpy.typing as npt


def group_of(mesh: Mesh) -> npt.NDArray[np.uint32]:
    """The number of each triangle's group."""
    groups = mesh.all_groups
    return np.repeat(np.arange(len(groups), dtype=np.uint32), [group.count for group in groups])


def with_groups(mesh: Mesh, numbers: npt.NDArray[np.uint32], groups: tuple[Group, ...]) -> Mesh:
    """Returns the mesh with triangles sorted by group, in their order within each, without empty groups."""
    order = np.argsort(numbers, kind="stable")
    counts = np.bincount(numbers, minlength=len(groups))
    first, found = 0, []
    for group, count in zip(groups, counts.tolist(), strict=True):
        if count:
            found.append(Group(group.name, group.material, first, count))
            first += count
    return replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[order]), groups=tuple(found))


def take_attributes(source: Mesh, simple: Mesh, names: tuple[str, ...], *, one_chart: bool = False) -> Mesh:
    """Returns `simple` with the named attributes, interpolated at the nearest places of `source`. A vertex is
    split where its corners come from several charts.

    one_chart: all three corners of a triangle come from one chart, even if it crosses several.
    """
    corners = _at_corners(source, simple, names, one_chart=one_chart)
    return split_by(simple, **corners) if corners else simple


def take_sway(source: Mesh, simple: Mesh) -> Mesh:
    """Returns `simple` with the sway of the nearest places of `source`. Vertices at one place get the same,
    so that wind opens no seam."""
    taken = _at_corners(source, simple, ("sway",), one_chart=False)["sway"]
    by_vertex = np.zeros((len(simple.positions), 2), np.float32)
    by_vertex[simple.triangles.reshape(-1)[::-1]] = taken[::-1]  # the last assignment wins: the first corner
    number, first = number_rows(simple.positions)
    # The mean of three may round beyond 1.
    return replace(simple, sway=np.ascontiguousarray(np.clip(by_vertex[first], 0, 1)[number]))


def _at_corners(
    source: Mesh, simple: Mesh, names: tuple[str, ...], *, one_chart: bool
) -> dict[str, npt.NDArray[np.float32]]:
    """Returns the named attributes that the source has, (3 m, k) for the corners of `simple`."""
    charts = topology(source.triangles, len(source.positions)).component
    middle = source.positions.astype(np.float64)
    centre = (middle.min(axis=0) + middle.max(axis=0)) / 2
    # Relative to the centre, so that the kernel's float32 loses no precision far from the origin.
    place, weights = project(
        (source.positions - centre).astype(np.float32),
        source.triangles,
        charts,
        (simple.positions - centre).astype(np.float32),
        simple.triangles,
        one_chart=one_chart,
    )
    corners = {}
    for name in names:
        values = getattr(source, name)
        if values is None:
            continue
        rows = values[source.triangles[place]].astype(np.float64)
        mixed = rows[:, 0] * weights[:, :1] + rows[:, 1] * weights[:, 1:2] + rows[:, 2] * weights[:, 2:]
        if name == "normals":
            length = lengths(mixed)
            mixed = np.where(length[:, None] > 1e-6, mixed / np.maximum(length, 1e-30)[:, None], rows[:, 0])
        corners[name] = mixed.astype(np.float32)
    return corners

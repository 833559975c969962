"""Takes attributes and groups of a simplified mesh from the nearest places of the original surface."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Group, Mesh
from paradize.kernels.mesh import project, topology
from paradize.stages.split import split_by

if TYPE_CHECKING:
    import numpy.typing as npt


def groups_of(mesh: Mesh) -> tuple[Group, ...]:
    return mesh.groups or (Group("default", "default", 0, len(mesh.triangles)),)


def group_of(mesh: Mesh) -> npt.NDArray[np.uint32]:
    """The number of each triangle's group."""
    groups = groups_of(mesh)
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
    """Returns `simple` with the named attributes, interpolated at the nearest places of `source`.

    one_chart: all three corners of a triangle come from one chart, even if it crosses several.
    """
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
            length = np.sqrt(
                mixed[:, 0] * mixed[:, 0] + mixed[:, 1] * mixed[:, 1] + mixed[:, 2] * mixed[:, 2]
            )
            mixed = np.where(length[:, None] > 1e-6, mixed / np.maximum(length, 1e-30)[:, None], rows[:, 0])
        corners[name] = mixed.astype(np.float32)
    return split_by(simple, **corners) if corners else simple

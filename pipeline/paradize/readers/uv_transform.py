"""Applies transforms of texture coordinates that materials name to the vertices of a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from paradize.data import Mesh, SourcePositions

if TYPE_CHECKING:
    import numpy.typing as npt

# Rows of an affine map of (u, v), top-left origin: u' = a u + b v + c, v' = d u + e v + f.
UvTransform = tuple[tuple[float, float, float], tuple[float, float, float]]
UNMOVED: UvTransform = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


class UvTransforms(NamedTuple):
    """The transforms of a material's first texture coordinates, and of its second ones, which are made of the
    first; None: it has none."""

    first: UvTransform = UNMOVED
    second: UvTransform | None = None


def transformed_uvs(
    mesh: Mesh, source: SourcePositions, transforms: Mapping[str, UvTransforms]
) -> tuple[Mesh, SourcePositions]:
    """The mesh with the texture coordinates of each material's triangles moved, and with second ones where a
    material has some, (0, 0) elsewhere. A vertex that materials with different transforms share becomes one
    for each; others keep their order. transforms: by material."""
    used = list(dict.fromkeys(transforms[g.material] for g in mesh.groups if g.material in transforms))
    if mesh.uvs is None or not used:
        return mesh, source
    number = {transform: index for index, transform in enumerate(used, 1)}
    count = len(mesh.positions)
    of_triangle = np.zeros(len(mesh.triangles), np.int64)
    for group in mesh.groups:
        if group.material in transforms:
            of_triangle[group.first : group.first + group.count] = number[transforms[group.material]]
    keys = of_triangle[:, None] * count + mesh.triangles
    found, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    place = np.empty(len(order), np.uint32)
    place[order] = np.arange(len(order), dtype=np.uint32)
    vertices, transform = found[order] % count, found[order] // count
    uvs = mesh.uvs[vertices].astype(np.float64)
    uvs1 = np.zeros_like(uvs) if any(pair.second for pair in used) else None
    for index, (of_first, of_second) in enumerate(used, 1):
        here = transform == index
        if uvs1 is not None and of_second is not None:
            uvs1[here] = _moved(uvs[here], of_second)
        uvs[here] = _moved(uvs[here], of_first)

    def taken(values: npt.NDArray[np.float32] | None) -> npt.NDArray[np.float32] | None:
        return None if values is None else values[vertices]

    moved = replace(
        mesh,
        positions=mesh.positions[vertices],
        normals=taken(mesh.normals),
        tangents=taken(mesh.tangents),
        uvs=uvs.astype(np.float32),
        uvs1=taken(mesh.uvs1) if uvs1 is None else uvs1.astype(np.float32),
        colors=taken(mesh.colors),
        triangles=place[inverse].reshape(mesh.triangles.shape),
    )
    return moved, replace(source, positions=source.positions[vertices])


def _moved(uvs: npt.NDArray[np.float64], rows: UvTransform) -> npt.NDArray[np.float64]:
    u, v = uvs.T
    return np.stack([row[0] * u + row[1] * v + row[2] for row in rows], axis=1)

"""Shared by the simplifiers: the result, the mesh centred and scaled, vertices joined, areas."""

from __future__ import annotations

from dataclasses import dataclass
from math import fsum
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.kernels.mesh import number_corners, number_rows
from paradize.stages.reproject import group_of as triangle_groups
from paradize.vectors import doubled_areas

if TYPE_CHECKING:
    import numpy.typing as npt

_LARGEST_IMAGE = 4.0  # of the diagonal: no image is stretched to more
# A part that would keep less than this of its area from one level to the next stays as it was. The first
# bound that lets a level come near its triangles holds: a jetty of boxes has nothing to give under the
# first.
KEPT_AREAS = (0.75, 0.5, 0.25)
# Times the triangles that were asked for: up to the first the search ends, above the second a note says why.
NEAR_TARGET, MISSED_TARGET = 1.2, 1.1


@dataclass(frozen=True)
class Simplified:
    """A simplified mesh; `note` says why it has more triangles than were asked for, and is empty otherwise.

    seams_kept: triangles end at texture seams still; where not, the texture is stretched beside some.
    """

    mesh: Mesh
    note: str
    seams_kept: bool = True


def normalised(
    positions: npt.NDArray[np.float32],
) -> tuple[npt.NDArray[np.float64], float, npt.NDArray[np.float64]]:
    """Positions centred on the origin and scaled to a diagonal of 1; metres per unit; and their centre."""
    wide = positions.astype(np.float64)
    low, high = wide.min(axis=0), wide.max(axis=0)
    x, y, z = (float(side) for side in high - low)
    largest = max(x, y, z)
    if not largest > 0:
        raise BakeError("the mesh has no extent")
    x, y, z = x / largest, y / largest, z / largest
    unit, centre = largest * float(np.sqrt(x * x + y * y + z * z)), (low + high) / 2
    return (wide - centre) / unit, unit, centre


def areas(positions: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32]) -> npt.NDArray[np.float64]:
    return 0.5 * doubled_areas(positions[triangles])


def used_only(mesh: Mesh) -> Mesh:
    """Vertices that a triangle uses, in the order of their first use."""
    index, first = number_corners(mesh.triangles.reshape(-1), np.zeros((mesh.triangles.size, 1), np.float32))
    return mesh.with_vertices(mesh.triangles.reshape(-1)[first], index.reshape(-1, 3))


def joined_vertices(mesh: Mesh, released: tuple[str, ...]) -> tuple[Mesh, npt.NDArray[np.uint32]]:
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
    joined = mesh.with_vertices(base[first], index.reshape(-1, 3))
    return joined, np.repeat(triangle_groups(mesh), 3)[first]


def image_scale(mesh: Mesh, points: npt.NDArray[np.float64], uvs: npt.NDArray[np.float32]) -> float:
    """How far 1 in texture coordinates reaches on the surface, on the mean; 0 where it cannot be said."""
    flat = np.concatenate([uvs.astype(np.float64), np.zeros((len(uvs), 1))], axis=1)
    surface, image = fsum(areas(points, mesh.triangles)), fsum(areas(flat, mesh.triangles))
    extent = float((flat.max(axis=0) - flat.min(axis=0)).max())
    scale = float(np.sqrt(surface / image)) if image > 0 and np.isfinite(image) else 0.0
    # Palettes have next to no area in the image: the bound keeps them from outweighing all else.
    return min(scale, _LARGEST_IMAGE / extent) if extent > 0 else 0.0

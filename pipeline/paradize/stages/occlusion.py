"""Ambient occlusion of a mesh: the share of the light from all around that reaches texels of its UVs.

From the place that a texel shows, rays leave in directions that follow the cosine to its normal; those that
meet a triangle within their reach are dark. H. Landis, "Production-ready global illumination", 2002. The
directions are stretches of one low-discrepancy sequence, another for each texel of 8 x 8
(kernels/occlusion/directions.hpp): no chance, and what is left of error is grain that mips average.

- The normal is that of the vertices, interpolated. Light from below the triangle itself does not count, so
  that a coarse round surface does not darken itself.
- Triangles hold light back from both sides.
- Texels that several triangles show (mirrored halves often do) hold the mean of their places.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from paradize.errors import BakeError
from paradize.kernels import maps, occlusion
from paradize.vectors import cross, dot, lengths

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Mesh

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    U32 = npt.NDArray[np.uint32]

RAYS = {"fast": 64, "balanced": 256, "exact": 1024}
LIFT = 1e-5  # of the diagonal: how far above the surface rays begin
_DARK = 0.01  # a share of the light that counts as none
_PLACES = 1 << 18  # processed together


@dataclass(frozen=True)
class Occlusion:
    """values: (h, w) float32, 1: all light arrives; 1 where no triangle lies. shared: of the texels with a
    triangle, the share that several triangles show. dark: the share that no light reaches."""

    values: F32
    shared: float
    dark: float


def mesh_occlusion(
    mesh: Mesh, on: U32, blocking: U32, *, height: int, width: int, reach: float, rays: int
) -> Occlusion:
    """The occlusion of triangles `on` (k, 3), whose UVs lie on the map, by triangles `blocking` (n, 3).

    mesh: with normals and UVs; its box is not a point. reach: length of the rays as a share of the box's
    diagonal, above 0. rays: of each place, a power of two, 16 to 65536. Raises BakeError for UVs that repeat
    or overlap too often to be drawn.
    """
    if mesh.uvs is None or mesh.normals is None:
        raise BakeError("the mesh has no UVs or no normals")
    points = _unit_places(mesh)
    try:
        touched = maps.rasterise(mesh.uvs, on, np.arange(len(on), dtype=np.int32), height=height, width=width)
        places = occlusion.places(mesh.uvs, on, touched)
    except ValueError as error:
        raise BakeError(
            str(error), mend="unwrap the model so that each triangle has texels of its own"
        ) from error
    blockers = occlusion.Blockers(points.astype(np.float32), blocking, rays)
    sums, counts = np.zeros(height * width), np.zeros(height * width, np.int64)
    for first in range(0, len(places.texel), _PLACES):
        part = slice(first, first + _PLACES)
        corners, weights = on[places.triangle[part]], places.weights[part]
        origin, normal, face = _frames(points, mesh.normals, corners, weights)
        texel = places.texel[part]
        found = blockers.open_shares(origin, normal, face, texel, width, reach=reach)
        np.add.at(sums, texel, found.astype(np.float64))
        np.add.at(counts, texel, 1)
    shown = counts > 0
    values = np.ones(height * width, np.float32)
    values[shown] = sums[shown] / counts[shown]
    inside = max(1, int(shown.sum()))
    dark = int((values < _DARK).sum()) / inside
    return Occlusion(values.reshape(height, width), places.shared / inside, dark)


def _unit_places(mesh: Mesh) -> F64:
    """The positions about the middle of their box, whose diagonal is 1."""
    wide = mesh.positions.astype(np.float64)
    low, high = wide.min(axis=0), wide.max(axis=0)
    side = float((high - low).max())
    if not side > 0.0:
        raise BakeError("all vertices lie at one place")
    wide = (wide - (0.5 * low + 0.5 * high)) / side
    box = (high - low) / side
    return np.asarray(wide / np.sqrt(box[0] * box[0] + box[1] * box[1] + box[2] * box[2]))


def _frames(points: F64, normals: F32, corners: U32, weights: F64) -> tuple[F32, F32, F32]:
    """Where rays begin, the normals there, and those of the triangles on the same side; all (n, 3)."""
    a, b, c = (points[corners[:, k]] for k in range(3))
    face = _unit(cross(b - a, c - a))
    place = _mix(weights, a, b, c)
    normal = _unit(_mix(weights, *(normals[corners[:, k]].astype(np.float64) for k in range(3))))
    along = dot(normal, face)
    normal = np.where((along == 0.0)[:, None], face, normal)
    face = np.where((along < 0.0)[:, None], -face, face)
    made = (place + LIFT * face, normal, face)
    return tuple(values.astype(np.float32) for values in made)  # type: ignore[return-value]


def _mix(weights: F64, a: F64, b: F64, c: F64) -> F64:
    return np.asarray(weights[:, 0, None] * a + weights[:, 1, None] * b + weights[:, 2, None] * c)


def _unit(vectors: F64) -> F64:
    """Each of length 1; a zero vector stays."""
    largest = np.abs(vectors).max(axis=1, keepdims=True, initial=0.0)
    scaled = vectors / np.where(largest > 0.0, largest, 1.0)
    length = lengths(scaled)[:, None]
    return np.asarray(scaled / np.where(length > 0.0, length, 1.0))

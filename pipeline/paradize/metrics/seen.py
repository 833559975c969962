"""The difference between two levels of a mesh as they are seen: in pictures from all around, as small as the
mesh is drawn.

Per pixel the mean normal is compared, because that is what light sees of the surfaces under it, and the
coverage, which is the silhouette. Two levels whose normals differ everywhere by much may look the same once a
pixel holds many of them. The kernel is not imported by any stage (`reference/seen.hpp`).

Colour and light of its own are compared by `metrics/switch.py`; gloss is not compared. How far a texture
slides on a level is measured on its own (`mapped_normal.uv_shift`).

    finest = seen_mesh(lod0, {"bark": SeenMaterial(normals=mips)})
    seen = seen_difference(finest, seen_mesh(lod1, ...), size_px=120.0)
    taken = largest_size(finest, seen_mesh(lod1, ...), Limits(), most_px=400.0)  # None: at no size

The materials of the two may differ: a level may have a normal map of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil, inf

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh
from paradize.kernels.reference.seen import SeenDifference, SeenMaterial, SeenMesh, seen_differences

# Directions of a picture, spread evenly over the sphere.
DIRECTIONS = 14
# Samples along the diagonal, and along the side of a pixel at least and at most. With fewer of them a small
# picture's error is mostly that of its own sampling.
_SAMPLES, _LEAST_SAMPLES, _MOST_SAMPLES = 768.0, 2, 16
_MOST_TILES = 64  # of 32 x 32 pixels; of larger pictures as many are measured
# Sizes in pixels along the bounding box's diagonal. What looks the same at the largest does so beyond: pixels
# are then narrower than what the levels differ in. At less than the smallest nothing is told apart.
LARGEST_PX, SMALLEST_PX = 4096.0, 4.0
_BISECTIONS = 2
# The turn from one direction to the next, as cosine and sine: the golden angle. H. Vogel, "A better way to
# construct the sunflower head", 1979.
_GOLDEN = -0.7373688780783197, 0.6754902942615238


@dataclass(frozen=True)
class Limits:
    """How much a level may differ from the finest where it takes over. normal_deg: 99 % of what is covered
    turns by no more. silhouette: pixels that only one covers, as a share of the rectangle around both."""

    normal_deg: float = 10.0
    silhouette: float = 0.004


@dataclass(frozen=True)
class Seen:
    """A difference of pictures. p99_deg, mean_deg, max_deg: of the normals of pixels, weighted by what both
    levels cover, over the pictures from all directions. silhouette: pixels that only one covers, as a share
    of the rectangle around both. size_px: the diagonal."""

    size_px: float
    p99_deg: float
    mean_deg: float
    max_deg: float
    silhouette: float

    def inside(self, limits: Limits) -> bool:
        """Whether it is no larger than the limits."""
        return self.p99_deg <= limits.normal_deg and self.silhouette <= limits.silhouette


def directions() -> npt.NDArray[np.float64]:
    """(DIRECTIONS, 3) unit, towards the viewer: a spiral over the sphere, the same bits on every machine."""
    out = np.empty((DIRECTIONS, 3), np.float64)
    cosine, sine = 1.0, 0.0
    for k in range(DIRECTIONS):
        y = 1.0 - (2.0 * k + 1.0) / DIRECTIONS
        around = float(np.sqrt(1.0 - y * y))
        out[k] = around * cosine, y, around * sine
        turn, lift = _GOLDEN
        cosine, sine = cosine * turn - sine * lift, cosine * lift + sine * turn
    return out


def diagonal_of(mesh: SeenMesh) -> float:
    """The diagonal of the box around its triangles, in the unit of its positions."""
    corners = mesh.positions[mesh.triangles.reshape(-1)].astype(np.float64)
    sides = corners.max(axis=0) - corners.min(axis=0)
    return float(np.sqrt((sides * sides).sum()))


def seen_mesh(mesh: Mesh, materials: Mapping[str, SeenMaterial]) -> SeenMesh:
    """A mesh as it is drawn. materials: by name; others are opaque, one-sided and without a normal map."""
    names = list(dict.fromkeys(group.material for group in mesh.groups)) or [""]
    rows = np.zeros(len(mesh.triangles), np.uint32)
    for group in mesh.groups:
        rows[group.first : group.first + group.count] = names.index(group.material)
    used = [materials.get(name, SeenMaterial()) for name in names]
    attributes = {"normals": mesh.normals, "tangents": mesh.tangents, "uvs": mesh.uvs, "colors": mesh.colors}
    return SeenMesh(mesh.positions, mesh.triangles, used, rows, **attributes)


def seen_difference(finest: SeenMesh, level: SeenMesh, size_px: float) -> Seen:
    """Compares pictures in which the finest level's diagonal has `size_px` pixels, 1 to LARGEST_PX. All 0
    where the mesh is a point."""
    found = seen_within(finest, level, size_px, Limits(inf, inf))
    assert found is not None
    return found


def seen_within(finest: SeenMesh, level: SeenMesh, size_px: float, limits: Limits) -> Seen | None:
    """As seen_difference; None where it is beyond the limits, which mostly takes less time."""
    size = diagonal_of(finest)
    if not size > 0:
        return Seen(size_px, 0.0, 0.0, 0.0, 0.0)
    found = seen_differences(
        finest,
        level,
        directions(),
        size / size_px,
        samples=max(_LEAST_SAMPLES, min(_MOST_SAMPLES, ceil(_SAMPLES / size_px))),
        most_tiles=_MOST_TILES,
        p99_deg=limits.normal_deg,
        changed=limits.silhouette,
    )
    if found is None:
        return None
    _, all_of_them = found
    seen = Seen(
        size_px,
        all_of_them.p99_deg,
        all_of_them.mean_deg,
        all_of_them.max_deg,
        _silhouette(all_of_them),
    )
    return seen if seen.inside(limits) else None


def _silhouette(difference: SeenDifference) -> float:
    return difference.changed_px / difference.box_px if difference.box_px > 0 else 0.0


def largest_size(
    finest: SeenMesh,
    level: SeenMesh,
    limits: Limits,
    most_px: float,
    also: Callable[[float], bool] = lambda _: True,
) -> Seen | None:
    """The difference at the largest size, at most `most_px`, at which the level may take over; None if there
    is none. Sizes are halved until one is inside the limits, then bisected. also: what else must hold of a
    size; it is asked first."""

    def inside(size_px: float) -> Seen | None:
        return seen_within(finest, level, size_px, limits) if also(size_px) else None

    above = size = min(max(most_px, SMALLEST_PX), LARGEST_PX)
    while (found := inside(size)) is None:
        if size <= SMALLEST_PX:
            return None
        above, size = size, max(0.5 * size, SMALLEST_PX)
    for _ in range(_BISECTIONS if size < above else 0):
        between = float(np.sqrt(found.size_px * above))
        tried = inside(between)
        above = between if tried is None else above
        found = tried or found
    return found

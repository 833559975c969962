"""Python interface of the reference kernel that compares pictures of meshes. Used by a metric; no stage
imports it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
import numpy.typing as npt

import paradize.kernels.reference._reference as _reference
from paradize.kernels.arrays import finite_rows, to_indices, triangle_rows
from paradize.kernels.reference import WRAPS
from paradize.kernels.threads import default_threads

F32 = npt.NDArray[np.float32]
MOST_PIXELS = 16384  # along a side of a picture


@dataclass(frozen=True)
class SeenMaterial:
    """The look of a material. normals: (h, w, 3) unit vectors of each mip of its normal map, green up, the
    finest first; none: flat. alpha: (h, w) of each mip; none: no holes. colors, glow: (h, w, 3) linear of
    each mip, what it reflects and what it gives off; none: white, and black. cutoff: what has less alpha is a
    hole. wrap: "repeat", "clamp" or "mirror" beyond the edges of its maps, along u and v. two_sided: whether
    back faces are drawn, with their normal turned round."""

    normals: Sequence[F32] = ()
    alpha: Sequence[F32] = ()
    cutoff: float = 0.0
    wrap: tuple[str, str] = ("repeat", "repeat")
    two_sided: bool = False
    colors: Sequence[F32] = ()
    glow: Sequence[F32] = ()


@dataclass(frozen=True)
class SeenDifference:
    """How two pictures of one size differ. mean_deg, p99_deg, max_deg: degrees between the mean normals of
    their pixels, weighted by what both cover. covered_px: pixels that the first mesh covers. changed_px:
    pixels that one covers and the other does not. box_px: those of the rectangle around both. Parts of pixels
    count as parts."""

    mean_deg: float
    p99_deg: float
    max_deg: float
    covered_px: float
    changed_px: float
    box_px: float


def _chain(levels: Sequence[F32], channels: int) -> list[F32]:
    out = []
    for level in levels:
        texels = np.ascontiguousarray(level, np.float32)
        texels = texels[:, :, None] if texels.ndim == 2 else texels
        if texels.ndim != 3 or texels.shape[2] != channels or not texels.size:
            raise ValueError(f"a mip of {texels.shape}, expected (h, w, {channels})")
        out.append(texels)
    return out


class SeenMesh:
    """A mesh as it is drawn. positions: (n, 3), any unit. triangles: (m, 3), m > 0. normals: (n, 3) unit;
    None: those of the triangles. tangents: (n, 4), uvs: (n, 2), or None; normal maps need both. colors: (n,
    4) linear, times those of the material, or None. by_triangle: (m,) rows of `materials`."""

    def __init__(
        self,
        positions: npt.ArrayLike,
        triangles: npt.ArrayLike,
        materials: Sequence[SeenMaterial] = (SeenMaterial(),),
        by_triangle: npt.ArrayLike | None = None,
        *,
        normals: npt.ArrayLike | None = None,
        tangents: npt.ArrayLike | None = None,
        uvs: npt.ArrayLike | None = None,
        colors: npt.ArrayLike | None = None,
    ) -> None:
        points = finite_rows(positions, 3, np.float32)
        faces = triangle_rows(triangles, len(points), least=1)
        rows = np.zeros(len(faces), np.uint32) if by_triangle is None else by_triangle
        rows = to_indices(rows)
        if rows.shape != (len(faces),) or int(rows.max()) >= len(materials):
            raise ValueError(f"expected ({len(faces)},) rows of {len(materials)} materials, got {rows.shape}")
        self.positions, self.triangles = points, faces
        *columns, painted = (
            None if values is None else finite_rows(values, width, np.float32, count=len(points))
            for values, width in ((normals, 3), (tangents, 4), (uvs, 2), (colors, 4))
        )
        native, chains = [], []
        for material in materials:
            if not 0.0 <= material.cutoff < float("inf"):
                raise ValueError(f"an alpha cutoff of {material.cutoff}")
            vectors, alpha = _chain(material.normals, 3), _chain(material.alpha, 1)
            maps = [vectors, alpha, _chain(material.colors, 3), _chain(material.glow, 3)]
            chains += maps
            ways = (WRAPS.index(way) for way in material.wrap)
            native.append(_reference.seen_material(*maps, material.cutoff, *ways, material.two_sided))
        self._held = (points, faces, columns, rows, painted, chains)  # the native mesh looks at them
        self.native = _reference.seen_mesh(points, faces, *columns, rows, native, painted)


def seen_differences(
    a: SeenMesh,
    b: SeenMesh,
    directions: npt.ArrayLike,
    pixel: float,
    *,
    samples: int,
    most_tiles: int,
    p99_deg: float = inf,
    changed: float = inf,
    threads: int | None = None,
) -> tuple[list[SeenDifference], SeenDifference] | None:
    """Compares orthographic pictures of two meshes, as defined in reference/seen.hpp: of each direction, and
    of all together. None where all together have a larger p99_deg, or more changed_px as a share of box_px,
    and the first pictures already make that certain.

    directions: (k, 3), towards the viewer, not 0. pixel: > 0, in the unit of the positions; no picture is
    wider than MOST_PIXELS. samples: along a side of a pixel, 1 to 16. most_tiles: of 32 x 32 pixels, measured
    of each picture, 1 to 65536.
    """
    towards = finite_rows(directions, 3, np.float64, name="directions")
    if not (np.abs(towards).max(axis=1) > 1e-9).all():
        raise ValueError("a direction of no length")
    corners = np.concatenate([mesh.positions[mesh.triangles.reshape(-1)] for mesh in (a, b)])
    sides = corners.max(axis=0).astype(np.float64) - corners.min(axis=0)
    span = float(np.sqrt((sides * sides).sum()))
    if not (pixel > 0 and span / pixel <= MOST_PIXELS):
        raise ValueError(f"a pixel of {pixel:g} of {span:g}, expected at most {MOST_PIXELS} along it")
    if not 1 <= samples <= 16 or not 1 <= most_tiles <= 65536:
        raise ValueError(f"{samples} samples, expected 1 to 16; {most_tiles} tiles, expected 1 to 65536")
    workers = default_threads(8) if threads is None else max(1, threads)
    limits = p99_deg, changed
    found = _reference.seen_differences(
        a.native, b.native, towards, pixel, samples, most_tiles, *limits, workers
    )
    if not found:
        return None
    *each, together = (SeenDifference(*map(float, sums)) for sums in found)
    return each, together


@dataclass(frozen=True)
class SeenLight:
    """One direction of light, and light from all around. toward: unit, to the light. direct, around: how much
    of a white surface's light comes from either, linear; what comes from around falls to 0 on what looks
    down."""

    toward: tuple[float, float, float]
    direct: float
    around: float


def switch_flips(
    before: SeenMesh,
    after: SeenMesh,
    directions: npt.ArrayLike,
    pixel: float,
    light: SeenLight,
    *,
    samples: int,
    background: int,
    threads: int | None = None,
) -> npt.NDArray[np.float64]:
    """Returns the mean of FLIP over the bounding box of `before`, 0..1, of orthographic pictures of two
    meshes along each direction, as defined in reference/switch.hpp.

    directions: (k, 3) unit, towards the viewer. pixel: > 0, in the unit of the positions. samples: along a
    side of a pixel, 1 to 16. background: the grey behind them, a code of sRGB, 0 to 255.
    """
    towards = finite_rows(directions, 3, np.float64, name="directions")
    if not pixel > 0 or not 1 <= samples <= 16 or not 0 <= background <= 255:
        raise ValueError(f"a pixel of {pixel:g}, {samples} samples or a background of {background}")
    workers = default_threads(8) if threads is None else max(1, threads)
    lit = list(light.toward), light.direct, light.around
    found = _reference.switch_flips(
        before.native, after.native, towards, pixel, samples, background, *lit, workers
    )
    return np.asarray(found)


def flip(a: npt.NDArray[np.uint8], b: npt.NDArray[np.uint8]) -> F32:
    """FLIP (h, w), 0..1, of two pictures (h, w, 3) in codes of sRGB, at 67 pixels per degree; without libm
    (reference/flip.hpp)."""
    if a.shape != b.shape or a.ndim != 3 or a.shape[2] != 3 or not a.size:
        raise ValueError(f"pictures of {a.shape} and {b.shape} cannot be compared")
    return np.asarray(_reference.flip(np.ascontiguousarray(a), np.ascontiguousarray(b)))

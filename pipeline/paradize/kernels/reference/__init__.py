"""Python interface of the reference kernels, with which metrics measure. No stage imports it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import paradize.kernels.reference._reference as _reference
from paradize.kernels.arrays import finite_rows, triangle_rows
from paradize.kernels.threads import default_threads

WRAPS = ("repeat", "clamp", "mirror")  # as places.hpp numbers them

# Largest gap of the two bounds of a distance: relative to it, or to the first surface's diagonal.
GAP, RESOLUTION = 0.001, 1e-7


class Surface:
    """Triangles in a search tree, made once for any number of measurements.

    positions: (n, 3) finite, any unit. triangles: (m, 3), m > 0. Copied only where necessary.
    """

    def __init__(self, positions: npt.ArrayLike, triangles: npt.ArrayLike) -> None:
        self.positions = finite_rows(positions, 3, np.float32)
        self.triangles = triangle_rows(triangles, len(self.positions), least=1)
        self.tree = _reference.Surface(self.positions, self.triangles)

    def distance_to(
        self, other: Surface, *, samples: int, threads: int | None = None
    ) -> tuple[float, float, float]:
        """(max, rms, p99) distance of this surface's samples from the other surface, in the unit of the
        positions. Points between samples may be farther than `max` (see between).

        samples: approximate number, 0 to 10^8; each triangle has at least ten.
        """
        if not 0 <= samples <= 10**8:
            raise ValueError(f"{samples} samples, expected 0 to 10^8")
        workers = default_threads(8) if threads is None else max(1, threads)
        distances = _reference.surface_distance(self.tree, other.tree, samples, workers)
        return float(distances[0]), float(distances[1]), float(distances[2])

    def between(
        self, other: Surface, *, samples: int, gap: float = GAP, threads: int | None = None
    ) -> tuple[float, float, float, float]:
        """(low, high, rms, p99) distance of the two surfaces, each the larger of both directions, in the
        unit of the positions. The maximum lies between `low` and `high` (except for rounding of float64).
        They differ by at most `gap` of it or RESOLUTION of this surface's diagonal, or by more where the work
        limit is reached: 60 million tests of a point against a triangle plus 600 per triangle. rms, p99: of
        samples, as in distance_to.

        gap: 1e-6 to 1.
        """
        if not 0 <= samples <= 10**8 or not 1e-6 <= gap <= 1:
            raise ValueError(f"{samples} samples, expected 0 to 10^8; gap {gap}, expected 1e-6 to 1")
        workers = default_threads(8) if threads is None else max(1, threads)
        low, high, rms, p99 = _reference.two_sided(self.tree, other.tree, samples, gap, RESOLUTION, workers)
        return float(low), float(high), float(rms), float(p99)


class Shading:
    """The attributes of a surface's vertices: normals (n, 3) unit, and tangents (n, 4) and uvs (n, 2) or
    None.

    triangles: (m, 3), in the order of the surface's triangles, where these vertices are not the surface's
    own.
    """

    def __init__(
        self,
        surface: Surface,
        normals: npt.ArrayLike,
        tangents: npt.ArrayLike | None,
        uvs: npt.ArrayLike | None,
        triangles: npt.ArrayLike | None = None,
    ) -> None:
        self.surface = surface
        count = len(np.asarray(normals))
        indices = triangle_rows(surface.triangles if triangles is None else triangles, count)
        if indices.shape != surface.triangles.shape:
            raise ValueError(f"{len(indices)} triangles of a surface of {len(surface.triangles)}")
        self.columns = [
            None if values is None else finite_rows(values, width, np.float32, count=count)
            for values, width in ((normals, 3), (tangents, 4), (uvs, 2))
        ]
        self.has_uvs = uvs is not None
        self.triangles = indices
        self.native = _reference.shading(indices, *self.columns)

    def angles_to(
        self,
        truth: Shading,
        *,
        near: float,
        samples: int,
        normal_map: npt.ArrayLike | None = None,
        wrap: tuple[str, str] = ("repeat", "repeat"),
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """(mean, p99, max) over this surface's area of the angles in degrees between the normals of both at
        one place (reference/places.hpp), and the same for normals changed by the normal map.

        near: how far, in the unit of the positions, a point that faces the same way may lie behind a nearer
        one that does not. normal_map: (h, w, 3) unit vectors, green up; without it, or without tangents or
        UVs, both results are equal. wrap: "repeat", "clamp" or "mirror" beyond its edges, along u and v.
        """
        vectors = None
        if normal_map is not None:
            vectors = np.ascontiguousarray(normal_map, np.float32)
            if (
                vectors.ndim != 3
                or vectors.shape[2] != 3
                or not vectors.size
                or not np.isfinite(vectors).all()
            ):
                raise ValueError(f"normal map {vectors.shape}: expected finite (h, w, 3)")
        if not 0 <= samples <= 10**8 or not near >= 0:
            raise ValueError(f"{samples} samples, near {near}")
        found = _reference.normal_angles(
            self.surface.tree, self.native, truth.surface.tree, truth.native,
            vectors, *(WRAPS.index(way) for way in wrap), near, samples, default_threads(8),
        )  # fmt: skip
        plain, mapped = ((float(mean), float(p99), float(most)) for mean, p99, most in found)
        return plain, mapped

    def shift_from(
        self, truth: Shading, *, unit: float, samples: int, threads: int | None = None
    ) -> tuple[float, float, float]:
        """(mean, p99, max) over this surface's area of the distance, in the unit of the positions, between
        the places where both show the same point of the texture. unit: distance per unit of UVs where the
        reference has no such UVs nearby."""
        if not (self.has_uvs and truth.has_uvs):
            raise ValueError("no texture coordinates")
        if not 1 <= samples <= 10**8 or not 0 <= unit < float("inf"):
            raise ValueError(f"{samples} samples, unit {unit}")
        workers = default_threads(8) if threads is None else max(1, threads)
        distances = _reference.uv_shift(
            self.surface.tree, self.native, truth.surface.tree, truth.native, unit, samples, workers
        )
        return float(distances[0]), float(distances[1]), float(distances[2])


@dataclass(frozen=True)
class Loading:
    """most: the farthest that a vertex lies from its text. low, high: box of the text's positions. collapsed:
    triangles with an area in the text and none as loaded, and the first. turned_p99_deg: 99 % of the text's
    area was turned by no more. Lengths in the positions' unit."""

    most: float
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    collapsed: int
    first_collapsed: int
    turned_p99_deg: float


def loading(
    positions: npt.NDArray[np.float32],
    origin: tuple[float, float, float],
    source_positions: npt.NDArray[np.float64],
    triangles: npt.NDArray[np.uint32],
) -> Loading:
    """The loss of positions (n, 3), relative to `origin`, against the positions (n, 3) of the file."""
    rows = finite_rows(positions, 3, np.float32)
    reference = finite_rows(source_positions, 3, np.float64, count=len(rows))
    most, low, high, collapsed, first, turned = _reference.loading(
        rows, np.array(origin, np.float64), reference, triangle_rows(triangles, len(rows), least=1)
    )
    return Loading(most, low, high, collapsed, first, turned)


def angles_deg(a: npt.ArrayLike, b: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """(n,) angles in degrees, 0 to 180, between the rows of two (n, 3) arrays; 90 for a zero row."""
    first, second = (finite_rows(values, 3, np.float32) for values in (a, b))
    if first.shape != second.shape:
        raise ValueError(f"{first.shape} and {second.shape} rows")
    return _reference.angles_deg(first, second)  # type: ignore[no-any-return]


def powers(bases: npt.NDArray[np.float64], exponent: float) -> npt.NDArray[np.float64]:
    """bases^exponent for bases >= 0 of any shape, with the same bits on all machines."""
    flat = np.ascontiguousarray(bases, np.float64).ravel()
    return np.asarray(_reference.powers(flat, float(exponent)), np.float64).reshape(bases.shape)


def mikktspace_tangents(
    positions: npt.ArrayLike, normals: npt.ArrayLike, uvs: npt.ArrayLike, triangles: npt.ArrayLike
) -> npt.NDArray[np.float32]:
    """(m, 3, 4) tangents of all corners by MikkTSpace in float64; w is such that w * cross(N, T) points up
    the image. positions, normals: (n, 3), normals unit. uvs: (n, 2), top-left origin."""
    p = finite_rows(positions, 3, np.float32)
    n, t = (finite_rows(rows, k, np.float32, count=len(p)) for rows, k in ((normals, 3), (uvs, 2)))
    return _reference.corner_tangents(p, n, t, triangle_rows(triangles, len(p), least=1))  # type: ignore[no-any-return]

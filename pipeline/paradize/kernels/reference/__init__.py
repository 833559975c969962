"""Checked face of the reference kernels, which metrics measure with and no stage imports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import paradize.kernels.reference._reference as _reference
from paradize.kernels.threads import default_threads

# How far apart the two bounds of a largest distance shall be: of it, or of the first surface's diagonal.
GAP, RESOLUTION = 0.001, 1e-7


def _rows(values: npt.ArrayLike, width: int = 3) -> npt.NDArray[np.float32]:
    rows = np.ascontiguousarray(values, np.float32)
    if rows.ndim != 2 or rows.shape[1] != width or not np.isfinite(rows).all():
        raise ValueError(f"expected (n, {width}) finite floats, got {rows.shape}")
    return rows


def _columns(values: npt.ArrayLike, count: int, width: int) -> npt.NDArray[np.float32]:
    rows = np.ascontiguousarray(values, np.float32)
    if rows.shape != (count, width) or not np.isfinite(rows).all():
        raise ValueError(f"expected ({count}, {width}) finite floats, got {rows.shape}")
    return rows


def _triangles(values: npt.ArrayLike, vertices: int) -> npt.NDArray[np.uint32]:
    triangles = np.ascontiguousarray(values, np.uint32)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles):
        raise ValueError(f"expected (m, 3) indices, got {triangles.shape}")
    if int(triangles.max()) >= vertices:
        raise ValueError(f"index {int(triangles.max())} of {vertices} vertices")
    return triangles


class Surface:
    """Triangles that are measured, in a tree; made once for any number of measurements.

    positions: (n, 3) finite, any unit; triangles: (m, 3), m > 0. Both are copied only where they must be.
    """

    def __init__(self, positions: npt.ArrayLike, triangles: npt.ArrayLike) -> None:
        self.positions = _rows(positions)
        self.triangles = _triangles(triangles, len(self.positions))
        self.tree = _reference.Surface(self.positions, self.triangles)

    def distance_to(
        self, other: Surface, *, samples: int, threads: int | None = None
    ) -> tuple[float, float, float]:
        """(max, rms, p99) distance from this surface's samples to the other surface, in the positions' unit:
        a point between samples may lie farther than `max` (see between).

        samples: about how many in all, besides ten or more in every triangle, 0 to 10^8.
        """
        if not 0 <= samples <= 10**8:
            raise ValueError(f"{samples} samples, expected 0 to 10^8")
        workers = default_threads(8) if threads is None else max(1, threads)
        found = _reference.surface_distance(self.tree, other.tree, samples, workers)
        return float(found[0]), float(found[1]), float(found[2])

    def between(
        self, other: Surface, *, samples: int, gap: float = GAP, threads: int | None = None
    ) -> tuple[float, float, float, float]:
        """(least, most, rms, p99) distance of the two surfaces, each the larger of both directions, in the
        positions' unit: the largest lies between `least` and `most` (but for the rounding of float64), which
        are `gap` of it or RESOLUTION of this surface's diagonal apart, or more where 60 million tests of a
        place against a triangle and 600 for each one of both did not do. rms, p99: of samples, as of
        distance_to.

        gap: 1e-6 to 1.
        """
        if not 0 <= samples <= 10**8 or not 1e-6 <= gap <= 1:
            raise ValueError(f"{samples} samples, expected 0 to 10^8; gap {gap}, expected 1e-6 to 1")
        workers = default_threads(8) if threads is None else max(1, threads)
        least, most, rms, p99 = _reference.two_sided(self.tree, other.tree, samples, gap, RESOLUTION, workers)
        return float(least), float(most), float(rms), float(p99)


class Shading:
    """What a surface's vertices carry: normals (n, 3) unit, and tangents (n, 4) and uvs (n, 2) or None.

    triangles: (m, 3) where these vertices are others than the surface's: its triangles, in their order.
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
        held = _triangles(surface.triangles if triangles is None else triangles, count)
        if held.shape != surface.triangles.shape:
            raise ValueError(f"{len(held)} triangles of a surface of {len(surface.triangles)}")
        self.held = [
            None if values is None else _columns(values, count, width)
            for values, width in ((normals, 3), (tangents, 4), (uvs, 2))
        ]
        self.has_uvs = uvs is not None
        self.triangles = held
        self.native = _reference.shading(held, *self.held)

    def angles_to(
        self,
        truth: Shading,
        *,
        near: float,
        samples: int,
        normal_map: npt.ArrayLike | None = None,
        repeat: bool = True,
        threads: int | None = None,
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """(mean, p99, max) over this surface's area of the degrees between the normals that both show at one
        place (reference/places.hpp), and the same of normals that the map turned. near: how far, in the
        positions' unit, a place that faces the same way may lie behind a nearer one that does not.
        normal_map: (h, w, 3) unit vectors, green up; without one, or where tangents or texture coordinates
        lack, both are the same."""
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
        workers = default_threads(8) if threads is None else max(1, threads)
        found = _reference.normal_angles(
            self.surface.tree, self.native, truth.surface.tree, truth.native,
            vectors, repeat, near, samples, workers,
        )  # fmt: skip
        plain, mapped = ((float(mean), float(p99), float(most)) for mean, p99, most in found)
        return plain, mapped

    def shift_from(
        self, truth: Shading, *, unit: float, samples: int, threads: int | None = None
    ) -> tuple[float, float, float]:
        """(mean, p99, max) over this surface's area of how far, in the positions' unit, the texture shown
        lies from where `truth` shows it. unit: what 1 in texture coordinates counts where nothing near has
        them."""
        if not (self.has_uvs and truth.has_uvs):
            raise ValueError("no texture coordinates")
        if not 1 <= samples <= 10**8 or not 0 <= unit < float("inf"):
            raise ValueError(f"{samples} samples, unit {unit}")
        workers = default_threads(8) if threads is None else max(1, threads)
        found = _reference.uv_shift(
            self.surface.tree, self.native, truth.surface.tree, truth.native, unit, samples, workers
        )
        return float(found[0]), float(found[1]), float(found[2])


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
    texts: npt.NDArray[np.float64],
    triangles: npt.NDArray[np.uint32],
) -> Loading:
    """What positions (n, 3), counted from `origin`, lost of the text's (n, 3) that they stand for."""
    rows = _rows(positions)
    truth = np.ascontiguousarray(texts, np.float64)
    if truth.shape != rows.shape or not np.isfinite(truth).all():
        raise ValueError(f"{truth.shape} positions in the text, expected {rows.shape}, finite")
    most, low, high, collapsed, first, turned = _reference.loading(
        rows, np.array(origin, np.float64), truth, _triangles(triangles, len(rows))
    )
    return Loading(most, low, high, collapsed, first, turned)


def angles_deg(a: npt.ArrayLike, b: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """(n,) angles in degrees, 0 to 180, between the rows of two (n, 3) arrays; 90 where a row is zero."""
    first, second = _rows(a), _rows(b)
    if first.shape != second.shape:
        raise ValueError(f"{first.shape} and {second.shape} rows")
    return _reference.angles_deg(first, second)  # type: ignore[no-any-return]


def powers(bases: npt.NDArray[np.float64], exponent: float) -> npt.NDArray[np.float64]:
    """bases^exponent of bases of any shape, 0 or more, with the same bits on every machine."""
    flat = np.ascontiguousarray(bases, np.float64).ravel()
    return np.asarray(_reference.powers(flat, float(exponent)), np.float64).reshape(bases.shape)


def mikktspace_tangents(
    positions: npt.ArrayLike, normals: npt.ArrayLike, uvs: npt.ArrayLike, triangles: npt.ArrayLike
) -> npt.NDArray[np.float32]:
    """(m, 3, 4) tangents of every corner as MikkTSpace defines them, in float64, w so that w * cross(N, T)
    points up the image. positions, normals: (n, 3), normals unit; uvs: (n, 2) top-left origin."""
    p, n, t = _rows(positions), _rows(normals), _rows(uvs, 2)
    if not len(p) == len(n) == len(t):
        raise ValueError(f"{len(p)} positions, {len(n)} normals, {len(t)} texture coordinates")
    return _reference.corner_tangents(p, n, t, _triangles(triangles, len(p)))  # type: ignore[no-any-return]

"""Python interface of the terrain kernels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from paradize.kernels.arrays import to_indices
from paradize.kernels.terrain import _terrain
from paradize.kernels.threads import default_threads

THREADS = default_threads(8)


def refine(
    heights: npt.NDArray[np.float32], tolerance: float, *, threads: int = THREADS
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """A Delaunay triangulation of grid points whose triangles lie within `tolerance` of each pixel.

    heights: (rows, columns) float32, finite, 2 to 16385 per side. tolerance: >= 0, in the unit of the
    heights. Returns vertices (n, 2) uint32 as (row, column) and triangles (m, 3) uint32, clockwise in an
    image with row 0 at the top. Raises ValueError for other shapes, dtypes or values.
    """
    return _triangulate(_terrain.refine, heights, tolerance, threads)


def bisect(
    heights: npt.NDArray[np.float32], tolerance: float, *, threads: int = THREADS
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """As `refine`, by a hierarchy of right triangles: not Delaunay, more triangles."""
    return _triangulate(_terrain.bisect, heights, tolerance, threads)


Corners = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]


def patch(
    heights: npt.NDArray[np.float32],
    corners: Corners,
    tolerance_m: float,
    hypotenuse_tolerance_m: float,
    leg_tolerance_m: float,
    *,
    most_vertices: int = 2**32 - 1,
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.uint32]]:
    """The part of a right triangle in pixel space that lies in the field, as a Delaunay triangulation.

    heights: (rows, columns) float32, metres, 2 to 16385 per side, C-contiguous, finite (not checked, because
    patches are many). corners: (row, column) of the right angle and of the ends of the hypotenuse, up to 2^20
    pixels away, also outside the field; legs of equal length, along rows and columns or along diagonals.
    Tolerances: metres, >= 0; tolerance_m is that of pixels inside and along the field's edge.

    The vertices of a border depend only on the heights along it, its two ends (where it leaves the field) and
    its tolerance, so the neighbouring patch has the same ones. Returns vertices (n, 2) int32 as (row, column)
    and triangles (m, 3) uint32, clockwise in an image with row 0 at the top; both empty where the triangle
    covers no area. most_vertices: limit of the vertices inside; the worst pixels come first. Raises
    ValueError. Releases Python's lock.
    """
    if heights.dtype != np.float32 or heights.ndim != 2 or not heights.flags.c_contiguous:
        raise ValueError(f"heights must be contiguous (rows, columns) float32, not {heights.shape}")
    pixels, triangles = _terrain.patch(
        heights,
        corners,
        float(tolerance_m),
        float(hypotenuse_tolerance_m),
        float(leg_tolerance_m),
        most_vertices,
    )
    columns = np.uint32(heights.shape[1])
    vertices = np.stack([pixels // columns, pixels % columns], axis=1).astype(np.int32)
    return vertices, triangles.reshape(-1, 3)


@dataclass(frozen=True)
class Vertices:
    """float32 arrays with one row per vertex: positions, normals (n, 3), tangents (n, 4), both UV sets (n,
    2). triangles: (m, 3) uint32, facing up; empty where single vertices were requested."""

    positions: npt.NDArray[np.float32]
    normals: npt.NDArray[np.float32]
    tangents: npt.NDArray[np.float32]
    uvs: npt.NDArray[np.float32]
    uvs1: npt.NDArray[np.float32]
    triangles: npt.NDArray[np.uint32]


def vertices(
    heights: npt.NDArray[np.float32],
    size_m: tuple[float, float],
    pixels: npt.NDArray[np.integer] | None = None,
    *,
    sand_repeat: float = 1.0,
    threads: int = THREADS,
) -> Vertices:
    """The vertices of a terrain of size_m = (x, z) metres around the origin at some pixels.

    heights: (rows, columns) float32, metres, at least 2 per side. pixels: (n, 2) as (row, column), or None
    for all pixels with two triangles per cell. Normals and tangents: central differences, one-sided at the
    edge; T along +X, w = +1. uvs: sand_repeat repetitions along x and as many along z as keep them square.
    uvs1: once over the terrain. Raises ValueError.
    """
    if heights.dtype != np.float32 or heights.ndim != 2:
        raise ValueError(f"heights must be (rows, columns) float32, not {heights.shape} {heights.dtype}")
    if pixels is not None and (pixels.ndim != 2 or pixels.shape[1] != 2):
        raise ValueError(f"pixels must be (n, 2), not {pixels.shape}")
    pixel_list = None if pixels is None else to_indices(pixels)
    return Vertices(
        *_terrain.vertices(np.ascontiguousarray(heights), pixel_list, *size_m, float(sand_repeat), threads)
    )


def _triangulate(
    make: Callable[..., tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]],
    heights: npt.NDArray[np.float32],
    tolerance: float,
    threads: int,
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    if heights.dtype != np.float32 or heights.ndim != 2:
        raise ValueError(f"heights must be (rows, columns) float32, not {heights.shape} {heights.dtype}")
    if not np.isfinite(heights).all():
        raise ValueError("heights must be finite")
    pixels, triangles = make(np.ascontiguousarray(heights), float(tolerance), threads)
    columns = np.uint32(heights.shape[1])
    return np.stack([pixels // columns, pixels % columns], axis=1), triangles.reshape(-1, 3)

"""Python interface of the terrain's reference rasterizer. Used by a metric; no stage imports it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import paradize.kernels.reference._reference as _reference
from paradize.kernels.arrays import finite_rows, triangle_rows
from paradize.kernels.threads import default_threads


def terrain_error(
    positions: npt.NDArray[np.float32],
    triangles: npt.NDArray[np.uint32],
    heights_m: npt.NDArray[np.float32],
    size_m: tuple[float, float],
    *,
    threads: int | None = None,
) -> tuple[float, float, int, int, int, int]:
    """The error of a mesh at each pixel of a height field: (largest error, sum of squares, pixels covered,
    pixels not covered, triangles that do not face up, first worst pixel as row * columns + column).

    positions: (n, 3) finite float32, metres. triangles: (m, 3) uint32 below n. heights_m: (rows, columns)
    float32 over size_m = (x, z) metres around the origin. The largest error is -1 where no pixel is covered.
    """
    arrays = _checked(positions, triangles, heights_m)
    workers = default_threads(8) if threads is None else max(1, threads)
    result: tuple[float, float, int, int, int, int] = _reference.terrain_error(*arrays, *size_m, workers)
    return result


def patch_error(
    positions: npt.NDArray[np.float32],
    triangles: npt.NDArray[np.uint32],
    heights_m: npt.NDArray[np.float32],
    size_m: tuple[float, float],
    corners: tuple[tuple[int, int], tuple[int, int], tuple[int, int]],
) -> tuple[float, float, int, int, int, int, int]:
    """As `terrain_error`, for the mesh of a patch, at each pixel of the closed triangle `corners`, (row,
    column) each, which may lie outside the field. Also returns the number of pixels outside the triangle that
    the mesh covers (searched one pixel around its box). One thread; releases Python's lock."""
    result: tuple[float, float, int, int, int, int, int] = _reference.patch_error(
        *_checked(positions, triangles, heights_m), *size_m, corners
    )
    return result


def _checked(
    positions: npt.NDArray[np.float32], triangles: npt.NDArray[np.uint32], heights_m: npt.NDArray[np.float32]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32], npt.NDArray[np.float32]]:
    positions = finite_rows(positions, 3, np.float32)
    triangles = triangle_rows(triangles, len(positions))
    heights_m = np.ascontiguousarray(heights_m, np.float32)
    if heights_m.ndim != 2 or min(heights_m.shape) < 2:
        raise ValueError(f"expected two rows and two columns or more, got {heights_m.shape}")
    return positions, triangles, heights_m

"""Checked face of the terrain's reference rasteriser, which the metric measures with and no stage imports."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import paradize.kernels.reference._reference as _reference
from paradize.kernels.threads import default_threads


def terrain_error(
    positions: npt.NDArray[np.float32],
    triangles: npt.NDArray[np.uint32],
    heights_m: npt.NDArray[np.float32],
    size_m: tuple[float, float],
    *,
    threads: int | None = None,
) -> tuple[float, float, int, int, int, int]:
    """Error of a mesh above every pixel of a height field: (largest error, sum of squares, pixels covered,
    pixels not covered, triangles that do not face up, first worst pixel as row * columns + column).

    positions: (n, 3) float32, metres; triangles: (m, 3) uint32 below n; heights_m: (rows, columns) float32
    over size_m = (x, z) metres about the origin. The largest error is -1 where no pixel is covered.
    """
    arrays = _checked(positions, triangles, heights_m)
    hands = default_threads(8) if threads is None else max(1, threads)
    found: tuple[float, float, int, int, int, int] = _reference.terrain_error(*arrays, *size_m, hands)
    return found


def patch_error(
    positions: npt.NDArray[np.float32],
    triangles: npt.NDArray[np.uint32],
    heights_m: npt.NDArray[np.float32],
    size_m: tuple[float, float],
    corners: tuple[tuple[int, int], tuple[int, int], tuple[int, int]],
) -> tuple[float, float, int, int, int, int, int]:
    """As `terrain_error`, of the mesh of one patch at every pixel of the closed triangle `corners`, (row,
    column) each, also outside the field; last the number of pixels outside it that the mesh covers (looked
    for one pixel round its box). One thread, free of Python's lock.
    """
    found: tuple[float, float, int, int, int, int, int] = _reference.patch_error(
        *_checked(positions, triangles, heights_m), *size_m, corners
    )
    return found


def _checked(
    positions: npt.NDArray[np.float32], triangles: npt.NDArray[np.uint32], heights_m: npt.NDArray[np.float32]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32], npt.NDArray[np.float32]]:
    positions = np.ascontiguousarray(positions, np.float32)
    triangles = np.ascontiguousarray(triangles, np.uint32)
    heights_m = np.ascontiguousarray(heights_m, np.float32)
    if positions.ndim != 2 or positions.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(f"expected (n, 3) and (m, 3), got {positions.shape} and {triangles.shape}")
    if heights_m.ndim != 2 or min(heights_m.shape) < 2:
        raise ValueError(f"expected two rows and two columns or more, got {heights_m.shape}")
    if len(triangles) and int(triangles.max()) >= len(positions):
        raise ValueError(f"index {int(triangles.max())} of {len(positions)} vertices")
    return positions, triangles, heights_m

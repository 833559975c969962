"""Checked face of the native atlas kernels: charts of a surface, and their packing."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import paradize.kernels.atlas._atlas as _atlas
from paradize.kernels.threads import default_threads


def make_charts(
    positions: npt.ArrayLike,
    triangles: npt.ArrayLike,
    *,
    deviation: float,
    most: int | None = None,
    threads: int | None = None,
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float64], int]:
    """(chart of each triangle (m,), corners (m, 3, 2) in the chart's plane, number of charts).

    positions: (n, 3) finite, about the origin, of a size near 1; triangles: (m, 3), one index per place.
    deviation: how far from flat a chart may be, above 0 and below 1. The corners' unit is the positions'.
    most: where there are more charts, their number comes back with two empty arrays, before any is laid out.
    """
    points = np.ascontiguousarray(positions, np.float64)
    faces = np.ascontiguousarray(triangles, np.uint32)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError(f"expected (n, 3) finite positions, got {points.shape}")
    if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces) or int(faces.max()) >= len(points):
        raise ValueError(f"expected (m, 3) indices below {len(points)}, got {faces.shape}")
    if not 0 < deviation < 1:
        raise ValueError(f"deviation {deviation}, expected 0 to 1")
    workers = default_threads(8) if threads is None else max(1, threads)
    limit = len(faces) if most is None else most
    chart, corners, count = _atlas.make_charts(points, faces, deviation, limit, workers)
    return chart, corners.reshape(-1, 3, 2), count


def most_charts(*, resolution: int, padding: int) -> int:
    """More charts than this do not fit, however small they are. Arguments as of `pack`."""
    return int(_atlas.most_charts(resolution, padding))


def pack(
    corners: npt.ArrayLike, chart: npt.ArrayLike, count: int, *, resolution: int, padding: int
) -> tuple[npt.NDArray[np.float64], float] | None:
    """(corners (m, 3, 2) in texels, x to the right and y up; texels per unit), or None where they do not fit.

    corners: (m, 3, 2) finite; chart: (m,) from 0 to count - 1, none empty. resolution: 16 to 16384; padding:
    0 to 64.
    """
    flat = np.ascontiguousarray(corners, np.float64).reshape(-1, 6)
    names = np.ascontiguousarray(chart, np.int32)
    if names.shape != (len(flat),) or not len(flat) or not np.isfinite(flat).all():
        raise ValueError(f"corners {flat.shape} of {names.shape} charts")
    if not np.array_equal(np.unique(names), np.arange(count)):
        raise ValueError(f"charts are not 0 to {count - 1}")
    if not 16 <= resolution <= 16384 or not 0 <= padding <= 64:
        raise ValueError(f"{resolution} texels with {padding} between")
    placed, texels_per_unit = _atlas.pack(flat, names, count, resolution, padding)
    return (placed.reshape(-1, 3, 2), float(texels_per_unit)) if len(placed) else None

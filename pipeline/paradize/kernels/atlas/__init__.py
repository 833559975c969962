"""Python interface of the native atlas kernels: charts of a surface, and their packing. Checks its
arguments."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import paradize.kernels.atlas._atlas as _atlas
from paradize.kernels.arrays import finite_rows, triangle_rows
from paradize.kernels.threads import default_threads


def make_charts(
    positions: npt.ArrayLike,
    triangles: npt.ArrayLike,
    *,
    deviation: float,
    max_charts: int | None = None,
    threads: int | None = None,
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float64], int]:
    """Cuts a surface into charts and flattens them.

    positions: (n, 3) finite, near the origin, size near 1. triangles: (m, 3), equal indices for equal
    positions. deviation: largest deviation of a chart from a plane, above 0 and below 1. max_charts: if there
    are more, returns their number with two empty arrays, before any is flattened.

    Returns the chart of each triangle (m,) int32, its corners (m, 3, 2) float64 in the chart's plane in the
    unit of the positions, and the number of charts. Raises ValueError for other arguments.
    """
    points = finite_rows(positions, 3, np.float64)
    faces = triangle_rows(triangles, len(points), least=1)
    if not 0 < deviation < 1:
        raise ValueError(f"deviation {deviation}, expected 0 to 1")
    workers = default_threads(8) if threads is None else max(1, threads)
    limit = len(faces) if max_charts is None else max_charts
    chart, corners, count = _atlas.make_charts(points, faces, deviation, limit, workers)
    return chart, corners.reshape(-1, 3, 2), count


def max_chart_count(*, resolution: int, padding: int) -> int:
    """An upper bound of the number of charts that fit, however small they are. Arguments as of `pack`."""
    return int(_atlas.most_charts(resolution, padding))


def pack(
    corners: npt.ArrayLike, chart: npt.ArrayLike, count: int, *, resolution: int, padding: int
) -> tuple[npt.NDArray[np.float64], float] | None:
    """Packs charts into a square texture.

    corners: (m, 3, 2) finite. chart: (m,) from 0 to count - 1, none empty. resolution: 16 to 16384 texels.
    padding: 0 to 64 texels.

    Returns the corners (m, 3, 2) in texels, x to the right and y up, and the texels per unit; None if the
    charts do not fit. Raises ValueError for other arguments.
    """
    flat = np.ascontiguousarray(corners, np.float64).reshape(-1, 6)
    chart_ids = np.ascontiguousarray(chart, np.int32)
    if chart_ids.shape != (len(flat),) or not len(flat) or not np.isfinite(flat).all():
        raise ValueError(f"corners {flat.shape} of {chart_ids.shape} charts")
    if not np.array_equal(np.unique(chart_ids), np.arange(count)):
        raise ValueError(f"charts are not 0 to {count - 1}")
    if not 16 <= resolution <= 16384 or not 0 <= padding <= 64:
        raise ValueError(f"{resolution} texels with {padding} between")
    packed, texels_per_unit = _atlas.pack(flat, chart_ids, count, resolution, padding)
    return (packed.reshape(-1, 3, 2), float(texels_per_unit)) if len(packed) else None

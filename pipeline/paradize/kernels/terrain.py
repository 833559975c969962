"""Checked numpy face of the terrain kernels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from paradize.kernels import _terrain
from paradize.kernels.threads import default_threads

THREADS = default_threads(8)


def refine(
    heights: npt.NDArray[np.float32], tolerance: float, *, threads: int = THREADS
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """A Delaunay triangulation of grid points whose triangles pass each pixel within `tolerance`.

    heights: (rows, columns) float32, finite, 2 to 16385 on each side. tolerance: >= 0, unit of the heights.
    Returns the vertices (n, 2) uint32 as (row, column), and the triangles (m, 3) uint32, which turn clockwise
    in an image drawn with row 0 at the top. Raises ValueError for other shapes, dtypes or values.
    """
    return _listed(_terrain.refine, heights, tolerance, threads)


def bisect(
    heights: npt.NDArray[np.float32], tolerance: float, *, threads: int = THREADS
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """As `refine`, by a hierarchy of right triangles: not Delaunay, more triangles."""
    return _listed(_terrain.bisect, heights, tolerance, threads)


def _listed(
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

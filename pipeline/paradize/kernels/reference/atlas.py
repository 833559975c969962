"""Python interface of the reference kernel of UV layouts. Used by a metric; no stage imports it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

import paradize.kernels.reference._reference as _reference
from paradize.kernels.arrays import finite_rows, triangle_rows


def _layout(
    positions: npt.ArrayLike, triangles: npt.ArrayLike, corners: npt.ArrayLike
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32], npt.NDArray[np.float64]]:
    points = finite_rows(positions, 3, np.float64)
    faces = triangle_rows(triangles, len(points), least=1)
    uvs = np.ascontiguousarray(corners, np.float64).reshape(-1, 6)
    if len(uvs) != len(faces) or not np.isfinite(uvs).all() or uvs.min() < 0 or uvs.max() > 1:
        raise ValueError(f"expected ({len(faces)}, 3, 2) corners in 0..1")
    return points, faces, uvs


def layout_quality(
    positions: npt.ArrayLike, triangles: npt.ArrayLike, corners: npt.ArrayLike
) -> dict[str, Any]:
    """stretch, seam_length, packing, flipped, without, charts and density, as defined in reference/atlas.hpp.

    positions: (n, 3). triangles: (m, 3), equal indices for equal positions. corners: (m, 3, 2) in 0..1.
    """
    quality: dict[str, Any] = _reference.layout_quality(*_layout(positions, triangles, corners))
    return quality


def layout_raster(
    positions: npt.ArrayLike, triangles: npt.ArrayLike, corners: npt.ArrayLike, *, resolution: int, gap: int
) -> tuple[int, int, int]:
    """(texels covered, texels covered twice, texels that another chart touches or approaches by less than
    `gap` texels) in a square of `resolution` texels, 1 to 16384; gap: 0 to 64."""
    if not 1 <= resolution <= 16384 or not 0 <= gap <= 64:
        raise ValueError(f"{resolution} texels, gap {gap}")
    covered, twice, near = _reference.layout_raster(*_layout(positions, triangles, corners), resolution, gap)
    return int(covered), int(twice), int(near)

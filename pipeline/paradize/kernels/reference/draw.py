"""Checked face of the reference kernel of draw orders, which a metric uses and no stage imports."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import paradize.kernels.reference._reference as _reference


def _triangles(values: npt.ArrayLike, vertices: int) -> npt.NDArray[np.uint32]:
    triangles = np.ascontiguousarray(values, np.uint32)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles):
        raise ValueError(f"expected (m, 3) indices, got {triangles.shape}")
    if int(triangles.max()) >= vertices:
        raise ValueError(f"index {int(triangles.max())} of {vertices} vertices")
    return triangles


def draw_cost(
    triangles: npt.ArrayLike, vertices: int, strides: list[int], *, cache: int = 16, lines: int = 1024
) -> tuple[float, float, float]:
    """(ACMR, ATVR, overfetch) of drawing (m, 3) triangles in their order, as reference/draw.hpp tells.

    strides: bytes of a vertex in each stream, 1 to 4096 each. cache: vertices, 1 to 65536. lines: of 64
    bytes, 1 to 2^24.
    """
    if not 1 <= cache <= 65536 or not 1 <= lines <= 1 << 24 or not all(1 <= s <= 4096 for s in strides):
        raise ValueError(f"cache {cache}, lines {lines}, strides {strides}")
    found = _reference.draw_cost(_triangles(triangles, vertices), vertices, cache, strides, lines)
    return float(found[0]), float(found[1]), float(found[2])

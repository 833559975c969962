"""Python interface of the reference kernel of draw order. Used by a metric; no stage imports it."""

from __future__ import annotations

import numpy.typing as npt

import paradize.kernels.reference._reference as _reference
from paradize.kernels.arrays import triangle_rows


def draw_cost(
    triangles: npt.ArrayLike, vertices: int, strides: list[int], *, cache: int = 16, lines: int = 1024
) -> tuple[float, float, float]:
    """(ACMR, ATVR, overfetch) of drawing triangles (m, 3) in their order, as defined in reference/draw.hpp.

    strides: bytes of a vertex in each stream, 1 to 4096. cache: vertices, 1 to 65536. lines: of 64 bytes, 1
    to 2^24.
    """
    if not 1 <= cache <= 65536 or not 1 <= lines <= 1 << 24 or not all(1 <= s <= 4096 for s in strides):
        raise ValueError(f"cache {cache}, lines {lines}, strides {strides}")
    costs = _reference.draw_cost(triangle_rows(triangles, vertices, least=1), vertices, cache, strides, lines)
    return float(costs[0]), float(costs[1]), float(costs[2])

"""Derivative filters: separable taps by name, and `auto`, which picks a filter by the heights.

"central", "fourth", "eighth": central differences of that order. "scharr": H. Scharr, "Optimale Operatoren in
der digitalen Bildverarbeitung", 2000. "smooth<r>", "quintic<r>", "septic<r>": for heights with coarse steps;
the slope at the centre of the polynomial of degree 3, 5 or 7 that best fits the 2 r + 1 texels along the
axis, smoothed across it by the same fit: A. Savitzky and M. J. E. Golay, "Smoothing and differentiation of
data by simplified least squares procedures", 1964.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from paradize.errors import BakeError
from paradize.kernels import filter as kernel
from paradize.tiers import TIERS

if TYPE_CHECKING:
    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    I32 = npt.NDArray[np.int32]

FAST_FILTER = "central"
REFERENCE_FILTER = "eighth"
# A filter that reads more texels is taken when its predicted error is below this part of the best so far.
_WORTH = 0.98


@dataclass(frozen=True)
class Taps:
    """derivative (r,) float64: weights of h[+k] - h[-k], k = 1..r, along the axis. smooth (s + 1,) float64:
    weights of the centre and of +-1..+-s across it; their sum over both sides is 1. Slopes of a plane are
    exact."""

    derivative: F64
    smooth: F64


def _solve(matrix: list[list[int]], right: list[int]) -> tuple[list[int], int]:
    """Solves a small regular system exactly, by elimination; the numerators and their common denominator.
    Without fractions: every process that bakes maps solves eighty of these as it starts."""
    n = len(right)
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    for i in range(n):
        for j in range(n):
            if j != i:
                rows[j] = [a * rows[i][i] - rows[j][i] * b for a, b in zip(rows[j], rows[i], strict=True)]
    whole = math.prod(rows[i][i] for i in range(n))
    return [rows[i][n] * (whole // rows[i][i]) for i in range(n)], whole


def _fitted(radius: int, powers: tuple[int, ...]) -> list[float]:
    """Weights of the texels 0..radius that give the coefficient of the first power in the least-squares fit
    of these powers, all even or all odd, to 2 radius + 1 texels."""
    sums = {power: sum(k**power for k in range(-radius, radius + 1)) for power in range(2 * powers[-1] + 1)}
    moments = [[sums[p + q] for q in powers] for p in powers]
    weights, whole = _solve(moments, [1] + [0] * (len(powers) - 1))
    return [
        sum(w * k**p for w, p in zip(weights, powers, strict=True)) / whole  # rounded once
        for k in range(radius + 1)
    ]


def _least_squares(radius: int, degree: int) -> Taps:
    derivative = _fitted(radius, tuple(range(1, degree + 1, 2)))[1:]
    smooth = _fitted(radius, tuple(range(0, degree, 2)))
    return Taps(np.array(derivative), np.array(smooth))


def _plain(*weights: float) -> Taps:
    return Taps(np.array(weights), np.ones(1))


def _all_filters() -> dict[str, Taps]:
    found = {
        "central": _plain(1 / 2),
        "scharr": Taps(np.array([0.5]), np.array([10 / 16, 3 / 16])),
        "fourth": _plain(2 / 3, -1 / 12),
        "eighth": _plain(4 / 5, -1 / 5, 4 / 105, -1 / 280),
    }
    for name, degree, least in (("smooth", 3, 2), ("quintic", 5, 3), ("septic", 7, 4)):
        for radius in range(least, kernel.REACH + 1):
            found[f"{name}{radius}"] = _least_squares(radius, degree)
    return found


TAPS: dict[str, Taps] = _all_filters()
# In the order in which `auto` tries them: the fewest texels first.
_BY_REACH = sorted(TAPS, key=lambda name: len(TAPS[name].derivative) * len(TAPS[name].smooth))


def taps_of(name: str) -> Taps:
    """Returns the taps of a filter by name. Raises BakeError for an unknown name."""
    if name not in TAPS:
        raise BakeError(f"no derivative filter {name!r}", mend=f"one of {', '.join(TAPS)}")
    return TAPS[name]


def choose_filter(
    heights: F32,
    source_bits: int,
    wrap: tuple[bool, bool],
    tier: str = "balanced",
    islands: I32 | None = None,
    codes: F32 | None = None,
) -> str:
    """Returns the name of the filter with the least predicted error on the heights (h, w).

    source_bits: 8, 16 or 32, of the file. tier: "fast" always takes "central"; "balanced" the best filter;
    "exact" takes "eighth" for floats, else as "balanced" (stages/normal.py then limits its slopes). islands:
    (h, w) int32, and codes: (n,) float32 height levels, as in data.HeightMap. Raises BakeError for an unknown
    tier.
    """
    if tier not in TIERS:
        raise BakeError(f"no tier {tier!r}", mend=f"one of {', '.join(TIERS)}")
    if tier == "fast":
        return FAST_FILTER
    if tier == "exact" and source_bits == 32:
        return REFERENCE_FILTER
    # A filter that is longer than the map would read nothing but reflections of its edges.
    longest = min((size - 1 for size in heights.shape if size > 1), default=1)
    names = [name for name in _BY_REACH if len(TAPS[name].derivative) <= longest]
    taps = [(TAPS[name].derivative, TAPS[name].smooth) for name in names]
    found = kernel.predict_errors(
        heights, taps, source_bits=source_bits, wrap=wrap, islands=islands, codes=codes
    )
    best, error = names[0], found.errors[0]
    for name, candidate in zip(names[1:], found.errors[1:], strict=True):
        if candidate < error * _WORTH:
            best, error = name, candidate
    return best

"""Weights of the derivative filters for the metrics, derived independently of the stages.

A filter is (derivative, smooth): weights of h[+k] - h[-k] along the axis, k = 1, 2, ..., and of the centre
and of +-1, +-2, ... across it.
"""

from __future__ import annotations

import re
from fractions import Fraction
from functools import cache
from math import factorial
from typing import TypeAlias

Taps: TypeAlias = tuple[tuple[float, ...], tuple[float, ...]]

EXACT = "eighth"  # error below 0.001 degrees for wavelengths of 8 texels and more
_ORDERS = {"central": 1, "fourth": 2, EXACT: 4}
_FITS = {"smooth": 3, "quintic": 5, "septic": 7}  # degrees of the fitted polynomials
_FIT = re.compile(f"({'|'.join(_FITS)})([1-9][0-9]?)")


@cache
def taps(name: str) -> Taps:
    """The taps of a filter. Raises KeyError for an unknown name."""
    if name == "scharr":
        return central_weights(1), (10 / 16, 3 / 16)
    fit = _FIT.fullmatch(name)
    if fit is None:
        return central_weights(_ORDERS[name]), (1.0,)
    degree, radius = _FITS[fit[1]], int(fit[2])
    if 2 * radius < degree:
        raise KeyError(name)
    return fitted_weights(radius, degree)


def central_weights(reach: int) -> tuple[float, ...]:
    """Weights of h[+k] - h[-k], k = 1 .. reach, exact for polynomials up to degree 2 reach: (-1)^(k + 1)
    reach!^2 / (k (reach - k)! (reach + k)!).

    Source: B. Fornberg, "Generation of finite difference formulas on arbitrarily spaced grids", 1988.
    """
    square = factorial(reach) ** 2
    return tuple(
        float(Fraction((-1) ** (k + 1) * square, k * factorial(reach - k) * factorial(reach + k)))
        for k in range(1, reach + 1)
    )


def fitted_weights(radius: int, degree: int) -> Taps:
    """Slope (weights of h[+k] - h[-k]) and value at the centre of the least-squares polynomial through 2
    radius + 1 texels. Uses orthogonal polynomials p_0, p_1, ...: p_(j+1)(x) = x p_j(x) - b_j p_(j-1)(x).

    Source: P. A. Gorry, "General least-squares smoothing and differentiation by the convolution
    (Savitzky-Golay) method", 1990.
    """
    texels = range(-radius, radius + 1)
    previous, current = [Fraction(0)] * len(texels), [Fraction(1)] * len(texels)
    slope_previous, slope_current = Fraction(0), Fraction(0)  # at the centre
    slope, value = [Fraction(0)] * len(texels), [Fraction(0)] * len(texels)
    last_norm = Fraction(0)
    for _ in range(degree + 1):
        norm = sum((p * p for p in current), Fraction(0))
        centre = current[radius]
        slope = [total + slope_current * p / norm for total, p in zip(slope, current, strict=True)]
        value = [total + centre * p / norm for total, p in zip(value, current, strict=True)]
        b = norm / last_norm if last_norm else Fraction(0)
        following = [x * p - b * q for x, p, q in zip(texels, current, previous, strict=True)]
        slope_previous, slope_current = slope_current, centre - b * slope_previous
        previous, current, last_norm = current, following, norm
    return tuple(map(float, slope[radius + 1 :])), tuple(map(float, value[radius:]))

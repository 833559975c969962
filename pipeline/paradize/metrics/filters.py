"""The derivative filters once more, as the metrics know them: derived here, not taken from the stages.

A filter is (derivative, smooth): weights of h[+k] - h[-k] along the axis for k = 1, 2, ..., and of the centre
and of +-1, +-2, ... across it.
"""

from __future__ import annotations

from fractions import Fraction
from math import factorial
from typing import TypeAlias

Taps: TypeAlias = tuple[tuple[float, ...], tuple[float, ...]]

SPECTRAL = "spectral"
EXACT = "eighth"  # its error is below a thousandth of a degree from a wavelength of 8 texels on


def central_weights(reach: int) -> tuple[float, ...]:
    """The weights of h[+k] - h[-k], k = 1 .. reach, that are exact for polynomials of degree 2 reach:
    (-1)^(k + 1) reach!^2 / (k (reach - k)! (reach + k)!).

    Source: B. Fornberg, "Generation of finite difference formulas on arbitrarily spaced grids", 1988.
    """
    square = factorial(reach) ** 2
    return tuple(
        float(Fraction((-1) ** (k + 1) * square, k * factorial(reach - k) * factorial(reach + k)))
        for k in range(1, reach + 1)
    )


_ORDERS = {"central": 1, "fourth": 2, EXACT: 4}


def taps(name: str) -> Taps | None:
    """The taps of a filter by its name; None for the spectral one. Raises KeyError for a name unknown."""
    if name == SPECTRAL:
        return None
    if name == "scharr":
        return central_weights(1), (10 / 16, 3 / 16)
    return central_weights(_ORDERS[name]), (1.0,)

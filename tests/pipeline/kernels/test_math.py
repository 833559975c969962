"""Our elementary functions against mpmath and against the identities that they must keep."""

from __future__ import annotations

import math
from collections.abc import Callable

import mpmath
import numpy as np
import numpy.typing as npt
import pytest

from paradize.kernels.maps import _maps
from paradize.kernels.math import linear_to_srgb, srgb_to_linear

mpmath.mp.prec = 120


def ours(name: str, x: npt.ArrayLike, y: npt.ArrayLike = ()) -> npt.NDArray[np.float64]:
    """A function of kernels/math/functions.hpp, of one argument or two, at some points."""
    first, second = np.array(x, np.float64), np.array(y, np.float64)
    out = np.empty_like(first)
    _maps.elementary(name, first, second, out)
    return out


def worst(found: np.ndarray, truth: Callable[[float], mpmath.mpf], points: np.ndarray, floor: float) -> float:
    """The largest error relative to the truth (absolute below `floor`)."""
    errors = []
    for value, point in zip(found, points, strict=True):
        exact = truth(float(point))
        errors.append(float(abs((mpmath.mpf(float(value)) - exact) / max(abs(exact), mpmath.mpf(floor)))))
    return max(errors)


POINTS = np.random.default_rng(3).random(400)


@pytest.mark.parametrize(
    ("name", "truth", "points", "floor", "bound"),
    [
        ("exp", mpmath.exp, POINTS * 1400 - 700, 1e-300, 2e-16),
        ("log", mpmath.log, np.concatenate([POINTS * 2, ours("exp", POINTS * 1400 - 700)]), 1e-300, 3e-16),
        ("sin", mpmath.sin, POINTS * 2000 - 1000, 1.0, 2e-16),
        ("cos", mpmath.cos, POINTS * 2000 - 1000, 1.0, 2e-16),
        ("acos", mpmath.acos, np.concatenate([POINTS * 2 - 1, 1 - POINTS * 1e-9]), 1e-300, 1e-15),
    ],
    ids=["exp", "log", "sin", "cos", "acos"],
)
def test_a_function_is_as_near_to_the_truth_as_it_states(
    name: str,
    truth: Callable[[float], mpmath.mpf],
    points: np.ndarray,
    floor: float,
    bound: float,
) -> None:
    assert worst(ours(name, points), truth, points, floor) < bound


def test_pow_is_as_near_as_it_states() -> None:
    x, y = POINTS[:200] * 4, POINTS[200:] * 8 - 4
    for base, power, value in zip(x, y, ours("pow", x, y), strict=True):
        exact = mpmath.power(mpmath.mpf(float(base)), mpmath.mpf(float(power)))
        bound = (3 + abs(power * math.log(base))) * 2e-16
        assert abs((mpmath.mpf(float(value)) - exact) / exact) < bound


def test_atan2_is_near_the_truth_in_all_quadrants() -> None:
    y, x = POINTS[:200] * 2 - 1, POINTS[200:] * 2 - 1
    for a, b, value in zip(y, x, ours("atan2", y, x), strict=True):
        exact = mpmath.atan2(mpmath.mpf(float(a)), mpmath.mpf(float(b)))
        assert abs((mpmath.mpf(float(value)) - exact) / exact) < 5e-16


def test_the_singular_points_have_their_limits() -> None:
    infinity = float("inf")
    assert ours("exp", [-1000.0, 0.0, 1000.0]).tolist() == [0.0, 1.0, infinity]
    assert ours("log", [0.0, 1.0, infinity]).tolist() == [-infinity, 0.0, infinity]
    assert np.isnan(ours("log", [-1.0, float("nan")])).all()
    assert ours("pow", [0.0, 0.0, 1.0, 5.0], [0.0, 2.0, 1e300, 0.0]).tolist() == [1.0, 0.0, 1.0, 1.0]
    assert ours("acos", [1.0, 1.5, -1.0, -7.0]).tolist() == [0.0, 0.0, math.pi, math.pi]
    assert ours("sin", [0.0]).tolist() == [0.0]
    assert ours("cos", [0.0]).tolist() == [1.0]
    assert ours("atan2", [0.0, 1.0, -1.0, 0.0], [0.0, 0.0, 0.0, -1.0]).tolist() == [
        0.0,
        math.pi / 2,
        -math.pi / 2,
        math.pi,
    ]


def test_srgb_round_trips_at_every_16_bit_code_and_has_its_anchor_points() -> None:
    codes = np.arange(65536) / 65535.0
    assert np.abs(linear_to_srgb(srgb_to_linear(codes)) - codes).max() < 2e-7
    assert srgb_to_linear([0.0, 1.0]).tolist() == [0.0, 1.0]
    assert srgb_to_linear([0.5])[0] == pytest.approx(0.21404114048223255, rel=1e-15)
    assert srgb_to_linear([-0.5])[0] == -srgb_to_linear([0.5])[0]

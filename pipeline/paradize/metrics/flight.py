"""Measures how well a camera path meets its waypoints, speeds, smoothness, duration and loop.

Input: the `flight` object of scene.json, the waypoints and the requested speeds. The path is evaluated
densely in float64 through the time table, as the player does. The requested speed is integrated
independently, by the midpoint rule.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import rounded
from paradize.vectors import lengths

F64 = npt.NDArray[np.float64]

MOMENTS = 20_000  # at which the speed is measured
STEPS = 512  # midpoints per segment, for the integral of the mean speed


def _path(segments: Sequence[Any], key: str) -> F64:
    return np.array([segment[key] for segment in segments], np.float64)  # (n, 3, 4)


def _evaluate(path: F64, u: F64) -> tuple[F64, F64]:
    """Position and derivative with respect to U, each (k, 3), at parameters u (k,) in [0, n]."""
    index = np.minimum(u.astype(np.int64), len(path) - 1)
    x = (u - index)[:, None]
    a, b, c, d = (path[index, :, k] for k in range(4))
    return a + x * (b + x * (c + x * d)), b + x * (2.0 * c + x * 3.0 * d)


def _speed_factor(u: F64, knots: F64, factors: F64) -> F64:
    """Requested speed factors at parameters u: smoothsteps between the waypoints, around the loop."""
    after = np.searchsorted(knots, u, side="right")
    x = np.clip((u - knots[after - 1]) / (knots[after] - knots[after - 1]), 0.0, 1.0)
    return factors[after - 1] + (factors[after] - factors[after - 1]) * (3.0 - 2.0 * x) * x * x


def _parameter_at(table: F64, t: F64) -> tuple[F64, F64]:
    """(U, dU/dt) at times t, from the cubic Hermite table."""
    k = np.clip(np.searchsorted(table[:, 0], t, side="right") - 1, 0, len(table) - 2)
    t0, u0, d0 = table[k].T
    t1, u1, d1 = table[k + 1].T
    h = t1 - t0
    x = (t - t0) / h
    h00, h10 = (1 + 2 * x) * (1 - x) * (1 - x), x * (1 - x) * (1 - x)
    h01, h11 = x * x * (3 - 2 * x), x * x * (x - 1)
    u = h00 * u0 + h10 * h * d0 + h01 * u1 + h11 * h * d1
    du = (6 * x * x - 6 * x) * (u0 - u1) / h + (1 - x) * (1 - 3 * x) * d0 + x * (3 * x - 2) * d1
    return u, du


def flight_error(
    flight: dict[str, Any],
    eye: Sequence[Sequence[float]],
    target: Sequence[Sequence[float]],
    speed: Sequence[float],
) -> dict[str, float]:
    """Measures the `flight` object of a scene.json. Returns errors by name, six digits.

    eye, target: (n, 3) waypoints, metres. speed: (n,) requested factors.

    path_miss_m: largest distance of eye or target from its waypoint. path_ripple_max, path_ripple_p99:
    relative deviation from the requested speed at MOMENTS times. path_jump_m, path_jump_m_per_u,
    path_jump_m_per_u2: largest jumps of position, first and second derivative between segments, around the
    loop as well. path_time_s: difference between duration_s and the time table's end.
    """
    segments = flight["segments"]
    knots = np.array([*flight["waypoint_u"], len(segments)], np.float64)
    factors = np.array([*speed, speed[0]], np.float64)
    paths = {"eye": (_path(segments, "eye"), eye), "target": (_path(segments, "target"), target)}
    miss = 0.0
    jumps = [0.0, 0.0, 0.0]
    for path, waypoints in paths.values():
        reached, _ = _evaluate(path, knots[:-1])
        miss = max(miss, float(lengths(reached - np.array(waypoints, np.float64)).max()))
        a, b, c, d = (path[:, :, k] for k in range(4))
        starts, ends = (a, b, 2 * c), (a + b + c + d, b + 2 * c + 3 * d, 2 * c + 6 * d)
        for k in range(3):
            jumps[k] = max(jumps[k], float(lengths(np.roll(ends[k], 1, axis=0) - starts[k]).max()))
    curve = paths["eye"][0]
    # Mean speed: the integral of length / requested factor over the path, divided by duration_s.
    middle = (np.arange(len(segments) * STEPS, dtype=np.float64) + 0.5) / STEPS
    pace = lengths(_evaluate(curve, middle)[1]) / _speed_factor(middle, knots, factors)
    mean = math.fsum(pace.tolist()) / STEPS / flight["duration_s"]
    table = np.array(flight["time_table"], np.float64)
    t = (np.arange(MOMENTS, dtype=np.float64) + 0.5) * (flight["duration_s"] / MOMENTS)
    u, rate = _parameter_at(table, t)
    actual = lengths(_evaluate(curve, np.clip(u, 0.0, len(segments)))[1]) * rate
    deviation = np.sort(
        np.abs(actual / (mean * _speed_factor(np.clip(u, 0.0, len(segments) - 1e-9), knots, factors)) - 1.0)
    )
    ends_s = float(table[-1, 0] - table[0, 0])
    errors = {
        "path_miss_m": miss,
        "path_ripple_max": float(deviation[-1]),
        "path_ripple_p99": float(deviation[math.ceil(0.99 * MOMENTS) - 1]),
        "path_jump_m": jumps[0],
        "path_jump_m_per_u": jumps[1],
        "path_jump_m_per_u2": jumps[2],
        "path_time_s": abs(ends_s - flight["duration_s"]),
    }
    return {name: rounded(value) for name, value in errors.items()}

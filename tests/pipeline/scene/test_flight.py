"""The camera flies through its waypoints, at the asked speed, and meets its beginning without a jump."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from paradize.errors import SceneError
from paradize.metrics.flight import flight_error
from paradize.scene.flight import (
    Flight,
    periodic_spline,
    plan_flight,
    sightings_of,
    sine_cosine,
    solve_cyclic,
)
from paradize.scene.settings import EyePoint, TargetPoint
from paradize.scene.settings import Flight as Settings
from tests.sweeps import tries

Points = list[tuple[float, float, float]]


def flight_of(points: Points, speeds: list[float] | None = None, duration_s: float = 60.0) -> Flight:
    speeds = speeds or [1.0] * len(points)
    eye = tuple(EyePoint(position=p, speed=s) for p, s in zip(points, speeds, strict=True))
    target = tuple(TargetPoint(position=(p[0] + 1.0, 0.0, p[2])) for p in points)
    return plan_flight(Settings(eye=eye, target=target, duration_s=duration_s))


def errors_of(flight: Flight, points: Points, speeds: list[float]) -> dict[str, float]:
    target = [(p[0] + 1.0, 0.0, p[2]) for p in points]
    return flight_error(flight.as_json(), points, target, speeds)


def ring(n: int, radius: float = 20.0) -> Points:
    return [
        (radius * math.cos(2 * math.pi * i / n), 2.0, radius * math.sin(2 * math.pi * i / n))
        for i in range(n)
    ]


coordinate = st.integers(-4000, 4000).map(lambda k: k / 32)
places = st.tuples(coordinate, coordinate, coordinate)
speed = st.sampled_from([0.3, 0.5, 1.0, 1.5, 3.0])


@st.composite
def paths(draw: Any) -> tuple[Points, list[float]]:
    points = draw(st.lists(places, min_size=3, max_size=12, unique=True))
    return points, [draw(speed) for _ in points]


@given(paths())
@settings(max_examples=tries(40), deadline=None)
def test_any_path_passes_through_its_waypoints_smoothly_and_on_time(path: tuple[Points, list[float]]) -> None:
    points, speeds = path
    try:
        flight = flight_of(points, speeds)
    except SceneError as error:
        assert "turns back" in str(error)
        return
    errors = errors_of(flight, points, speeds)
    size = 1.0 + max(abs(value) for point in points for value in point)
    assert errors["path_miss_m"] == 0.0
    assert errors["path_jump_m"] < 1e-12 * size
    assert errors["path_jump_m_per_u"] < 1e-11 * size
    assert errors["path_jump_m_per_u2"] < 1e-11 * size
    assert errors["path_time_s"] == 0.0
    assert errors["path_ripple_p99"] < 0.01
    table = np.array(flight.table)
    assert (np.diff(table, axis=0)[:, :2] > 0.0).all() and (table[:, 2] > 0.0).all()
    assert tuple(table[-1][:2]) == (flight.duration_s, len(flight.eye))
    assert table[0][2] == table[-1][2]


@pytest.mark.parametrize("n", [3, 4, 7, 24])
def test_a_ring_is_flown_at_an_even_speed(n: int) -> None:
    errors = errors_of(flight_of(ring(n)), ring(n), [1.0] * n)
    assert errors["path_ripple_max"] < 3e-4


def test_speed_factors_hold_at_the_waypoints() -> None:
    speeds = [1.0, 0.5, 2.0, 1.0, 3.0]
    flight = flight_of(ring(5), speeds)

    def speed_at(u: float) -> float:
        t = min(flight.table, key=lambda row: abs(row[1] - u))[0]
        a, b = (np.array(flight.view(t + d)[0]) for d in (-1e-4, 1e-4))
        return float(np.linalg.norm(b - a) / 2e-4)

    measured = [speed_at(u) for u in flight.waypoint_u]
    for got, requested in zip(measured, speeds, strict=True):
        assert got / measured[0] == pytest.approx(requested, rel=1e-3)


def test_the_metric_agrees_with_an_adaptive_integration() -> None:
    """Independent of both: scipy integrates the spline's length; the even speed must be length / duration."""
    points = [(0.0, 0.0, 0.0), (30.0, 2.0, 5.0), (35.0, 8.0, 40.0), (-10.0, 3.0, 30.0)]
    flight = flight_of(points)
    length = 0.0
    for segment in flight.eye:

        def pace(u: float, axes: Any = segment) -> float:
            return math.sqrt(sum((b + 2 * c * u + 3 * d * u * u) ** 2 for _, b, c, d in axes))

        length += quad(pace, 0.0, 1.0, epsabs=1e-12)[0]
    for t in np.linspace(0.0, 59.0, 50):
        a, b = (np.array(flight.view(t + d)[0]) for d in (-1e-5, 1e-5))
        assert np.linalg.norm(b - a) / 2e-5 == pytest.approx(length / 60.0, rel=5e-4)


def test_the_metric_sees_planted_faults() -> None:
    points = ring(6)
    tree = flight_of(points).as_json()
    good = flight_error(tree, points, [(p[0] + 1.0, 0.0, p[2]) for p in points], [1.0] * 6)
    tree["segments"][3]["eye"][0][0] += 0.5
    bad = flight_error(tree, points, [(p[0] + 1.0, 0.0, p[2]) for p in points], [1.0] * 6)
    assert good["path_jump_m"] < 1e-12 and bad["path_jump_m"] == pytest.approx(0.5)
    tree = flight_of(points).as_json()
    for row in tree["time_table"]:
        row[2] *= 1.1
    assert flight_error(tree, points, points, [1.0] * 6)["path_ripple_max"] > 0.02


def test_the_spline_is_scipys_periodic_spline() -> None:
    values, units = [0.0, 3.0, -1.0, 4.0, 2.0], [1, 3, 2, 1, 4]
    knots = np.concatenate([[0], np.cumsum(units)])
    truth = CubicSpline(knots, [*values, values[0]], bc_type="periodic")
    cubics = periodic_spline(values, units)
    for k, (a, b, c, d) in enumerate(cubics):
        for u in (0.0, 0.3, 0.99):
            assert a + u * (b + u * (c + u * d)) == pytest.approx(float(truth(k + u)), abs=1e-12)


def test_the_cyclic_solver_solves() -> None:
    low, diagonal, high = [1.0, 2.0, 1.0, 0.5], [5.0, 6.0, 7.0, 4.0], [1.5, 1.0, 2.0, 1.0]
    matrix = np.diag(diagonal)
    for i in range(4):
        matrix[i, i - 1] += low[i]
        matrix[i, (i + 1) % 4] += high[i]
    right = [1.0, -2.0, 3.0, 0.25]
    assert matrix @ solve_cyclic(low, diagonal, high, right) == pytest.approx(right)


def test_a_path_there_and_back_slows_at_its_turns_or_is_refused() -> None:
    points = [(0.0, 1.0, 0.0), (10.0, 1.0, 0.0), (20.0, 1.0, 0.0), (10.0, 1.0, 0.0)]
    try:
        errors = errors_of(flight_of(points), points, [1.0] * 4)
    except SceneError as error:
        assert "turns back" in str(error)
    else:
        assert errors["path_miss_m"] == 0.0


@given(st.floats(-3600.0, 3600.0))
def test_sine_and_cosine_are_those_of_libm(degrees: float) -> None:
    sine, cosine = sine_cosine(degrees)
    turned = math.radians(math.fmod(degrees, 360.0))
    assert sine == pytest.approx(math.sin(turned), abs=2e-15)
    assert cosine == pytest.approx(math.cos(turned), abs=2e-15)


def test_the_flight_loops_and_answers_at_any_time() -> None:
    flight = flight_of(ring(5))
    for t in (0.0, 12.5, 59.999):
        assert np.allclose(flight.view(t), flight.view(t + 60.0))
    assert np.allclose(flight.view(-1e-9), flight.view(0.0), atol=1e-6)


def test_a_sphere_is_met_where_it_is_near_and_when_it_is_seen() -> None:
    points = ring(8, 20.0)
    eye = tuple(EyePoint(position=p) for p in points)
    target = tuple(TargetPoint(position=(0.0, 2.0, 0.0)) for _ in points)
    flight = plan_flight(Settings(eye=eye, target=target, duration_s=60.0))
    inside, outside = sightings_of(flight, 40.0, 1.5, [((0.0, 2.0, 0.0), 1.0), ((40.0, 2.0, 0.0), 1.0)])
    assert inside.farthest_seen_m >= inside.nearest_m + 2.0  # its far side, a diameter behind the near one
    assert (outside.farthest_seen_m > 0.0) == outside.seen
    assert inside.seen and inside.first_seen_s == 0.0
    assert inside.nearest_m == pytest.approx(19.0, abs=0.2)
    assert outside.seen and 10.0 < outside.first_seen_s < 30.0  # behind the eye until it has flown half round
    assert outside.nearest_m == pytest.approx(19.0, abs=0.2)


@given(
    st.lists(
        st.tuples(st.tuples(*3 * [st.floats(-60.0, 60.0)]), st.floats(0.01, 0.45)), min_size=1, max_size=8
    ),
    st.floats(20.0, 100.0),
    st.floats(0.5, 2.5),
)
@settings(max_examples=tries(30), deadline=None)
def test_what_is_met_is_what_angles_at_every_moment_say(
    spheres: list[tuple[tuple[float, float, float], float]], fov_deg: float, aspect: float
) -> None:
    """Between the view direction and the sphere's nearest edge lies no more than half the picture's
    diagonal. Spheres are less than half as large as they are near, so that none lies around the eye."""
    points = ring(6)
    flight = flight_of(points)
    count = round(flight.duration_s / 0.25)
    times = flight.duration_s * np.arange(count) / count
    eye, target = (np.array(rows) for rows in zip(*(flight.view(float(t)) for t in times), strict=True))
    ahead = (target - eye) / np.linalg.norm(target - eye, axis=1, keepdims=True)
    half = math.atan(math.tan(math.radians(fov_deg) / 2) * math.hypot(1.0, aspect))
    centers = [np.array(center) for center, _ in spheres]
    away = [np.linalg.norm(center - eye, axis=1) for center in centers]
    radii = [share * float(distance.min()) for (_, share), distance in zip(spheres, away, strict=True)]
    found = sightings_of(flight, fov_deg, aspect, [(c, r) for (c, _), r in zip(spheres, radii, strict=True)])
    for center, radius, distance, met in zip(centers, radii, away, found, strict=True):
        cosine = np.einsum("nk,nk->n", center - eye, ahead) / distance
        room = half + np.arcsin(radius / distance) - np.arccos(np.clip(cosine, -1.0, 1.0))
        if np.abs(room).min() < 1e-6:  # on the very edge at some moment
            continue
        seen = np.flatnonzero(room > 0.0)
        near = distance - radius
        assert met.nearest_m == pytest.approx(near.min(), abs=1e-9)
        assert met.seen == bool(len(seen))
        assert met.first_seen_s == (times[seen[0]] if len(seen) else 0.0)
        far = (distance + radius)[seen].max() if len(seen) else 0.0
        assert met.farthest_seen_m == pytest.approx(far, abs=1e-9)


def test_the_roll_turns_between_its_waypoints_as_a_spline_of_its_own() -> None:
    """At a waypoint it is what was asked, in radians; between, what scipy's periodic spline says."""
    points, rolls = ring(5), [0.0, 20.0, -10.0, 5.0, 40.0]
    eye = tuple(EyePoint(position=p, roll_deg=roll) for p, roll in zip(points, rolls, strict=True))
    target = tuple(TargetPoint(position=(0.0, 2.0, 0.0)) for _ in points)
    flight = plan_flight(Settings(eye=eye, target=target, duration_s=20.0))
    knots = [*flight.waypoint_u, len(flight.eye)]
    truth = CubicSpline(knots, np.radians([*rolls, rolls[0]]), bc_type="periodic")
    for t in np.linspace(0.0, 19.9, 37):
        place, ahead, roll = flight.pose(float(t))
        assert (place, ahead) == flight.view(float(t))
        assert roll == pytest.approx(float(truth(flight.parameter(float(t)))), abs=1e-9)

"""Metrics against what geometry says by itself; every metric at its extremes: `tests/extremes/`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from paradize.data import Heightfield, HeightMap, Mesh, Texture
from paradize.metrics.flight import flight_error
from paradize.metrics.levels import dudv_levels, gloss_levels
from paradize.metrics.mapped_normal import normal_error
from paradize.metrics.picture import flip_errors
from paradize.metrics.surface import Original
from paradize.metrics.terrain import terrain_error
from paradize.scene.flight import plan_flight
from paradize.scene.settings import EyePoint, TargetPoint
from paradize.scene.settings import Flight as Settings
from paradize.stages.terrain import terrain_mesh
from tests.pipeline.shapes import soup, sphere
from tests.sweeps import sweep

GOLDEN = (1 + 5**0.5) / 2


def solid(name: str) -> tuple[Mesh, float]:
    """A solid inscribed in the unit ball, and the radius of the ball inscribed in it."""
    if name == "octahedron":
        points = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
        inner = 1 / 3**0.5
    else:
        points = [(0, a, b * GOLDEN) for a in (-1, 1) for b in (-1, 1)]
        points += [(a, b * GOLDEN, 0) for a in (-1, 1) for b in (-1, 1)]
        points += [(b * GOLDEN, 0, a) for a in (-1, 1) for b in (-1, 1)]
        inner = GOLDEN**2 / 12**0.5 * 2 / (1 + GOLDEN**2) ** 0.5
    places = np.array(points, np.float64)
    places /= np.linalg.norm(places[0])
    edge = np.sort(np.linalg.norm(places[:, None] - places[None], axis=2)[0])[1]
    faces = []
    for i in range(len(places)):
        for j in range(i):
            for k in range(j):
                sides = [np.linalg.norm(places[a] - places[b]) for a, b in ((i, j), (j, k), (k, i))]
                if max(sides) < 1.01 * edge:
                    normal = np.cross(places[j] - places[i], places[k] - places[i])
                    faces.append((i, j, k) if normal @ places[i] > 0 else (i, k, j))
    return soup([tuple(p) for p in places], faces), inner


@pytest.mark.parametrize("name", sweep(["octahedron", "icosahedron"], test=["icosahedron"]))
def test_a_ball_is_as_far_from_a_solid_inside_it_as_their_radii_differ(name: str) -> None:
    """Above the middle of a face; the ball is a mesh too, inside the true one by 1 - cos(pi / 2 / rings)."""
    rings = 60
    ball = sphere(rings)
    inside, inner = solid(name)
    assert len(inside.triangles) == {"octahedron": 8, "icosahedron": 20}[name]
    found = Original(ball).distance(inside)
    lower, most = (found[key] * 2 * 3**0.5 for key in ("error_max_lower", "error_max"))
    assert 1 - inner - 2 * (1 - np.cos(np.pi / 2 / rings)) < lower < 1 - inner + 1e-6
    assert lower <= most < 1.001 * (1 - inner) + 1e-6


@pytest.mark.parametrize("degrees", [0.01, 5.0, 60.0])
def test_normals_that_turn_about_one_axis_are_off_by_the_angle(degrees: float) -> None:
    """A flat square whose normals all lean alike: the largest, the mean and the 99th of 100 are one."""
    square = soup([(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)], [(0, 2, 1), (0, 3, 2)])
    up = np.tile(np.array([0, 1, 0], np.float32), (4, 1))
    turn = np.radians(degrees)
    leaning = np.tile(np.array([np.sin(turn), np.cos(turn), 0], np.float32), (4, 1))
    found = normal_error(replace(square, normals=up), replace(square, normals=leaning))
    for value in found.values():
        assert value == pytest.approx(degrees, rel=2e-5)


@pytest.mark.parametrize("lift", [1e-3, 0.5, 7.0])
def test_a_plane_that_is_lifted_is_off_by_the_lift(lift: float) -> None:
    rows, columns = np.indices((9, 13))
    field = Heightfield((rows * 0.5 + columns * 0.25).astype(np.float32), 12.0, 8.0)
    mesh = terrain_mesh(field, tolerance_m=0.1, tier="balanced")
    found = terrain_error(replace(mesh, positions=mesh.positions + np.array([0, lift, 0], np.float32)), field)
    assert found.max_m == pytest.approx(lift, rel=1e-3)
    assert found.rms_m == pytest.approx(lift, rel=1e-3)


def test_a_circle_is_flown_at_its_own_speed() -> None:
    """Of n waypoints on a circle the spline leaves it by less than (2 pi / n)^4 / 100 of the radius."""
    n, radius = 36, 50.0
    angle = 2 * np.pi * np.arange(n) / n
    points = [(radius * c, 3.0, radius * s) for c, s in zip(np.cos(angle), np.sin(angle), strict=True)]
    eye = tuple(EyePoint(position=p) for p in points)
    target = tuple(TargetPoint(position=(0.0, float(k % 2), 0.0)) for k in range(n))
    flight = plan_flight(Settings(eye=eye, target=target, duration_s=100.0))
    found = flight_error(flight.as_json(), points, [t.position for t in target], [1.0] * n)
    assert found["path_miss_m"] == 0.0
    assert found["path_ripple_max"] < 1e-4
    length = 2 * np.pi * radius
    table = np.array(flight.table)
    middle = np.interp(50.0, table[:, 0], table[:, 1])
    assert middle == pytest.approx(len(flight.eye) / 2, rel=1e-3)  # half the time, half the way round
    k, x = divmod(middle, 1.0)
    at = [sum(c * x**p for p, c in enumerate(cubic)) for cubic in flight.eye[int(k)]]
    assert np.hypot(at[0], at[2]) == pytest.approx(radius, rel=(2 * np.pi / n) ** 4 / 100)
    assert np.hypot(at[0] + radius, at[2]) < 1e-3 * length


def test_black_and_white_differ_as_far_as_pictures_can_and_equal_ones_not_at_all() -> None:
    black, white = np.zeros((40, 50, 3), np.float32), np.ones((40, 50, 3), np.float32)
    assert flip_errors([black, white], [black, white]) == {"mean": 0.0, "p99": 0.0, "max": 0.0}
    found = flip_errors([black], [white])
    assert 0.95 < found["mean"] <= found["max"] <= 1.0


@pytest.mark.parametrize("code", [0, 40, 127])
def test_gloss_that_is_off_by_a_known_step_has_its_psnr(code: int) -> None:
    flat = HeightMap(np.zeros((16, 24), np.float32), (1.0, 1.0), (True, True), "central")
    gloss = np.full((16, 24, 2), code / 255, np.float32)
    texture = Texture("RG8_UNORM", 24, 16, (bytes([code + 8]) * (16 * 24 * 2),))
    found = gloss_levels(texture, gloss, flat)[0]
    assert found["psnr_db"] == pytest.approx(-20 * np.log10(8 / 255), abs=1e-4)
    assert found["max"] == pytest.approx(8 / 255, rel=1e-5)


def test_offsets_that_lean_alike_are_none() -> None:
    """A slope that is the same everywhere shakes nothing: du/dv are its deviation, which is zero."""
    slope = HeightMap(
        np.add.outer(np.zeros(12), np.arange(20.0)).astype(np.float32), (2.0, 2.0), (False, False), "central"
    )
    still = Texture("RG8_SNORM", 20, 12, (bytes(12 * 20 * 2),))
    assert dudv_levels(still, slope)[0]["max_deg"] < 1e-4
    step = Texture("RG8_SNORM", 20, 12, (bytes([64, 0]) * (12 * 20),))
    assert dudv_levels(step, slope)[0]["mean_deg"] == pytest.approx(np.degrees(np.arcsin(64 / 127)), rel=1e-5)

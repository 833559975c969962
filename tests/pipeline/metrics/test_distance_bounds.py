"""The largest distance between two surfaces lies between its two bounds: by closed forms and by brute force
in float64."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.mesh.lods import NO_ERROR, Plan, make_levels
from paradize.data import Mesh
from paradize.kernels.reference import Surface
from paradize.metrics.surface import Original, is_loose
from tests.pipeline.shapes import grid, soup, sphere
from tests.sweeps import sample, tries

GAP = 0.02


def bounds(a: Mesh, b: Mesh, threads: int = 2) -> tuple[float, float]:
    """(least, most) with no samples but the fewest."""
    there, back = (Surface(mesh.positions, mesh.triangles) for mesh in (a, b))
    return there.between(back, samples=0, threads=threads)[:2]


def to_triangles(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """The distance of each point (n, 3) to the nearest of triangles (m, 3, 3): to their planes where it
    stands above them, and to their sides."""
    p = points[:, None]
    a, b, c = (corners[None, :, k] for k in range(3))
    best = np.full((len(points), len(corners)), np.inf)
    for s, e in ((a, b), (b, c), (c, a)):
        side = e - s
        length = (side * side).sum(-1)
        t = np.clip(((p - s) * side).sum(-1) / np.where(length > 0, length, 1), 0, 1)
        best = np.minimum(best, np.linalg.norm(p - s - t[..., None] * side, axis=-1))
    u, v, w = b - a, c - a, p - a
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    wu, wv = (w * u).sum(-1), (w * v).sum(-1)
    flat = uu * vv - uv * uv
    sound = flat > 1e-12 * uu * vv
    one = (vv * wu - uv * wv) / np.where(sound, flat, 1)
    two = (uu * wv - uv * wu) / np.where(sound, flat, 1)
    inside = sound & (one >= 0) & (two >= 0) & (one + two <= 1)
    off = np.linalg.norm(w - one[..., None] * u - two[..., None] * v, axis=-1)
    return np.where(inside, np.minimum(best, off), best).min(axis=1)


def dense(mesh: Mesh, steps: int) -> tuple[np.ndarray, float]:
    """Points of every triangle, and how far any point of it lies from one at most."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    shares = [(i / steps, j / steps) for i in range(steps + 1) for j in range(steps + 1 - i)]
    x, y = np.array(shares).T[:, :, None, None]
    points = (1 - x - y) * corners[:, 0] + x * corners[:, 1] + y * corners[:, 2]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max()
    return points.reshape(-1, 3), float(longest) / steps


def truth_between(a: Mesh, b: Mesh, steps: int) -> tuple[float, float]:
    """Two numbers that the largest distance lies between."""
    largest, apart = 0.0, 0.0
    for one, other in ((a, b), (b, a)):
        points, step = dense(one, steps)
        found = to_triangles(points, other.positions[other.triangles].astype(np.float64))
        largest, apart = max(largest, float(found.max())), max(apart, step)
    return largest, largest + apart


def assert_bounds(a: Mesh, b: Mesh, steps: int = 24) -> None:
    least, most = bounds(a, b)
    low, high = truth_between(a, b, steps)
    scale = max(float(np.abs(mesh.positions).max()) for mesh in (a, b))
    assert low <= most + 1e-12 * scale
    assert least <= high + 1e-12 * scale
    across = float(np.linalg.norm(np.ptp(a.positions.astype(np.float64), axis=0)))
    assert least <= most <= (1 + GAP) * least + 1.01e-7 * across


@st.composite
def soups(draw: st.DrawFn) -> Mesh:
    """One to six triangles of points on a coarse grid: some share points, cross, or have no area."""
    count = draw(st.integers(3, 8))
    places = st.tuples(*[st.integers(-3, 3)] * 3)
    points = draw(st.lists(places, min_size=count, max_size=count))
    corners = st.tuples(*[st.integers(0, count - 1)] * 3)
    triangles = draw(st.lists(corners, min_size=1, max_size=6))
    return Mesh(np.array(points, np.float32) * np.float32(0.37), np.array(triangles, np.uint32))


@given(soups(), soups())
@settings(max_examples=tries(60), deadline=None)
def test_of_any_few_triangles_the_largest_distance_lies_between_the_bounds(a: Mesh, b: Mesh) -> None:
    assert_bounds(a, b)


@pytest.mark.deep
@pytest.mark.parametrize(("pair",), [((10, 7),), ((12, 12),), ((5, 16),)])
def test_of_two_spheres_the_largest_distance_lies_between_the_bounds(pair: tuple[int, int]) -> None:
    assert_bounds(sphere(pair[0]), sphere(pair[1], offset=(0.05, -0.02, 0.01)), steps=6)


def holed(at: tuple[float, float], half: float) -> Mesh:
    """A square from -1 to 1 with a square hole in it."""
    x, y = at
    outer = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    inner = [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]
    points = np.array([(u, 0.0, v) for u, v in outer + inner], np.float32)
    sides = [(k, (k + 1) % 4) for k in range(4)]
    faces = [face for a, b in sides for face in ((a, b, b + 4), (a, b + 4, a + 4))]
    return Mesh(points, np.array(faces, np.uint32))


@pytest.mark.parametrize("half", [1e-2, 1e-4, 1e-6])
def test_a_hole_between_all_samples_is_found(half: float) -> None:
    """Its middle is as far from its rim as half its width. Samples of the whole square see nothing of it."""
    square = Mesh(
        np.array([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.uint32),
    )
    with_hole = holed((0.3137, -0.1719), half)
    inner = with_hole.positions[4:, ::2].astype(np.float64)
    wide = np.ptp(inner, axis=0).min() / 2  # as float32 has it
    there, back = (Surface(mesh.positions, mesh.triangles) for mesh in (square, with_hole))
    assert there.distance_to(back, samples=2000)[0] < 0.9 * wide
    found = Original(square).distance(with_hole, 2000)
    lower, most = (found[key] * 8**0.5 for key in ("error_max_lower", "error_max"))
    assert lower <= wide * (1 + 1e-5) and wide * (1 - 1e-5) <= most <= lower * (1 + GAP) + 3e-7


@pytest.mark.parametrize("length", [1e-3, 0.2])
def test_a_spike_as_thin_as_a_needle_is_as_far_as_its_tip(length: float) -> None:
    ground = grid(6)
    x, z = 0.2345, 0.4777
    points = [(x, 0, z), (x + 1e-6, 0, z), (x, length, z)]
    spiked = Mesh(
        np.concatenate([ground.positions, np.array(points, np.float32)]),
        np.concatenate([ground.triangles, np.array([[0, 1, 2]], np.uint32) + len(ground.positions)]),
    )
    least, most = bounds(ground, spiked)
    assert least <= length * (1 + 1e-6) and length * (1 - 1e-6) <= most <= length * (1 + GAP)


def fan(count: int) -> Mesh:
    """A square in needles that meet in one corner, and one triangle without an area."""
    side = np.linspace(0, 1, count + 1)
    rim = np.concatenate([np.stack([0 * side + 1, side], 1), np.stack([1 - side, 0 * side + 1], 1)])
    points = np.zeros((len(rim) + 1, 3), np.float32)
    points[1:, ::2] = rim
    k = np.arange(1, len(rim))
    return Mesh(points, np.stack([0 * k, k, k + 1], 1).astype(np.uint32))


def hilly(size: int) -> Mesh:
    """A square with hills of equal height all over."""
    flat = grid(size)
    points = flat.positions.copy()
    points[:, 1] = 0.002 * np.sin(40 * points[:, 0]) * np.sin(31 * points[:, 2])
    return Mesh(points, flat.triangles)


def test_bounds_of_long_needles_over_many_triangles_lie_together() -> None:
    """Each needle crosses a hundred triangles, and hundreds of places are nearly as far as the farthest."""
    least, most = bounds(hilly(40), fan(50))
    assert 0.0019 <= least <= most <= (1 + GAP) * least <= 0.0021


def test_triangles_that_lie_twice_change_no_bound_by_more_than_the_gap() -> None:
    once, other = sphere(8), sphere(6)
    twice = Mesh(once.positions, np.concatenate([once.triangles, once.triangles[::-1, ::-1]]))
    (least, most), (again, again_most) = bounds(once, other), bounds(twice, other)
    assert again <= most and least <= again_most <= (1 + GAP) * again


TRIANGLE = soup([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [(0, 1, 2)])


@pytest.mark.parametrize(
    ("other", "distance"),
    [
        (TRIANGLE, 0.0),
        (soup([(0, 0.5, 0), (1, 0.5, 0), (0, 0.5, 1)], [(2, 1, 0)]), 0.5),
        (soup([(0, 0, 0), (0, 0, 0), (0, 0, 0)], [(0, 1, 2)]), 1.0),  # a point
        (soup([(0, 0, 0), (1, 0, 0), (0.5, 0, 0)], [(0, 1, 2)]), 1.0),  # a line
        (soup([(0, 0, 0), (1, 1e-7, 0), (1, 0, 0)], [(0, 1, 2)]), 1.0),  # a needle
        (soup([(1e6, 0, 0), (1e6, 1, 0), (1e6, 0, 1)], [(0, 1, 2)]), 1e6),
    ],
    ids=["itself", "above", "point", "line", "needle", "far"],
)
def test_of_one_triangle_the_bounds_are_the_distance(other: Mesh, distance: float) -> None:
    for found in (bounds(TRIANGLE, other), bounds(other, TRIANGLE)):
        assert found == pytest.approx((distance, distance), rel=1.01e-3, abs=1e-12)


@pytest.mark.parametrize(("away", "scale"), sample(product([0.0, 1e3, 1e6], [1e-12, 1.0, 1e30]), every=8))
def test_bounds_hold_at_any_size_and_place(scale: float, away: float) -> None:
    a, b = (
        replace(m, positions=((m.positions + np.array([away, 0, 0])) * scale).astype(np.float32))
        for m in (sphere(6), sphere(4))
    )
    assert_bounds(a, b, steps=8)


def test_bounds_do_not_depend_on_threads() -> None:
    a, b = sphere(30), sphere(17, offset=(0.01, 0.02, 0))
    assert len({bounds(a, b, threads) for threads in (1, 2, 3, 8)}) == 1


def test_what_is_measured_of_a_level_is_bounded_outwards() -> None:
    found = Original(sphere(30)).distance(sphere(9), 2000)
    assert found["error_p99"] <= found["error_max_lower"] <= found["error_max"]
    assert found["error_max"] <= (1 + GAP) * found["error_max_lower"] and not is_loose(found)


def test_a_level_whose_bounds_lie_apart_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a kernel's limit of work leaves the bounds apart, the upper one is the error, and a note has
    both."""
    far = NO_ERROR | {"error_max": 0.02, "error_max_lower": 0.015}
    monkeypatch.setattr(Original, "distance", lambda *_: far)
    steps, notes = make_levels(sphere(12), Plan(count=2), "balanced")
    assert steps[1].errors["error_max"] == 0.02
    assert any("lies between 0.015 and 0.02 of the diagonal" in note for note in notes)


def test_what_is_farthest_from_three_points_is_the_middle_of_their_circle() -> None:
    """Inside a slim triangle, at neither its middle nor a side's."""
    base, height = 0.3472963553, 0.984807753  # two sides of 1, angles of 80, 80 and 20 degrees
    corners = [(0.0, 0.0, 0.0), (base, 0.0, 0.0), (base / 2, 0.0, height)]
    slim = soup(corners, [(0, 1, 2)])
    points = soup([c for c in corners for _ in range(3)], [(0, 1, 2), (3, 4, 5), (6, 7, 8)])
    radius = 0.5 / height
    least, most = bounds(slim, points)
    assert 0.999 * radius <= least <= radius * (1 + 1e-6)
    assert radius * (1 - 1e-6) <= most <= 1.001 * radius

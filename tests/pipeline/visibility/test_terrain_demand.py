"""The terrain that a flight needs: what any moment of it wants is baked, and all that a view sees counts."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from paradize.bakers.terrain.tree import Tree
from paradize.data import Heightfield
from paradize.scene.flight import plan_flight
from paradize.scene.settings import EyePoint, Flight, TargetPoint
from paradize.stages.terrain_tree import diamond_of
from paradize.visibility.query import Sphere, VisibilityQuery, drawn_to_m, lifted_spheres, plan_query
from tests.pipeline.bakers.terrain.test_tree import FIELDS, grown, tables_of
from tests.pipeline.terrain_cut import drawn, split_diamonds
from tests.sweeps import sweep


def flight_settings(low: bool) -> Flight:
    y = 4.0 if low else 60.0
    eye = tuple(EyePoint(position=p) for p in ((20, y, -10), (5, y, -14), (-25, y + 3, -8), (0, y, 4)))
    target = tuple(TargetPoint(position=p) for p in ((5, 0, -10), (-20, 1, -12), (-20, 0, 5), (18, 0, -2)))
    return Flight(duration_s=12.0, fov_deg=50.0, near_m=0.2, far_m=500.0, eye=eye, target=target)


def flight_views_of(flight: Flight, **more: Any) -> dict[str, Any]:
    plain = {"mirror_m": None, "water_m": None, "shadow": None, "sun": [0.3, 0.9, 0.3]}
    return {"flight": asdict(flight), "viewport": [160, 90], "error_px": 1.0} | plain | more


def still_query() -> VisibilityQuery:
    return plan_query(flight_views_of(flight_settings(False)))


def looks(flight: Flight, count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Eye and target at moments that no run starts at."""
    planned = plan_flight(flight)
    return [
        (np.array(eye), np.array(target))
        for eye, target in (planned.view(flight.duration_s * (k + 0.37) / count) for k in range(count))
    ]


def visible(
    centers: np.ndarray, radii: np.ndarray, eye: np.ndarray, target: np.ndarray, flight: Flight
) -> np.ndarray:
    """Which spheres (n, 3), (n,) the picture's pyramid may show: those that none of its five planes parts."""
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    tangent = math.tan(math.radians(flight.fov_deg) / 2)
    normals = [ahead]
    for side, slope in ((right, tangent * 160 / 90), (up, tangent)):
        normals += [(slope * ahead + sign * side) / math.hypot(slope, 1.0) for sign in (1.0, -1.0)]
    return np.asarray(((centers - eye) @ np.stack(normals, axis=1) >= -radii[:, None]).all(axis=1))


class Known:
    """The patches of a tree that could be split, as columns."""

    def __init__(self, tree: Tree) -> None:
        patches = [patch for patch in tree.patches if patch.diamond is not None]
        self.centers = np.array([patch.sphere.center for patch in patches])
        self.radii = np.array([patch.sphere.radius_m for patch in patches])
        self.errors = np.array([patch.error.max_m for patch in patches if patch.error])
        self.names = [(patch.level, diamond_of(patch.corners)) for patch in patches]

    def wanted(
        self,
        eye: np.ndarray,
        target: np.ndarray,
        flight: Flight,
        mirror_m: float | None,
        water_m: float | None = None,
    ) -> set[tuple[int, tuple[int, int]]]:
        """The diamonds, by level and place, of whose patches one is in view with too large an error."""
        pixels = 90 / (2 * math.tan(math.radians(flight.fov_deg) / 2))
        away = np.linalg.norm(self.centers - eye, axis=1) - self.radii
        large = np.flatnonzero(self.errors * pixels > np.maximum(flight.near_m, away))
        centers, radii = self.centers[large], self.radii[large]
        seen = visible(centers, radii, eye, target, flight)
        if mirror_m is not None and eye[1] > mirror_m:
            flipped = centers * [1.0, -1.0, 1.0] + [0.0, 2 * mirror_m, 0.0]
            above = centers[:, 1] + radii > mirror_m
            seen |= above & visible(flipped, radii, eye, target, flight)
        if water_m is not None and eye[1] > water_m:  # refraction may show it anywhere below the surface
            for share in np.linspace(0.0, 1.0, 23):
                lifted_spheres = centers.copy()
                lifted_spheres[:, 1] += share * np.maximum(0.0, water_m - lifted_spheres[:, 1])
                seen |= visible(lifted_spheres, radii, eye, target, flight)
        return {self.names[k] for k in large[seen]}


@pytest.fixture(scope="module")
def everything() -> Tree:
    return grown(FIELDS["square"], 4)[1]


@pytest.mark.parametrize(
    ("low", "mirror_m", "water_m"),
    sweep(
        [
            (True, 0.5, None),
            (False, None, None),
            (False, 0.5, None),
            (True, None, 3.0),
            (True, None, None),
            (False, None, 3.0),
        ],
        test=[(True, 0.5, None)],
    ),
)
def test_what_any_moment_wants_of_the_whole_tree_is_baked(
    everything: Tree, low: bool, mirror_m: float | None, water_m: float | None
) -> None:
    flight, known = flight_settings(low), Known(everything)
    query = plan_query(flight_views_of(flight, mirror_m=mirror_m, water_m=water_m))
    _, demanded = grown(FIELDS["square"], 4, query)
    baked = {(diamond.level, diamond.key) for diamond in demanded.diamonds}
    wanted = set()
    for eye, target in looks(flight, 331):
        wanted |= known.wanted(eye, target, flight, mirror_m, water_m)
    assert wanted
    assert wanted <= baked
    if not low:
        assert len(baked) < len(everything.diamonds)
        assert demanded.left_out > 0 and demanded.left_out_bytes > 0


def test_patches_drawn_in_view_are_within_the_accepted_error_or_the_finest() -> None:
    flight = flight_settings(False)
    grower, tree = grown(FIELDS["square"], 4, plan_query(flight_views_of(flight)))
    tables, pixels = tables_of(tree), 90 / (2 * math.tan(math.radians(flight.fov_deg) / 2))
    centers = np.array([patch.sphere.center for patch in tree.patches])
    radii = np.array([patch.sphere.radius_m for patch in tree.patches])
    checked = 0
    for eye, target in looks(flight, 61):
        seen = visible(centers, radii, eye, target, flight)
        split = split_diamonds(tables, tuple(eye), pixels, flight.near_m)
        for p in drawn(tables, split):
            patch = tree.patches[p]
            if seen[p] and patch.level < grower.shape.finest and patch.error is not None:
                away = max(flight.near_m, math.dist(eye, centers[p]) - radii[p])
                assert patch.error.max_m * pixels <= away * (1 + 1e-5)
                checked += 1
    assert checked > 100


def test_ground_in_the_lights_square_counts_as_seen() -> None:
    flight = flight_settings(True)
    dark = plan_query(flight_views_of(flight))
    lit = plan_query(flight_views_of(flight, shadow={"extent_m": 30.0, "center": [0.0, 0.0, 0.0]}))
    inside, outside = Sphere((3.0, 0.0, 3.0), 1.0), Sphere((0.0, 400.0, 0.0), 1.0)
    assert len(lit.seeing(inside, lit.runs)) == len(lit.runs)
    assert len(dark.seeing(inside, dark.runs)) < len(dark.runs)
    assert len(lit.seeing(outside, lit.runs)) == len(dark.seeing(outside, dark.runs)) == 0


def test_ground_beyond_the_far_plane_does_not_count_as_seen() -> None:
    """On the axis and in the picture's corners, which are farther away; from a free camera."""
    eye = (*(EyePoint(position=(0.0, 20.0, 10.0)),) * 3, EyePoint(position=(0.01, 20.0, 10.0)))
    target = (TargetPoint(position=(0.0, 20.0, -10.0)),) * 4
    flight = replace(flight_settings(True), eye=eye, target=target, far_m=40.0)
    query = plan_query(flight_views_of(flight))
    tangent = math.tan(math.radians(flight.fov_deg) / 2)
    for x, y in ((0.0, 0.0), (0.9, 0.9), (-0.9, 0.5)):
        for deep, seen in ((41.5, True), (42.5, False), (60.0, False)):
            right, up = x * deep * tangent * 160 / 90, y * deep * tangent
            ball = Sphere((right, 20.0 + up, 10.0 - deep), 2.0)
            assert (len(query.seeing(ball, query.runs)) > 0) is seen
    region = {"low": [-5.0, 19.0, -5.0], "high": [5.0, 21.0, 5.0], "near_m": 0.5}
    free = plan_query(flight_views_of(flight, region=region))
    corner_m = 40.0 * math.sqrt(1.0 + tangent * tangent * (1.0 + (160 / 90) ** 2))
    for away, seen in ((corner_m + 6.9, True), (corner_m + 7.1, False)):
        assert (len(free.runs) - 1 in free.seeing(Sphere((away, 20.0, 0.0), 2.0), free.runs)) is seen


def test_ground_that_water_lifts_into_view_counts_as_seen() -> None:
    """Straight ahead over the sea: what lies below the picture's lower edge is drawn higher up."""
    eye = (EyePoint(position=(0.0, 1.0, 10.0)),) * 4
    target = (TargetPoint(position=(0.0, 1.0, -10.0)),) * 4
    eye = (*eye[:3], EyePoint(position=(0.1, 1.0, 10.0)))
    flight = replace(flight_settings(True), eye=eye, target=target)
    dry, wet = (plan_query(flight_views_of(flight, water_m=level)) for level in (None, 0.0))
    for depth_m in (8.0, 40.0):
        floor = Sphere((0.0, -depth_m, 2.0), 0.5)
        assert len(dry.seeing(floor, dry.runs)) == 0
        assert len(wet.seeing(floor, wet.runs)) == len(wet.runs)
    behind = Sphere((0.0, -8.0, 20.0), 0.5)
    assert len(wet.seeing(behind, wet.runs)) == 0
    below = plan_query(flight_views_of(flight, water_m=2.0))  # an eye under water sees things where they are
    assert len(below.seeing(Sphere((0.0, -8.0, 2.0), 0.5), below.runs)) == 0


def test_runs_hold_the_eye_and_the_view_at_every_moment() -> None:
    flight = flight_settings(True)
    planned, query = plan_flight(flight), still_query()
    query = plan_query(flight_views_of(flight))
    for k in range(1999):
        t = flight.duration_s * k / 1999
        eye, target = planned.view(t)
        run = int(np.searchsorted(query.start_s, t, side="right")) - 1
        starts = np.flatnonzero(query.start_s == query.start_s[run])
        balls = [math.dist(eye, [axis[i] for axis in query.eye]) - query.slack_m[i] for i in starts]
        assert min(balls) <= 1e-9
        i = starts[int(np.argmin(balls))]
        ahead = np.array(target) - eye
        corner = np.array([axis[i] for axis in query.ahead]) @ ahead / np.linalg.norm(ahead)
        assert corner >= query.cosine[i]  # the picture's middle, far inside


def runs_at(query: VisibilityQuery, t: float) -> set[int]:
    """The runs that hold a second: those that start last before it."""
    start = query.start_s[int(np.searchsorted(query.start_s, t, side="right")) - 1]
    return set(np.flatnonzero(query.start_s == start).tolist())


def test_what_one_moment_wants_or_sees_is_wanted_or_seen_by_its_run() -> None:
    """Points in the very corners of the picture, at its far plane, and at the distance that just asks."""
    flight = replace(flight_settings(True), duration_s=3.0, far_m=40.0)  # fast: metres in every run
    planned, query = plan_flight(flight), plan_query(flight_views_of(flight))
    tangent = math.tan(math.radians(flight.fov_deg) / 2)
    mirrored, images = plan_query(flight_views_of(flight, mirror_m=1.5)), 0
    for k in range(400):
        t = flight.duration_s * (k + 0.37) / 400
        eye, target = (np.array(place) for place in planned.view(t))
        ahead = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(ahead, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        up = np.cross(right, ahead)
        across, along = ((-1.0, 1.0)[k >> bit & 1] for bit in (0, 1))
        corner = ahead + tangent * (across * 160 / 90 * right + along * up)
        for deep in (0.3, 5.0, 39.99):
            point = Sphere(tuple((eye + deep * corner).tolist()), 0.0)
            assert runs_at(query, t) & set(query.seeing(point, query.runs).tolist())
            x, y, z = point.center
            if y < 1.5:  # in the mirror's picture stands what is as far above the water
                image = Sphere((x, 3.0 - y, z), 0.0)
                assert runs_at(query, t) & set(mirrored.seeing(image, query.runs).tolist())
                images += 1
        ball = Sphere(tuple((eye + 9.0 * corner).tolist()), 1.5)
        away = math.dist(ball.center, eye) - ball.radius_m
        asking = away / query.pixels * (1.0 + 1e-6)
        assert runs_at(query, t) & set(query.wanting(asking, ball, query.runs).tolist())
    assert images > 100
    assert query.pixels == pytest.approx(90 / (2 * tangent))
    half = plan_query(flight_views_of(flight, error_px=2.0))
    assert half.pixels == pytest.approx(query.pixels / 2)


def test_the_light_sees_its_whole_box_and_not_much_more() -> None:
    """A square of 30 m across the light, three times as deep: also where the sun stands in the zenith."""
    for sun, side in (([0.0, 1.0, 0.0], (1.0, 0.0, 0.0)), ([0.6, 0.8, 0.0], (0.0, 0.0, 1.0))):
        flight_views = flight_views_of(
            flight_settings(True), shadow={"extent_m": 30.0, "center": [0, 500.0, 0]}, sun=sun
        )
        query = plan_query(flight_views)
        for direction, reach in ((side, 15.0), (tuple(sun), 45.0)):
            for share, seen in ((0.99, True), (1.01, False)):
                x, y, z = (share * reach * axis for axis in direction)
                found = query.seeing(Sphere((x, 500.0 + y, z), 0.0), query.runs)
                assert (len(found) == len(query.runs)) is seen


def test_a_tree_is_the_same_whatever_asks_for_it_first() -> None:
    ground, flight = FIELDS["wide"], flight_settings(True)
    first, again = (grown(ground, 4, plan_query(flight_views_of(flight))) for _ in range(2))
    assert tables_of(first[1]) == tables_of(again[1])
    for one, other in zip(first[1].patches, again[1].patches, strict=True):
        assert first[0].mesh(one).triangles.tobytes() == again[0].mesh(other).triangles.tobytes()


def test_a_plain_needs_its_corners_only() -> None:
    grower, tree = grown(Heightfield(np.full((65, 65), 2.5, np.float32), 64.0, 64.0), query=still_query())
    assert [patch.sizes for patch in tree.patches] == [(3, 1), (3, 1)]
    assert tree.needed_s is None
    assert tree.left_out == sum(grower.shape.count()) - 2


@pytest.mark.parametrize(("depth_m", "radius_m"), [(0.1, 5.0), (9.0, 2.0), (80.0, 0.5), (3.0, 0.0)])
def test_what_water_lifts_is_held_all_the_way_up(depth_m: float, radius_m: float) -> None:
    held = lifted_spheres(Sphere((4.0, 2.0 - depth_m, 6.0), radius_m), 2.0)
    for share in np.linspace(0.0, 1.0, 101):
        middle = (4.0, 2.0 - depth_m * share, 6.0)
        room = max(sphere.radius_m - math.dist(sphere.center, middle) for sphere in held)
        assert room >= radius_m - 1e-9


def test_the_far_plane_lies_where_a_matrix_of_float32_has_it() -> None:
    """Far / near: 1e4 as asked for, 2e6 some 5 % and more beyond, 4e7 nowhere."""
    assert 1000.0 <= drawn_to_m(0.1, 1000.0) < 1005.0
    assert drawn_to_m(0.001, 2000.0) > 2097.0
    assert drawn_to_m(0.0001, 4000.0) == np.inf

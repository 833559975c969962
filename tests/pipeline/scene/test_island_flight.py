"""The island's flight: it keeps clear of everything, tells its story in order, and meets its beginning."""

from __future__ import annotations

import tomllib
from math import asin, atan2, degrees, pi, sqrt, tan
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from paradize.scene.flight import Flight, plan_flight
from paradize.scene.motion import motion_json, moved
from paradize.scene.placement import placed
from paradize.scene.settings import Scene, SceneObject, load_scene

RAW = Path(__file__).resolve().parents[3] / "raw_assets"
STEP_S = 0.1


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(RAW / "island.toml")


@pytest.fixture(scope="module")
def flight(scene: Scene) -> Flight:
    return plan_flight(scene.flight)


@pytest.fixture(scope="module")
def moments(flight: Flight) -> np.ndarray:
    """Eye and target at every STEP_S: (n, 2, 3)."""
    count = round(flight.duration_s / STEP_S)
    return np.array([flight.view(i * STEP_S) for i in range(count)])


@pytest.fixture(scope="module")
def ground(scene: Scene) -> Any:
    """Height of the ground, metres, at points x, z; the sea floor's edge goes on beyond the heightmap."""
    terrain = scene.terrain
    assert terrain is not None
    pixels = oiio.ImageBuf(str(terrain.heightmap)).get_pixels(oiio.FLOAT)[..., 0].astype(np.float64)
    heights = terrain.base_m + terrain.height_m * pixels

    def at(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        rows, columns = heights.shape
        c = np.clip((x / terrain.size_m[0] + 0.5) * (columns - 1), 0, columns - 1.001)
        r = np.clip((z / terrain.size_m[1] + 0.5) * (rows - 1), 0, rows - 1.001)
        i, j = r.astype(int), c.astype(int)
        a, b = r - i, c - j
        top = heights[i, j] * (1 - b) + heights[i, j + 1] * b
        low = heights[i + 1, j] * (1 - b) + heights[i + 1, j + 1] * b
        return np.asarray(top * (1 - a) + low * a)

    return at


def surface(item: SceneObject) -> np.ndarray:
    """Points of an object and all its instances in the world, no farther than 15 cm, times the scale, from
    one another on the surface: (n, 3)."""
    vertices, faces = [], []
    for line in item.mesh.read_text(encoding="ascii").splitlines():
        if line.startswith("v "):
            vertices.append([float(x) for x in line.split()[1:4]])
        elif line.startswith("f "):
            faces.append([int(corner.split("/")[0]) - 1 for corner in line.split()[1:4]])
    triangles = np.array(vertices)[np.array(faces)]
    edges = triangles - np.roll(triangles, 1, axis=1)
    pieces = np.ceil(np.sqrt((edges**2).sum(axis=2)).max(axis=1) / 0.15).astype(int)
    points = []
    for n in np.unique(pieces):
        corner = triangles[pieces == n]
        for i in range(n + 1):
            for j in range(n + 1 - i):
                u, v = i / n, j / n
                points.append(corner[:, 0] * (1 - u - v) + corner[:, 1] * u + corner[:, 2] * v)
    local = np.concatenate(points)
    everywhere = []
    for instance in map(placed, item.instances):
        turn = Rotation.from_quat(instance["rotation"])
        everywhere.append(turn.apply(local * instance["scale"]) + instance["position"])
    return np.concatenate(everywhere)


@pytest.fixture(scope="module")
def objects(scene: Scene) -> dict[str, np.ndarray]:
    return {item.name: surface(item) for item in scene.objects}


def rays(flight: Flight, t_s: float, aspect: float, grid: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """The eye, and grid x grid directions over the whole picture, edges included: (3,), (grid * grid, 3)."""
    eye, target = (np.array(p) for p in flight.view(t_s))
    ahead = target - eye
    ahead /= sqrt(float((ahead**2).sum()))
    right = np.cross(ahead, [0.0, 1.0, 0.0])
    right /= sqrt(float((right**2).sum()))
    up = np.cross(right, ahead)
    reach = tan(flight.fov_rad / 2)
    across, over = np.meshgrid(np.linspace(-1, 1, grid) * reach * aspect, np.linspace(-1, 1, grid) * reach)
    return eye, ahead + across.reshape(-1, 1) * right + over.reshape(-1, 1) * up


def in_view(flight: Flight, t_s: float, aspect: float, points: np.ndarray) -> np.ndarray:
    """Which points lie inside the picture."""
    eye, target = (np.array(p) for p in flight.view(t_s))
    ahead = (target - eye) / sqrt(float(((target - eye) ** 2).sum()))
    right = np.cross(ahead, [0.0, 1.0, 0.0])
    right /= sqrt(float((right**2).sum()))
    away = points - eye
    depth = (away * ahead).sum(axis=1)
    x, y = (away * right).sum(axis=1), (away * np.cross(right, ahead)).sum(axis=1)
    reach = tan(flight.fov_rad / 2)
    return np.asarray((depth > 0) & (np.abs(x) < depth * reach * aspect) & (np.abs(y) < depth * reach))


def test_the_eye_stays_above_the_ground_and_the_sea(moments: np.ndarray, ground: Any) -> None:
    eye = moments[:, 0]
    assert (eye[:, 1] - ground(eye[:, 0], eye[:, 2])).min() > 0.5
    assert eye[:, 1].min() > 0.4


@pytest.mark.deep
def test_the_eye_keeps_clear_of_the_jetty_and_of_all_that_grows(
    moments: np.ndarray, objects: dict[str, np.ndarray]
) -> None:
    for name, points in objects.items():
        away, _ = cKDTree(points).query(moments[:, 0])
        assert away.min() > 0.5, f"{away.min():.2f} m from the {name} at {away.argmin() * STEP_S:.1f} s"


def test_sixty_palms_of_three_kinds_and_the_grass_stand_on_dry_sand(scene: Scene, ground: Any) -> None:
    grove = [item for item in scene.objects if item.mesh.parent.name == "palm" and item.name != "palm"]
    counts = {item.name: len(item.instances) for item in grove}
    assert set(counts) == {"tall", "leaning", "young"} and min(counts.values()) > 10
    assert sum(counts.values()) >= 60
    names = ("tall", "leaning", "young", "grass", "far_grass", "bush", "fan")
    for item in (item for item in scene.objects if item.name in names):
        at = np.array([instance.position for instance in item.instances])
        assert np.abs(at[:, 1] - ground(at[:, 0], at[:, 2])).max() < 0.02 and at[:, 1].min() > 1.0


def test_palms_that_lean_do_so_out_of_the_grove(scene: Scene, objects: dict[str, np.ndarray]) -> None:
    item = next(item for item in scene.objects if item.name == "leaning")
    feet = np.array([instance.position for instance in item.instances])
    points = objects["leaning"].reshape(len(feet), -1, 3)
    palms = [item for item in scene.objects if item.name in ("tall", "young")]
    middle = np.mean([instance.position for item in palms for instance in item.instances], axis=0)
    crowns = points.mean(axis=1)  # most of a palm's surface is leaves
    outwards = ((crowns - feet) * (feet - middle))[:, (0, 2)].sum(axis=1)
    away = np.hypot(*(crowns - feet)[:, (0, 2)].T)
    assert (outwards > 0.0).all() and away.min() > 1.5, away


def test_pebbles_lie_in_the_sand_of_the_beach_beside_the_eye_s_way(
    scene: Scene, objects: dict[str, np.ndarray], moments: np.ndarray, ground: Any
) -> None:
    item = next(item for item in scene.objects if item.name == "pebbles")
    middles = np.array([instance.position for instance in item.instances])
    away, _ = cKDTree(moments[:, 0][:, (0, 2)]).query(middles[:, (0, 2)])
    assert len(middles) > 150 and middles[:, 1].min() > 0.1 and away.max() < 14.0
    points = objects["pebbles"].reshape(len(middles), -1, 3)
    height = points[..., 1] - ground(points[..., 0], points[..., 2])
    assert height.max(axis=1).min() > 0.0 and height.max() < 0.1  # each handful is seen, none floats
    assert np.quantile(height.min(axis=1), 0.9) < 0.005, "their open undersides lie in the sand"


def test_tufts_of_few_blades_stand_where_the_eye_never_comes_near(scene: Scene, moments: np.ndarray) -> None:
    far = next(item for item in scene.objects if item.name == "far_grass")
    away, _ = cKDTree([instance.position for instance in far.instances]).query(moments[:, 0])
    assert len(far.instances) > 400 and away.min() > 9.0


def test_no_shell_lies_in_the_palm_s_foot(scene: Scene) -> None:
    items = {item.name: item for item in scene.objects}
    shells = np.array([instance.position for instance in items["shell"].instances])
    foot = np.array(items["palm"].instances[0].position)
    assert len(shells) == 900 and np.hypot(*(shells - foot)[:, (0, 2)].T).min() > 0.7


def test_the_flight_lasts_four_minutes_and_no_budget_is_missing(scene: Scene) -> None:
    assert (scene.flight.duration_s, scene.flight.fov_deg, scene.flight.near_m) == (240.0, 52.0, 0.2)
    manifest = tomllib.loads((RAW / "island.toml").read_text(encoding="utf-8"))
    assert set(manifest["budget"]) == {
        "surface_max",
        "terrain_max_m",
        "normal_p99_deg",
        "dudv_p99_deg",
        *(f"{kind}_psnr_db" for kind in ("color", "alpha", "height", "gloss")),
        "sky_max_relative",
        "path_miss_m",
        "path_ripple_max",
    }


def test_boulders_stand_in_the_sea_with_their_feet_under_water(scene: Scene, ground: Any) -> None:
    rocks = [item for item in scene.objects if item.mesh.parent.name == "rocks"]
    assert len(rocks) == 2 and sum(len(item.instances) for item in rocks) == 60
    for item in rocks:
        at = np.array([instance.position for instance in item.instances])
        assert (at[:, 1] > 0.0).all() and at[:, 1].max() < 1.0
        assert ground(at[:, 0], at[:, 2]).max() < 0.5  # none is buried


def test_the_bar_stands_on_the_beach_above_the_sea_and_the_boat_lies_at_its_edge(
    objects: dict[str, np.ndarray], ground: Any
) -> None:
    bar, boat = objects["bar"], objects["boat"]
    feet = bar[bar[:, 1] < bar[:, 1].min() + 0.02]
    assert (feet[:, 1] < ground(feet[:, 0], feet[:, 2]) - 0.1).all()  # the posts end in the sand
    deck_y = 1.95
    deck = bar[np.abs(bar[:, 1] - deck_y) < 0.02]
    assert len(deck) > 500 and (ground(deck[:, 0], deck[:, 2]) < deck_y).all()
    height = boat[:, 1] - ground(boat[:, 0], boat[:, 2])
    assert -0.25 < height.min() < 0.0 and np.quantile(height, 0.05) < 0.1  # it rests on the sand
    assert ground(boat[:, 0], boat[:, 2]).min() < 0.1


def test_crabs_walk_on_wet_sand_fish_swim_under_water_and_gulls_keep_clear_of_the_eye_and_the_ground(
    scene: Scene, moments: np.ndarray, ground: Any
) -> None:
    animals = {item.name: item for item in scene.objects if item.motion}
    assert {name: len(item.instances) for name, item in animals.items()} == {"crab": 8, "gull": 8, "fish": 28}
    for name, item in animals.items():
        motion = motion_json(item.motion)
        assert motion is not None
        for number, instance in enumerate(map(placed, item.instances)):
            shares = np.arange(0, len(moments), 5) / len(moments)
            at = np.array([moved(instance, motion, number, share)["position"] for share in shares])
            above = at[:, 1] - ground(at[:, 0], at[:, 2])
            away = np.sqrt(((at - moments[::5, 0]) ** 2).sum(axis=1))
            if name == "crab":
                assert np.abs(above).max() < 0.02 and 0.03 < at[:, 1].min() <= at[:, 1].max() < 0.36
                assert away.min() > 1.0
            elif name == "fish":
                assert above.min() > 0.08 and at[:, 1].max() < -0.3, f"fish {number}: {above.min():.2f} m"
            else:
                assert above.min() > 4.0 and away.min() > 3.0, f"{name} {number}: {away.min():.1f} m"


def test_the_bar_is_seen_from_the_jetty_and_from_the_palm(
    flight: Flight, scene: Scene, objects: dict[str, np.ndarray]
) -> None:
    aspect = scene.head.viewport[0] / scene.head.viewport[1]
    for t in (*range(30, 42), *range(108, 118)):
        assert in_view(flight, float(t), aspect, objects["bar"]).mean() > 0.95, f"at {t} s"


def test_the_sea_is_never_empty(scene: Scene, flight: Flight) -> None:
    aspect = scene.head.viewport[0] / scene.head.viewport[1]
    items = [item for item in scene.objects if item.name in ("boulder", "slab", "tall", "jetty")]
    landmarks = np.array([instance.position for item in items for instance in item.instances])
    assert len(items) == 4
    seen = {t: int(in_view(flight, float(t), aspect, landmarks).sum()) for t in range(196, 240)}
    assert min(seen.values()) > 0, [t for t, count in seen.items() if not count]


def test_nothing_stands_in_the_way_of_the_near_plane(scene: Scene, flight: Flight) -> None:
    aspect = scene.head.viewport[0] / scene.head.viewport[1]
    reach = tan(flight.fov_rad / 2)
    assert flight.near_m * sqrt(1.0 + reach * reach * (1.0 + aspect * aspect)) < 0.4


def test_the_flight_passes_through_its_waypoints_and_meets_its_beginning(
    scene: Scene, flight: Flight
) -> None:
    for i, u in enumerate(flight.waypoint_u):
        eye = [axis[0] for axis in flight.eye[u]]
        assert np.abs(np.array(eye) - scene.flight.eye[i].position).max() < 1e-9
    start, end = flight.view(0.0), flight.view(flight.duration_s - 1e-6)
    assert np.abs(np.array(start) - np.array(end)).max() < 1e-4


def test_the_view_turns_calmly(moments: np.ndarray, scene: Scene) -> None:
    ahead = moments[:, 1] - moments[:, 0]
    distance = np.sqrt((ahead**2).sum(axis=1))
    assert distance.min() > 2.0
    ahead /= distance[:, None]
    turn = np.degrees(np.arccos(np.clip((ahead * np.roll(ahead, 1, axis=0)).sum(axis=1), -1, 1))) / STEP_S
    assert turn.max() < 14.0, f"{turn.max():.1f} degrees/s at {turn.argmax() * STEP_S:.1f} s"
    assert max(abs(point.roll_deg) for point in scene.flight.eye) <= 8.0
    speed = np.sqrt(((moments[:, 0] - np.roll(moments[:, 0], 1, axis=0)) ** 2).sum(axis=1)) / STEP_S
    assert 0.4 < speed.min() < speed.max() < 6.0  # a walk on the jetty, a glide over the sea


def test_the_flight_tells_its_story_in_order(
    moments: np.ndarray, objects: dict[str, np.ndarray], ground: Any
) -> None:
    eye = moments[:, 0]
    seconds = np.arange(len(eye)) * STEP_S
    jetty, palm = objects["jetty"], objects["palm"]
    x0, x1, z0, z1 = jetty[:, 0].min(), jetty[:, 0].max(), jetty[:, 2].min(), jetty[:, 2].max()
    over_jetty = (eye[:, 0] > x0) & (eye[:, 0] < x1) & (eye[:, 2] > z0) & (eye[:, 2] < z1)
    walk = seconds[over_jetty]
    assert len(walk) * STEP_S > 20.0
    assert np.ptp(walk) < len(walk) * STEP_S + 0.5  # in one go
    assert eye[over_jetty][0, 2] > eye[over_jetty][-1, 2]  # from the sea to the beach
    crown = palm[palm[:, 1] > palm[:, 1].max() - 2.5].mean(axis=0)
    away = eye - crown
    near = np.sqrt(away[:, 0] ** 2 + away[:, 2] ** 2) < 18.0
    below = near & (eye[:, 1] < crown[1] - 2.0)
    around = np.unwrap(np.array([atan2(z, x) for x, z in away[below][:, [0, 2]]]))
    assert abs(around[-1] - around[0]) > 0.75 * pi  # most of the way round the palm, from below
    dune = seconds[eye[:, 1].argmax()]
    assert ground(eye[:, 0], eye[:, 2])[eye[:, 1].argmax()] > 2.0
    far = seconds[np.sqrt((eye[:, [0, 2]] ** 2).sum(axis=1)).argmax()]
    assert walk[-1] < seconds[below].mean() < dune < far
    assert moments[:, 0, 1][seconds < walk[0]].min() < 1.5  # low over the sea towards the jetty


def test_on_the_lagoon_the_water_fills_the_view(flight: Flight, scene: Scene, ground: Any) -> None:
    aspect = scene.head.viewport[0] / scene.head.viewport[1]
    full = []
    for t in np.arange(165.0, 215.0, 0.5):
        eye, directions = rays(flight, t, aspect)
        if directions[:, 1].max() < -1e-3:
            hit = eye - directions * (eye[1] / directions[:, 1])[:, None]
            if ground(hit[:, 0], hit[:, 2]).max() < 0.0:
                full.append(t)
    assert len(full) * 0.5 >= 3.0, f"water alone for {len(full) * 0.5} s"


def test_the_poster_shows_palm_jetty_water_and_sky(
    flight: Flight, scene: Scene, objects: dict[str, np.ndarray], ground: Any
) -> None:
    t = scene.head.poster_s
    aspect = scene.head.viewport[0] / scene.head.viewport[1]
    assert in_view(flight, t, aspect, objects["palm"]).mean() > 0.999
    assert in_view(flight, t, aspect, objects["jetty"]).mean() > 0.95
    eye, directions = rays(flight, t, aspect, grid=25)
    pitch = np.array([degrees(asin(d[1] / sqrt(float((d**2).sum())))) for d in directions])
    assert (pitch > 1.0).mean() > 0.25
    down = directions[pitch < -1.0]
    hit = eye - down * (eye[1] / down[:, 1])[:, None]
    assert (ground(hit[:, 0], hit[:, 2]) < 0.0).mean() > 0.2

"""Moving objects go round an ellipse in whole rounds, rests in its pauses, and is seen as near as it
comes."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.errors import ParadizeError
from paradize.placement import to_world
from paradize.scene.flight import plan_flight
from paradize.scene.motion import all_stands, motion_json, moved, reach_m, stands
from paradize.scene.placement import placed
from paradize.scene.settings import Beat, Instance, Motion, load_scene
from tests.pipeline.scenes import make_cove

STAND = placed(Instance(position=(3.0, 1.0, -2.0), yaw_deg=25.0, pitch_deg=8.0, roll_deg=-5.0, scale=1.5))
GLIDE = Motion(laps=-3, radius_m=(6.0, 4.0), rise_m=0.5, bank_deg=15.0, beat=Beat(per_lap=20, lift_deg=30.0))
WALK = Motion(laps=2, radius_m=(1.2, 0.1), heading="fixed", pauses=5, pause_share=0.4)
ROUND = """
[object.motion]
laps = 2
radius_m = [1.5, 1.0]
"""


def way(motion: Motion, count: int = 2000) -> list[dict[str, Any]]:
    table = motion_json(motion)
    assert table is not None
    return [moved(STAND, table, 4, k / count) for k in range(count + 1)]


def positions(motion: Motion, count: int = 2000) -> np.ndarray:
    return np.array([place["position"] for place in way(motion, count)])


@pytest.mark.parametrize("motion", [GLIDE, WALK])
def test_the_end_of_the_flight_meets_its_beginning(motion: Motion) -> None:
    first, *_, last = way(motion)
    for key in ("position", "rotation", "scale"):
        same = np.abs(np.subtract(first[key], last[key])).max()
        turned = np.abs(np.add(first[key], last[key])).max() if key == "rotation" else math.inf
        assert min(same, turned) < 1e-9


@pytest.mark.parametrize("motion", [GLIDE, WALK, Motion(laps=1, radius_m=(1.0, 5.0), rise_m=0.25)])
def test_it_goes_round_its_ellipse_in_its_own_plane_and_no_farther_than_its_reach(motion: Motion) -> None:
    own = Rotation.from_quat(STAND["rotation"]).inv().apply(positions(motion) - STAND["position"])
    a, b = motion.radius_m
    assert np.abs((own[:, 0] / a) ** 2 + (own[:, 2] / b) ** 2 - 1.0).max() < 1e-9
    assert np.abs(own[:, 1]).max() == pytest.approx(motion.rise_m, abs=1e-4)
    table = motion_json(motion)
    assert table is not None and np.sqrt((own**2).sum(axis=1)).max() <= reach_m(table)
    turns = np.unwrap(np.arctan2(own[:, 2] / b, own[:, 0] / a))
    assert turns[-1] - turns[0] == pytest.approx(2.0 * math.pi * motion.laps)


def test_what_looks_ahead_looks_along_its_way_and_leans_into_the_turn() -> None:
    places = way(GLIDE, 1000)
    for before, now, after in zip(places, places[1:], places[2:], strict=False):
        step = np.subtract(after["position"], before["position"])
        nose, left = Rotation.from_quat(now["rotation"]).apply([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
        up = Rotation.from_quat(STAND["rotation"]).apply([0.0, 1.0, 0.0])
        level = step - up * (step @ up)
        assert nose @ level / np.sqrt(level @ level) > 1.0 - 1e-4
        inwards = np.subtract(STAND["position"], now["position"])
        assert (left @ up) * (left @ inwards) < 0.0  # the wing on the inner side is the lower one


def test_a_crab_keeps_its_direction_and_stands_still_in_its_pauses() -> None:
    places = way(WALK)
    assert all(place["rotation"] == places[0]["rotation"] for place in places)
    steps = np.sqrt((np.diff(positions(WALK), axis=0) ** 2).sum(axis=1))
    still = steps < 1e-12
    assert still.mean() == pytest.approx(WALK.pause_share, abs=0.02)
    begins = sum(bool(now and not before) for before, now in pairwise(still))
    assert begins == pytest.approx(WALK.pauses * WALK.laps, abs=1)
    assert steps.max() < 0.03  # it never jumps


@pytest.mark.parametrize("motion", [GLIDE, WALK])
def test_somewhere_it_stands_for_every_moment_of_its_way(motion: Motion) -> None:
    """A search of all moments: the eye that comes near it comes as near to one of its stands."""
    standing = np.array([one["position"] for one in all_stands([STAND], motion_json(motion))])
    apart = np.sqrt(((positions(motion, 500)[:, None] - standing[None]) ** 2).sum(axis=2)).min(axis=1)
    assert apart.max() < 0.27 + motion.rise_m * 0.1


@pytest.fixture(scope="module")
def cove(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The cove whose posts go round."""
    scene = make_cove(tmp_path_factory.mktemp("cove"))
    scene.write_text(scene.read_text().replace("[[object.instance]]", f"{ROUND}\n[[object.instance]]", 1))
    return scene


def test_required_detail_is_that_of_the_nearest_approach(
    cove: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cove_store: Callable[[Path], Path]
) -> None:
    """Each post's distance at every moment, searched: the levels that are published are fine enough."""
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    report = bake(cove, tmp_path / "out", BuildOptions())
    assert not report.errors
    manifest = json.loads((tmp_path / "out/scene.json").read_text())
    item = manifest["objects"][0]
    flight, scene = plan_flight(load_scene(cove).flight), load_scene(cove)
    assert item["motion"]["laps"] == 2 and item["motion"]["beat"] is None
    assert item["instances"] == [placed(one) for one in scene.objects[0].instances]
    nearest = math.inf
    for k in range(300):
        eye = flight.view(flight.duration_s * k / 300)[0]
        for number, one in enumerate(item["instances"]):
            now = moved(one, item["motion"], number, k / 300)
            middle = to_world(item["center"], now)
            nearest = min(nearest, math.dist(eye, middle) - item["radius_m"] * now["scale"][0])
    standing = min(
        math.dist(flight.view(flight.duration_s * k / 300)[0], to_world(item["center"], one))
        - item["radius_m"] * one["scale"][0]
        for k in range(300)
        for one in stands(scene.objects[0])
    )
    assert standing <= nearest + 0.25


@pytest.mark.parametrize(
    ("wrong", "place"),
    [
        ("laps = 0\nradius_m = [1.0, 1.0]", "object[0].motion.laps"),
        ("laps = 1.5\nradius_m = [1.0, 1.0]", "object[0].motion.laps"),
        ("laps = 1\nradius_m = [1.0, -1.0]", "object[0].motion.radius_m"),
        ("laps = 1\nradius_m = [1.0, 1.0]\npause_share = 1.0", "object[0].motion.pause_share"),
        (
            "laps = 1\nradius_m = [1.0, 1.0]\n[object.motion.beat]\nper_lap = 0",
            "object[0].motion.beat.per_lap",
        ),
    ],
)
def test_a_motion_that_does_not_close_or_is_out_of_range_is_refused(
    cove: Path, wrong: str, place: str
) -> None:
    text = cove.read_text()
    broken = cove.with_name("broken.toml")
    broken.write_text(text.replace(ROUND.strip(), f"[object.motion]\n{wrong}"))
    with pytest.raises(ParadizeError) as caught:
        load_scene(broken)
    errors = getattr(caught.value, "errors", [caught.value])
    assert any(str(error.place).startswith(place) for error in errors), [error.place for error in errors]


def test_wings_turn_about_a_hinge_in_metres_and_so_need_vertices_that_are_no_grid(cove: Path) -> None:
    text = cove.read_text().replace(
        ROUND.strip(), f"quantise = true\n{ROUND}[object.motion.beat]\nper_lap = 3"
    )
    broken = cove.with_name("broken.toml")
    broken.write_text(text)
    with pytest.raises(ParadizeError, match="quantise"):
        load_scene(broken)


def test_the_player_s_own_numbers() -> None:
    """tests/player/scene/test_motion.cpp holds the player to the same."""
    table = motion_json(replace(GLIDE, pauses=4, pause_share=0.25))
    assert table is not None
    now = moved(STAND, table, 3, 0.37)
    assert now["position"] == pytest.approx(EXPECTED_POSITION, abs=1e-9)
    assert now["rotation"] == pytest.approx(EXPECTED_ROTATION, abs=1e-9)


EXPECTED_POSITION = [1.302034768, 1.563553994, -5.577675028]
EXPECTED_ROTATION = [0.070255349, -0.526970406, -0.191482641, 0.825045923]

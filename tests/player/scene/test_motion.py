"""Gulls circle and crabs walk on the baked island, and the moments of play are those of --time."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.pictures import load
from tests.player.passes.test_beat import beating
from tests.player.posed import Posed, Vec, differs
from tests.player.synthetic import write_scene

Player = Callable[..., subprocess.CompletedProcess[str]]
OFF = "sky,shafts,post"  # animals are looked at, and their shadows on the sand


@pytest.fixture(scope="module")
def posed(island: Path, player: Player, tmp_path_factory: pytest.TempPathFactory) -> Posed:
    return Posed(island, player, tmp_path_factory.mktemp("posed"))


def only(posed: Posed, name: str) -> dict[str, Any]:
    """The scene with one kind of animal, and without lamps and what else moves."""
    scene = posed.scene()
    kept = [item for item in scene["objects"] if item["name"] == name]
    for lit in (scene, scene["terrain"], *kept):
        lit.pop("light_sets", None)
    scene.pop("lights", None)
    scene["shadow"]["size"] = 1024
    return scene | {"water": None, "particles": [], "objects": kept}


def moments(posed: Posed, scene: dict[str, Any], eye: Vec, target: Vec, *seconds: float) -> list[Any]:
    return [posed.render(eye, target, scene=scene, time_s=second, disable=OFF) for second in seconds]


def crab_views(posed: Posed) -> tuple[dict[str, Any], Vec, Vec]:
    """One crab from 2 m away."""
    scene = only(posed, "crab")
    item = scene["objects"][0]
    item["instances"] = item["instances"][:1]
    x, y, z = item["instances"][0]["position"]
    return scene, (x + 0.4, y + 0.9, z + 2.4), (x, y, z)


class Walker:
    """The small scene without its sea, its box on an ellipse with two stops a lap, the eye at one place."""

    def __init__(self, folder: Path, player: Player) -> None:
        none = {"particles": [], "water": None, "reflection": None, "refraction": None}
        self.folder, self.player = write_scene(folder, **none), player
        self.scene = json.loads((folder / "scene.json").read_text())
        path = {"beat": None, "laps": 2, "radius_m": [1.5, 1.0], "pauses": 2, "pause_share": 0.4}
        self.scene["objects"][0]["motion"] = beating() | path
        self.leg_s = self.scene["flight"]["duration_s"] / 4
        self.stop_s = 0.4 * self.leg_s
        for segment in self.scene["flight"]["segments"]:
            segment["eye"] = [[v, 0.0, 0.0, 0.0] for v in (3.0, 4.0, 9.0)]
            segment["target"] = [[v, 0.0, 0.0, 0.0] for v in (0.0, 0.5, 0.0)]

    def shown(self, second: float, *options: object, file: str = "a.png") -> NDArray[np.float32]:
        (self.folder / "scene.json").write_text(json.dumps(self.scene))
        arguments = ("--time", second, "--disable", OFF, "--screenshot", self.folder / "a.png", *options)
        done = self.player(self.folder, *arguments)
        assert done.returncode == 0, done.stderr
        return load(self.folder / file)


@pytest.fixture
def walker(player: Player, tmp_path: Path) -> Walker:
    return Walker(tmp_path / "scene", player)


def test_a_box_walks_with_its_shadow_and_stops(walker: Walker) -> None:
    first_s, then_s = (walker.stop_s + share * (walker.leg_s - walker.stop_s) for share in (0.4, 0.7))
    assert not differs(walker.shown(0.1), walker.shown(walker.stop_s - 0.1)).any()
    assert differs(walker.shown(first_s), walker.shown(then_s)).mean() > 0.02
    walker.scene["objects"][0]["views"] = ["shadow"]
    assert differs(walker.shown(first_s), walker.shown(then_s)).mean() > 0.005


def test_a_moment_in_play_is_the_moment_by_itself(walker: Walker) -> None:
    second = walker.stop_s + 0.5 * (walker.leg_s - walker.stop_s)
    alone, before = walker.shown(second + 3 / 30), walker.shown(second)
    last = walker.shown(second, "--wait-resident", "--frames", 4, file="a_0003.png")
    assert (np.abs(last - alone).max(axis=2) > 3 / 255).mean() < 1e-3
    assert differs(alone, before).mean() > 0.002


@pytest.mark.deep
def test_a_crab_walks_with_its_shadow_and_stops(posed: Posed) -> None:
    scene, eye, target = crab_views(posed)
    duration_s, motion = scene["flight"]["duration_s"], scene["objects"][0]["motion"]
    leg_s = duration_s / motion["laps"] / motion["pauses"]
    stop_s = motion["pause_share"] * leg_s
    halted = moments(posed, scene, eye, target, 0.1, stop_s - 0.1)
    assert not differs(*halted).any()
    walking = moments(
        posed, scene, eye, target, stop_s + 0.4 * (leg_s - stop_s), stop_s + 0.7 * (leg_s - stop_s)
    )
    assert differs(*walking).mean() > 0.002
    scene["objects"][0]["views"] = ["shadow"]
    shadows = moments(
        posed, scene, eye, target, stop_s + 0.4 * (leg_s - stop_s), stop_s + 0.7 * (leg_s - stop_s)
    )
    assert differs(*shadows).mean() > 0.0005


@pytest.mark.deep
def test_its_legs_step_and_without_a_beat_they_are_stiff(posed: Posed) -> None:
    """Compared in the crab's own place: the same moment with and without the beat."""
    scene, eye, target = crab_views(posed)
    scene["objects"][0]["motion"] |= {"pauses": 0, "radius_m": [0.0, 0.0]}
    assert differs(*moments(posed, scene, eye, target, 1.0, 1.2)).any()
    scene["objects"][0]["motion"]["beat"] = None
    assert not differs(*moments(posed, scene, eye, target, 1.0, 1.2)).any()


@pytest.mark.deep
def test_a_gull_flaps_and_glides(posed: Posed) -> None:
    scene = only(posed, "gull")
    item = scene["objects"][0]
    item["instances"] = item["instances"][:1]
    item["motion"] |= {"radius_m": [0.0, 0.0], "rise_m": 0.0, "ahead": False}
    x, y, z = item["instances"][0]["position"]
    eye, target = (x + 2.5, y + 1.0, z + 2.5), (x, y, z)
    motion = item["motion"]
    lap_s = scene["flight"]["duration_s"] / motion["laps"]
    beat = motion["beat"]
    glide_s = beat["glide_share"] * lap_s / beat["glides"]
    assert not differs(*moments(posed, scene, eye, target, 0.4 * glide_s, 0.6 * glide_s)).any()
    beat_s = lap_s / beat["per_lap"]
    flapping = moments(posed, scene, eye, target, 1.6 * glide_s, 1.6 * glide_s + 0.5 * beat_s)
    assert differs(*flapping).mean() > 0.004


@pytest.mark.deep
def test_the_flight_shows_a_crab_a_gull_and_the_bar(posed: Posed, player: Player, tmp_path: Path) -> None:
    """At 46 s: a crab on the sand below, a gull in the sky on the left, the bar at the right edge."""
    scene = posed.scene()
    for file in posed.source.iterdir():
        (tmp_path / file.name).symlink_to(file)
    (tmp_path / "scene.json").unlink()
    shown = []
    for left_out in ((), ("crab", "gull", "bar")):
        kept = [item for item in scene["objects"] if item["name"] not in left_out]
        (tmp_path / "scene.json").write_text(json.dumps(scene | {"objects": kept, "particles": []}))
        picture = tmp_path / "shown.png"
        done = player(tmp_path, "--time", 46, "--size", "640x360", "--screenshot", picture)
        assert done.returncode == 0, done.stderr
        shown.append(load(picture))
    changed: NDArray[np.bool_] = np.abs(shown[0] - shown[1]).max(axis=2) > 6 / 255
    gull, crab, bar = changed[:90, :320], changed[290:, :400], changed[90:220, 580:]
    assert gull.sum() > 20 and crab.sum() > 150 and bar.sum() > 1000, (gull.sum(), crab.sum(), bar.sum())


@pytest.mark.deep
def test_a_moment_in_play_of_the_island_is_the_moment_by_itself(
    posed: Posed, player: Player, tmp_path: Path
) -> None:
    """Crabs walk through the view; their shadows go in steps of a tenth of a second."""
    for artifact in posed.scene()["artifacts"].values():
        (tmp_path / artifact["file"]).symlink_to(posed.source / artifact["file"])
    (tmp_path / "scene.json").write_text(json.dumps(only(posed, "crab")))
    common = ("--wait-resident", "--size", "320x180")
    play = (*common, "--frames", 4, "--time", 45.9)
    assert player(tmp_path, *play, "--screenshot", tmp_path / "play.png").returncode == 0
    alone = (*common, "--frames", 1, "--time", 45.9 + 3 / 30)
    assert player(tmp_path, *alone, "--screenshot", tmp_path / "alone.png").returncode == 0
    last, one = load(tmp_path / "play_0003.png"), load(next(tmp_path.glob("alone*.png")))
    assert (np.abs(last - one).max(axis=2) > 3 / 255).mean() < 1e-4

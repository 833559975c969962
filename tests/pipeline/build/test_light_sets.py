"""The lights of each draw call are those that reach it, no more and no fewer."""

from __future__ import annotations

from math import cos, dist, pi, sin
from pathlib import Path
from typing import Any

import pytest

from paradize.build.light_sets import add_light_sets, light_entries
from paradize.errors import GroupedError, SceneError
from paradize.placement import to_world
from paradize.player_limits import MOST_LIGHTS_OF_A_SET
from paradize.scene.motion import motion_json, moved
from paradize.scene.settings import Motion, Scene, load_scene
from tests.pipeline.scenes import make_cove

UPRIGHT = {"rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0]}


def light(x: float, y: float, z: float, range_m: float = 3.0, intensity: float = 1.0) -> dict[str, Any]:
    return {
        "position": [x, y, z],
        "range_m": range_m,
        "intensity": intensity,
        "color": [1.0, 0.5, 0.2],
        "radius_m": 0.05,
    }


def crate(
    *positions: list[float], scale: float = 1.0, sway: dict[str, float] | None = None
) -> dict[str, Any]:
    """An object with a bounding sphere of 0.5 m round (0, 1, 0)."""
    stands = [UPRIGHT | {"position": at, "scale": [scale, 0.5 * scale, scale]} for at in positions]
    still = {"sway": sway, "motion": None}
    return {"name": "crate", "center": [0.0, 1.0, 0.0], "radius_m": 0.5, "instances": stands} | still


def manifest(lights: list[dict[str, Any]], *objects: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"lights": lights, "objects": list(objects), "terrain": None, "water": None} | more


def lists(scene: dict[str, Any], indices: list[int]) -> list[list[int]]:
    return [scene["light_sets"][index]["lights"] for index in indices]


def test_lists_of_instances_and_patches_are_those_of_brute_force() -> None:
    lights = [light(1.7 * i, 0.4 * (i % 4), 2.3 * (i % 5), 2.0 + 0.3 * (i % 3)) for i in range(12)]
    crates = crate(*([1.3 * i, -1.0 + 0.2 * i, 9.0 - 0.8 * i] for i in range(20)), scale=2.0)
    patches = {
        "center": [[2.0 * i, 0.0, 1.5 * j] for i in range(12) for j in range(8)],
        "radius_m": [0.3 + 0.01 * i for i in range(96)],
    }
    scene = manifest(lights, crates, terrain={"patches": patches})
    assert add_light_sets(scene, {}) == []
    spheres = [(to_world(crates["center"], one), 1.0) for one in crates["instances"]]
    spheres += list(zip(patches["center"], patches["radius_m"], strict=True))
    expected = [
        [i for i, one in enumerate(lights) if dist(one["position"], center) - radius < one["range_m"]]
        for center, radius in spheres
    ]
    found = lists(scene, crates["light_sets"]) + lists(scene, scene["terrain"]["light_sets"])
    assert found == expected
    assert {len(one) for one in found} >= {0, 1, 2}, "the case is too simple"
    keys = [(tuple(one["lights"]), one["glow"]) for one in scene["light_sets"]]
    assert len(set(keys)) == len(keys) and keys[0] == ((), None)


def test_wind_brings_an_object_nearer_to_a_light() -> None:
    still, swaying = (
        manifest([light(0.0, 1.0, 3.9)], crate([0.0, 0.5, 0.0], sway=sway))
        for sway in (None, {"lean_m": 0.5, "flutter_m": 0.1})
    )
    add_light_sets(still, {})
    add_light_sets(swaying, {})
    assert "light_sets" not in still["objects"][0]
    assert lists(swaying, swaying["objects"][0]["light_sets"]) == [[0]]


def test_a_moving_mesh_off_its_origin_has_every_light_that_it_passes() -> None:
    lights = [light(4.5 * cos(k * pi / 6), 0.0, 4.5 * sin(k * pi / 6)) for k in range(12)]
    motion = motion_json(Motion(laps=1, radius_m=(1.0, 2.0)))
    assert motion is not None
    item = crate([0.0, 0.0, 0.0]) | {"center": [3.0, 0.0, 0.0], "motion": motion}
    scene = manifest(lights, item)
    add_light_sets(scene, {})
    way = [to_world(item["center"], moved(item["instances"][0], motion, 0, k / 100)) for k in range(100)]
    passed = [k for k, one in enumerate(lights) if min(dist(one["position"], at) for at in way) < 3.5]
    (found,) = lists(scene, item["light_sets"])
    assert len(passed) > 6 and set(found) >= set(passed)


def test_the_water_has_the_lights_whose_spheres_cross_its_level() -> None:
    water = {"level_m": 1.0}
    scene = manifest([light(900.0, 3.9, 0.0), light(0.0, 4.1, 0.0), light(0.0, -1.5, 0.0)], water=water)
    add_light_sets(scene, {})
    assert lists(scene, [water["light_set"]]) == [[0, 2]]


def test_a_glowing_instance_has_a_set_of_its_own_and_others_share() -> None:
    scene = manifest([light(0.0, 1.0, 0.0), light(0.0, 1.0, 0.1)], crate([0.0, 0.0, 0.0], [0.1, 0.0, 0.0]))
    add_light_sets(scene, {"crate": [1, 0]})
    sets = [scene["light_sets"][index] for index in scene["objects"][0]["light_sets"]]
    assert sets == [{"lights": [0, 1], "glow": 1}, {"lights": [0, 1], "glow": 0}]


def test_of_too_many_lights_the_strongest_stay_and_a_warning_says_so() -> None:
    lights = [light(0.0, 1.0, 0.9 + 0.01 * i, intensity=9.0 if i == 19 else 1.0) for i in range(20)]
    scene = manifest(lights, crate([0.0, 0.0, 0.0]))
    (warning,) = add_light_sets(scene, {})
    assert "20 reach the object crate" in warning and str(MOST_LIGHTS_OF_A_SET) in warning
    (kept,) = lists(scene, scene["objects"][0]["light_sets"])
    assert kept == [*range(MOST_LIGHTS_OF_A_SET - 1), 19]


def test_as_many_sets_as_the_player_takes_are_no_fault_and_one_more_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("paradize.build.light_sets.MOST_LIGHT_SETS", 4)  # one of them without a light
    lights = [light(9.0 * i, 1.0, 0.0) for i in range(4)]
    places = [[9.0 * i, 0.0, 0.0] for i in range(4)]
    scene = manifest(lights, crate(*places[:3]))
    assert add_light_sets(scene, {}) == []
    assert lists(scene, scene["objects"][0]["light_sets"]) == [[0], [1], [2]]
    scene = manifest(lights, crate(*places))
    (warning,) = add_light_sets(scene, {})
    assert "more than 4 sets" in warning
    assert lists(scene, scene["objects"][0]["light_sets"]) == [[0], [1], [2], []]


def scene_with(folder: Path, lights: str) -> Scene:
    path = make_cove(folder)
    path.write_text(path.read_text() + lights)
    return load_scene(path)


def test_a_light_of_an_object_stands_at_each_instance_and_each_later_than_the_one_before(
    tmp_path: Path,
) -> None:
    """The last of two goes on 0.5 s after the first, and 0.25 s before all go off."""
    scene = scene_with(
        tmp_path,
        '\n[[light]]\nname = "lamp"\nobject = "post"\noffset = [0.0, 2.0, 0.0]\non_s = 1.0\noff_s = 1.75\n'
        "step_s = 0.5\n",
    )
    post = next(item for item in scene.objects if item.name == "post")
    entries, glow = light_entries(scene)
    assert len(entries) == len(post.instances)
    assert glow == {"post": list(range(len(entries)))}
    for k, (entry, instance) in enumerate(zip(entries, post.instances, strict=True)):
        assert entry["hours"] == {"on_s": 1.0 + 0.5 * k, "off_s": 1.75}
        if not (instance.pitch_deg or instance.roll_deg) and instance.scale == 1.0:
            x, y, z = instance.position
            assert entry["position"] == pytest.approx([x, y + 2.0, z])


@pytest.mark.parametrize(
    ("fields", "problem"),
    [
        ("", "has neither position nor object"),
        ('position = [0.0, 1.0, 0.0]\nobject = "post"', "has position and object"),
        ('object = "pine"', "'pine' is not an object"),
        ("position = [0.0, 1.0, 0.0]\non_s = 1.0", "stands without off_s"),
        ("position = [0.0, 1.0, 0.0]\non_s = 1.0\noff_s = 5000.0", "is 5000"),
        ("position = [0.0, 1.0, 0.0]\nstep_s = 1.0", "is 1"),
        ('object = "post"\non_s = 1.0\noff_s = 1.5\nstep_s = 0.5', "the last of"),
        ("position = [0.0, 1.0, 0.0]\non_s = 1.0\noff_s = 0.5\nfade_s = 30.0", "is 30"),
    ],
)
def test_a_light_that_cannot_be_meant_so_is_refused_with_its_place(
    tmp_path: Path, fields: str, problem: str
) -> None:
    with pytest.raises((SceneError, GroupedError), match=r"light\[0\]") as caught:
        scene_with(tmp_path, f'\n[[light]]\nname = "lamp"\n{fields}\n')
    assert problem in str(caught.value)

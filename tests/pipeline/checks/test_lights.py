"""`check` finds lights that do nothing, and sets that lack one."""

from __future__ import annotations

from typing import Any

from paradize.build.light_sets import add_light_sets
from paradize.checks.lights import check_lights


def light(x: float, **changes: Any) -> dict[str, Any]:
    return {
        "name": f"lamp{x:g}",
        "position": [x, 1.0, 0.0],
        "color": [1.0, 0.5, 0.2],
        "intensity": 2.0,
        "radius_m": 0.05,
        "range_m": 3.0,
        "hours": {"on_s": 3.0, "off_s": 5.0},
        "fade_s": 1.0,
        "flicker": 0.0,
    } | changes


def scene(*lights: dict[str, Any]) -> dict[str, Any]:
    """Two crates, ten metres apart, on a patch of ground that lies far away."""
    stand = {"rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0]}
    crates = {
        "name": "crate",
        "center": [0.0, 0.5, 0.0],
        "radius_m": 0.8,
        "sway": None,
        "motion": None,
        "instances": [stand | {"position": [x, 0.0, 0.0]} for x in (0.0, 10.0)],
    }
    patches = {"center": [[0.0, -50.0, 0.0]], "radius_m": [5.0]}
    found = {
        "lights": list(lights),
        "objects": [crates],
        "terrain": {"patches": patches},
        "water": {"level_m": -9.0},
    }
    add_light_sets(found, {})
    return found


def codes(manifest: dict[str, Any]) -> list[tuple[str, str]]:
    return [(finding.code, finding.place) for finding in check_lights(manifest, "scene.json")]


def test_a_scene_whose_lights_are_on_and_reach_something_has_no_findings() -> None:
    assert codes(scene(light(0.0), light(11.0, hours=None))) == []
    assert codes({"objects": [], "terrain": None, "water": None}) == []


def test_a_light_that_reaches_nothing_is_found() -> None:
    assert codes(scene(light(0.0), light(5.0, range_m=0.5))) == [("PZ424", "lights[1]")]


def test_a_light_deep_under_water_does_not_reach_it() -> None:
    deep = light(30.0, position=[30.0, -59.0, 0.0])  # 50 m below the water
    assert codes(scene(light(0.0), deep)) == [("PZ424", "lights[1]")]


def test_a_light_that_is_never_on_is_found() -> None:
    never = [
        light(0.0, intensity=0.0),
        light(1.0, color=[0.0] * 3),
        light(2.0, hours={"on_s": 4.0, "off_s": 4.0}),
    ]
    assert codes(scene(*never)) == [("PZ425", f"lights[{k}]") for k in range(3)]


def test_a_set_that_lacks_a_light_which_reaches_is_found() -> None:
    manifest = scene(light(0.0), light(10.0))
    manifest["objects"][0]["light_sets"][1] = 0
    assert codes(manifest) == [("PZ426", "objects[0].light_sets[1]")]

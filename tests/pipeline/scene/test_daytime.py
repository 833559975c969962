"""Keys of the light: what they require, when it is needed, and which are refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from paradize.errors import GroupedError, SceneError
from paradize.scene.daytime import key_skies, standing_light
from paradize.scene.map_sets import SceneMaps
from paradize.scene.requirements import require
from paradize.scene.settings import load_scene
from tests.pipeline.scenes import SCENE, make_cove

DAY, NIGHT = (
    "faces = [" + ", ".join(f'"{start}{end}.exr"' for end in ("px", "nx", "py", "ny", "pz", "nz")) + "]"
    for start in ("", "night_")
)
KEYS = f"""
[[daytime]]
at_s = 1.0
exposure = 0.8
[[daytime]]
at_s = 3.0
sun = {{ elevation_deg = -5.0, intensity = 0.0 }}
{NIGHT}
[[daytime]]
at_s = 5.0
sun = {{ elevation_deg = -9.0, intensity = 0.0 }}
moon = {{ intensity = 0.3 }}
{NIGHT}
[[daytime]]
at_s = 7.0
sun = {{ elevation_deg = -5.0, intensity = 0.0 }}
"""


@pytest.fixture
def load(tmp_path: Path) -> Any:
    make_cove(tmp_path)
    for name in ("px", "nx", "py", "ny", "pz", "nz"):
        (tmp_path / f"night_{name}.exr").write_bytes((tmp_path / f"{name}.exr").read_bytes())
    (tmp_path / "clouds.png").write_bytes((tmp_path / "sand.png").read_bytes())

    def write(keys: str, before: str = SCENE) -> Any:
        (tmp_path / "scene.toml").write_text(before + keys)
        return load_scene(tmp_path / "scene.toml")

    return write


def faults(load: Any, keys: str, before: str = SCENE) -> str:
    with pytest.raises((SceneError, GroupedError)) as caught:
        load(keys, before)
    return str(caught.value)


def test_each_sky_is_baked_once_and_needed_from_the_key_before_its_own(load: Any) -> None:
    scene = load(KEYS + '[clouds]\npicture = "clouds.png"\n')
    day, night = key_skies(scene)
    assert (day.name, day.keys, day.spans_s) == ("sky", (0, 3), ((7.0, 3.0), (5.0, 1.0)))
    assert day.first_s == 0.0  # from the last key over the flight's end
    assert (night.name, night.keys, night.first_s) == ("sky_2", (1, 2), 1.0)
    outputs = {
        out.artifact: out
        for job in require(replace(scene, objects=()), SceneMaps([], {}, {})).jobs
        for out in job.outputs
    }
    assert outputs["sky_2"].reason == "the sky and the water's mirror from 1 s to 5 s and from 3 s to 7 s"
    assert outputs["sky_2"].passes == ("environment", "sky")
    assert outputs["clouds_color"].passes == ("environment", "sky")


def test_two_keys_need_both_skies_from_the_first_frame(load: Any) -> None:
    keys = f"[[daytime]]\nat_s = 1.0\n[[daytime]]\nat_s = 5.0\n{NIGHT}\n"
    assert [(sky.name, sky.first_s) for sky in key_skies(load(keys))] == [("sky", 0.0), ("sky_2", 0.0)]


def test_without_keys_the_sky_is_what_it_was(load: Any) -> None:
    scene = load("")
    assert [(sky.name, sky.first_s) for sky in key_skies(scene)] == [("sky", 0.0)]
    assert standing_light(scene) is scene


def test_a_fixed_moment_is_lit_as_at_the_key_nearest_to_the_poster(load: Any) -> None:
    mist = "ambient = { intensity = 0.25 }\nfog = { density_per_m = 0.125, color = [1.0, 0.5, 0.25] }\n"
    lit = KEYS.replace("exposure = 0.8\n", "exposure = 0.8\n" + mist)
    standing = standing_light(load(lit))  # poster_s = 2: the first of two equally near
    assert standing.head.exposure == 0.8
    assert standing.sun.intensity == 3.0
    assert standing.ambient.intensity == 0.25
    assert (standing.fog.density_per_m, standing.fog.color) == (0.125, (1.0, 0.5, 0.25))


def test_keys_that_cannot_be_played_are_refused_with_their_place(load: Any) -> None:
    one = "[[daytime]]\nat_s = 1.0\n"
    assert "daytime: has one key" in faults(load, one)
    assert "daytime[1].at_s: is 1" in faults(load, one + one)
    assert "daytime[1].at_s: is 8" in faults(load, one + "[[daytime]]\nat_s = 8.0\n")
    moon = "[[daytime]]\nat_s = 4.0\nmoon = { intensity = 0.3 }\n"
    assert "only one of them casts shadows" in faults(load, one + moon)
    assert "clouds: stands without [[daytime]]" in faults(load, '[clouds]\npicture = "clouds.png"\n')
    no_sky = SCENE.replace("[sky]\n" + DAY, "")
    assert "[sky]" not in no_sky
    assert "daytime[0].faces: is missing" in faults(load, one + "[[daytime]]\nat_s = 4.0\n", no_sky)
    own = "".join(f"[[daytime]]\nat_s = {second}.0\n{NIGHT}\n" for second in (1, 4))
    assert "sky: is shown by no key" in faults(load, own)


def test_light_shafts_without_the_shadows_that_they_show_are_refused(load: Any) -> None:
    shadow, shafts = "[shadow]\nsize = 256\nextent_m = 20.0\n", "[light_shafts]\nrange_m = 30.0\n"
    assert load(shafts).light_shafts.range_m == 30.0
    dark = SCENE.replace(shadow, "")
    assert dark != SCENE
    assert "light_shafts: stands without [shadow]" in faults(load, shafts, dark)

"""Each of these effects is seen at a moment of the island's flight: so many pixels differ without it.

The others have their poses: wind, near waves, ripples, swash, caustics, relief, shafts, lamps and animals, in
files of their names.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.pictures import load
from tests.player.posed import Picture, differs

SIZE, LARGE = "192x108", "640x360"  # large where a map's relief is finer than a pixel of the other
FAINT = 3.5 / 255.0
UNSHADED = "particles,shadow"  # shadows of all the grass take more time than the rest of a picture
# Effects that no setting turns off are cut out of a shader: file, its words, and their replacement.
NO_STARS = ("daytime_sky.frag", "color += stars(", "color += 0.0 * stars(")
ONE_SCALE_OF_SAND = ("terrain.frag", "    return s;\n", "    return SandScale(1.0, 1.0, 0.0);\n")
Change = Callable[[dict[str, Any]], Any]


@pytest.fixture(scope="module")
def moment(island: Path, player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The picture at a second of the flight, with a change of scene.json or of a shader."""
    kept: dict[tuple[float, str, str], Picture] = {}

    def render(
        second: float,
        change: Change | None = None,
        shader: tuple[str, str, str] | None = None,
        size: str = SIZE,
        disable: str = "particles",
    ) -> Any:
        if change is None and shader is None and (second, size, disable) in kept:
            return kept[second, size, disable]
        folder = tmp_path_factory.mktemp("moment")
        manifest = json.loads((island / "scene.json").read_text())
        if change:
            change(manifest)
        for artifact in manifest["artifacts"].values():
            (folder / artifact["file"]).symlink_to((island / artifact["file"]).resolve())
        (folder / "scene.json").write_text(json.dumps(manifest))
        environment = {}
        if shader:
            name, words, instead = shader
            shutil.copytree(ROOT / "shaders", folder / "shaders")
            text = (folder / "shaders" / name).read_text()
            assert text.count(words) == 1
            (folder / "shaders" / name).write_text(text.replace(words, instead))
            environment["PARADIZE_SHADERS"] = str(folder / "shaders")
        out = folder / "picture.png"
        arguments = ("--time", second, "--size", size, "--screenshot", out, "--disable", disable)
        result = player(folder, *arguments, env=environment)
        assert result.returncode == 0, result.stderr
        picture = load(out)
        if change is None and shader is None:
            kept[second, size, disable] = picture
        return picture

    return render


def item(scene: dict[str, Any], name: str) -> dict[str, Any]:
    """The object of a scene.json that has the name."""
    found: dict[str, Any] = next(one for one in scene["objects"] if one["name"] == name)
    return found


@pytest.mark.deep
def test_clouds_stand_over_the_sea(moment: Any) -> None:
    assert differs(moment(20.0), moment(20.0, lambda one: one["daytime"].update(clouds=None))).mean() > 0.05


@pytest.mark.deep
def test_stars_stand_in_the_sky_of_the_night(moment: Any) -> None:
    changed = differs(moment(198.0), moment(198.0, shader=NO_STARS))
    assert 0.002 < changed[:48].mean() < 0.2


@pytest.mark.deep
def test_the_moon_glitters_on_the_lagoon(moment: Any) -> None:
    """Without the lamps, which glitter too."""

    def unlit(one: dict[str, Any]) -> None:
        for light in one["lights"]:
            light["intensity"] = 0.0

    def dull(one: dict[str, Any]) -> None:
        unlit(one)
        one["water"]["specular"] = 0.0

    seen, without = moment(205.0, unlit), moment(205.0, dull)
    changed = differs(seen, without, 20.0 / 255.0)
    assert changed.mean() > 0.04
    assert seen[changed].mean() > without[changed].mean() + 0.1


@pytest.mark.deep
def test_beams_rise_from_the_lamps(moment: Any) -> None:
    def without(one: dict[str, Any]) -> None:
        for light in one["lights"]:
            light["beam_m"] = 0.0

    changed = differs(moment(214.0), moment(214.0, without))
    assert 0.004 < changed[:54].mean() < 0.2


@pytest.mark.deep
def test_mosquitoes_are_seen_round_their_lamp(moment: Any) -> None:
    def without(one: dict[str, Any]) -> None:
        one["particles"] = [field for field in one["particles"] if field["motion"] != "swarm"]

    seen, bare = (moment(214.0, change, size=LARGE, disable="shadow") for change in (None, without))
    changed = differs(seen, bare)
    rows, columns = changed.nonzero()
    assert changed.sum() > 100
    assert np.ptp(rows) < 160 and np.ptp(columns) < 160, "one swarm"


@pytest.mark.deep
def test_starfish_are_seen_on_the_floor_of_the_lagoon(moment: Any) -> None:
    def without(one: dict[str, Any]) -> None:
        one["objects"].remove(item(one, "starfish"))

    seen, bare = (moment(183.0, change, disable=UNSHADED) for change in (None, without))
    assert differs(seen, bare).mean() > 0.003


@pytest.mark.deep
def test_pebbles_are_seen_on_the_beach(moment: Any) -> None:
    def without(one: dict[str, Any]) -> None:
        one["objects"].remove(item(one, "pebbles"))

    seen, bare = (moment(50.0, change, size=LARGE, disable=UNSHADED) for change in (None, without))
    assert differs(seen, bare).mean() > 0.001


@pytest.mark.deep
@pytest.mark.parametrize(("name", "second", "pixels"), [("crab", 50.0, 300), ("gull", 113.0, 60)])
def test_animals_show_their_maps(moment: Any, name: str, second: float, pixels: int) -> None:
    """Not one colour, and not that of another animal: its pixels with the map differ from those without."""

    def plain(one: dict[str, Any]) -> None:
        for material in item(one, name)["materials"].values():
            material["maps"]["color"] = None

    def without(one: dict[str, Any]) -> None:
        one["objects"].remove(item(one, name))

    seen = moment(second, size=LARGE)
    animal = differs(seen, moment(second, without, size=LARGE), FAINT)
    changed = differs(seen, moment(second, plain, size=LARGE), FAINT) & animal
    assert animal.sum() > pixels and changed.sum() > 0.5 * animal.sum(), (animal.sum(), changed.sum())


@pytest.mark.deep
def test_grass_leans_in_the_wind(moment: Any) -> None:
    def calm(one: dict[str, Any]) -> None:
        for name in ("grass", "far_grass"):
            item(one, name)["sway"] = None

    seen, still = (moment(156.0, change, disable=UNSHADED) for change in (None, calm))
    assert differs(seen, still).mean() > 0.01


@pytest.mark.deep
def test_the_palm_s_bark_has_relief(moment: Any) -> None:
    def smooth(one: dict[str, Any]) -> None:
        for material in item(one, "palm")["materials"].values():
            material["maps"]["normal"] = None

    def without(one: dict[str, Any]) -> None:
        one["objects"].remove(item(one, "palm"))

    seen = moment(97.0, size=LARGE)
    palm = differs(seen, moment(97.0, without, size=LARGE))
    changed = differs(seen, moment(97.0, smooth, size=LARGE), FAINT)
    assert (changed & palm).sum() > 0.05 * palm.sum()


@pytest.mark.deep
@pytest.mark.parametrize(("kind", "share"), [("normal", 0.05), ("height", 0.15)])
def test_the_jetty_s_wood_has_relief(moment: Any, kind: str, share: float) -> None:
    def smooth(one: dict[str, Any]) -> None:
        for material in item(one, "jetty")["materials"].values():
            material["maps"][kind] = None

    def without(one: dict[str, Any]) -> None:
        one["objects"].remove(item(one, "jetty"))

    seen = moment(27.0, size=LARGE)
    jetty = differs(seen, moment(27.0, without, size=LARGE))
    changed = differs(seen, moment(27.0, smooth, size=LARGE), FAINT)
    assert (changed & jetty).sum() > share * jetty.sum(), (changed & jetty).sum() / jetty.sum()


@pytest.mark.deep
def test_waves_break_up_the_mirror_image_of_the_island(moment: Any) -> None:
    def calm(one: dict[str, Any]) -> None:
        one["water"]["reflection_distortion"] = 0.0

    seen = moment(113.0, size=LARGE)
    assert differs(seen, moment(113.0, calm, size=LARGE), FAINT).mean() > 0.02


@pytest.mark.deep
def test_the_sand_has_relief_near_the_eye_and_far_away(moment: Any) -> None:
    def smooth(one: dict[str, Any]) -> None:
        one["terrain"]["sand_normal"] = ""

    seen = moment(148.0, size=LARGE)
    assert differs(seen, moment(148.0, smooth, size=LARGE), FAINT).mean() > 0.05
    # Without the scales for far away, grains and lumps blur where pixels cover many.
    one_scale = differs(seen, moment(148.0, shader=ONE_SCALE_OF_SAND, size=LARGE), FAINT)
    assert one_scale.mean() > 0.01


def test_the_jetty_s_grain_is_filtered_as_far_as_the_flight_sees_it(island: Path) -> None:
    """Mips that end earlier break up under the lamps, which graze its beams."""
    artifacts = json.loads((island / "scene.json").read_text())["artifacts"]
    last = [artifacts[f"jetty_{name}"] for name in ("color", "normal", "height")]
    for one in last:
        assert one["max_level"] is None or one["max_level"] >= one["gutter"]["level_in_use"]

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


# objects, a second at which they are seen, and the least share of its pixels; `make test` looks at one second
SEEN = [
    pytest.param(("boat",), 50.0, 0.02, id="boat"),
    pytest.param(("pebbles",), 50.0, 0.001, id="pebbles"),
    pytest.param(("shell",), 40.0, 0.001, id="shells", marks=pytest.mark.deep),
    pytest.param(("log", "branch"), 44.0, 0.001, id="driftwood", marks=pytest.mark.deep),
    pytest.param(("bar", "things"), 36.0, 0.01, id="bar", marks=pytest.mark.deep),
    pytest.param(("tall", "leaning", "young"), 137.0, 0.05, id="grove", marks=pytest.mark.deep),
    pytest.param(("grass", "far_grass"), 156.0, 0.005, id="grass", marks=pytest.mark.deep),
    pytest.param(("bush", "fan"), 156.0, 0.01, id="shrubs", marks=pytest.mark.deep),
    pytest.param(("boulder", "slab"), 118.0, 0.004, id="rocks", marks=pytest.mark.deep),
    pytest.param(("starfish",), 183.0, 0.003, id="starfish", marks=pytest.mark.deep),
    pytest.param(("fish",), 183.0, 0.001, id="fish", marks=pytest.mark.deep),
]


@pytest.mark.parametrize(("names", "second", "share"), SEEN)
def test_what_lives_or_lies_on_the_island_is_seen(
    moment: Any, names: tuple[str, ...], second: float, share: float
) -> None:
    def without(one: dict[str, Any]) -> None:
        for name in names:
            one["objects"].remove(item(one, name))

    seen, bare = (moment(second, change, size=LARGE, disable=UNSHADED) for change in (None, without))
    assert differs(seen, bare).mean() > share, differs(seen, bare).mean()


@pytest.mark.deep
@pytest.mark.parametrize(("second", "share"), [(137.0, 0.02), (153.0, 0.06)])
def test_the_grove_sways(moment: Any, second: float, share: float) -> None:
    def calm(one: dict[str, Any]) -> None:
        for name in ("tall", "leaning", "young"):
            item(one, name)["sway"] = None

    seen, still = (moment(second, change, size=LARGE, disable=UNSHADED) for change in (None, calm))
    assert differs(seen, still).mean() > share


@pytest.mark.deep
def test_clouds_have_drifted_by_noon(moment: Any) -> None:
    def still(one: dict[str, Any]) -> None:
        one["daytime"]["clouds"]["drift_repeats"] = 0

    assert differs(moment(60.0), moment(60.0, still)).mean() > 0.02


@pytest.mark.deep
def test_the_beach_is_wet_along_the_sea(moment: Any) -> None:
    def dry(one: dict[str, Any]) -> None:
        one["terrain"] |= {"wet_darkness": 0.0, "wet_smoothness": one["terrain"]["smoothness"]}

    assert differs(moment(44.0), moment(44.0, dry)).mean() > 0.05


@pytest.mark.deep
@pytest.mark.parametrize("second", [177.0, 179.0, 181.0])
def test_the_horizon_at_dusk_is_no_dark_strip(moment: Any, second: float) -> None:
    """Haze, which covers the far sea, hardly darkens it: nearer waves are at most 0.055 brighter."""
    rows = moment(second, size=LARGE)[:140, 40:400].mean(axis=(1, 2))  # beside the islet
    horizon = int(np.diff(rows[:80]).argmin())
    strip = horizon + int(rows[horizon : horizon + 14].argmin())
    assert rows[strip : strip + 30].max() - rows[strip] < 0.055


@pytest.mark.deep
def test_lamps_have_gone_on_one_after_the_other(moment: Any) -> None:
    """Three are lit, and the others not yet; all at once, each of the others would glow."""

    def together(one: dict[str, Any]) -> None:
        for light in one["lights"]:
            light["hours"]["on_s"] = one["lights"][0]["hours"]["on_s"]

    def none(one: dict[str, Any]) -> None:
        for light in one["lights"]:
            light["hours"]["on_s"] = 230.0

    three, every, dark = (moment(203.0, change, size=LARGE).mean(axis=2) for change in (None, together, none))
    assert (three - dark > 0.05).sum() > 100 and (every - three > 0.05).sum() > 300


@pytest.mark.parametrize("disable", ["shadow", pytest.param("beams", marks=pytest.mark.deep)])
def test_the_island_s_second_240_is_its_second_0_again(moment: Any, disable: str) -> None:
    """Sky, clouds, waves, wind, animals and sparkles, then shadows and lit air too: a loop without a hop."""
    first, last, before = (moment(second, disable=disable) for second in (0.0, 240.0, 239.0))
    assert np.array_equal(first, last) and differs(first, before).mean() > 0.05


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
def test_waves_break_up_what_the_sea_mirrors(moment: Any) -> None:
    def calm(one: dict[str, Any]) -> None:
        one["water"]["reflection_distortion"] = 0.0

    seen = moment(10.0, size=LARGE)
    assert differs(seen, moment(10.0, calm, size=LARGE), FAINT).mean() > 0.02


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

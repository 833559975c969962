"""Point lights light surfaces as the equations say, only those in their sets, and only while they are on."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.build.light_sets import add_light_sets
from tests.player.passes.test_materials import AWAY_M, STEP, WHITE, Render, middle, quad, render, thing
from tests.player.posed import HEIGHT, WIDTH, Posed, Vec, around, differs, pixel
from tests.player.synthetic import instance, material, write_scene
from tests.sweeps import sample

__all__ = ["render"]  # the fixture


def lamp(position: list[float], **changes: Any) -> dict[str, Any]:
    """A light of scene.json that is always on."""
    return {
        "name": "lamp",
        "position": position,
        "color": [1.0, 1.0, 1.0],
        "intensity": 1.0,
        "radius_m": 0.01,
        "range_m": 8.0,
        "hours": None,
        "fade_s": 0.0,
        "flicker": 0.0,
    } | changes


ONE_SET = [{"lights": [], "glow": None}, {"lights": [0], "glow": None}]


def lit_wall(
    render: Render, light: dict[str, Any], surface: dict[str, Any], sets: list[dict[str, Any]] = ONE_SET
) -> float:
    """Linear light in the middle of a white wall at the origin that faces +Z, the eye and the light."""
    wall = thing("wall", {"m": material(None, **surface)}, light_sets=[1])
    picture = render([wall], {"wall": quad()}, lights=[light], light_sets=sets)
    return float(middle(picture).mean())


@pytest.mark.parametrize("distance_m", sample([1.0, 0.5, 2.5, 4.5], every=3))
def test_light_falls_with_the_square_of_the_distance_and_ends_at_the_range(
    render: Render, distance_m: float
) -> None:
    intensity, range_m = 1.6 * distance_m**2, 5.0
    light = lamp([0.0, 0.0, distance_m], intensity=intensity, range_m=range_m)
    # The four by four pixels in the middle, which lie up to 19 cm from it.
    pixel_m = 2.0 * np.tan(0.45) * AWAY_M / 54
    x, y = np.meshgrid(*[pixel_m * np.array([-1.5, -0.5, 0.5, 1.5])] * 2)
    squared = distance_m**2 + x * x + y * y
    window = (1.0 - (squared / range_m**2) ** 2) ** 2  # Karis 2013
    expected = intensity / squared * window * (distance_m / np.sqrt(squared)) / pi
    assert lit_wall(render, light, WHITE) == pytest.approx(float(expected.mean()), abs=STEP)


def test_beyond_its_range_a_light_lights_nothing(render: Render) -> None:
    light = lamp([0.0, 0.0, 2.5], intensity=1e4, range_m=2.4)
    assert lit_wall(render, light, WHITE) == 0.0


def test_light_from_the_side_falls_with_the_cosine(render: Render) -> None:
    light = lamp([1.5, 0.0, 2.0], intensity=12.0, range_m=50.0)
    expected = 12.0 / 2.5**2 * (2.0 / 2.5) / pi
    assert lit_wall(render, light, WHITE) == pytest.approx(expected, abs=STEP)


def test_a_glossy_wall_reflects_the_light_as_ggx_says(render: Render) -> None:
    """Straight on: the light and the eye on the normal, where D = 1 / (pi alpha^2) and V = 1/4."""
    smoothness, f0 = 0.5, 0.04
    light = lamp([0.0, 0.0, AWAY_M], intensity=8.0, range_m=1e3)
    shine = lit_wall(render, light, {"specular": 0.5, "smoothness": smoothness, "color": [0.0, 0.0, 0.0]})
    alpha = (1.0 - smoothness) ** 2 + 0.01 / AWAY_M / 3.0
    expected = 8.0 / AWAY_M**2 * f0 / (4.0 * pi * alpha**2)
    assert shine == pytest.approx(expected, rel=0.05, abs=STEP)


def test_light_from_behind_passes_through_a_leaf_and_is_yellower(render: Render) -> None:
    leaf = WHITE | {"translucency": 0.5, "two_sided": True}
    light = lamp([0.0, 0.0, -2.0], intensity=8.0, range_m=50.0)
    expected = 8.0 / 2.0**2 / pi * 0.5 * (1.35 + 1.15 + 0.35) / 3.0
    assert lit_wall(render, light, leaf) == pytest.approx(expected, rel=0.02)
    assert lit_wall(render, light, WHITE | {"two_sided": True}) == 0.0


def test_the_lights_of_a_set_add_up(render: Render) -> None:
    wall = thing("wall", {"m": material(None, **WHITE)}, light_sets=[1])
    lights = [lamp([x, 0.0, 2.0], intensity=2.0, range_m=50.0) for x in (-1.0, 1.5)]
    seen = []
    for chosen in ([0], [1], [0, 1]):
        sets = [ONE_SET[0], {"lights": chosen, "glow": None}]
        seen.append(middle(render([wall], {"wall": quad()}, lights=lights, light_sets=sets)).mean())
    assert seen[2] == pytest.approx(sum(seen[:2]), abs=2.0 * STEP)


def test_an_instance_glows_as_bright_as_its_light_and_is_dark_when_that_is_off(render: Render) -> None:
    glowing = {"color": [0.0, 0.0, 0.0], "specular": 0.0, "emission": [0.6, 0.6, 0.6]}
    sets = [ONE_SET[0], {"lights": [], "glow": 0}]
    seen = {
        on_s: lit_wall(render, lamp([0.0, 0.0, 3.0], hours={"on_s": on_s, "off_s": 8.0}), glowing, sets)
        for on_s in (0.0, 6.0)
    }
    assert seen[0.0] == pytest.approx(0.6, abs=STEP)
    assert seen[6.0] == 0.0


@pytest.mark.parametrize("between", [0, 200])
def test_each_instance_is_lit_by_its_own_set(render: Render, between: int) -> None:
    """Three walls side by side, two lights: the set of each says which it sees, whatever reaches it. With
    many sets between theirs they lie in two blocks of uniforms."""
    stands = [instance([x, 0.0, 0.0], scale=0.5) for x in (-1.5, 0.0, 1.5)]
    walls = thing("wall", {"m": material(None, **WHITE)}, *stands, light_sets=[1, 0, 2 + between])
    red, green = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    lights = [lamp([0.0, 0.0, 3.0], color=color, intensity=12.0) for color in (red, green)]
    first, second = ({"lights": [i], "glow": None} for i in (0, 1))
    sets = [ONE_SET[0], first, *[ONE_SET[0]] * between, second]
    picture = render([walls], {"wall": quad()}, lights=lights, light_sets=sets)
    row = picture[HEIGHT_OF_MIDDLE]
    columns = [round(48 + 1.5 * side * 54 / (2.0 * np.tan(0.45) * AWAY_M)) for side in (-1, 0, 1)]
    left, center, right = (row[column] for column in columns)
    assert left[0] > 0.2 and left[1] == 0.0
    assert not center.any()
    assert right[1] > 0.2 and right[0] == 0.0


HEIGHT_OF_MIDDLE = 27

SIZE = SMALL_WIDTH, SMALL_HEIGHT = 160, 90
EYE: Vec = (-3.0, 3.5, 6.0)
TARGET: Vec = (0.0, 0.5, 0.0)


@pytest.fixture(scope="module")
def night(player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Posed:
    """A box on sand beside water, in the dark, and a lamp that is on from second 2 to second 5."""
    folder = write_scene(tmp_path_factory.mktemp("night") / "scene")
    scene = json.loads((folder / "scene.json").read_text())
    scene["sun"]["intensity"] = scene["ambient"]["intensity"] = 0.0
    scene["fog"] |= {"density_per_m": 0.0, "color": [0.0, 0.0, 0.0]}
    scene |= {"particles": [], "sky": None, "shadow": None}
    hours = {"on_s": 2.0, "off_s": 5.0}
    lights = [lamp([1.5, 1.0, 2.0], intensity=6.0, hours=hours, fade_s=1.0, flicker=0.4)]
    # A second one that nothing stands near, but for the largest patches.
    lights.append(lamp([25.0, 0.5, -25.0], intensity=6.0, range_m=2.0, hours=hours))
    scene |= {"lights": lights, "light_sets": []}
    add_light_sets(scene, {})
    (folder / "scene.json").write_text(json.dumps(scene))
    return Posed(folder, player, tmp_path_factory.mktemp("posed"), size=SIZE)


def without_lights(posed: Posed) -> dict[str, Any]:
    scene = posed.scene()
    del scene["lights"], scene["light_sets"], scene["terrain"]["light_sets"]
    scene["water"].pop("light_set", None)
    for item in scene["objects"]:
        item.pop("light_sets", None)
    return scene


def test_a_lamp_lights_the_sand_and_the_box_while_it_is_on(night: Posed) -> None:
    dark = night.render(EYE, TARGET, time_s=1.0)
    assert not dark.any()
    lit = night.render(EYE, TARGET, time_s=4.0)
    assert differs(lit, dark).mean() > 0.3
    # The sand in front is lit, and so is the box's side that faces the lamp.
    assert lit[SMALL_HEIGHT * 3 // 4, SMALL_WIDTH // 2 :].max() > 0.3
    assert not night.render(EYE, TARGET, time_s=8.0).any()


def test_while_no_lamp_is_on_the_picture_is_that_of_a_scene_without_lamps(night: Posed) -> None:
    scene, bare = night.scene(), without_lights(night)
    for one in (scene, bare):
        one["sun"]["intensity"] = 3.0
        one["ambient"]["intensity"] = 0.4
    assert np.array_equal(
        night.render(EYE, TARGET, time_s=1.0, scene=scene), night.render(EYE, TARGET, time_s=1.0, scene=bare)
    )


def test_patches_outside_a_lamps_set_look_as_if_they_were_inside(night: Posed) -> None:
    """The lists leave out only what the lamp does not reach: with one set for all the picture is the same."""
    scene = night.scene()
    scene["light_sets"] = [scene["light_sets"][0], {"lights": [0, 1], "glow": None}]
    terrain = scene["terrain"]
    assert 0 in terrain["light_sets"], "the lamp reaches every patch, so that this shows nothing"
    terrain["light_sets"] = [1] * len(terrain["light_sets"])
    for item in scene["objects"]:
        item["light_sets"] = [1] * len(item["instances"])
    scene["water"]["light_set"] = 1
    seen = night.render(EYE, TARGET, time_s=4.0)
    assert not differs(seen, night.render(EYE, TARGET, time_s=4.0, scene=scene), 1.5 / 255.0).any()


def test_a_lamp_glitters_on_the_water(night: Posed) -> None:
    scene = night.scene()
    dull = scene | {"water": scene["water"] | {"specular": 0.0}}
    lit, bare = (
        night.render((-3.0, 1.2, 7.0), (1.0, -0.4, 1.0), time_s=4.0, scene=one, disable="terrain")
        for one in (scene, dull)
    )
    assert differs(lit, bare).mean() > 0.002


def test_the_water_itself_is_lit_by_every_lamp_above_it(night: Posed) -> None:
    """Without glitter: what is left is the light that the water scatters."""
    scene = night.scene()
    scene["water"] |= {"specular": 0.0}
    places = [(-2.0, 0.6, 0.0), (2.0, 0.6, 0.0)]
    scene["lights"] = [one | {"position": list(p)} for one, p in zip(scene["lights"], places, strict=True)]
    scene["water"]["light_set"] = len(scene["light_sets"])
    scene["light_sets"].append({"lights": [0, 1], "glow": None})
    eye, target = (0.0, 3.0, 6.0), (0.0, -0.4, 0.0)
    lit = night.render(eye, target, time_s=4.0, scene=scene, disable="terrain,objects,reflection")
    for x, _, z in places:
        assert around(lit.max(axis=2), *pixel(eye, target, (x, -0.4, z), SIZE), 2).min() > 0.1


def test_the_water_is_lit_as_far_as_its_lamps_reach(night: Posed) -> None:
    """Beside a lamp that is too weak to be seen, but reaches all the water, it looks the same."""
    scene = night.scene()
    near, weak = ([2.0, 0.5, 1.0], 3.0, 6.0), ([25.0, 0.5, -25.0], 100.0, 1e-6)
    for one, (place, range_m, intensity) in zip(scene["lights"], (near, weak), strict=True):
        one |= {"position": place, "range_m": range_m, "intensity": intensity, "flicker": 0.0}
    pictures = []
    for lights in ([], [0], [0, 1]):
        scene["water"]["light_set"] = len(scene["light_sets"])
        scene["light_sets"].append({"lights": lights, "glow": None})
        pictures.append(
            night.render(
                (0.0, 5.0, 6.0),
                (1.0, -0.4, 0.0),
                time_s=4.0,
                scene=scene | {"objects": []},
                disable="terrain,reflection",
            )
        )
    dark, lit, by_both = pictures
    assert 0.1 < differs(lit, dark).mean() < 0.8
    assert np.array_equal(lit, by_both)


def test_water_above_the_ground_takes_a_lamps_light_colour_by_colour(night: Posed) -> None:
    """One metre of it, which lets less red through than blue, beside water that absorbs nothing."""
    scene = night.scene()
    scene["lights"][0]["position"][1] = 2.0
    scene["water"] |= {"level_m": 1.0}
    clear, tinted = (
        night.render(
            (1.5, 4.0, 6.0),
            (1.5, 0.0, 2.0),
            time_s=4.0,
            scene=scene | {"water": scene["water"] | {"absorption_per_m": absorption}},
            disable="water,objects,post",
        ).mean(axis=(0, 1))
        for absorption in ([0.0, 0.0, 0.0], [2.0, 0.1, 0.0])
    )
    assert tinted[0] < 0.25 * clear[0]
    assert tinted[2] > 0.95 * clear[2]


def test_a_beam_rises_above_a_lamp_while_it_is_on(night: Posed) -> None:
    scene = night.scene()
    x, y, z = scene["lights"][0]["position"]
    scene["lights"][0]["beam_m"] = 3.0
    eye, target = (x, y + 1.0, z + 6.0), (x, y + 1.0, z)
    seen = {
        (second, off): night.render(eye, target, time_s=second, scene=scene, disable=off)
        for second, off in ((4.0, "post"), (4.0, "post,beams"), (8.0, "post"))
    }
    beam = differs(seen[4.0, "post"], seen[4.0, "post,beams"], 2.5 / 255.0)
    columns, rows = np.flatnonzero(beam.any(axis=0)), np.flatnonzero(beam.any(axis=1))
    assert abs(float(columns.mean()) - SMALL_WIDTH / 2) < 0.75 and len(columns) < SMALL_WIDTH / 5
    assert rows.max() < pixel(eye, target, (x, y, z), SIZE)[1] + 0.5
    assert rows.min() < SMALL_HEIGHT / 2
    assert not seen[8.0, "post"].any()


@pytest.mark.parametrize("side", [(0.0, 6.0), (6.0, 0.0)])
def test_a_beam_is_as_bright_as_the_light_that_the_haze_scatters_out_of_it(
    night: Posed, side: tuple[float, float]
) -> None:
    """Around its axis one metre above the lamp, from any side: a bell curve of width 0.125 m."""
    scene = night.scene()
    x, y, z = scene["lights"][0]["position"]
    color = [1.0, 0.5, 0.25]
    scene["lights"][0] |= {"beam_m": 3.0, "flicker": 0.0, "intensity": 60.0, "color": color}
    eye = (x + side[0], y + 1.0, z + side[1])
    seen = night.render(eye, (x, y + 1.0, z), time_s=4.0, scene=scene, disable="post,terrain,objects,water")
    pixel_m = 2.0 * 6.0 * np.tan(0.45) / SMALL_HEIGHT
    rows, columns = np.mgrid[-2:2, -3:3] + 0.5
    above_m, aside_m = 1.0 - rows * pixel_m, columns * pixel_m
    width_m = 0.09 + 0.035 * above_m
    bell = np.exp(-((aside_m / width_m) ** 2)) - 0.002
    expected = 60.0 * 0.0024 * bell / width_m * (1.0 - above_m / 3.0) ** 2
    middle_row, middle_column = SMALL_HEIGHT // 2, SMALL_WIDTH // 2
    here = seen[middle_row - 2 : middle_row + 2, middle_column - 3 : middle_column + 3]
    assert np.abs(here - expected[..., None] * color).max() < STEP


def test_a_moment_looks_the_same_however_it_is_reached(
    night: Posed, player: Callable[..., Any], tmp_path: Path
) -> None:
    """Played to frame 90, which is second 3, and drawn alone: strength, fade and flicker are the same."""
    played, alone = tmp_path / "played.png", tmp_path / "alone.png"
    size = ("--size", "96x54")
    run = player(night.source, *size, "--time", 2.9, "--frames", 4, "--screenshot", played)
    assert run.returncode == 0, run.stderr
    last = sorted(tmp_path.glob("played*"))[-1]
    assert player(night.source, *size, "--time", 3.0, "--screenshot", alone).returncode == 0
    assert last.read_bytes() == alone.read_bytes()


@pytest.mark.deep
def test_the_jettys_lamps_light_planks_poles_sand_and_water_in_the_night(
    island: Path, player: Callable[..., Any], tmp_path: Path
) -> None:
    """As the flight comes back along it, when all are on."""
    posed = Posed(island, player, tmp_path, frozenset({"jetty", "lamp"}))
    scene = posed.scene()
    scene["sun"]["intensity"] = 0.05
    scene["ambient"]["intensity"] = 0.02
    scene["fog"]["color"] = [0.0, 0.0, 0.0]
    scene |= {"sky": None, "particles": [], "exposure": 2.0}
    bare = scene | {"lights": [one | {"intensity": 0.0} for one in scene["lights"]]}
    eye, target = (34.5, 2.6, 46.0), (38.0, 1.0, 34.0)
    second = max(light["hours"]["on_s"] for light in scene["lights"]) + 1.5
    lit, dark = (posed.render(eye, target, time_s=second, scene=one, disable="post") for one in (scene, bare))
    brighter = lit.max(axis=2) > dark.max(axis=2) + 6.0 / 255.0
    assert brighter.mean() > 0.05
    places: dict[str, Vec] = {
        "planks": (38.0, 1.22, 38.0),
        "a pole": (36.86, 1.0, 39.2),
        "the water": (36.0, 0.0, 39.5),
    }
    for name, place in places.items():
        radius, share = (12, 0.08) if name == "the water" else (3, 0.25)  # waves break the light up
        assert around(brighter, *pixel(eye, target, place), radius).mean() > share, name


@pytest.mark.deep
def test_mosquitoes_swarm_round_the_lamp_of_the_jettys_head_at_night_and_nowhere_by_day(
    island: Path, player: Callable[..., Any], tmp_path: Path
) -> None:
    posed = Posed(island, player, tmp_path, frozenset({"jetty", "lamp"}))
    scene = posed.scene()
    (swarm,) = [cloud for cloud in scene["particles"] if cloud["motion"] == "swarm"]
    scene |= {"sky": None, "exposure": 2.0, "particles": [swarm]}
    scene["sun"]["intensity"] = 0.05
    x, y, z = swarm["center"]
    eye, target = (x - 1.5, y - 0.2, z + 3.0), (x, y, z)
    on_s, off_s = (scene["lights"][0]["hours"][key] for key in ("on_s", "off_s"))
    off = "terrain,water,shadow,post"
    for second, is_there in ((on_s + 4.0, True), (off_s - 190.0, False)):
        with_them, bare = (
            posed.render(eye, target, time_s=second, scene=one, disable=off)
            for one in (scene, scene | {"particles": []})
        )
        changed = differs(with_them, bare)
        assert (40 if is_there else 0) <= changed.sum() <= (4000 if is_there else 0)
        if is_there:
            here = np.argwhere(changed).mean(axis=0)
            assert np.hypot(here[0] - HEIGHT / 2, here[1] - WIDTH / 2) < 25.0

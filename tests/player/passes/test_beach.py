"""Each pass changes the picture where it draws and nowhere else: a box on a small beach, made without a bake.

The tests of the baked island, from more poses and of finer effects, are deep.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.data import Lod
from paradize.formats.glb.encode import encode_glb
from tests.pictures import require_like, save
from tests.player.patches import tiled
from tests.player.posed import FOV_RAD, Picture, Posed, Vec, around, differs
from tests.player.posed import pixel as posed_pixel
from tests.player.synthetic import box, identity, instance, texture, write_scene

# Pictures of four times as many pixels take twice the time.
SIZE = WIDTH, HEIGHT = 160, 90
GOLDEN_SIZE = 320, 180
pixel = partial(posed_pixel, size=SIZE)

EYE: Vec = (-1.0, 2.2, 9.0)  # over the water, towards the box on the beach
TARGET: Vec = (0.0, 0.4, -3.0)
BOX: Vec = (0.0, 0.5, -3.0)
DOWN_EYE: Vec = (0.3, 4.0, 12.0)  # straight down on the floor of the sea
DOWN: Vec = (0.3, 0.0, 11.9)


def beach(x: npt.NDArray[np.float64], z: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """An even slope, 4.5 m high and as deep; the waterline lies below the axis x."""
    return np.asarray(0.0 * x - 0.15 * z)


def waves(steep: float) -> bytes:
    """A map of normals that rise and fall twice along each side."""
    turn = np.arange(64) * (4.0 * np.pi / 64)
    both = np.stack(np.broadcast_arrays(np.sin(turn)[None], np.cos(turn)[:, None]), axis=2)
    return texture("RG8_SNORM", (steep * both).astype(np.int8))


@pytest.fixture(scope="module")
def posed(player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Posed:
    ground = tiled(60.0, beach, levels=5, error_m=0.05)
    folder = write_scene(tmp_path_factory.mktemp("beach") / "scene", terrain=ground)
    manifest = json.loads((folder / "scene.json").read_text())
    for name in ("water_normal", "water_dudv"):
        data = waves(40.0)
        (folder / f"{name}.ktx2").write_bytes(data)
        manifest["artifacts"][name] |= identity(data)
    (folder / "scene.json").write_text(json.dumps(manifest))
    return Posed(folder, player, tmp_path_factory.mktemp("posed"), size=SIZE)


def scene(posed: Posed, **water: Any) -> dict[str, Any]:
    """Without particles; the sea lies at 0 and its normals stand still."""
    out = posed.scene() | {"particles": []}
    out["water"] |= {"level_m": 0.0, "scroll_per_s": [0.0, 0.0]} | water
    (box,) = out["objects"]
    box["instances"] = [instance(list(BOX), 0.4)]
    return out


def without_box(one: dict[str, Any]) -> dict[str, Any]:
    return one | {"objects": []}


def test_the_water_mirrors_the_box_where_the_reflection_is_drawn(posed: Posed) -> None:
    x, y, z = BOX
    here = pixel(EYE, TARGET, (x, -y - 1.0, z))
    still = scene(posed, reflection_distortion=0.0)
    seen, bare, blind, blind_bare = (
        posed.render(EYE, TARGET, scene=one, disable=off)
        for off in ("", "reflection")
        for one in (still, without_box(still))
    )
    assert around(differs(seen, bare), *here, 3).mean() > 0.5
    assert not around(differs(blind, blind_bare), *here, 3).any()


def test_reflection_and_refraction_change_water_and_nothing_else(posed: Posed) -> None:
    # Without the post pass, whose glow spreads light over every edge.
    one = scene(posed)
    whole = posed.render(EYE, TARGET, scene=one, disable="post")
    bare = posed.render(EYE, TARGET, scene=one, disable="post,water")
    for name in ("reflection", "refraction"):
        blind = posed.render(EYE, TARGET, scene=one, disable=f"post,{name}")
        changed = differs(whole, blind)
        assert changed.mean() > 0.02
        water = differs(whole, bare, 2.5 / 255.0) | differs(blind, bare, 2.5 / 255.0)
        assert (changed & ~water).mean() < 0.001
        assert not changed[: HEIGHT // 4].any()


def test_waves_break_up_what_the_water_mirrors(posed: Posed) -> None:
    broken, flat = (
        posed.render(EYE, TARGET, scene=scene(posed, reflection_distortion=share)) for share in (0.12, 0.0)
    )
    assert differs(broken, flat).mean() > 0.01


def test_the_box_casts_a_shadow_on_the_sand_and_outside_the_map_everything_is_lit(posed: Posed) -> None:
    one = scene(posed)
    one["sun"]["direction"] = [0.8, 0.6, 0.0]
    away = one | {"shadow": one["shadow"] | {"extent_m": 4.0, "center": [-60.0, 0.0, -60.0]}}
    lit, shadowed, outside = (
        posed.render(EYE, TARGET, scene=of, disable=f"water,reflection,refraction,post{off}")
        for of, off in ((one, ",shadow"), (one, ""), (away, ""))
    )
    x, y, z = BOX
    dark = differs(lit, shadowed) & (shadowed.mean(axis=2) < lit.mean(axis=2))
    assert around(dark, *pixel(EYE, TARGET, (x - 1.8, y, z)), 1).all()
    # Lit sand does not shadow itself.
    assert around(dark, *pixel(EYE, TARGET, (x - 1.0, y, z)), 28).sum() > 0.98 * dark.sum()
    # A shadow is never brighter than lit sand.
    assert (differs(lit, shadowed) & ~dark).mean() < 0.002
    assert not differs(lit, outside, 1.5 / 255.0).any()


def test_the_sky_fills_what_nothing_else_covers(posed: Posed) -> None:
    one = scene(posed)
    with_it, bare = (posed.render(EYE, TARGET, scene=one, disable=f"water,post{off}") for off in ("", ",sky"))
    changed = differs(with_it, bare)
    horizon = round(pixel(EYE, TARGET, (0.0, 4.5, -30.0))[1])
    assert changed[: horizon - 2].all()
    assert not changed[horizon + 3 :].any()


def test_sparkles_are_light_where_they_float(posed: Posed) -> None:
    field = posed.scene()["particles"][0] | {"center": [0.0, 2.0, -3.0], "radius_m": 1.5}
    one = without_box(scene(posed)) | {"particles": [field]}
    shown, bare = (
        posed.render(EYE, TARGET, time_s=2.0, scene=one, disable=off) for off in ("water", "water,particles")
    )
    changed = differs(shown, bare, 2.5 / 255.0)
    assert 0 < changed.mean() < 0.05
    assert (shown[changed].sum(axis=1) > bare[changed].sum(axis=1)).all()
    x, y = pixel(EYE, TARGET, (0.0, 2.0, -3.0))
    metre = abs(pixel(EYE, TARGET, (0.0, 3.0, -3.0))[1] - y)
    rows, columns = np.nonzero(changed)
    assert np.hypot(columns - x, rows - y).max() < 3.4 * metre  # they drift upwards; nearer ones look larger
    later = posed.render(EYE, TARGET, time_s=5.0, scene=one, disable="water")
    assert differs(shown, later, 2.5 / 255.0).any()


@pytest.mark.deep
def test_effect_map_only_below_mix_low_and_sand_only_above_mix_high(posed: Posed) -> None:
    strange = texture("RGBA8_SRGB", np.full((4, 4, 4), (255, 0, 255, 255), np.uint8))
    one = without_box(scene(posed))
    one["terrain"] |= {"effect_color": "box_color", "mix_low_m": -0.5, "mix_high_m": -0.1}
    seen, other_sand, other_effect = (
        posed.render(EYE, TARGET, disable="water,post", scene=one, files=files)
        for files in (None, {"sand_color": strange}, {"box_color": strange})
    )
    last_sand, first_floor = (
        round(pixel(EYE, TARGET, (0.0, height, -height / 0.15))[1]) for height in (-0.1, -0.5)
    )
    sand, floor = np.s_[30 : last_sand - 2], np.s_[first_floor + 3 :]
    assert differs(seen, other_sand)[sand].mean() > 0.9
    assert not differs(seen, other_sand, 1.5 / 255)[floor].any()
    assert differs(seen, other_effect)[floor].mean() > 0.9
    assert not differs(seen, other_effect, 1.5 / 255)[sand].any()


def test_the_sea_floor_shows_sand_where_the_effect_map_ends_below_it_and_else_none(posed: Posed) -> None:
    strange = texture("RGBA8_SRGB", np.full((4, 4, 4), (255, 0, 255, 255), np.uint8))
    one = without_box(scene(posed, level_m=5.0))  # above all of the ground
    for low_m, shown in ((-50.0, 0.9), (5.0, 0.0)):
        one["terrain"] |= {"effect_color": "box_color", "effect_normal": "water_dudv"}
        one["terrain"] |= {"mix_low_m": low_m, "mix_high_m": low_m + 1.0}
        seen, other = (
            posed.render(DOWN_EYE, DOWN, disable="water,post", scene=one, files=files)
            for files in (None, {"sand_color": strange})
        )
        assert (differs(seen, other).mean() > shown) == (shown > 0.0)


def test_at_the_terrain_s_border_the_effect_map_ends_and_does_not_begin_anew(posed: Posed) -> None:
    """Its texels are 4 m wide. At one border it looks as if the other half of the map were alike."""
    one = without_box(scene(posed))
    maps = {"effect_color": "box_color", "effect_normal": "water_dudv", "mix_low_m": 50.0, "mix_high_m": 51.0}
    one["terrain"] |= maps

    def seen(color: int, slope: int) -> Picture:
        """From above the border on the left. color, slope: in the right half of the maps."""
        colors = np.full((16, 16, 4), 200, np.uint8)
        colors[:, 8:] = color
        slopes = np.zeros((16, 16, 2), np.int8)
        slopes[:, 8:] = slope
        files = {"box_color": texture("RGBA8_SRGB", colors), "water_dudv": texture("RG8_SNORM", slopes)}
        eye, target = (-28.0, 6.5, -15.0), (-28.0, 2.2, -15.1)
        return posed.render(eye, target, scene=one, files=files, disable="water,post")

    alike = seen(200, 0)
    assert not differs(alike, seen(20, 0), 1.5 / 255).any()
    assert not differs(alike, seen(200, 90), 1.5 / 255).any()


def test_near_the_eye_grains_shift_the_effect_map_by_as_many_metres(posed: Posed) -> None:
    """On a terrain that says it is twice as large, with as large grains, half as far in its map."""
    one = without_box(scene(posed))
    maps = {"effect_color": "box_color", "sand_normal": "water_normal", "mix_low_m": -5.0, "mix_high_m": 50.0}
    one["terrain"] |= maps
    larger = one | {"terrain": one["terrain"] | {"size_m": [120.0, 120.0], "sand_repeat": 16.0}}
    near, far = (
        [posed.render(eye, target, scene=of, disable="water,post") for of in (one, larger)]
        for eye, target in (((0.0, 3.0, -10.0), (0.0, 1.5, -10.1)), ((0.0, 70.0, -10.0), (0.0, 1.5, -10.1)))
    )
    assert differs(*near, 2.5 / 255).mean() > 0.05
    assert not differs(*far, 1.5 / 255).any()


def test_an_eye_in_the_sea_sees_the_sky_straight_above_and_only_water_at_flat_angles(posed: Posed) -> None:
    """Beyond 48.8 degrees from the vertical the surface reflects all light: Snell's law."""
    eye: Vec = (0.0, -1.0, 25.0)
    angles = np.radians([3.0, 47.0, 50.0, 73.0])
    poses: list[tuple[Vec, Vec]] = [
        (eye, (float(np.sin(angle)), float(np.cos(angle)) - 1.0, 25.0)) for angle in angles
    ]
    still = {"water_normal": waves(0.0), "water_dudv": waves(0.0)}
    one = scene(posed, shallow_color=[0.05, 0.6, 0.3])
    above, inside, outside, aside = (
        picture[44:46, 79:81].mean(axis=(0, 1))
        for picture in posed.views(poses, scene=one, files=still, disable="post")
    )
    for sky in (above, inside):
        assert sky[2] > 1.3 * sky[1], "the sky is blue"
    for water in (outside, aside):
        assert water[1] > 1.1 * water[2], "the water glows green"


def test_waves_focus_light_on_the_floor_and_keep_its_brightness(posed: Posed) -> None:
    one = scene(posed)
    seen, still = (
        posed.render(DOWN_EYE, DOWN, scene=one, disable="water,post", files=files)
        for files in (None, {"water_normal": waves(0.0)})
    )
    assert differs(seen, still).mean() > 0.3
    gain = seen.mean(axis=2) / still.mean(axis=2)
    assert 0.9 < gain.mean() < 1.15


def test_wet_sand_is_darker_and_mirrors_the_sky(posed: Posed) -> None:
    one = without_box(scene(posed))
    dull = one | {"terrain": one["terrain"] | {"wet_smoothness": 0.0}}
    dry = dull | {"terrain": dull["terrain"] | {"wet_darkness": 0.0}}
    shiny, rough, light = (
        posed.render(EYE, TARGET, scene=of, disable="water,post") for of in (one, dull, dry)
    )
    film = differs(shiny, rough)
    assert 0.005 < film.mean() < 0.5
    blue_share = [of[film][:, 2].mean() / of[film][:, 0].mean() for of in (shiny, rough)]
    assert blue_share[0] > 1.03 * blue_share[1]
    wet = differs(rough, light)
    assert rough[wet].mean() < light[wet].mean()
    above = round(pixel(EYE, TARGET, (0.0, 1.0, -7.0))[1])
    assert not film[:above].any() and not wet[:above].any()


def test_shallows_are_turquoise_and_deep_water_is_blue(posed: Posed) -> None:
    one = scene(posed)
    shallow, deep = posed.views([(DOWN_EYE, DOWN), ((0.3, 4.0, 28.0), (0.3, 0.0, 27.9))], scene=one)
    red, green, blue = shallow.mean(axis=(0, 1))
    assert green > 1.15 * red and blue > red
    assert deep[..., 2].mean() / deep[..., 1].mean() > 1.1 * blue / green


LOW_EYE: Vec = (0.0, 1.0, 15.0)  # low over the sea, away from the beach
SEAWARD: Vec = (0.0, 0.2, 25.0)


@pytest.mark.deep
def test_waves_lift_the_sea_near_the_eye_and_run_but_not_in_quality_fast(posed: Posed) -> None:
    lifted, calm = (scene(posed, wave_height_m=height_m) for height_m in (0.32, 0.0))
    first, second = posed.play(LOW_EYE, SEAWARD, 2, time_s=5.0, scene=lifted)
    assert differs(first, posed.render(LOW_EYE, SEAWARD, time_s=5.0, scene=calm)).mean() > 0.05
    assert differs(first, second, 1 / 255).mean() > 0.01
    assert differs(first, second, 40 / 255).mean() < 0.004
    fast = (posed.render(LOW_EYE, SEAWARD, time_s=5.0, scene=one, quality="fast") for one in (lifted, calm))
    assert np.array_equal(*fast)


SHORE_EYE: Vec = (0.0, 6.0, 9.0)  # over the waterline
SHORE: Vec = (0.0, 0.0, 1.0)


def test_a_sea_that_waves_hardly_lift_looks_calm(posed: Posed) -> None:
    """It looks up its mirror image and its floor where the calm sea does."""
    lifted, calm = (
        posed.render(EYE, TARGET, scene=scene(posed, wave_height_m=height_m), disable="post")
        for height_m in (1e-3, 0.0)
    )
    assert differs(lifted, calm, 2.5 / 255).mean() < 0.001


def test_the_sea_mirrors_no_more_than_8_of_a_sky_s_radiance(posed: Posed) -> None:
    """A sky has its sun painted in, whose glitter the sea draws itself."""
    one = without_box(scene(posed))
    seen = [
        posed.render(
            DOWN_EYE,
            DOWN,
            scene=one,
            files={"sky": texture("RGBA16F", np.full((6, 8, 8, 4), radiance, np.float16))},
            disable="post,reflection,terrain,refraction",
        )
        for radiance in (7.0, 8.0, 60.0)
    ]
    assert differs(seen[0], seen[1], 1.5 / 255).mean() > 0.5
    assert np.array_equal(seen[1], seen[2])


def test_the_grid_that_waves_lift_moves_with_the_eye_and_the_waves_do_not(posed: Posed) -> None:
    """On both sides of a place where the grid goes on by a cell of 1 m."""
    one = scene(posed, wave_height_m=0.32)
    first, second = (
        posed.render((x, *LOW_EYE[1:]), (x, *SEAWARD[1:]), time_s=5.0, scene=one) for x in (2.499, 2.501)
    )
    assert differs(first, second, 2 / 255).mean() < 0.03


def test_waves_run_up_the_beach_with_foam_and_leave_the_dry_sand_and_the_waterline_of_a_calm_sea(
    posed: Posed,
) -> None:
    shape = {"swash_height_m": 0.3, "swash_waves": 4}
    calm, running, lifted = (
        posed.render(SHORE_EYE, SHORE, time_s=4.5, scene=without_box(scene(posed, **water)))
        for water in ({}, shape, {"wave_height_m": 0.32})
    )
    foam = (running - calm)[..., 2] > 40 / 255
    assert differs(running, calm).mean() > 0.03
    assert 0.005 < foam.mean() < 0.1
    assert not differs(running, calm)[: HEIGHT // 4].any()
    waterline = round(pixel(SHORE_EYE, SHORE, (0.0, 0.0, 0.0))[1])
    assert differs(lifted, calm, 2 / 255)[:waterline].mean() < 0.002
    # Where the wave was white, sand is dark a second later.
    later = posed.render(SHORE_EYE, SHORE, time_s=5.7, scene=without_box(scene(posed, **shape)))
    assert ((later - calm).mean(axis=2)[foam] < -4 / 255).mean() > 0.3
    lap_later = posed.render(SHORE_EYE, SHORE, time_s=14.5, scene=without_box(scene(posed, **shape)))
    assert np.array_equal(running, lap_later)


def test_without_the_picture_of_a_mirror_the_sheet_of_a_wave_is_not_black(posed: Posed) -> None:
    """Seen at a flat angle, where it mirrors much. Wet sand alone is darker by less than a tenth."""
    running, calm = (
        posed.render(
            (0.0, 1.0, 6.0),
            (0.0, 0.3, -2.0),
            time_s=4.5,
            scene=without_box(scene(posed, swash_height_m=height_m, swash_waves=4)),
            disable="post,reflection",
        )
        for height_m in (0.4, 0.0)
    )
    assert differs(running, calm).mean() > 0.02
    assert (calm - running).max() < 0.2


def ground(eye: Vec, target: Vec, slope: float = 0.0) -> npt.NDArray[np.float64]:
    """(h, w, 3): the points of the plane y = slope * z that a picture from `eye` to `target` shows."""
    forward = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    y, x = (np.mgrid[:HEIGHT, :WIDTH] + 0.5 - np.array([HEIGHT, WIDTH])[:, None, None] / 2) / (HEIGHT / 2)
    ray = forward + np.tan(0.5 * FOV_RAD) * (x[..., None] * right - y[..., None] * np.cross(right, forward))
    share = (slope * eye[2] - eye[1]) / (ray[..., 1] - slope * ray[..., 2])
    return np.asarray(eye + share[..., None] * ray)


@pytest.mark.deep
def test_waves_run_up_as_high_as_the_scene_says_and_no_higher(posed: Posed) -> None:
    """Of four waves the highest, over 10 m of the beach: each has its own height, and lobes."""
    eye, target = (0.0, 9.0, 3.0), (0.0, 0.0, -2.0)
    height_m = 0.3
    shape = {"swash_height_m": height_m, "swash_waves": 4}
    calm = posed.render(eye, target, scene=without_box(scene(posed)), disable="post")
    wet = [
        differs(
            posed.render(
                eye, target, time_s=second, scene=without_box(scene(posed, **shape)), disable="post"
            ),
            calm,
            3 / 255,
        )
        for second in (0.5, 5.5, 8.5)
    ]
    reached = np.where(np.any(wet, axis=0), ground(eye, target, -0.15)[..., 1], -1.0).max(axis=0)
    assert 0.65 * height_m < reached.mean() < 0.75 * height_m
    assert reached.max() < height_m


def test_ripples_are_seen_round_a_pole_and_nowhere_else(posed: Posed) -> None:
    pole = (0.0, 0.0, 4.0)
    ring = {"x_m": [pole[0]], "z_m": [pole[2]], "radius_m": [0.2]}
    one, flat = (
        without_box(scene(posed, ripples={"height_m": height_m, **ring})) for height_m in (0.05, 0.0)
    )
    rippled, later = posed.play(EYE, TARGET, 2, scene=one, disable="post")
    changed = differs(rippled, posed.render(EYE, TARGET, scene=flat, disable="post"))
    assert differs(rippled, later, 2 / 255).any()
    assert differs(rippled, later, 60 / 255).mean() < 0.004
    _, y = pixel(EYE, TARGET, pole)
    assert 0.003 < changed.mean() < 0.2
    assert not changed[: round(y) - 20].any()


@pytest.mark.deep
def test_ripples_fade_away_from_their_pole_and_end_4_metres_from_it(posed: Posed) -> None:
    ring = {"x_m": [0.0], "z_m": [6.0], "radius_m": [0.2]}
    eye, target = (0.0, 4.0, 12.0), (0.0, 0.0, 5.5)
    rippled, flat = (
        posed.render(
            eye,
            target,
            scene=without_box(scene(posed, ripples={"height_m": height_m, **ring})),
            disable="post",
        )
        for height_m in (0.05, 0.0)
    )
    change = np.abs(rippled - flat).max(axis=2)
    places = ground(eye, target)
    away = np.hypot(places[..., 0], places[..., 2] - 6.0) - 0.2
    near, far = (change[(away >= start) & (away < start + 1.0)].mean() for start in (0.0, 2.5))
    assert near > 1 / 255
    assert far < 0.2 * near
    assert not change[away > 4.0].any()


@pytest.mark.deep
def test_shafts_brighten_the_air_towards_a_low_sun_but_not_in_shadow_in_the_dark_or_in_quality_fast(
    posed: Posed,
) -> None:
    one = scene(posed) | {"light_shafts": {"density_per_m": 0.024, "anisotropy": 0.5, "range_m": 40.0}}
    one["sun"] |= {"direction": [0.8, 0.36, -0.48]}
    (thing,) = one["objects"]
    high = thing | {"views": ["shadow"], "instances": [instance([3.0, 2.0, 0.0], 0.4)]}
    lit, plain = (posed.render(EYE, TARGET, scene=one, disable=off) for off in ("post", "post,shafts"))
    change = (lit - plain).mean(axis=2)
    assert differs(lit, plain).mean() > 0.1
    assert change[:20, -20:].mean() > 1.5 * max(change[:20, :20].mean(), 1 / 255)
    clear, shaded = (
        posed.render(EYE, TARGET, scene=one | {"objects": things}, disable="post")[:25]
        for things in ([], [high])
    )
    assert ((shaded - clear).mean(axis=2) < -4 / 255).mean() > 0.04
    dark = one | {"sun": one["sun"] | {"intensity": 0.0}}
    for of, quality in ((dark, "balanced"), (one, "fast")):
        with_it, without = (
            posed.render(EYE, TARGET, scene=of, disable=off, quality=quality)
            for off in ("post", "post,shafts")
        )
        assert np.array_equal(with_it, without)


def test_the_wind_moves_a_box_its_shadow_and_its_mirror_image_and_nothing_else(posed: Posed) -> None:
    swaying = box()
    swaying = replace(swaying, sway=np.repeat(swaying.positions[:, 1:2] / 2.0, 2, axis=1).astype(np.float32))
    files = {"box_mesh": encode_glb([Lod(swaying, 0.0, 0.0), Lod(swaying, 0.02, 0.01)], "box")}
    one = scene(posed, reflection_distortion=0.0)
    one["wind"] = {"direction": [1.0, 0.0], "speed_m_per_s": 5.0, "gust_m": 24.0}
    (thing,) = one["objects"]
    thing["sway"] = {"lean_m": 1.0, "flutter_m": 0.05}

    shown, shadow = (
        one | {"objects": [thing | {"views": views}]} for views in (["camera", "reflection"], ["shadow"])
    )

    def at(second: float, of: dict[str, Any], off: str) -> Picture:
        return posed.render(EYE, TARGET, time_s=second, scene=of, files=files, disable=off)

    x, y, z = BOX
    first, second = (at(s, shown, "shadow,post") for s in (3.16, 4.2))
    changed = differs(first, second)
    itself, mirrored = (
        around(changed, *pixel(EYE, TARGET, (x, height, z)), radius).sum()
        for height, radius in ((y + 1.0, 23), (-y - 1.0, 15))
    )
    assert itself > 25 and mirrored > 25
    upper, lower = changed[: HEIGHT * 5 // 9], changed[HEIGHT * 5 // 9 :]
    assert upper[:, 45:115].sum() == upper.sum() and lower[:, 45:115].sum() == lower.sum()
    off = "water,post"
    before = at(3.16, shadow, off)
    changed = differs(before, at(4.2, shadow, off))
    assert changed.sum() > 25
    assert around(changed, *pixel(EYE, TARGET, (x - 0.9, y, z - 0.7)), 23).sum() == changed.sum()
    # The shadow is drawn anew, ten times a second.
    same, _, _, last = posed.play(EYE, TARGET, 4, time_s=3.18, scene=shadow, files=files, disable=off)
    assert np.array_equal(same, before)
    assert differs(same, last, 1 / 255).any()
    # It leans where the wind blows: to the right.
    upright = at(
        3.16, one | {"objects": [thing | {"views": ["camera", "reflection"], "sway": None}]}, "shadow,post"
    )
    bare = at(3.16, without_box(one), "shadow,post")
    columns = [np.argwhere(differs(of, bare)[: HEIGHT // 2])[:, 1].mean() for of in (upright, first)]
    assert columns[1] > columns[0] + 1.0


def test_a_box_looks_the_same_whatever_the_shader_of_its_material_leaves_out(posed: Posed) -> None:
    """Without highlights, and where all of its instances stand above the water."""
    one = scene(posed)
    (thing,) = one["objects"]

    tilted = np.random.default_rng(5).normal([0.0, 1.0, 0.0], 0.4, (24, 3)).astype(np.float32)
    uneven = replace(box(), normals=tilted / np.linalg.norm(tilted, axis=1, keepdims=True))
    files = {"box_mesh": encode_glb([Lod(uneven, 0.0, 0.0), Lod(uneven, 0.02, 0.01)], "box")}

    def seen(*, sunken: bool = False, **changes: Any) -> Picture:
        stands = thing["instances"] + ([instance([-8.0, -4.0, 20.0])] if sunken else [])
        surfaces = {name: of | {"specular": 0.0} | changes for name, of in thing["materials"].items()}
        of = one | {"objects": [thing | {"instances": stands, "materials": surfaces}]}
        return posed.render(EYE, TARGET, scene=of, files=files, disable="shadow,water,terrain,sky,post")

    matte, also_sunken = seen(), seen(sunken=True)
    assert matte.any()
    assert not differs(matte, also_sunken, 1.5 / 255.0).any()
    assert not differs(matte, seen(specular=1e-6), 1.5 / 255.0).any()
    # A box that also stands in the sea is lit in its pixels.
    assert differs(matte, seen(vertex_lit=True), 1.5 / 255.0).any()
    assert np.array_equal(also_sunken, seen(sunken=True, vertex_lit=True))


def test_the_beach_by_day_looks_as_approved(posed: Posed, root: Path) -> None:
    """All passes, with two boxes on the beach and one in the water, from the side: a swapped axis shows."""
    ring = {"x_m": [-1.2], "z_m": [5.0], "radius_m": [0.5], "height_m": 0.03}
    one = scene(posed, scroll_per_s=[0.03, 0.02], ripples=ring, swash_height_m=0.2, wave_height_m=0.1)
    one["sun"]["direction"] = [-0.48, 0.36, -0.8]  # ahead, so that the sea glitters and shadows are seen
    one |= {"light_shafts": {"density_per_m": 0.01, "anisotropy": 0.5, "range_m": 40.0}}
    one["particles"] = [posed.scene()["particles"][0] | {"center": [3.5, 1.5, -2.0]}]
    maps = {"sand_normal": "water_normal", "effect_color": "box_color", "effect_normal": "water_normal"}
    one["terrain"] |= maps
    (thing,) = one["objects"]
    stands = [([0.0, 0.4, -3.0], 0.4, 1.0), ([-5.0, 1.2, -8.0], 1.0, 1.0), ([-1.2, -1.0, 5.0], 0.2, 0.7)]
    thing["instances"] = [instance(*stand) for stand in stands]
    picture = replace(posed, size=GOLDEN_SIZE).render(
        (2.0, 2.4, 11.0), (-0.8, 0.3, 0.0), time_s=4.5, scene=one
    )
    rendered = root / "build/golden/beach.png"
    rendered.parent.mkdir(parents=True, exist_ok=True)
    save(rendered, picture)
    require_like(root / "tests/golden/beach.png", rendered)

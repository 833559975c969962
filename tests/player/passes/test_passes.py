"""Each pass changes the picture where it draws and nowhere else, on the baked island from fixed poses."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.data import Texture
from paradize.formats.glb.cut import cut_glb
from paradize.formats.ktx2.encode import encode_ktx2
from tests.player.posed import HEIGHT, WIDTH, Picture, Posed, Vec, around, differs, pixel

# Poses on the island. They depend on its terrain, not on the player.
PALM_EYE: Vec = (-2.0, 1.6, 8.0)  # over the lagoon, with the palm ahead
PALM_TARGET: Vec = (-24.0, 2.0, 3.0)
FLOOR_EYE: Vec = (1.0, 3.0, 14.0)  # over the middle of the lagoon, straight down
FLOOR_TARGET: Vec = (1.0, 0.0, 13.9)
SEA_EYE: Vec = (70.0, 0.7, 90.0)  # low over the open sea, away from the island
SEA_TARGET: Vec = (170.0, -3.0, 190.0)
JETTY_EYE: Vec = (33.0, 1.5, 30.0)  # poles that stand in shallow water
JETTY_TARGET: Vec = (38.0, -0.4, 33.0)
BEACH_EYE: Vec = (-6.0, 1.3, 12.0)  # low over the wet sand, towards the palm
BEACH_TARGET: Vec = (-24.0, 0.2, 3.0)
DUNE_EYE: Vec = (-8.0, 9.0, -24.0)  # a dune from above: higher than mix_high
DUNE_TARGET: Vec = (-8.0, 4.0, -25.0)
DRY = "water,reflection,refraction,shafts,sky,post"  # the sand, what stands on it, and their shadows


@pytest.fixture(scope="module")
def posed(island: Path, player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Posed:
    """Everything that no test here looks at is left out: a picture then takes three quarters of the time."""
    return Posed(island, player, tmp_path_factory.mktemp("posed"), frozenset({"palm", "jetty"}))


def as_baked(posed: Posed) -> dict[str, Picture]:
    """The scene as it is, from four poses in one start: frames of a thirtieth of a second."""
    down: Vec = (SEA_EYE[0], -3.0, SEA_EYE[2] - 3.0)
    poses = {
        "palm": (PALM_EYE, PALM_TARGET),
        "jetty": (JETTY_EYE, JETTY_TARGET),
        "floor": (FLOOR_EYE, FLOOR_TARGET),
        "sea": (SEA_EYE, down),
    }
    return dict(zip(poses, posed.views(list(poses.values())), strict=True))


def sea_and_dune(posed: Posed) -> list[Picture]:
    """In one start: from 3 m above the sea, and low over it; two of a dune, the second 4 mm higher."""
    poses: list[tuple[Vec, Vec]] = [
        ((70.0, 3.0, 90.0), (170.0, 3.0, 190.0)),
        (SEA_EYE, (170.0, 0.7, 190.0)),
        ((-8.0, 8.0, -20.0), (4.0, 5.0, -24.0)),
        ((-8.0, 8.004, -20.0), (4.0, 5.004, -24.0)),
    ]
    return posed.views(poses, disable="particles")


def without(posed: Posed, name: str) -> dict[str, Any]:
    """The scene without one of its objects and without particles."""
    scene = posed.scene()
    scene["objects"] = [item for item in scene["objects"] if item["name"] != name]
    scene["particles"] = []
    return scene


def crown(posed: Posed) -> Vec:
    x, y, z = posed.scene()["particles"][0]["center"]
    return (x, y, z)


def plain(color: tuple[int, int, int]) -> bytes:
    """A texture of a single colour."""
    levels = tuple(bytes((*color, 255)) * (size * size) for size in (4, 2, 1))
    return encode_ktx2(Texture("RGBA8_SRGB", 4, 4, levels))


@pytest.mark.deep
def test_the_water_mirrors_the_palm(posed: Posed) -> None:
    x, y, z = crown(posed)
    here = pixel(PALM_EYE, PALM_TARGET, (x, -y, z))
    assert 0 < here[1] < HEIGHT, "the pose does not show the mirrored crown"
    with_palm = as_baked(posed)["palm"]
    bare = without(posed, "palm")
    assert around(differs(with_palm, posed.render(PALM_EYE, PALM_TARGET, scene=bare)), *here, 10).mean() > 0.1
    # Without the reflection pass the water does not show the palm.
    blind = posed.render(PALM_EYE, PALM_TARGET, disable="reflection")
    blind_bare = posed.render(PALM_EYE, PALM_TARGET, disable="reflection", scene=bare)
    assert not around(differs(blind, blind_bare), *here, 10).any()


@pytest.mark.deep
def test_waves_break_up_what_the_water_mirrors(posed: Posed) -> None:
    """So much that it is seen: with a strength of 0.02 it was 0.5 % of the pixels, with 0.12 it is 4.7 %."""
    seen = as_baked(posed)["jetty"]
    still = posed.scene()
    still["water"]["reflection_distortion"] = 0.0
    flat = posed.render(JETTY_EYE, JETTY_TARGET, time_s=1 / 30, scene=still)
    assert differs(seen, flat).mean() > 0.03


@pytest.mark.deep
def test_caustics_are_sharp_and_keep_the_brightness_of_the_floor(posed: Posed) -> None:
    """Bright lines and dark cells on the lagoon's floor, compared with a surface without waves."""
    even = Texture("RG8_SNORM", 4, 4, tuple(bytes(2 * size * size) for size in (4, 2, 1)))
    seen, still = (
        posed.render(FLOOR_EYE, FLOOR_TARGET, disable="water,post", files=files)
        for files in (None, {"water_normal": encode_ktx2(even)})
    )
    assert differs(seen, still).mean() > 0.8
    gain = seen.mean(axis=2) / still.mean(axis=2)
    assert gain.std() > 0.3  # by the divergence of the waves alone, with a flat top, it was 0.22
    assert 0.9 < gain.mean() < 1.15


@pytest.mark.deep
def test_wet_sand_mirrors_the_sky(posed: Posed) -> None:
    """Along the beach, where a film of water lies; rough sand of the same height does not."""
    seen = posed.render(BEACH_EYE, BEACH_TARGET, disable="water")
    rough = posed.scene()
    rough["terrain"]["wet_smoothness"] = 0.0
    dull = posed.render(BEACH_EYE, BEACH_TARGET, disable="water", scene=rough)
    changed = differs(seen, dull)
    assert changed.mean() > 0.03
    red, _, blue = seen[changed].mean(axis=0)
    assert blue > 0.82 * red  # sand with its grains on is at 0.77, a rough one at 0.72


@pytest.mark.deep
def test_reflection_and_refraction_change_water_and_nothing_else(posed: Posed) -> None:
    # Without the post pass, whose glow spreads light over every edge.
    whole = posed.render(PALM_EYE, PALM_TARGET, disable="post")
    bare = posed.render(PALM_EYE, PALM_TARGET, disable="post,water")
    for name in ("reflection", "refraction"):
        blind = posed.render(PALM_EYE, PALM_TARGET, disable=f"post,{name}")
        changed = differs(whole, blind)
        assert changed.mean() > 0.02
        # At its edge the water is transparent only with the refraction pass, which gives its depth.
        water = differs(whole, bare, 2.5 / 255.0) | differs(blind, bare, 2.5 / 255.0)
        assert (changed & ~water).mean() < 0.001
        assert not changed[: HEIGHT // 4].any()


@pytest.mark.deep
def test_the_palm_casts_a_shadow_on_the_sand(posed: Posed) -> None:
    scene = posed.scene()
    sun = np.asarray(scene["sun"]["direction"])
    top = np.asarray(crown(posed))
    place = top - sun * (top[1] - 0.4) / sun[1]
    eye, target = (place[0] - 4.0, 7.0, place[2] + 9.0), (place[0], 0.4, place[2])
    lit = posed.render(eye, target, disable=f"{DRY},shadow")
    shadowed = posed.render(eye, target, disable=DRY)
    dark = differs(lit, shadowed) & (shadowed.mean(axis=2) < lit.mean(axis=2))
    assert around(dark, WIDTH / 2, HEIGHT / 2, 40).mean() > 0.1
    # A shadow is never brighter than lit sand, and without the palm there is no shadow there.
    assert (differs(lit, shadowed) & (shadowed.mean(axis=2) > lit.mean(axis=2))).mean() < 0.002
    bare = without(posed, "palm")
    alone = differs(*(posed.render(eye, target, scene=bare, disable=off) for off in (DRY, f"{DRY},shadow")))
    assert around(alone, WIDTH / 2, HEIGHT / 2, 40).mean() < 0.01


@pytest.mark.deep
def test_a_shadow_caster_needs_positions_only(posed: Posed) -> None:
    scene = posed.scene()
    sun, top = np.asarray(scene["sun"]["direction"]), np.asarray(crown(posed))
    place = top - sun * (top[1] - 0.4) / sun[1]
    eye, target = (place[0] - 4.0, 7.0, place[2] + 9.0), (place[0], 0.4, place[2])
    palm = next(item for item in scene["objects"] if item["name"] == "palm")
    palm["views"] = ["shadow"]
    for material in palm["materials"].values():
        material["maps"] |= {"normal": None, "height": None, "gloss": None}
    scene["particles"] = []
    mesh = (posed.source / scene["artifacts"]["palm_mesh"]["file"]).read_bytes()
    bare = cut_glb(mesh, attributes=("POSITION", "TEXCOORD_0"))
    assert len(bare) < 0.7 * len(mesh)
    lit, shadowed = (
        posed.render(eye, target, scene=scene, files={"palm_mesh": bare}, disable=off)
        for off in ("shadow", "")
    )
    dark = differs(lit, shadowed) & (shadowed.mean(axis=2) < lit.mean(axis=2))
    assert around(dark, WIDTH / 2, HEIGHT / 2, 40).mean() > 0.1
    # Where the palm stood, the picture now shows what is behind it.
    beside = (float(top[0]) + 8.0, 4.0, float(top[2]) + 12.0)
    there, gone = (
        posed.render(beside, (float(top[0]), float(top[1]), float(top[2])), **given)
        for given in ({}, {"scene": scene, "files": {"palm_mesh": bare}})
    )
    assert around(differs(there, gone), WIDTH / 2, HEIGHT / 2, 15).mean() > 0.2


@pytest.mark.deep
def test_fronds_cast_shadows_with_their_alpha_cutoff(posed: Posed) -> None:
    scene = posed.scene()
    sun, top = np.asarray(scene["sun"]["direction"]), np.asarray(crown(posed))
    place = top - sun * (top[1] - 0.4) / sun[1]
    eye, target = (place[0] - 4.0, 7.0, place[2] + 9.0), (place[0], 0.4, place[2])
    lit = posed.render(eye, target, disable=f"{DRY},shadow")
    leaves = differs(lit, posed.render(eye, target, disable=DRY))
    for item in scene["objects"]:
        for material in item["materials"].values():
            material["alpha_cutoff"] = 0.0
    cards = differs(*(posed.render(eye, target, scene=scene, disable=off) for off in (f"{DRY},shadow", DRY)))
    assert (
        around(cards, WIDTH / 2, HEIGHT / 2, 50).sum() > 1.1 * around(leaves, WIDTH / 2, HEIGHT / 2, 50).sum()
    )


@pytest.mark.deep
def test_leaflets_cast_shadows_of_their_own(posed: Posed) -> None:
    """Beside the same shadow in a map of 4 mm a texel. One map of the whole square, 5 cm a texel,
    shows a third of its detail, at an error of 0.073."""
    scene = posed.scene()
    scene["particles"] = []
    sun, top = np.asarray(scene["sun"]["direction"]), np.asarray(crown(posed))
    place = top - sun * (top[1] - 0.4) / sun[1]
    eye, target = (place[0] - 2.0, 4.0, place[2] + 4.0), (place[0], 0.4, place[2])
    near = copy.deepcopy(scene)
    near["shadow"] |= {"extent_m": 16.0, "center": [float(place[0]), 0.4, float(place[2])], "size": 4096}
    visible = [
        posed.render(eye, target, scene=one).mean(axis=2)
        / np.maximum(posed.render(eye, target, scene=one, disable="shadow").mean(axis=2), 1e-3)
        for one in (scene, near)
    ]
    detail = [float(np.abs(np.diff(shadow, axis=1)).sum()) for shadow in visible]
    assert detail[0] > 0.38 * detail[1]
    assert np.sqrt(np.mean((visible[0] - visible[1]) ** 2)) < 0.067


@pytest.mark.deep
@pytest.mark.parametrize("elevation_deg", [45.0, 12.0, 85.0])
def test_lit_sand_does_not_shadow_itself(posed: Posed, elevation_deg: float) -> None:
    scene = posed.scene()
    scene["objects"], scene["particles"] = [], []
    angle = np.radians(elevation_deg)
    scene["sun"]["direction"] = [float(-np.cos(angle)), float(np.sin(angle)), 0.0]
    eye, target = (2.0, 2.5, 2.0), (2.0, 1.2, -4.0)  # the beach at the lagoon's head rises evenly
    lit = posed.render(eye, target, scene=scene, disable="shadow,water")
    shadowed = posed.render(eye, target, scene=scene, disable="water")
    assert differs(lit, shadowed).mean() < 0.02


@pytest.mark.deep
def test_outside_the_shadow_map_everything_is_lit(posed: Posed) -> None:
    scene = posed.scene()
    scene["shadow"] |= {"extent_m": 4.0, "center": [-60.0, 0.0, -60.0]}
    lit = posed.render(PALM_EYE, PALM_TARGET, disable="shadow")  # nor shafts, which shadows make
    outside = posed.render(PALM_EYE, PALM_TARGET, scene=scene, disable="shafts")
    assert not differs(lit, outside, 1.5 / 255.0).any()


@pytest.mark.deep
def test_steep_water_shows_the_floor_and_grazing_water_the_sky(posed: Posed) -> None:
    steep = posed.render(FLOOR_EYE, FLOOR_TARGET)
    floor = differs(steep, posed.render(FLOOR_EYE, FLOOR_TARGET, disable="refraction"), 12 / 255.0).mean()
    sky = differs(steep, posed.render(FLOOR_EYE, FLOOR_TARGET, disable="reflection"), 12 / 255.0).mean()
    assert floor > 0.8
    assert sky < 0.1
    flat = posed.render(SEA_EYE, SEA_TARGET)
    half = slice(HEIGHT // 2, HEIGHT * 3 // 4)
    floor = differs(flat, posed.render(SEA_EYE, SEA_TARGET, disable="refraction"), 12 / 255.0)[half].mean()
    sky = differs(flat, posed.render(SEA_EYE, SEA_TARGET, disable="reflection"), 12 / 255.0)[half].mean()
    assert sky > 0.2
    assert floor < 0.05


@pytest.mark.deep
def test_shallows_are_turquoise_and_the_open_sea_is_blue(posed: Posed) -> None:
    red, green, blue = as_baked(posed)["floor"].mean(axis=(0, 1))
    assert green > 1.15 * red
    assert blue > red
    red, green, blue = as_baked(posed)["sea"].mean(axis=(0, 1))
    assert blue > 1.2 * green > 1.2 * red


@pytest.mark.deep
def test_a_pole_is_bent_where_it_enters_the_water(posed: Posed) -> None:
    # Below the water the jetty appears nearer to the surface than along a straight ray. Without refraction
    # (index 1) its picture reaches further down.
    bare = without(posed, "jetty")
    seen = differs(posed.render(JETTY_EYE, JETTY_TARGET), posed.render(JETTY_EYE, JETTY_TARGET, scene=bare))
    dry = differs(
        posed.render(JETTY_EYE, JETTY_TARGET, disable="water,refraction"),
        posed.render(JETTY_EYE, JETTY_TARGET, scene=bare, disable="water,refraction"),
    )
    blind = differs(
        posed.render(JETTY_EYE, JETTY_TARGET, disable="refraction,reflection"),
        posed.render(JETTY_EYE, JETTY_TARGET, scene=bare, disable="refraction,reflection"),
    )
    below = ~blind & dry  # pixels of the part under water along straight rays
    assert below.mean() > 0.01, "the pose does not show poles under water"
    assert (seen & below).sum() > 0.1 * below.sum()  # it is visible through the water,
    assert (seen & below).sum() < 0.9 * below.sum()  # but not at these pixels


@pytest.mark.deep
def test_effect_map_only_below_mix_low_and_sand_only_above_mix_high(posed: Posed) -> None:
    strange = plain((255, 0, 255))
    (floor, dune), other_sand, other_effect = (
        posed.views([(FLOOR_EYE, FLOOR_TARGET), (DUNE_EYE, DUNE_TARGET)], disable="water", files=files)
        for files in ({}, {"sand_color": strange}, {"effect_color": strange})
    )
    assert not differs(floor, other_sand[0], 1.5 / 255).any()
    assert differs(dune, other_sand[1]).mean() > 0.5
    assert not differs(dune, other_effect[1], 1.5 / 255).any()
    assert differs(floor, other_effect[0]).mean() > 0.9


@pytest.mark.deep
def test_sand_neither_shimmers_nor_fades_to_one_colour(posed: Posed) -> None:
    first, moved = sea_and_dune(posed)[2:]
    near = (slice(HEIGHT * 2 // 3, HEIGHT), slice(0, WIDTH))
    grain = np.abs(np.diff(first[near].mean(axis=2), axis=1)).mean()
    flicker = np.abs(first[near] - moved[near]).mean()
    assert grain > 0.002
    assert flicker < 0.012


@pytest.mark.deep
def test_sparkles_are_light_around_the_palm_only(posed: Posed) -> None:
    field = posed.scene()["particles"][0]
    eye, target = (-12.0, 3.5, 8.0), crown(posed)
    whole = posed.render(eye, target, time_s=2.0)
    bare = posed.render(eye, target, time_s=2.0, disable="particles")
    changed = differs(whole, bare, 2.5 / 255.0)
    assert 0 < changed.mean() < 0.05
    assert (whole[changed].sum(axis=1) > bare[changed].sum(axis=1)).all()
    x, y = pixel(eye, target, crown(posed))
    metre = abs(pixel(eye, target, (crown(posed)[0], crown(posed)[1] + 1.0, crown(posed)[2]))[1] - y)
    rows, columns = np.nonzero(changed[: int(y + 20)])
    # They drift upwards; nearer ones appear further out.
    assert np.hypot(columns - x, rows - y).max() < (field["radius_m"] * 1.6 + 1.0) * metre
    later = posed.render(eye, target, time_s=9.0)
    assert differs(whole, later, 2.5 / 255.0)[: HEIGHT // 3].any()


@pytest.mark.deep
def test_the_sky_fills_what_nothing_else_covers(posed: Posed) -> None:
    whole = posed.render(PALM_EYE, PALM_TARGET, disable="water,particles")
    changed = differs(whole, posed.render(PALM_EYE, PALM_TARGET, disable="water,particles,sky"))
    horizon = round(pixel(PALM_EYE, PALM_TARGET, (-2000.0, 1.6, -450.0))[1])
    assert changed[: HEIGHT // 5].mean() > 0.7
    assert changed[horizon + 12 :].mean() < 0.05


@pytest.mark.deep
def test_relief_of_the_wood_is_seen_and_parallax_moves_it_alone(posed: Posed) -> None:
    eye, target = (38.0, 1.75, 28.0), (37.9, 1.2, 27.0)  # so near that a pixel covers few texels
    scene = without(posed, "palm")
    flat = without(posed, "palm")
    wood = next(item for item in flat["objects"] if item["name"] == "jetty")
    for material in wood["materials"].values():
        material["parallax_scale"] = material["parallax_bias"] = 0.0
    # Without shadows, which hide some of it.
    whole, unmoved, bare = (
        posed.render(eye, target, scene=one, disable="shadow")
        for one in (scene, flat, without(posed, "jetty"))
    )
    changed, jetty = differs(whole, unmoved, 3.5 / 255.0), differs(whole, bare)
    assert (changed & jetty).sum() > 0.05 * jetty.sum()
    assert (changed & ~jetty).mean() < 0.02  # its reflection remains
    level = Texture("RG8_SNORM", 4, 4, tuple(bytes(2 * size * size) for size in (4, 2, 1)))
    files = {"jetty_normal": encode_ktx2(level)}
    even = posed.render(eye, target, scene=scene, disable="shadow", files=files)
    assert (differs(whole, even) & jetty).sum() > 0.2 * jetty.sum()


@pytest.mark.deep
def test_an_eye_at_the_water_surface_gives_a_clean_picture(posed: Posed) -> None:
    for height_m in (0.02, 0.0, -0.02, -0.8):
        picture = posed.render((0.0, height_m, 20.0), (0.0, height_m + 0.1, 0.0))
        assert picture.mean() > 0.05
        assert picture.std() > 0.005


@pytest.mark.deep
def test_an_eye_in_the_sea_sees_the_sky_straight_above_and_only_water_at_flat_angles(posed: Posed) -> None:
    """Beyond 49 degrees from the vertical the surface reflects all light: Snell's law."""
    eye: Vec = (70.0, -1.0, 90.0)
    poses: list[tuple[Vec, Vec]] = [(eye, (70.0, 4.0, 90.5)), (eye, (90.0, 5.0, 90.0))]
    above, aside = (
        picture[80:100, 150:170].mean(axis=(0, 1)) for picture in posed.views(poses, disable="particles,post")
    )
    assert above[2] > 1.3 * above[1], "the sky is blue"
    assert aside[1] > 1.1 * aside[2], "the water glows turquoise"


@pytest.mark.deep
def test_the_far_sea_is_no_dark_strip_under_the_horizon(posed: Posed) -> None:
    picture = sea_and_dune(posed)[0]
    rows = picture[HEIGHT // 2 : HEIGHT // 2 + 14].mean(axis=(1, 2))  # from the horizon to the nearer waves
    darkest = rows.argmin()
    assert rows[darkest:].max() - rows[darkest] < 0.08  # it was 0.13: a grey strip


@pytest.mark.deep
def test_the_horizon_fades_into_haze(posed: Posed) -> None:
    picture = sea_and_dune(posed)[1]
    column: Picture = picture[HEIGHT // 2 - 10 : HEIGHT // 2 + 10].mean(axis=1)
    assert np.abs(np.diff(column, axis=0)).max() < 0.1

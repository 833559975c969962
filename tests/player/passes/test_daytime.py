"""Day turns into night along the flight: sun, moon, stars, clouds, shadows, exposure, each where it shows."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.pictures import load
from tests.player.posed import differs
from tests.player.synthetic import identity, texture, write_scene
from tests.sweeps import sweep

Picture = NDArray[Any]
DAY_S, DUSK_S, NIGHT_S, DAWN_S = 1.0, 4.0, 6.0, 8.5  # of the keys, on a flight of 10 s
MOON = np.array([0.498, 0.342, 0.797])  # towards it at night: 148 degrees from the north, 20 high
SIZE = (160, 90)


def light(azimuth_deg: float, elevation_deg: float, intensity: float) -> dict[str, Any]:
    return {
        "azimuth_rad": float(np.radians(azimuth_deg)),
        "elevation_rad": float(np.radians(elevation_deg)),
        "color": [1.0, 0.9, 0.75],
        "intensity": intensity,
    }


def key(at_s: float, sun: dict[str, Any], moon: dict[str, Any], share: float, sky: str) -> dict[str, Any]:
    """share: of the light of day that is left around."""
    return {
        "at_s": at_s,
        "sun": sun,
        "moon": moon,
        "ambient": {"color": [0.5, 0.65, 1.0], "intensity": 0.6 * share},
        "fog": {"color": [0.7 * share, 0.8 * share, 0.9 * share], "density_per_m": 0.0},
        "exposure": 1.0,
        "cubemap": sky,
        "cubemap_azimuth_rad": 0.0,
    }


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A box on a plane, by the sea, with a day and a night sky of one colour each and clouds all around."""
    folder = write_scene(tmp_path_factory.mktemp("daytime"))
    manifest = json.loads((folder / "scene.json").read_text())
    cube = np.zeros((6, 8, 8, 4), np.float16)
    cube[..., :3], cube[..., 3] = (0.2, 0.35, 0.7), 1.0
    clouds = np.zeros((32, 32, 4), np.uint8)
    clouds[:, :16] = (255, 128, 200, 255)  # in one half of each repeat
    files = {
        "sky": texture("RGBA16F", cube),
        "sky_2": texture("RGBA16F", cube * np.float16(0.02)),
        "clouds_color": texture("RGBA8_SRGB", clouds),
    }
    for name, data in files.items():
        (folder / f"{name}.ktx2").write_bytes(data)
        entry = copy.deepcopy(manifest["artifacts"]["sky"]) | identity(data) | {"file": f"{name}.ktx2"}
        manifest["artifacts"][name] = entry | {"kind": "texture" if name == "clouds_color" else "cubemap"}
    manifest["streaming"] = sorted(manifest["artifacts"])
    down = light(148.0, -5.0, 0.0)
    manifest["daytime"] = {
        "keys": [
            key(DAY_S, light(100.0, 50.0, 3.0), down, 1.0, "sky"),
            key(DUSK_S, light(250.0, -5.0, 0.0), down, 0.1, "sky_2"),
            key(NIGHT_S, light(300.0, -20.0, 0.0), light(148.0, 20.0, 0.3), 0.02, "sky_2"),
            key(DAWN_S, light(60.0, -5.0, 0.0), down, 0.1, "sky_2"),
        ],
        "moon_diameter_rad": 0.1,
        "clouds": None,
    }
    manifest["particles"] = []
    (folder / "plain.json").write_text(json.dumps(manifest))
    return folder


@pytest.fixture(scope="module")
def kept() -> dict[str, Picture]:
    """Pictures that more than one test looks at."""
    return {}


@pytest.fixture
def picture(
    scene: Path, player: Callable[..., Any], tmp_path: Path, kept: dict[str, Picture]
) -> Callable[..., Picture]:
    """Renders the scene at a second, looking from `eye` along `ahead`, after a change of its manifest.
    frames: how many, if more than one, 1/30 s apart."""
    plain = json.loads((scene / "plain.json").read_text())

    def render(
        time_s: float,
        *arguments: object,
        frames: int = 1,
        change: Callable[[dict[str, Any]], Any] = lambda _: None,
        eye: Any = (0.0, 3.0, 9.0),
        ahead: Any = (0.0, -0.2, -1.0),
        size: tuple[int, int] = SIZE,
    ) -> Picture:
        manifest = copy.deepcopy(plain)
        target = np.add(eye, ahead)
        still = {
            "roll": [0.0] * 4,
            "eye": [[v, 0, 0, 0] for v in eye],
            "target": [[v, 0, 0, 0] for v in target],
        }
        manifest["flight"] |= {"segments": [still], "waypoint_u": [0]}
        manifest["flight"]["time_table"] = [[0.0, 0.0, 0.1], [10.0, 1.0, 0.1]]
        change(manifest)
        wanted = repr((time_s, arguments, frames, size, manifest))
        if wanted in kept:
            return kept[wanted]
        (scene / "scene.json").write_text(json.dumps(manifest))
        out = tmp_path / "picture.png"
        given = ["--time", time_s, "--size", f"{size[0]}x{size[1]}", "--screenshot", out]
        given += ["--check-finite", "--debug"]
        if frames > 1:
            given += ["--frames", frames, "--wait-resident"]
        result = player(scene, *given, *arguments)
        assert result.returncode == 0, result.stderr
        files = [out] if frames == 1 else [tmp_path / f"picture_{i:04}.png" for i in range(frames)]
        pictures = [load(file) for file in files]
        kept[wanted] = pictures[0] if frames == 1 else np.stack(pictures)
        return kept[wanted]

    return render


def test_at_a_key_the_scene_is_lit_as_one_whose_light_stands_still(picture: Callable[..., Picture]) -> None:
    def standing(manifest: dict[str, Any]) -> None:
        day = manifest["daytime"]["keys"][0]
        azimuth, elevation = day["sun"]["azimuth_rad"], day["sun"]["elevation_rad"]
        direction = [
            np.sin(azimuth) * np.cos(elevation),
            np.sin(elevation),
            -np.cos(azimuth) * np.cos(elevation),
        ]
        manifest["sun"] |= {"direction": direction, "color": day["sun"]["color"], "intensity": 3.0}
        manifest |= {key: day[key] for key in ("ambient", "fog", "exposure")} | {"daytime": None}

    same = [picture(DAY_S, "--disable", "water", change=change) for change in (lambda _: None, standing)]
    ground = np.s_[60:]  # below the horizon: the sky has no disc where it stands still
    assert np.abs(same[0][ground] - same[1][ground]).max() < 2.5 / 255.0


def test_shadows_turn_with_the_sun_and_moonlight_casts_them_too(picture: Callable[..., Picture]) -> None:
    lit, dark = (
        [picture(s, "--disable", f"water,reflection,refraction{off}") for s in (DAY_S, 2.0, NIGHT_S)]
        for off in (",shadow", "")
    )
    morning, later, night = (differs(a, b, 2.5 / 255.0) for a, b in zip(lit, dark, strict=True))
    for shadow in (morning, later, night):
        assert 0.005 < shadow.mean() < 0.3
    assert (morning ^ later).mean() > 0.5 * morning.mean()


def test_the_night_is_dark_and_the_exposure_follows(picture: Callable[..., Picture]) -> None:
    day, night = picture(DAY_S), picture(NIGHT_S)
    assert night.mean() < 0.25 * day.mean()

    def longer(manifest: dict[str, Any]) -> None:
        manifest["daytime"]["keys"][2]["exposure"] = 3.0

    assert picture(NIGHT_S, change=longer).mean() > 1.5 * night.mean()


@pytest.mark.deep
def test_the_sky_darkens_all_the_way_between_two_keys(picture: Callable[..., Picture]) -> None:
    day, between, dusk = (picture(s, ahead=(-0.7, 1.0, 0.2)).mean() for s in (DAY_S, 2.5, DUSK_S - 0.01))
    assert dusk < 0.9 * between
    assert between < 0.95 * day


def test_moon_and_stars_stand_in_the_night_sky_alone(picture: Callable[..., Picture]) -> None:
    day, night = (picture(s, ahead=MOON) for s in (DAY_S, NIGHT_S))
    middle = np.s_[SIZE[1] // 2 - 3 : SIZE[1] // 2 + 3, SIZE[0] // 2 - 3 : SIZE[0] // 2 + 3]
    assert night[middle].mean() > 0.4 > 2.0 * np.median(night)
    assert np.ptp(day[:30].mean(axis=2)) < 0.1
    up = [picture(s, ahead=(-0.7, 1.0, 0.2)) for s in (DAY_S, NIGHT_S)]
    bright = [(sky.max(axis=2) > np.median(sky.max(axis=2)) + 0.08).mean() for sky in up]
    assert bright[0] == 0.0
    assert 0.002 < bright[1] < 0.05


WIDE_RAD = 0.5  # of a moon that is to be looked at closely
WIDE_PX = 0.5 * WIDE_RAD * SIZE[1] / 2 / np.tan(0.45)  # its radius


def wide(manifest: dict[str, Any]) -> None:
    manifest["daytime"]["moon_diameter_rad"] = WIDE_RAD


def test_the_moon_is_as_wide_as_the_scene_says(picture: Callable[..., Picture]) -> None:
    disc = picture(NIGHT_S, "--disable", "post", ahead=MOON, change=wide).max(axis=2) > 0.2
    # The limb and the seas of the disc are darker than the rest.
    assert 0.9 < disc.sum() / (np.pi * WIDE_PX**2) < 0.98


def test_the_moon_is_lit_from_the_right_and_a_little_from_above(picture: Callable[..., Picture]) -> None:
    shown = picture(NIGHT_S, "--disable", "post", ahead=MOON, change=wide).max(axis=2)
    y, x = (np.mgrid[: SIZE[1], : SIZE[0]] - (np.array(SIZE[::-1])[:, None, None] - 1) / 2) / WIDE_PX
    limb = (np.hypot(x, y) < 0.97) & (np.hypot(x, y) > 0.85)
    right, left, above, below = (
        shown[limb & side].mean() for side in (x > 0.7, x < -0.7, (x < 0) & (y < -0.4), (x < 0) & (y > 0.4))
    )
    assert right > 2.0 * left
    assert above > 1.1 * below


def test_the_moon_hides_the_stars_behind_it(picture: Callable[..., Picture]) -> None:
    def dark(manifest: dict[str, Any]) -> None:
        wide(manifest)
        manifest["daytime"]["keys"][2]["moon"]["intensity"] = 0.0

    shown = picture(NIGHT_S, "--disable", "post", ahead=MOON, change=dark).max(axis=2)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] - (np.array(SIZE[::-1])[:, None, None] - 1) / 2
    disc = np.hypot(x, y) < 0.8 * WIDE_PX
    assert shown[disc & (x > 0)].max() < 0.5 * np.median(shown)


def test_stars_turn_slowly_and_do_not_flicker(picture: Callable[..., Picture]) -> None:
    """Their light stays the same as they pass from pixel to pixel."""
    skies = picture(NIGHT_S, frames=4, ahead=(-0.7, 1.0, 0.2))
    sums = [float((sky**2.2).sum()) for sky in skies]
    assert np.ptp(sums) < 0.05 * np.mean(sums)
    assert differs(skies[0], skies[3], 20.0 / 255.0).mean() > 0.002


def flat_sea(manifest: dict[str, Any]) -> None:
    """A mirror without glitter."""
    manifest["water"] |= {"specular": 0.0, "reflection_distortion": 0.0}


@pytest.mark.parametrize(
    ("second", "light"), sweep([(NIGHT_S, "moon"), (DAY_S, "sun")], test=[(NIGHT_S, "moon")])
)
def test_the_sea_mirrors_no_disc_whose_glitter_it_draws(
    picture: Callable[..., Picture], second: float, light: str
) -> None:
    """So a disc ten times as wide changes nothing in a sea that does not glitter."""

    def low(width_rad: float) -> Callable[[dict[str, Any]], None]:
        def change(manifest: dict[str, Any]) -> None:
            flat_sea(manifest)
            for one in manifest["daytime"]["keys"]:
                one[light] |= {"azimuth_rad": np.pi, "elevation_rad": 0.3}  # over +Z
            manifest["sun"]["angular_diameter_rad"] = width_rad
            manifest["daytime"]["moon_diameter_rad"] = width_rad

        return change

    above, mirrored = (
        [
            picture(second, change=low(width), eye=(0.0, 2.0, 60.0), ahead=(0.0, side * np.tan(0.3), 1.0))
            for width in (0.01, 0.1)
        ]
        for side in (1.0, -1.0)
    )
    assert differs(above[0], above[1]).mean() > 0.002
    assert not differs(mirrored[0], mirrored[1]).any()


def test_the_sea_mirrors_no_disc_of_a_sky_that_stands_still(
    picture: Callable[..., Picture], scene: Path
) -> None:
    """A picture of a sky has its sun painted in. A pixel of the mirror image is narrower than that sun."""
    shown = 320, 180
    size = 256
    s, t = np.meshgrid(*[(np.arange(size) + 0.5) / size * 2.0 - 1.0] * 2)
    towards = np.stack([s, -t, np.ones_like(s)], axis=-1)  # of the face +Z
    towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
    sun = np.array([0.0, np.sin(0.3), np.cos(0.3)])
    cube = np.zeros((6, size, size, 4), np.float16)
    cube[..., :3], cube[..., 3] = (0.2, 0.35, 0.7), 1.0
    cube[4, towards @ sun > np.cos(np.radians(0.45)), :3] = 40.0
    data = texture("RGBA16F", cube)
    (scene / "painted.ktx2").write_bytes(data)

    def painted(manifest: dict[str, Any]) -> None:
        flat_sea(manifest)
        entry = manifest["artifacts"]["sky"] | identity(data) | {"file": "painted.ktx2"}
        manifest["artifacts"]["sky"] = entry
        manifest |= {"daytime": None}
        manifest["sun"]["direction"] = sun.tolist()

    above, mirrored = (
        picture(
            DAY_S, change=painted, eye=(0.0, 2.0, 60.0), ahead=(0.0, side * np.tan(0.3), 1.0), size=shown
        ).max(axis=2)
        for side in (1.0, -1.0)
    )
    here = np.s_[shown[1] // 2 - 2 : shown[1] // 2 + 2, shown[0] // 2 - 2 : shown[0] // 2 + 2]
    beside = np.s_[shown[1] // 2 - 2 : shown[1] // 2 + 2, shown[0] // 2 + 25 : shown[0] // 2 + 30]
    assert above[here].mean() > above[beside].mean() + 0.1
    assert mirrored[here].mean() < mirrored[beside].mean() + 0.1


def test_the_air_glows_around_the_sun(picture: Callable[..., Picture]) -> None:
    elevation = np.radians(50.0)
    azimuth = np.radians(100.0)
    sun = [np.sin(azimuth) * np.cos(elevation), np.sin(elevation), -np.cos(azimuth) * np.cos(elevation)]
    row = picture(DAY_S, "--disable", "post", ahead=sun)[SIZE[1] // 2].mean(axis=1)
    near, far = row[SIZE[0] // 2 + 6], row[-5]  # 4 and 40 degrees beside it
    assert near > far + 0.05


def test_the_moon_draws_a_path_of_glitter_on_the_sea(picture: Callable[..., Picture]) -> None:
    def dim(manifest: dict[str, Any]) -> None:
        manifest["daytime"]["keys"][2]["moon"]["intensity"] = 0.0

    sea = {"eye": (0.0, 2.0, -60.0), "ahead": MOON * [1.0, 0.0, 1.0] + [0.0, -0.15, 0.0]}
    changed = differs(picture(NIGHT_S, **sea), picture(NIGHT_S, change=dim, **sea), 8.0 / 255.0)[50:]
    columns = changed.mean(axis=0)
    assert columns[60:100].mean() > 0.2
    assert columns[60:100].mean() > 2.0 * columns[:30].mean()


def test_clouds_cover_the_sky_and_drift_round_in_a_flight(picture: Callable[..., Picture]) -> None:
    def cloudy(manifest: dict[str, Any]) -> None:
        clouds = {"color": "clouds_color", "high_rad": 0.4, "repeat": 8, "drift_repeats": 1}
        manifest["daytime"]["clouds"] = clouds

    def at(second: float, change: Callable[[dict[str, Any]], None]) -> Picture:
        return picture(second, "--disable", "water,terrain,objects", change=change, ahead=(0.0, 0.2, -1.0))

    clear, now, later = at(DAY_S, lambda _: None), at(DAY_S, cloudy), at(DAY_S + 2.5, cloudy)
    covered = differs(clear, now)
    assert 0.1 < covered.mean() < 0.6
    row = 35
    assert (covered[row] ^ differs(at(DAY_S + 2.5, lambda _: None), later)[row]).mean() > 0.3
    assert np.array_equal(now, at(DAY_S + 10.0, cloudy))


def test_clouds_are_bright_on_the_side_of_the_light(picture: Callable[..., Picture]) -> None:
    """Their picture is twice as bright lit from the right as from the left."""

    def cloudy(side: float) -> Callable[[dict[str, Any]], None]:
        def change(manifest: dict[str, Any]) -> None:
            clouds = {"color": "clouds_color", "high_rad": 0.4, "repeat": 8, "drift_repeats": 1}
            manifest["daytime"]["clouds"] = clouds
            manifest["daytime"]["keys"][0]["sun"] |= {"azimuth_rad": side * np.pi / 2, "elevation_rad": 0.2}

        return change

    right, left = (
        picture(DAY_S, "--disable", "water,terrain,objects,post", change=cloudy(side), ahead=(0.0, 0.2, -1.0))
        for side in (1.0, -1.0)
    )
    cloud = differs(right, left)
    assert cloud.mean() > 0.1
    assert right[cloud].mean() > 1.15 * left[cloud].mean()


@pytest.mark.deep
def test_clouds_at_dusk_are_about_as_bright_as_the_sky_that_lights_them(
    picture: Callable[..., Picture],
) -> None:
    """Neither sun nor moon lights, and the scene's ambient light is five times as bright as the sky."""

    def cloudy(manifest: dict[str, Any]) -> None:
        clouds = {"color": "clouds_color", "high_rad": 0.4, "repeat": 8, "drift_repeats": 0}
        manifest["daytime"]["clouds"] = clouds

    def at(second: float, change: Callable[[dict[str, Any]], None] = lambda _: None) -> Picture:
        return picture(second, "--disable", "water,terrain,objects", change=change, ahead=(0.0, 0.2, -1.0))

    covered = differs(at(DAY_S), at(DAY_S, cloudy))
    sky, clouds = ((one[covered] ** 2.2).mean() for one in (at(DUSK_S), at(DUSK_S, cloudy)))
    assert 0.4 * sky < clouds < 1.6 * sky


def test_the_loop_closes_and_a_moment_looks_the_same_however_it_is_reached(
    picture: Callable[..., Picture], scene: Path, player: Callable[..., Any], tmp_path: Path
) -> None:
    start, end, before = (picture(s, "--disable", "water") for s in (0.0, 10.0, 9.97))
    assert np.array_equal(start, end)
    assert np.percentile(np.abs(start - before), 99) < 0.03
    shot = picture(5.0, "--disable", "water")
    arguments = ("--time", 4.9, "--frames", 4, "--size", f"{SIZE[0]}x{SIZE[1]}", "--disable", "water")
    result = player(scene, *arguments, "--wait-resident", "--screenshot", tmp_path / "played.png")
    assert result.returncode == 0, result.stderr
    played = load(tmp_path / "played_0003.png")
    assert np.abs(played - shot).max() < 1.5 / 255.0

"""The island's sources: the scripts make them again; tiles, cube and loop have no seam; levels as told."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
import soundfile
from numpy.typing import NDArray

Array = NDArray[Any]
RAW = Path(__file__).resolve().parents[3] / "raw_assets"
LIMIT_BYTES = 25_000_000
SCRIPTS = {
    "terrain": ["terrain/height.png"],
    "sand": ["terrain/sand.png", "terrain/sand_height.png"],
    "effect": ["terrain/effect.png", "terrain/effect_height.png"],
    "water": ["water/waves.png"],
    "sky": [f"sky/golden/{name}.exr" for name in ("px", "nx", "py", "ny", "pz", "nz")],
    "clouds": ["sky/clouds.png"],
    "animals": ["animals/gull.png", "animals/crab.png"],
}
LAST_BIT = {"terrain/effect_height.png": 16}  # written in multiples of 16 grey levels


def script(name: str) -> ModuleType:
    """A module of raw_assets/make."""
    if str(RAW / "make") not in sys.path:
        sys.path.append(str(RAW / "make"))
    return importlib.import_module(name)


def pixels(path: Path, kind: str) -> Array:
    """An image as stored: (h, w, c) of the numpy type named."""
    image = oiio.ImageInput.open(str(path))
    assert image is not None, oiio.geterror()
    data = image.read_image(kind)
    image.close()
    return np.asarray(data)


def half_steps(values: Array) -> Array:
    """Half floats as integers that count their steps, negative values below zero."""
    bits = values.astype(np.float16).view(np.int16).astype(np.int32)
    return np.where(bits < 0, -(bits & 0x7FFF), bits)


@pytest.mark.deep
@pytest.mark.parametrize("name", SCRIPTS)
def test_script_makes_the_same_pictures_again_to_one_step(name: str, tmp_path: Path) -> None:
    script(name).make(tmp_path)
    for file in SCRIPTS[name]:
        if file.endswith(".exr"):
            made, kept = (half_steps(pixels(p / file, "half")) for p in (tmp_path, RAW))
        else:
            kind = "uint16" if file.endswith(("height.png", "waves.png")) else "uint8"
            made, kept = (pixels(p / file, kind).astype(np.int32) for p in (tmp_path, RAW))
        assert made.shape == kept.shape
        assert np.abs(made - kept).max() <= LAST_BIT.get(file, 1), file


@pytest.mark.deep
def test_script_makes_the_same_sound_again(tmp_path: Path) -> None:
    script("sound").make(tmp_path)
    made, rate = soundfile.read(tmp_path / "sound/ocean.ogg", dtype="float64")
    kept, kept_rate = soundfile.read(RAW / "sound/ocean.ogg", dtype="float64")
    assert (rate, made.shape) == (kept_rate, kept.shape)
    assert np.abs(made - kept).max() <= 1.0 / 32768.0


def test_sources_stay_below_25_megabytes() -> None:
    total = sum(p.stat().st_size for p in RAW.rglob("*") if p.is_file() and "__pycache__" not in p.parts)
    assert 0 < total <= LIMIT_BYTES


def test_every_source_is_told_of_in_the_list() -> None:
    result = (RAW / "SOURCES.md").read_text(encoding="utf-8")
    for files in SCRIPTS.values():
        for file in files:
            assert file in result or (file.startswith("sky/golden/") and file[11:13] in result), file


@pytest.mark.parametrize("file", ["terrain/sand.png", "terrain/sand_height.png", "water/waves.png"])
@pytest.mark.parametrize("axis", [0, 1])
def test_tile_meets_itself_no_harsher_than_it_meets_within(file: str, axis: int) -> None:
    image = pixels(RAW / file, "float").astype(np.float64)
    step = np.abs(np.diff(image, axis=axis, append=np.take(image, [0], axis)))
    per_line = step.mean(axis=(1 - axis, 2))
    assert per_line[-1] <= per_line[:-1].max()
    # and the slope goes on: the second difference across the seam is no larger than elsewhere
    bend = np.abs(np.roll(image, -1, axis) - 2.0 * image + np.roll(image, 1, axis)).mean(axis=(1 - axis, 2))
    assert max(bend[0], bend[-1]) <= bend[1:-1].max() * 1.02


def test_sand_is_pale_gold_and_no_part_of_it_stands_out() -> None:
    image = pixels(RAW / "terrain/sand.png", "float")
    assert np.abs(image.mean((0, 1)) * 255 - (0xE8, 0xD3, 0xA2)).max() < 2.0
    blocks = image.reshape(8, 128, 8, 128, 3).mean((1, 3))
    assert np.ptp(blocks, axis=(0, 1)).max() * 255 < 4.0


def test_terrain_is_an_island_with_dunes_lagoon_and_a_floor_that_ends_level() -> None:
    terrain = script("terrain")
    image = pixels(RAW / "terrain/height.png", "uint16")[:, :, 0].astype(np.float64)
    height = terrain.BLACK_M + image / 65535.0 * (terrain.WHITE_M - terrain.BLACK_M)
    assert height.shape == (1025, 1025)
    assert height.max() == pytest.approx(6.0, abs=0.01)
    assert -16.0 < height.min() < -14.5
    edges = np.concatenate([height[0], height[-1], height[:, 0], height[:, -1]])
    assert np.abs(edges + 15.0).max() < 0.01
    columns = np.flatnonzero((height > 0.0).any(0)) / 1024.0 * 200.0 - 100.0
    assert 110.0 < np.ptp(columns) < 125.0
    x, z, _ = terrain.LAGOON
    assert -2.2 < height[int((z / 200 + 0.5) * 1024), int((x / 200 + 0.5) * 1024)] < -1.0
    # a bather walks out of the lagoon to the open sea without crossing land
    south = height[int((z / 200 + 0.5) * 1024) :, int((x / 200 + 0.5) * 1024)]
    assert (south < -0.5).all()


def test_terrain_has_no_stairs() -> None:
    image = pixels(RAW / "terrain/height.png", "uint16")[:, :, 0]
    assert np.unique(image).size > 20_000
    assert np.unique(image % 256).size == 256


def sky_faces(sky: str) -> Any:
    """The six faces of a sky: (6, n, n, 3)."""
    names = script("sky").FACES
    return np.stack([pixels(RAW / f"sky/{sky}/{name}.exr", "float") for name in names])


@pytest.mark.deep
def test_cube_faces_meet_along_all_twelve_edges() -> None:
    sky = script("sky")
    faces = sky_faces("golden")
    size = faces.shape[1]
    assert faces.shape == (6, size, size, 3)
    rays = np.stack([sky.face_directions(face, size) for face in range(6)])
    border = np.zeros((size, size), bool)
    border[0] = border[-1] = border[:, 0] = border[:, -1] = True
    points, colors = rays[:, border].reshape(-1, 3), faces[:, border].reshape(-1, 3)
    owner = np.repeat(np.arange(6), int(border.sum()))
    # how much neighbours within a face differ, along the same borders
    rows = np.abs(faces[:, [0, -1]] - faces[:, [1, -2]]).mean((2, 3))
    columns = np.abs(faces[:, :, [0, -1]] - faces[:, :, [1, -2]]).mean((1, 3))
    inside = max(rows.max(), columns.max())
    worst, edges = 0.0, set()
    for face in range(6):
        mine = owner == face
        others = ~mine
        # each border texel's nearest texel of another face lies across the edge, a texel away
        cosine = points[mine] @ points[others].T
        nearest = cosine.argmax(1)
        assert np.arccos(np.clip(cosine.max(1), -1, 1)).max() < 2.5 / size
        gap = np.abs(colors[mine] - colors[others][nearest])
        worst = max(worst, float(gap.mean()))
        edges |= {tuple(sorted((face, int(o)))) for o in np.unique(owner[others][nearest])}
    assert len(edges) == 12
    assert worst <= 1.5 * inside + 1e-3


@pytest.mark.parametrize("number", range(7))
def test_a_clear_sky_of_128_texels_a_face_holds_what_1024_would(number: int) -> None:
    """Read between texels, at 63,000 places of the faces ahead, above and to the side."""
    sky = script("sky")
    one, last = sky.SKIES[number], sky.PIXELS - 1
    errors = []
    for face in (0, 2, 5):
        texels = sky.radiance(one, sky.face_directions(face))
        rays = sky.face_directions(face, 8 * sky.PIXELS)[4:-4:7, 4:-4:7]
        at = (np.arange(8 * sky.PIXELS)[4:-4:7] + 0.5) / 8 - 0.5
        first = np.minimum(at.astype(int), last - 1)
        part = at - first
        rows = texels[:, first] + part[:, None] * (texels[:, first + 1] - texels[:, first])
        read = rows[first] + part[:, None, None] * (rows[first + 1] - rows[first])
        exact = sky.radiance(one, rays)
        errors.append((np.abs(read - exact).max(axis=2) / exact.max(axis=2)).ravel())
    assert np.quantile(errors, 0.99) < 0.0025 and np.max(errors) < 0.03


def test_each_sky_is_brightest_at_its_horizon_towards_the_north_where_its_light_stands() -> None:
    sky = script("sky")
    rays = np.stack([sky.face_directions(face, sky.PIXELS) for face in range(6)])
    brightness = []
    for one in sky.SKIES:
        faces = sky_faces(one.name)
        assert np.isfinite(faces).all()
        assert faces.min() >= 0.0
        assert faces.max() < 8.0  # no disc: no fireflies in the reflections
        assert np.abs(faces[0, :, ::-1] - faces[1]).max() < 0.02  # east and west are alike
        ring = np.abs(rays[..., 1] - 0.03) < 0.03
        north, south = (faces[ring & (side * rays[..., 2] > 0.9)].mean() for side in (-1.0, 1.0))
        assert north > 1.05 * south, one.name
        brightness.append(faces[rays[..., 1] > 0.0].mean())
    assert (np.diff(brightness[1:]) < 0.0).all()  # from afternoon to night


def test_horizon_is_seamless_haze() -> None:
    for one in script("sky").SKIES:
        faces = sky_faces(one.name)
        for face in faces[[0, 1, 4, 5]]:
            half = face.shape[0] // 2
            assert np.abs(face[half] - face[half - 1]).max() < 0.12, one.name


def test_clouds_meet_at_the_ends_of_their_picture_and_are_lit_from_their_sides() -> None:
    picture = pixels(RAW / "sky/clouds.png", "float")
    right, left, above, cover = np.moveaxis(picture, -1, 0)
    assert 0.1 < (cover > 0.3).mean() < 0.5
    assert cover[0].max() == 0.0  # nothing is cut at the upper edge
    steps = np.abs(np.diff(cover, axis=1, append=cover[:, :1])).mean(axis=0)
    assert steps[-1] < 3.0 * np.median(steps) + 0.005
    thick = cover > 0.4
    assert np.abs(right - left)[thick].mean() > 0.1
    rows = np.arange(len(picture))[:, None] * np.ones_like(cover)
    assert np.corrcoef(rows[thick], above[thick])[0, 1] < -0.3  # brighter towards their tops


@pytest.mark.deep
def test_ocean_loops_without_a_click_or_a_step_in_loudness() -> None:
    sound, rate = soundfile.read(RAW / "sound/ocean.ogg", dtype="float64")
    assert (rate, sound.shape[1]) == (44100, 2)
    assert 20.0 <= len(sound) / rate <= 30.0
    assert (RAW / "sound/ocean.ogg").stat().st_size <= 600_000
    around = np.roll(sound, len(sound) // 2, 0)  # the seam is now in the middle
    seam = len(sound) // 2
    for order in (1, 2, 3):  # a click stands out in the differences, the higher the sharper
        step = np.abs(np.diff(around, order, axis=0)).max(1)
        near = np.r_[step[seam - 4410 : seam - 32], step[seam + 32 : seam + 4410]]
        assert step[seam - 8 : seam + 8].max() <= near.max()
    # the encoder errs no more at the seam than anywhere else
    wanted = script("sound").loop()
    error = np.sqrt(np.square(sound - wanted).reshape(-1, 490, 2).mean((1, 2)))
    assert max(error[0], error[-1]) <= np.quantile(error, 0.999)
    # and so what is loud before it is as loud after it: half a second on either side
    halves = np.array([sound[-rate // 2 :], sound[: rate // 2]])
    level = 10.0 * np.log10(np.square(halves).mean((1, 2)))
    assert abs(level[1] - level[0]) < 1.0


def test_ocean_swells_and_never_clips() -> None:
    sound, rate = soundfile.read(RAW / "sound/ocean.ogg", dtype="float64")
    assert np.abs(sound).max() < 0.9
    loudness = np.sqrt((sound**2).sum(1)[: len(sound) // rate * rate].reshape(-1, rate).mean(1))
    assert 1.5 < loudness.max() / loudness.min() < 6.0
    assert abs(np.corrcoef(sound.T)[0, 1]) < 0.5  # the two ears hear different water

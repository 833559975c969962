"""Promises of heights, gloss and du/dv, and of bake_maps as a whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.color import bake_color
from paradize.bakers.maps.bake import bake_maps
from paradize.data import Image
from paradize.errors import BakeError
from paradize.formats.ktx2.layout import full_level_count
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.kernels import maps
from paradize.kernels.maps import Levels
from paradize.metrics.filters import taps
from paradize.metrics.texels import decode_texels, rebuilt
from paradize.stages.dudv import DudvLevels
from paradize.stages.gloss import GlossSettings, gloss_map
from paradize.stages.height import height_from_color, height_from_height
from tests.pipeline.heights import angles_between, normals, save, waves
from tests.pipeline.map_truth import normals as true_normals


def test_height_is_the_luminance_of_linear_light() -> None:
    pixels = np.float32([[[0.5, 0.5, 0.5], [1, 0, 0], [0, 1, 0], [0, 0, 1]]])
    heights = height_from_color(Image(pixels, "srgb", 32))
    assert np.allclose(heights[0], [0.21404114, 0.2126, 0.7152, 0.0722], atol=1e-6)
    assert np.array_equal(height_from_color(Image(pixels, "srgb", 32)), heights)
    assert np.allclose(height_from_color(Image(pixels, "linear", 32))[0, 0], 0.5)
    grey = np.float32([[[0.5, 1.0], [0.25, 0.0], [0.75, 0.5]]])  # with alpha
    assert np.array_equal(maps.luminance(grey), grey[:, :, 0])


def test_heights_are_never_touched_by_a_colour_transform() -> None:
    values = np.random.default_rng(2).random((4, 5, 1), np.float32)
    assert np.array_equal(height_from_height(Image(values, "data", 32)), values[:, :, 0])


def test_levels_do_what_their_names_say() -> None:
    plane = np.linspace(0, 1, 11, dtype=np.float32)[None, :]

    def shaped(**kwargs: float) -> np.ndarray:
        return maps.apply_levels(plane, Levels(**kwargs))[0]

    assert np.array_equal(shaped(), plane[0])
    assert np.allclose(shaped(invert=True), 1 - plane[0], atol=1e-7)
    assert np.allclose(shaped(black=0.2, white=0.8), np.clip((plane[0] - 0.2) / 0.6, 0, 1), atol=1e-6)
    assert np.allclose(shaped(gamma=2.0), np.sqrt(plane[0]), atol=1e-6)
    assert np.allclose(shaped(contrast=0.0), 0.5)
    assert np.allclose(shaped(brightness=0.25), np.clip(plane[0] + 0.25, 0, 1), atol=1e-6)
    # In the order of their names, and within 0..1 before the contrast as well as at the end.
    assert np.allclose(shaped(contrast=0.5, brightness=0.25), 0.5 * plane[0] + 0.5, atol=1e-6)
    narrow = 0.5 * np.clip((plane[0] - 0.2) / 0.6, 0, 1) + 0.25
    assert np.allclose(shaped(black=0.2, white=0.8, contrast=0.5), narrow, atol=1e-6)
    for bad in ({"black": 1.0}, {"gamma": 0.0}, {"contrast": float("nan")}):
        with pytest.raises(ValueError, match=r"levels|black"):
            Levels(**bad)


def test_gloss_shines_only_inside_its_mask() -> None:
    mask = np.zeros((4, 4), np.bool_)
    mask[:, 2:] = True
    gloss = gloss_map(np.full((4, 4), 0.5, np.float32), GlossSettings(), mask)
    assert (gloss[:, :2, 0] == 0).all()
    assert (gloss[:, 2:, 0] == 0.5).all()
    assert np.allclose(gloss[:, :, 1], 0.45)
    with pytest.raises(BakeError, match="smoothness"):
        GlossSettings(smoothness=(0.0, 1.5))


# Du/dv


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 1000), st.integers(1, 20), st.integers(1, 20), st.floats(0.01, 100))
def test_dudv_codes_sum_to_zero_and_no_code_is_further_than_one_from_its_value(
    seed: int, rows: int, columns: int, scale: float
) -> None:
    heights = np.random.default_rng(seed).random((rows, columns), np.float32)
    found = normals(heights, scale=(scale, scale))
    mean = found[:, :, :2].astype(np.float64).mean(axis=(0, 1))
    made = DudvLevels(rows, columns, 1, (float(mean[0]), float(mean[1])))
    for first in range(0, rows, 4):
        made.put(0, first, found[first : first + 4])
    codes = np.frombuffer(made.levels()[0], np.int8).reshape(rows, columns, 2)
    assert (codes.astype(np.int64).sum(axis=(0, 1)) == 0).all()
    offsets = found[:, :, :2] - mean
    if np.abs(offsets).max() <= 1:
        assert np.abs(codes - offsets * 127.0).max() <= 1.5 + 1e-4


def test_dudv_codes_are_the_nearest_to_x_and_y_less_the_mean_of_each() -> None:
    vectors = np.random.default_rng(5).uniform(-0.5, 0.5, (9, 13, 3)).astype(np.float32)
    codes, rest = maps.dudv_codes(vectors, (0.25, -0.375))
    less = 127 * (vectors[:, :, :2].astype(np.float64) - [0.25, -0.375])
    assert np.abs(codes - less).max() <= 0.5001
    assert np.abs(rest / 64 - (less - codes)).max() < 1 / 64 + 1e-4


def test_dudv_codes_that_rounding_moved_furthest_are_moved_back_first() -> None:
    values = np.zeros((1, 8, 3), np.float32)
    values[0, :, 0] = np.float32([0.45, 0.3, 0.4, 0.1, 2.0, -1.0, -1.0, 0.2]) / np.float32(127)
    codes, rest = maps.dudv_codes(values, (0.0, 0.0))
    codes[0, 5:, 0] -= 1  # the sum is 0 + 2 - 2 - 3: three are to be moved up
    before = codes.copy()
    maps.balance(codes, rest)
    assert codes[:, :, 0].sum() == 0
    moved = np.flatnonzero(codes[0, :, 0] != before[0, :, 0])
    assert list(moved) == [0, 1, 2]


def test_dudv_is_the_normal_maps_x_and_y_less_their_mean_in_every_level(tmp_path: Path) -> None:
    heights = waves(64, 64, 5) * 0.08 + 0.5
    path = save(tmp_path / "waves.exr", heights[:, :, None], oiio.FLOAT)
    made = bake_maps(path, only=["dudv"], source="height", wrap="repeat", strength=4.0)["dudv"]
    texture = decode_ktx2(made.data)
    assert texture.format == "RG8_SNORM"
    truth = true_normals(heights, taps("fourth"), scale=(2.56, 2.56), wrap=(True, True))
    level_truth = truth[:, :, :2] - truth[:, :, :2].mean(axis=(0, 1))
    for level in range(len(texture.levels)):
        size = 64 >> level
        mean = level_truth.reshape(size, 1 << level, size, 1 << level, 2).mean(axis=(1, 3))
        assert np.abs(decode_texels(texture, level) - mean).max() < 1.51 / 127
        codes = np.frombuffer(texture.levels[level], np.int8).reshape(-1, 2)
        assert (codes.astype(np.int64).sum(axis=0) == 0).all()


# The whole


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    rng = np.random.default_rng(11)
    smooth = waves(64, 96, 3)[:, :, None] * 20 + 128 + rng.integers(0, 30, (64, 96, 3))
    return save(tmp_path / "stone.png", smooth.clip(0, 255).astype(np.uint8))


def test_all_four_maps_come_with_every_mip_and_their_measured_error(picture: Path) -> None:
    made = bake_maps(picture)
    assert list(made) == ["normal", "height", "gloss", "dudv"]
    assert made["height"].filter is None
    assert made["normal"].filter == made["dudv"].filter == made["gloss"].filter
    expected = {
        "normal": ("BC5_SNORM", "normal_p99_deg"),
        "height": ("BC4_UNORM", "height_psnr_db"),
        "gloss": ("BC5_UNORM", "gloss_psnr_db"),
        "dudv": ("RG8_SNORM", "dudv_p99_deg"),
    }
    for name, (fmt, metric) in expected.items():
        product = made[name]
        assert (product.format, product.metric, product.width, product.height) == (fmt, metric, 96, 64)
        assert product.errors[metric] == product.error
        texture = decode_ktx2(product.data, name)
        assert len(texture.levels) == len(product.levels) == full_level_count(96, 64)
        assert product.errors[f"{name}_max_deg" if "deg" in metric else f"{name}_max"] > 0


def test_a_size_that_blocks_do_not_divide_stays_uncompressed(tmp_path: Path) -> None:
    path = save(tmp_path / "odd.png", np.random.default_rng(1).integers(0, 256, (5, 7, 3), dtype=np.uint8))
    formats = {name: product.format for name, product in bake_maps(path).items()}
    assert formats == {"normal": "RG8_SNORM", "height": "R8_UNORM", "gloss": "RG8_UNORM", "dudv": "RG8_SNORM"}
    assert bake_color(path).format == "RGBA8_SRGB"


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (8, 1), (3, 2)])
def test_maps_of_the_smallest_pictures_are_baked(tmp_path: Path, size: tuple[int, int]) -> None:
    path = save(tmp_path / "small.png", np.random.default_rng(1).integers(0, 256, (*size, 3), dtype=np.uint8))
    for fmt in ("ktx2", "png"):
        for product in bake_maps(path, fmt=fmt).values():
            assert (product.height, product.width) == size
            assert np.isfinite(product.error)
    assert bake_color(path).errors["color_psnr_db"] > 50


@pytest.mark.parametrize("strength", [0.0, 1e-6, 1.0, 1e6, -1e6])
def test_any_strength_gives_finite_maps(picture: Path, strength: float) -> None:
    for product in bake_maps(picture, strength=strength).values():
        assert np.isfinite(list(product.errors.values())).all()
    if abs(strength) <= 1e-6:
        made = bake_maps(picture, only=["normal"], strength=strength)["normal"]
        assert (decode_texels(decode_ktx2(made.data)) == 0).all()


def test_strength_is_the_height_of_white_in_percent_of_the_width(tmp_path: Path) -> None:
    for width in (32, 64):
        ramp = (np.arange(width, dtype=np.float32) / width)[None, :, None].repeat(16, 0)
        path = save(tmp_path / f"ramp{width}.exr", ramp, oiio.FLOAT)
        made = bake_maps(path, only=["normal"], source="height", strength=100.0)["normal"]
        normal = decode_texels(decode_ktx2(made.data))
        assert np.abs(normal - [-(0.5**0.5), 0]).max() < 1 / 127  # as high as wide: 45 degrees


def test_a_slope_scale_in_metres_replaces_the_strength(tmp_path: Path) -> None:
    ramp = (np.arange(32, dtype=np.float32) / 32)[None, :, None].repeat(16, 0)
    path = save(tmp_path / "ramp.exr", ramp, oiio.FLOAT)
    made = bake_maps(path, only=["normal"], source="height", strength=7.0, slope_scale=16.0)["normal"]
    slope = 16.0 / 32
    expected = -slope / (1 + slope * slope) ** 0.5
    assert np.abs(decode_texels(decode_ktx2(made.data)) - [expected, 0]).max() < 1 / 127


def test_png_maps_tell_what_ktx2_maps_tell_of_level_0(tmp_path: Path) -> None:
    codes = (waves(32, 48, 4) * 20 + 128).clip(0, 255).astype(np.uint8)
    path = save(tmp_path / "c.png", np.dstack([codes] * 3))
    for source in ("color", "height"):
        png, ktx2 = (bake_maps(path, fmt=fmt, source=source) for fmt in ("png", "ktx2"))
        for name, made in png.items():
            assert list(made.errors) == list(ktx2[name].errors)
            assert len(made.levels) == 1
            assert made.levels[0].keys() == ktx2[name].levels[0].keys()
        message = png["normal"].errors
        for part in ("filter", "encoding"):
            mean, p99, most = (message[f"normal_{part}_{name}deg"] for name in ("", "p99_", "max_"))
            assert 0 <= min(mean, p99) <= max(mean, p99) <= most < 1
        assert message["normal_encoding_deg"] > 0
        assert 0 <= message["normal_p99_deg"] <= message["normal_max_deg"] < 1


def test_png_maps_follow_gltf_and_zero_is_exact(tmp_path: Path) -> None:
    flat = save(tmp_path / "flat.png", np.full((8, 8, 3), 77, np.uint8))
    made = bake_maps(flat, fmt="png")
    assert {product.format for product in made.values()} == {"PNG8", "PNG16"}
    path = tmp_path / "normal.png"
    path.write_bytes(made["normal"].data)
    codes = oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8)
    assert np.array_equal(codes, np.broadcast_to(np.uint8([128, 128, 255]), (8, 8, 3)))
    assert made["normal"].error == 0.0
    assert made["dudv"].error == 0.0


def test_float_heights_keep_their_slopes_and_the_height_map_is_stretched_with_a_warning(
    tmp_path: Path,
) -> None:
    heights = (waves(32, 32, 4) * 50 + 300)[:, :, None]
    path = save(tmp_path / "metres.exr", heights, oiio.FLOAT)
    made = bake_maps(path, source="height", wrap="repeat", slope_scale=1 / 100, only=["height", "normal"])
    assert any("run from" in warning for warning in made["height"].warnings)
    truth = true_normals(heights[:, :, 0], taps("fourth"), scale=(0.01, 0.01), wrap=(True, True))
    normal = decode_texels(decode_ktx2(made["normal"].data))
    assert angles_between(rebuilt(normal), truth).mean() < 3


def test_an_8_bit_height_source_is_warned_about(tmp_path: Path) -> None:
    path = save(tmp_path / "h.png", np.arange(64, dtype=np.uint8).reshape(8, 8, 1))
    assert "8 bits" in bake_maps(path, source="height", only=["height"])["height"].warnings[0]
    wide = save(tmp_path / "w.png", np.arange(64, dtype=np.uint16).reshape(8, 8, 1), oiio.UINT16)
    assert bake_maps(wide, source="height", only=["height"])["height"].warnings == []


def test_maps_are_of_the_tier_that_was_asked_for(picture: Path) -> None:
    errors = {}
    for tier in ("fast", "balanced", "exact"):
        made = bake_maps(picture, tier=tier)
        assert {product.tier for product in made.values()} == {tier}
        assert not any("tier" in warning for product in made.values() for warning in product.warnings)
        errors[tier] = made["height"].error
    assert errors["fast"] < errors["balanced"] <= errors["exact"]
    assert bake_color(picture, tier="exact").format == "BC7_SRGB"


def test_groups_that_shine_need_a_layout(picture: Path) -> None:
    with pytest.raises(BakeError, match="groups that shine need a UV layout"):
        bake_maps(picture, gloss_groups=["leaves"])


def test_the_same_bytes_with_one_thread_and_with_many(picture: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    image = rng.random((37, 29, 4), np.float32)
    codes = (image * 255).astype(np.uint8)
    plane = np.ascontiguousarray(image[:, :, 0])
    for threads in (2, 3, 64):
        for call in (
            lambda t: maps.linear_light(image, encoded=True, threads=t),
            lambda t: maps.linear_light(codes, encoded=True, threads=t),
            lambda t: maps.halved_light(codes[:36, :28], threads=t),
            lambda t: maps.rgba_codes(image, encoded=False, threads=t),
            lambda t: maps.luminance(image, threads=t),
            lambda t: maps.apply_levels(plane, Levels(gamma=2.2), threads=t),
            lambda t: maps.halve(image, threads=t),
            lambda t: maps.halve(image, with_alpha=True, threads=t),
            lambda t: maps.normalise(image[:, :, :3], threads=t),
            lambda t: maps.dudv_codes(image[:, :, :3], (0.4, 0.5), threads=t),
            lambda t: maps.nearest_covered(plane > 0.9, wrap=(True, False), threads=t),
            lambda t: maps.snorm8(image, threads=t),
        ):
            assert np.array_equal(call(1), call(threads))
    first = {name: product.data for name, product in bake_maps(picture).items()}
    assert first == {name: product.data for name, product in bake_maps(picture).items()}

"""Promises of the maps: height, normal, gloss, du/dv, gutters, and of bake_maps as a whole."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bake_maps import bake_color, bake_cubemap, bake_maps
from paradize.data import Group, Image, Mesh
from paradize.errors import BakeError, SourceError
from paradize.formats.ktx2 import decode_ktx2, full_level_count
from paradize.kernels import maps
from paradize.kernels.maps import Levels
from paradize.metrics.angle import angles_deg, rebuilt, reference_normals
from paradize.metrics.texels import decode_texels
from paradize.stages import gutter
from paradize.stages.dudv import dudv_map
from paradize.stages.gloss import GlossSettings, gloss_map
from paradize.stages.height import height_from_color, height_from_height

FILTERS = ("central", "scharr", "fourth")


def normals(
    heights: np.ndarray,
    *,
    scale: tuple[float, float] = (1.0, 1.0),
    filter_name: str = "fourth",
    wrap: tuple[bool, bool] = (False, False),
    green_down: bool = False,
    islands: np.ndarray | None = None,
) -> np.ndarray:
    return maps.normals_from_heights(
        np.ascontiguousarray(heights, np.float32),
        scale=scale,
        filter_name=filter_name,
        wrap=wrap,
        green_down=green_down,
        islands=islands,
    )


def waves(rows: int, columns: int, seed: int, wavelength: float = 12.0) -> np.ndarray:
    """Smooth periodic heights of a few sinusoids whose wavelengths are whole parts of the size, not below
    `wavelength`."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:rows, 0:columns]
    heights = np.zeros((rows, columns))
    for _ in range(6):
        kx = rng.integers(-columns // wavelength, columns // wavelength + 1)
        ky = rng.integers(-rows // wavelength, rows // wavelength + 1)
        heights += np.sin(2 * np.pi * (kx * x / columns + ky * y / rows) + rng.random() * 6)
    return heights.astype(np.float32)


def save(path: Path, pixels: np.ndarray, kind: object = oiio.UINT8) -> Path:
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    assert target.write_image(np.ascontiguousarray(pixels))
    assert target.close()
    return path


# Normals


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (2, 2), (5, 6)])
@settings(deadline=None, max_examples=12)
@given(st.floats(-(2.0**99), 2.0**99, width=32), st.floats(1e-6, 1e6), st.booleans(), st.booleans())
def test_flat_ground_is_exactly_up(
    name: str, shape: tuple[int, int], level: float, scale: float, wrap_x: bool, wrap_y: bool
) -> None:
    flat = np.full(shape, level, np.float32)
    found = normals(flat, filter_name=name, scale=(scale, scale), wrap=(wrap_x, wrap_y))
    assert np.array_equal(found, np.broadcast_to(np.float32([0, 0, 1]), (*shape, 3)))


@pytest.mark.parametrize("name", FILTERS)
def test_a_ramp_has_one_normal_up_to_the_edges_and_green_points_up_the_image(name: str) -> None:
    y, x = np.mgrid[0:9, 0:11].astype(np.float32)
    found = normals(0.5 * x - 0.25 * y, filter_name=name)
    expected = np.array([-0.5, -0.25, 1.0]) / np.sqrt(0.25 + 0.0625 + 1)
    assert np.abs(found - expected).max() < 1e-6
    down = normals(0.5 * x - 0.25 * y, filter_name=name, green_down=True)
    assert np.abs(down - expected * [1, -1, 1]).max() < 1e-6


@pytest.mark.parametrize("name", FILTERS)
def test_a_ramp_of_89_9_degrees_is_right(name: str) -> None:
    slope = 572.9572133543032  # tan of 89.9 degrees
    found = normals(
        np.arange(32, dtype=np.float32)[None, :].repeat(8, 0), filter_name=name, scale=(slope, 1.0)
    )
    truth = np.array([-np.sin(np.radians(89.9)), 0, np.cos(np.radians(89.9))])
    assert angles_deg(found.astype(np.float64), np.broadcast_to(truth, found.shape)).max() < 1e-3


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 1000), st.sampled_from(FILTERS), st.floats(1e-6, 1e6))
def test_scaling_heights_scales_slopes(seed: int, name: str, factor: float) -> None:
    heights = waves(8, 10, seed, 4.0).astype(np.float64)
    one = normals(heights, scale=(factor, factor), filter_name=name, wrap=(True, True)).astype(np.float64)
    truth = reference_normals(
        heights.astype(np.float32), 0, 8, slope_scale=(factor, factor), wrap=(True, True), filter_name=name
    )
    assert angles_deg(one, truth).max() < 2e-3
    assert np.abs((one * one).sum(axis=2) - 1).max() < 1e-6
    assert (one[:, :, 2] >= 0).all()


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("factor", [1e-20, 1e20, 1e30])
def test_slopes_beyond_float_range_stay_unit_vectors(name: str, factor: float) -> None:
    found = normals(waves(8, 10, 3, 4.0), filter_name=name, scale=(factor, factor)).astype(np.float64)
    assert np.isfinite(found).all()
    assert np.abs((found * found).sum(axis=2) - 1).max() < 1e-6
    huge = normals(np.float32([[0, 3e38, -3e38, 0]]), filter_name=name).astype(np.float64)
    assert np.abs((huge * huge).sum(axis=2) - 1).max() < 1e-6


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 1000), st.sampled_from(FILTERS), st.integers(1, 9), st.integers(1, 9))
def test_a_wrapped_tile_is_the_middle_of_its_three_by_three_repetition(
    seed: int, name: str, rows: int, columns: int
) -> None:
    tile = np.random.default_rng(seed).random((rows, columns), np.float32)
    wrapped = normals(tile, filter_name=name, scale=(20, 20), wrap=(True, True))
    repeated = normals(np.tile(tile, (5, 5)), filter_name=name, scale=(20, 20))
    middle = repeated[2 * rows : 3 * rows, 2 * columns : 3 * columns]
    assert np.array_equal(wrapped, middle)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000), st.sampled_from(FILTERS))
def test_rotating_the_heights_rotates_the_normals(seed: int, name: str) -> None:
    heights = np.random.default_rng(seed).random((7, 7), np.float32)
    found = normals(heights, filter_name=name, scale=(3, 3))
    turned = normals(np.rot90(heights), filter_name=name, scale=(3, 3))
    back = np.rot90(turned, -1)  # (x, y) of the turned map is (-y, x) of this one
    assert np.abs(np.dstack([back[:, :, 1], -back[:, :, 0], back[:, :, 2]]) - found).max() < 1e-6


@pytest.mark.parametrize("name", FILTERS)
def test_normals_agree_with_an_independent_float64_computation(name: str) -> None:
    heights = waves(33, 47, 7, 5.0)
    for wrap in [(False, False), (True, False), (False, True), (True, True)]:
        found = normals(heights, filter_name=name, scale=(2.0, 3.0), wrap=wrap).astype(np.float64)
        truth = reference_normals(heights, 0, 33, slope_scale=(2.0, 3.0), wrap=wrap, filter_name=name)
        assert angles_deg(found, truth).max() < 1e-3


def test_fourth_order_normals_of_smooth_heights_are_within_a_tenth_of_a_degree_of_the_truth() -> None:
    rng = np.random.default_rng(1)
    n = 256
    y, x = np.mgrid[0:n, 0:n] * (2 * np.pi / n)
    heights, dx, dy = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    for _ in range(40):
        wavelength = rng.uniform(8, 64)
        angle = rng.uniform(0, 2 * np.pi)
        kx, ky = np.rint(n / wavelength * np.cos(angle)), np.rint(n / wavelength * np.sin(angle))
        k = np.hypot(kx, ky) * 2 * np.pi / n
        phase = rng.uniform(0, 2 * np.pi)
        amplitude = 1 / (k * np.sqrt(20))
        heights += amplitude * np.sin(kx * x + ky * y + phase)
        slope = amplitude * np.cos(kx * x + ky * y + phase) * 2 * np.pi / n
        dx += slope * kx
        dy += slope * ky
    truth = np.dstack([-dx, dy, np.ones_like(dx)])
    truth /= np.sqrt((truth * truth).sum(axis=2, keepdims=True))
    means = {
        name: angles_deg(
            normals(heights, filter_name=name, wrap=(True, True)).astype(np.float64), truth
        ).mean()
        for name in FILTERS
    }
    assert means["fourth"] < 0.1
    assert means["fourth"] < means["central"] < 2


# Islands and gutters


def two_quads() -> Mesh:
    """Two UV islands: the left and the right part of the map, with a strip between them."""
    uvs = [
        (0.0, 0.0),
        (0.375, 0.0),
        (0.375, 1.0),
        (0.0, 1.0),
        (0.625, 0.0),
        (1.0, 0.0),
        (1.0, 1.0),
        (0.625, 1.0),
    ]
    triangles = np.uint32([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    return Mesh(
        positions=np.zeros((8, 3), np.float32),
        triangles=triangles,
        uvs=np.float32(uvs),
        groups=(Group("left", "wood", 0, 2), Group("right", "leaf", 2, 2)),
    )


def test_islands_are_found_by_shared_uv_points_and_drawn_where_they_lie() -> None:
    islands = gutter.island_map(two_quads(), height=10, width=16)
    assert (islands[:, :6] == 0).all()
    assert (islands[:, 6:10] == -1).all()
    assert (islands[:, 10:] == 1).all()


def test_a_texel_that_a_triangle_only_touches_is_drawn_too() -> None:
    sliver = Mesh(
        positions=np.zeros((3, 3), np.float32),
        triangles=np.uint32([[0, 1, 2]]),
        uvs=np.float32([(0.01, 0.501), (0.99, 0.501), (0.99, 0.502)]),
    )
    assert (gutter.island_map(sliver, height=8, width=8)[4] == 0).all()


def test_uvs_outside_the_tile_wrap_and_ones_that_tile_for_ever_are_refused() -> None:
    mesh = two_quads()
    assert mesh.uvs is not None
    shifted = Mesh(mesh.positions, mesh.triangles, uvs=mesh.uvs + np.float32([1, -2]), groups=mesh.groups)
    assert np.array_equal(
        gutter.island_map(shifted, height=10, width=16) >= 0,
        gutter.island_map(mesh, height=10, width=16) >= 0,
    )
    endless = Mesh(mesh.positions, mesh.triangles, uvs=mesh.uvs * np.float32(1e7), groups=mesh.groups)
    with pytest.raises(BakeError, match="tile too often"):
        gutter.island_map(endless, height=64, width=64)


def test_the_mask_holds_the_groups_named_by_group_or_material_and_unknown_names_are_told() -> None:
    for name in ("right", "leaf"):
        mask = gutter.group_mask(two_quads(), [name], height=10, width=16)
        assert mask[:, 10:].all()
        assert not mask[:, :10].any()
    with pytest.raises(BakeError, match="'bark'"):
        gutter.group_mask(two_quads(), ["bark"], height=4, width=4)


@pytest.mark.parametrize("name", FILTERS)
def test_no_slope_crosses_from_one_island_to_another(name: str) -> None:
    islands = np.zeros((12, 16), np.int32)
    islands[:, 8:] = 1
    y, x = np.mgrid[0:12, 0:16].astype(np.float32)
    left, right = 0.25 * x, 100 - 0.5 * y
    heights = np.where(islands == 0, left, right)
    found = normals(heights, filter_name=name, islands=islands)
    assert np.abs(found[:, :8] - normals(left, filter_name=name)[:, :8]).max() < 1e-6
    assert np.abs(found[:, 8:] - normals(right, filter_name=name)[:, 8:]).max() < 1e-6


@settings(deadline=None, max_examples=40)
@given(
    st.integers(0, 10_000),
    st.integers(1, 9),
    st.integers(1, 9),
    st.booleans(),
    st.booleans(),
    st.integers(1, 12),
)
def test_a_gutter_texel_takes_the_nearest_covered_one(
    seed: int, rows: int, columns: int, wrap_x: bool, wrap_y: bool, rarity: int
) -> None:
    covered = np.random.default_rng(seed).integers(0, rarity + 1, (rows, columns)) == 0
    found = maps.nearest_covered(covered, wrap=(wrap_x, wrap_y))
    if not covered.any():
        assert (found == -1).all()
        return
    y, x = np.mgrid[0:rows, 0:columns]

    def square(ys: np.ndarray, xs: np.ndarray) -> np.ndarray:
        dy, dx = np.abs(ys - y[..., None]), np.abs(xs - x[..., None])
        dy = np.minimum(dy, rows - dy) if wrap_y else dy
        dx = np.minimum(dx, columns - dx) if wrap_x else dx
        return np.asarray(dy * dy + dx * dx)

    every = np.flatnonzero(covered)
    nearest = square(every // columns, every % columns).min(axis=2)
    assert np.array_equal(square(found[..., None] // columns, found[..., None] % columns)[..., 0], nearest)
    assert covered.ravel()[found.ravel()].all()


# Height and gloss


def test_height_is_the_luminance_of_linear_light() -> None:
    pixels = np.float32([[[0.5, 0.5, 0.5], [1, 0, 0], [0, 1, 0], [0, 0, 1]]])
    heights = height_from_color(Image(pixels, "srgb", 32))
    assert np.allclose(heights[0], [0.21404114, 0.2126, 0.7152, 0.0722], atol=1e-6)
    assert np.array_equal(height_from_color(Image(pixels, "srgb", 32)), heights)
    assert np.allclose(height_from_color(Image(pixels, "linear", 32))[0, 0], 0.5)


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
def test_dudv_has_no_mean_before_and_after_quantisation(
    seed: int, rows: int, columns: int, scale: float
) -> None:
    heights = np.random.default_rng(seed).random((rows, columns), np.float32)
    found = normals(heights, scale=(scale, scale))
    offsets = dudv_map(found)
    assert np.abs(offsets.astype(np.float64).mean(axis=(0, 1))).max() < 1e-7
    codes = maps.balanced_snorm8(offsets)
    assert (codes.astype(np.int64).sum(axis=(0, 1)) == 0).all()
    if np.abs(offsets).max() <= 1:
        assert np.abs(codes - offsets * 127.0).max() <= 1.5 + 1e-4


def test_dudv_is_the_normal_maps_x_and_y_less_their_mean_in_every_level(tmp_path: Path) -> None:
    heights = waves(64, 64, 5) * 0.08 + 0.5
    path = save(tmp_path / "waves.exr", heights[:, :, None], oiio.FLOAT)
    made = bake_maps(path, only=["dudv"], source="height", wrap="repeat", strength=4.0)["dudv"]
    texture = decode_ktx2(made.data)
    assert texture.format == "RG8_SNORM"
    truth = reference_normals(
        heights, 0, 64, slope_scale=(2.56, 2.56), wrap=(True, True), filter_name="fourth"
    )
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
        assert len(texture.levels) == full_level_count(96, 64)


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
    truth = reference_normals(
        heights[:, :, 0], 0, 32, slope_scale=(0.01, 0.01), wrap=(True, True), filter_name="fourth"
    )
    normal = decode_texels(decode_ktx2(made["normal"].data))
    assert angles_deg(rebuilt(normal), truth).mean() < 3


def test_an_8_bit_height_source_is_warned_about(tmp_path: Path) -> None:
    path = save(tmp_path / "h.png", np.arange(64, dtype=np.uint8).reshape(8, 8, 1))
    assert "8 bits" in bake_maps(path, source="height", only=["height"])["height"].warnings[0]
    wide = save(tmp_path / "w.png", np.arange(64, dtype=np.uint16).reshape(8, 8, 1), oiio.UINT16)
    assert bake_maps(wide, source="height", only=["height"])["height"].warnings == []


def test_a_tier_that_maps_do_not_have_is_told(picture: Path) -> None:
    assert bake_maps(picture, only=["normal"], tier="fast")["normal"].tier == "fast"
    exact = bake_maps(picture, only=["normal"], tier="exact")["normal"]
    assert exact.tier == "balanced"
    assert any("'exact'" in warning for warning in exact.warnings)


@pytest.mark.parametrize(
    "wrong",
    [
        {"only": ["bump"]},
        {"source": "depth"},
        {"green": "left"},
        {"fmt": "dds"},
        {"tier": "best"},
        {"wrap": "mirror"},
        {"strength": float("nan")},
        {"strength": 1e7},
        {"gloss_groups": ["leaves"]},
    ],
)
def test_settings_that_make_no_sense_are_refused(picture: Path, wrong: dict[str, object]) -> None:
    with pytest.raises(BakeError):
        bake_maps(picture, **wrong)  # type: ignore[arg-type]


def test_the_same_bytes_with_one_thread_and_with_many(picture: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    image = rng.random((37, 29, 4), np.float32)
    plane = np.ascontiguousarray(image[:, :, 0])
    for threads in (2, 3, 64):
        for call in (
            lambda t: maps.srgb_to_linear(image, source_bits=32, threads=t),
            lambda t: maps.linear_to_srgb8(image, threads=t),
            lambda t: maps.luminance(image, threads=t),
            lambda t: maps.apply_levels(plane, Levels(gamma=2.2), threads=t),
            lambda t: maps.halve(image, threads=t),
            lambda t: maps.halve(image, with_alpha=True, threads=t),
            lambda t: maps.nearest_covered(plane > 0.9, wrap=(True, False), threads=t),
            lambda t: maps.snorm8(image, threads=t),
            *(
                lambda t, name=name: maps.normals_from_heights(
                    plane, scale=(9, 9), filter_name=name, wrap=(True, False), threads=t
                )
                for name in FILTERS
            ),
        ):
            assert np.array_equal(call(1), call(threads))
    first = {name: product.data for name, product in bake_maps(picture).items()}
    assert first == {name: product.data for name, product in bake_maps(picture).items()}


def test_colour_with_alpha_from_another_file(tmp_path: Path) -> None:
    color = save(tmp_path / "c.png", np.full((16, 16, 3), 90, np.uint8))
    hole = np.full((16, 16, 1), 255, np.uint8)
    hole[4:12, 4:12] = 0
    product = bake_color(color, alpha=save(tmp_path / "a.png", hole))
    assert product.format == "BC3_SRGB"
    assert np.array_equal(decode_texels(decode_ktx2(product.data))[:, :, 3] * 255, hole[:, :, 0])
    wrong = save(tmp_path / "b.png", np.zeros((8, 16, 1), np.uint8))
    with pytest.raises(SourceError, match="one size"):
        bake_color(color, alpha=wrong)


def test_an_opaque_alpha_channel_costs_nothing(tmp_path: Path) -> None:
    pixels = np.full((8, 8, 4), 255, np.uint8)
    assert bake_color(save(tmp_path / "o.png", pixels)).format == "BC1_RGB_SRGB"


def test_a_linear_picture_is_measured_against_its_own_sRGB_encoding(tmp_path: Path) -> None:
    values = np.random.default_rng(3).random((6, 6, 3), np.float32)
    product = bake_color(save(tmp_path / "linear.exr", values, oiio.FLOAT))
    assert product.format == "RGBA8_SRGB"
    assert 55 < product.errors["color_psnr_db"] < 63  # rounding to 8 bits: 20 log10(255 sqrt 12) = 58.9 dB


def test_what_lies_under_transparent_texels_does_not_bleed(tmp_path: Path) -> None:
    pixels = np.zeros((32, 32, 4), np.uint8)
    pixels[:, :, 1] = 255  # green under transparency
    pixels[8:24, 8:24] = (200, 30, 30, 255)
    product = bake_color(save(tmp_path / "leaf.png", pixels))
    texture = decode_ktx2(product.data)
    for level in range(len(texture.levels)):
        assert decode_texels(texture, level)[:, :, 1].max() < 0.2


def test_a_cube_map_wants_six_squares_of_one_size(tmp_path: Path) -> None:
    faces = [
        save(tmp_path / f"{i}.exr", np.full((8, 8, 3), i + 0.5, np.float32), oiio.FLOAT) for i in range(6)
    ]
    product = bake_cubemap(faces)
    texture = decode_ktx2(product.data)
    assert (texture.format, texture.faces, len(texture.levels)) == ("RGBA16F", 6, 4)
    for face in range(6):
        assert (decode_texels(texture, 0, face)[:, :, :3] == face + 0.5).all()
    with pytest.raises(SourceError, match="six faces"):
        bake_cubemap(faces[:5])
    odd = save(tmp_path / "odd.exr", np.zeros((8, 4, 3), np.float32), oiio.FLOAT)
    with pytest.raises(SourceError, match="square"):
        bake_cubemap([*faces[:5], odd])


BAKE = """
import hashlib, json, sys
import json
import os
import subprocess
import sys
from pathlib import Path
from paradize.bake_maps import bake_color, bake_maps
made = {**bake_maps(Path(sys.argv[1]), strength=5.0, wrap="repeat"), "color": bake_color(Path(sys.argv[1]))}
print(json.dumps({k: [hashlib.sha256(p.data).hexdigest(), p.errors] for k, p in made.items()}))
"""


def test_an_old_cpu_gives_the_same_bytes_and_the_same_errors(picture: Path) -> None:
    old = {
        "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA",
    }
    found = []
    for extra in ({}, old):
        done = subprocess.run(
            [sys.executable, "-c", BAKE, str(picture)],
            capture_output=True,
            text=True,
            timeout=100,
            env={**os.environ, **extra},
        )
        assert done.returncode == 0, done.stderr
        assert "warn" not in done.stderr.lower(), done.stderr
        found.append(json.loads(done.stdout))
    assert found[0] == found[1]

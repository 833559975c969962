"""Promises of the metrics of maps: every level against float64, closed forms, exact percentiles, threads."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.data import HeightMap, Texture
from paradize.kernels.reference import maps as reference_maps
from paradize.metrics import levels
from paradize.metrics.filters import taps
from paradize.metrics.texels import bc7_codes, decode_texels
from tests.pipeline import map_truth as truth
from tests.pipeline.heights import waves
from tests.places import PEAK
from tests.sweeps import sample

SHAPES = [(1, 1), (1, 9), (9, 1), (2, 3), (16, 64), (37, 53), (68, 132), (201, 3)]
FILTERS = ["central", "scharr", "fourth", "eighth", "smooth3", "septic6"]
WRAPS = [(False, False), (True, False), (False, True), (True, True)]


def near(found: list[dict[str, float]], wanted: list[dict[str, float]], slack: float = 1e-5) -> None:
    """slack: the six digits that are told, and the float32 of the decoder in numpy."""
    assert len(found) == len(wanted)
    for level, (one, other) in enumerate(zip(found, wanted, strict=True)):
        assert one.keys() == other.keys()
        for key, value in other.items():
            assert one[key] == pytest.approx(value, rel=slack, abs=1e-6), (level, key)


def ground(
    heights: np.ndarray, name: str = "fourth", wrap: tuple[bool, bool] = (True, True), **more: Any
) -> HeightMap:
    return HeightMap(heights, **{"slope_scale": (2.0, 3.0), "wrap": wrap, "filter_name": name, **more})


def some_heights(rows: int, columns: int) -> np.ndarray:
    return np.random.default_rng(5).random((rows, columns), np.float32)


def settled(ground: HeightMap, name: str = "eighth") -> np.ndarray:
    """Normals by a filter; by itself the one that all are held to."""
    return truth.normals(
        ground.heights, taps(name), scale=ground.slope_scale, wrap=ground.wrap, green_down=ground.green_down
    )


# Against numpy


@pytest.mark.parametrize(("shape", "name"), sample(product(SHAPES, FILTERS), every=5))
def test_normals_of_every_level_are_held_to_one_truth_and_to_their_own_filter(
    shape: tuple[int, int], name: str
) -> None:
    heights = some_heights(*shape)
    for wrap in WRAPS:
        field = ground(heights, name, wrap, green_down=wrap[0])
        exact, own = settled(field), settled(field, name)
        texture = truth.random_texture("BC5_SNORM", *shape)
        chain = [truth.normalised(truth.mean(exact, k)) for k in range(len(texture.levels))]
        near(levels.normal_levels(texture, field), truth.angles(texture, chain))
        near([levels.encoding_error(texture, field)], truth.angles(texture, [own]))
        apart = truth.angles_between(own, exact)
        wanted = {"mean_deg": apart.mean(), "p99_deg": truth.p99(apart), "max_deg": apart.max()}
        near([levels.filter_error(field)], [wanted])


def stepped(shape: tuple[int, int], wrap: tuple[bool, bool], name: str, **more: Any) -> HeightMap:
    """Heights of 16 codes that stand ever farther apart."""
    codes = (np.linspace(0.0, 1.0, 16) ** 2).astype(np.float32)
    heights = codes[np.random.default_rng(6).integers(0, 16, shape)]
    return ground(heights, name, wrap, height_levels=codes, **more)


@pytest.mark.parametrize("shape", [(1, 1), (2, 3), (16, 64), (37, 53)])
@pytest.mark.parametrize("wrap", WRAPS)
def test_an_angle_counts_as_far_as_it_exceeds_what_the_half_steps_of_the_codes_allow(
    shape: tuple[int, int], wrap: tuple[bool, bool]
) -> None:
    field = stepped(shape, wrap, "central")
    exact, cones = settled(field), truth.cones(field)
    assert (cones > 0).all()
    texture = truth.random_texture("BC5_SNORM", *shape)
    chain = [truth.normalised(truth.mean(exact, k)) for k in range(len(texture.levels))]
    room = [truth.mean(cones[:, :, None], k)[:, :, 0] for k in range(len(texture.levels))]
    near(levels.normal_levels(texture, field), truth.angles(texture, chain, room=room))


@pytest.mark.parametrize("wrap", WRAPS)
def test_held_slopes_are_those_of_the_filter_within_what_the_half_steps_allow(
    wrap: tuple[bool, bool],
) -> None:
    field = stepped((37, 53), wrap, "smooth8", clamp_slopes=True)
    texture = truth.random_texture("BC5_SNORM", 37, 53)
    near([levels.encoding_error(texture, field)], truth.angles(texture, [truth.held(field)]))
    assert levels.filter_error(field)["max_deg"] < 1e-9
    assert levels.filter_error(replace(field, clamp_slopes=False))["max_deg"] > 1.0


def test_steps_that_were_smoothed_are_judged_by_the_source() -> None:
    field = stepped((16, 16), (True, True), "eighth")
    smoothed = replace(
        field,
        heights=field.heights * np.float32(0.5),
        reference_heights=field.heights,
        reference_levels=field.height_levels,
    )
    texture = truth.random_texture("BC5_SNORM", 16, 16)
    assert levels.normal_levels(texture, smoothed) == levels.normal_levels(texture, field)
    assert levels.encoding_error(texture, smoothed) != levels.encoding_error(texture, field)


@pytest.mark.parametrize("shape", SHAPES)
def test_dudv_of_every_level_agrees_with_numpy(shape: tuple[int, int]) -> None:
    field = ground(some_heights(*shape))
    xy = settled(field)[:, :, :2]
    xy = xy - xy.mean(axis=(0, 1))
    texture = truth.random_texture("RG8_SNORM", *shape)
    chain = [truth.rebuilt(truth.mean(xy, k)) for k in range(len(texture.levels))]
    near(levels.dudv_levels(texture, field), truth.angles(texture, chain))


@pytest.mark.parametrize("shape", SHAPES)
def test_decoded_vectors_are_judged_as_the_texture_is_that_holds_them(shape: tuple[int, int]) -> None:
    field = ground(some_heights(*shape))
    texture = truth.random_texture("RG8_SNORM", *shape)
    xy = decode_texels(texture)
    near([levels.vector_error(xy, field)], levels.normal_levels(texture, field)[:1])
    near([levels.vector_error(xy, field, less_mean=True)], levels.dudv_levels(texture, field)[:1])


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(
    "name", ["R8_UNORM", "RG8_UNORM", "BC4_UNORM", "BC5_UNORM", "R16_UNORM", "RG16_SNORM"]
)
def test_values_of_every_level_agree_with_numpy(shape: tuple[int, int], name: str) -> None:
    texture = truth.random_texture(name, *shape)
    channels = decode_texels(texture).shape[2]
    values = np.random.default_rng(2).random((*shape, channels), np.float32)
    wanted = [
        truth.differences(decode_texels(texture, k), truth.mean(values.astype(np.float64), k))
        for k in range(len(texture.levels))
    ]
    near(levels.value_levels(texture, values), wanted)


@pytest.mark.parametrize("shape", SHAPES)
def test_gloss_of_every_level_agrees_with_numpy(shape: tuple[int, int]) -> None:
    gloss = np.random.default_rng(3).random((*shape, 2), np.float32)
    field = ground(some_heights(*shape) * np.float32(0.1))
    texture = truth.random_texture("BC5_UNORM", *shape)
    everywhere = [np.ones((h, w), np.bool_) for h, w in truth.sizes(*shape)]
    near(levels.gloss_levels(texture, gloss, field), gloss_truth(texture, gloss, settled(field), everywhere))


def gloss_truth(
    texture: Texture, gloss: np.ndarray, vectors: np.ndarray, masks: list[np.ndarray]
) -> list[dict[str, float]]:
    """The result of gloss_levels for the texels that each level's mask holds."""
    wide = gloss.astype(np.float64)
    joined = np.dstack([wide[:, :, 0], (1 - wide[:, :, 1]) ** 4, vectors])
    wanted = []
    for k, mask in enumerate(masks):
        found = truth.mean(joined, k)[mask]
        r = np.sqrt((found[:, 2:] ** 2).sum(axis=1))
        lost = 2 * np.maximum(0, 1 - r * r) / (r * (3 - r * r)) if k else 0.0
        smooth = 1 - np.minimum(1, found[:, 1] + lost) ** 0.25
        shown = decode_texels(texture, k)[mask]
        apart = np.abs(half_width(shown[:, 1].astype(np.float64)) - half_width(smooth))
        if not mask.any():
            shown, found, smooth, apart = np.zeros((1, 2)), np.zeros((1, 2)), np.zeros(1), np.zeros(1)
        widths = (apart.mean(), np.sort(apart)[-(-apart.size * 99 // 100) - 1], apart.max())
        wanted.append(
            truth.differences(shown, np.stack([found[:, 0], smooth], axis=1))
            | dict(zip(("width_mean_deg", "width_p99_deg", "width_max_deg"), widths, strict=True))
        )
    return wanted


def half_width(smoothness: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Degrees from the normal at which the slopes of GGX's facets, alpha = (1 - s)^2, are half as dense as
    the flat ones, by bisection: alpha^2 / (pi (alpha^2 + tan^2)^2)."""
    square = (1.0 - smoothness) ** 4
    low, high = np.zeros_like(square), np.full_like(square, 0.25 * np.pi)
    for _ in range(60):
        middle = 0.5 * (low + high)
        above = (square + np.tan(middle) ** 2) ** 2 < 2.0 * square**2
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return np.degrees(low)


@pytest.mark.parametrize(("shown", "meant"), [(0.5, 0.6), (0.95, 0.9), (0.0, 0.3), (1.0, 0.5)])
def test_a_highlight_is_as_much_too_wide_as_its_lobe_is(shown: float, meant: float) -> None:
    flat = ground(np.zeros((8, 8), np.float32))
    codes = np.full((8, 8, 2), round(shown * 255), np.uint8)
    texture = Texture("RG8_UNORM", 8, 8, tuple(codes[: 8 >> k, : 8 >> k].tobytes() for k in range(4)))
    gloss = np.full((8, 8, 2), meant, np.float32)
    wanted = abs(
        half_width(np.array(round(shown * 255) / 255)) - half_width(np.array(np.float32(meant), np.float64))
    )
    for level in levels.gloss_levels(texture, gloss, flat):
        found = [level[f"width_{name}_deg"] for name in ("mean", "p99", "max")]
        assert found == pytest.approx([wanted] * 3, rel=1e-5)


@pytest.mark.parametrize(
    ("shape", "kind"), sample(product(SHAPES, [np.uint8, np.uint16, np.float32]), every=5)
)
def test_colours_of_every_level_agree_with_numpy(shape: tuple[int, int], kind: type) -> None:
    rng = np.random.default_rng(4)
    for name, channels in (("BC1_RGB_SRGB", 3), ("BC3_SRGB", 4), ("RGBA8_SRGB", 4)):
        pixels = rng.random((*shape, channels), np.float32) * np.float32(1.1)
        if channels == 4:
            pixels[:, :, 3] *= rng.random(shape) > 0.5
        if kind is not np.float32:
            pixels = (np.minimum(pixels, 1) * np.iinfo(kind).max).astype(kind)
        texture = truth.random_texture(name, *shape)
        for encoded in (True, False):
            for cutoff in (None, 0.4):
                found = levels.color_levels(texture, pixels, encoded=encoded, alpha_cutoff=cutoff)
                near(found, truth.colors(texture, pixels, encoded, cutoff))


@pytest.mark.parametrize(("cutoff", "least"), [(0.4, 0.5), (0.05, 1.0)])
def test_alpha_is_multiplied_by_sixteen_at_most_and_by_a_sixteenth_at_least(
    cutoff: float, least: float
) -> None:
    """One texel of 32, or all, reach the cutoff: their means would need a factor beyond."""
    pixels = np.random.default_rng(6).random((32, 32, 4), np.float32)
    pixels[:, :, 3] = 0 if least < 1 else 1
    pixels[::4, ::8, 3] = least
    texture = truth.random_texture("RGBA8_SRGB", 32, 32)
    found = levels.color_levels(texture, pixels, encoded=True, alpha_cutoff=cutoff)
    near(found, truth.colors(texture, pixels, True, cutoff))


def test_every_level_of_bc7_is_judged_by_its_own_codes() -> None:
    rng = np.random.default_rng(7)
    blocks = [rng.integers(0, 256, -(-h // 4) * -(-w // 4) * 16, np.uint8) for h, w in truth.sizes(13, 22)]
    baked = Texture("BC7_SRGB", 22, 13, tuple(b.tobytes() for b in blocks))
    plain = tuple(bc7_codes(baked, k).tobytes() for k in range(len(blocks)))
    pixels = rng.random((13, 22, 4), np.float32)
    found, wanted = (
        levels.color_levels(texture, pixels, encoded=True, alpha_cutoff=None)
        for texture in (baked, Texture("RGBA8_SRGB", 22, 13, plain))
    )
    assert found == wanted


@pytest.mark.parametrize("name", [*truth.BLOCK_BYTES, *truth.TEXEL_BYTES])
def test_native_decoders_agree_with_numpy_on_any_bytes(name: str) -> None:
    if name == "R32F":
        texture = Texture(name, 5, 3, (np.arange(15, dtype="<f4").tobytes(),))
    else:
        texture = truth.random_texture(name, 61, 83, seed=9)
    decoded = decode_texels(texture).astype(np.float32)
    one = Texture(texture.format, texture.width, texture.height, texture.levels[:1])
    if name.endswith("SRGB"):
        found = levels.color_levels(one, decoded, encoded=True, alpha_cutoff=None)[0]
        assert found.get("alpha_psnr_db", 120.0) == 120.0
    else:
        found = levels.value_levels(one, decoded)[0]
    assert found["max"] < 2e-7
    assert found["psnr_db"] == levels.LOSSLESS_DB


# Closed forms


@pytest.mark.parametrize("degrees", [1e-4, 0.5, 30.0, 89.0])
def test_normals_tilted_by_a_known_angle_are_that_far_off(degrees: float) -> None:
    heights = np.zeros((24, 40), np.float32)
    tilted = np.array([np.sin(np.radians(degrees)), 0.0])
    level = np.broadcast_to(tilted, (24, 40, 2)).astype("<f4")
    view = reference_maps.Texture("float32", 24, 40, [level.tobytes()], 2)
    flat = reference_maps.HeightMap(heights, taps=taps("fourth"), scale=(1.0, 1.0), wrap=(True, True))
    found = reference_maps.normal_levels(view, flat)[0]
    for value in (found.sum / found.number, found.p99, found.max):
        assert value == pytest.approx(degrees, rel=1e-5)


def test_noise_of_a_known_size_has_its_psnr() -> None:
    values = np.full((64, 64, 1), 100 / 255, np.float32)
    signs = np.where(np.random.default_rng(1).random((64, 64)) < 0.5, -1, 1)
    texture = Texture("R8_UNORM", 64, 64, ((100 + 10 * signs).astype(np.uint8).tobytes(),))
    found = levels.value_levels(texture, values)[0]
    assert found["psnr_db"] == pytest.approx(-20 * np.log10(10 / 255), abs=1e-4)
    assert found["p99"] == pytest.approx(10 / 255, rel=1e-5)


def chain_of(values: np.ndarray, name: str, top: float) -> Texture:
    """A texture of 8-bit codes whose levels are area means."""
    kind = np.int8 if name.endswith("SNORM") else np.uint8
    codes = [
        np.rint(truth.mean(values, k) * top).astype(kind) for k in range(len(truth.sizes(*values.shape[:2])))
    ]
    return Texture(name, values.shape[1], values.shape[0], tuple(level.tobytes() for level in codes))


@pytest.mark.parametrize("shape", [(32, 48), (37, 53)])
def test_one_wrong_level_is_the_one_that_is_told(shape: tuple[int, int]) -> None:
    values = np.random.default_rng(8).random((*shape, 2))
    texture = chain_of(values, "RG8_UNORM", 255.0)
    sound = levels.value_levels(texture, values.astype(np.float32))
    assert all(level["max"] < 0.51 / 255 for level in sound)
    for wrong in range(len(texture.levels)):
        bent = list(texture.levels)
        bent[wrong] = bytes(255 - code for code in bent[wrong])
        found = levels.value_levels(
            Texture("RG8_UNORM", shape[1], shape[0], tuple(bent)), values.astype(np.float32)
        )
        assert [k for k, level in enumerate(found) if level != sound[k]] == [wrong]


def test_means_of_means_of_odd_sizes_are_told_as_errors() -> None:
    """11 texels to 5 to 2: texel 2 of the 5 straddles the middle of the 11."""
    values = np.zeros((1, 11, 1))
    values[0, 4:6] = 1.0
    once = truth.area_matrix(11, 5) @ values[0, :, 0]
    twice = truth.area_matrix(5, 2) @ once
    rows = [values[0, :, 0], once, twice, [values.mean()]]
    texture = Texture(
        "R8_UNORM", 11, 1, tuple(np.rint(np.array(r) * 255).astype(np.uint8).tobytes() for r in rows)
    )
    found = levels.value_levels(texture, values.astype(np.float32))
    exact = truth.area_matrix(11, 2) @ values[0, :, 0]
    assert found[1]["max"] < 0.51 / 255
    assert found[2]["max"] == pytest.approx(np.abs(twice - exact).max(), abs=0.51 / 255)
    assert found[2]["max"] > 0.05


def test_normals_that_cancel_out_are_measured_against_plus_z() -> None:
    heights = np.float32([[0.0, 1e30], [0.0, 1e30]])  # wrapped: slopes of nothing; ends: all one way
    texture = Texture("RG8_SNORM", 2, 2, (bytes(8), bytes(2)))
    wrapped = levels.normal_levels(texture, ground(heights))
    assert [level["max_deg"] for level in wrapped] == [0.0, 0.0]
    sawtooth = np.float32([[0, 1e30, 2e30, 1e30]])
    texture = Texture("RG8_SNORM", 4, 1, (bytes([129, 0, 0, 0, 127, 0, 0, 0]), bytes(4), bytes(2)))
    found = levels.normal_levels(texture, ground(sawtooth, "central"))
    assert found[2]["max_deg"] == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize("shape", [(1, 1), (1, 8), (8, 1), (5, 7)])
@pytest.mark.parametrize("level", [0.0, -3.0, 3e38])
def test_flat_ground_has_no_error_at_all(shape: tuple[int, int], level: float) -> None:
    heights = np.full(shape, level, np.float32)
    zero = Texture("RG8_SNORM", shape[1], shape[0], tuple(bytes(2 * a * b) for a, b in truth.sizes(*shape)))
    for name in FILTERS:
        for measure in (levels.normal_levels, levels.dudv_levels):
            for found in measure(zero, ground(heights, name)):
                assert found["max_deg"] == 0.0


@pytest.mark.parametrize("scale", [1e-6, 1e6, 1e30])
def test_slopes_of_any_size_are_measured(scale: float) -> None:
    field = ground(waves(24, 32, 3, 6.0), slope_scale=(scale, scale))
    normals = settled(field)
    texture = chain_of(normals[:, :, :2], "RG8_SNORM", 127.0)
    one = Texture("RG8_SNORM", 32, 24, texture.levels[:1])
    found = levels.normal_levels(one, field)[0]
    assert np.isfinite([*found.values()]).all()
    near([found], truth.angles(one, [normals]))


# Percentiles, threads, islands, refusals


@pytest.mark.parametrize("count", [1, 2, 99, 100, 101, 199, 200, 201, 5000])
def test_percentiles_are_exact(count: int) -> None:
    order = np.random.default_rng(count).permutation(count)
    values = ((order + 1) / (count + 1)).astype(np.float32).reshape(1, count, 1)
    zero = Texture("R8_UNORM", count, 1, (bytes(count),))
    found = reference_maps.value_levels(
        reference_maps.Texture("unorm8", 1, count, zero.levels, 1), values, threads=3
    )[0]
    ranked = np.sort(values.ravel())
    assert found.p99 == ranked[-(-count * 99 // 100) - 1]
    assert found.max == ranked[-1]
    assert (ranked <= found.p99).sum() * 100 >= 99 * count


def test_many_equal_errors_do_not_disturb_a_percentile() -> None:
    values = np.repeat(np.float32([0.25, 0.5, 0.75]), [9000, 985, 15]).reshape(100, 100, 1)
    view = reference_maps.Texture("unorm8", 100, 100, [bytes(10000)], 1)
    for seed in range(3):
        shuffled = np.random.default_rng(seed).permutation(values.ravel()).reshape(values.shape)
        found = reference_maps.value_levels(view, shuffled, threads=1 + seed)[0]
        assert (found.p99, found.max) == (0.5, 0.75)


def measured(threads: int) -> list[Any]:
    """One of every face, on sizes that halve evenly, in part, and never."""
    out: list[Any] = []
    for shape in [(256, 128), (260, 100), (63, 127)]:
        heights, gloss = some_heights(*shape), np.random.default_rng(1).random((*shape, 2), np.float32)
        islands = np.arange(shape[1], dtype=np.int32)[None, :].repeat(shape[0], 0) // 40 - 1
        one = reference_maps.HeightMap(heights, taps=taps("septic6"), scale=(1, 1), wrap=(True, False))
        two = reference_maps.HeightMap(heights, taps=taps("eighth"), scale=(1, 1), wrap=(True, True))
        three = reference_maps.HeightMap(
            heights, taps=taps("central"), scale=(1, 1), wrap=(False, False), islands=islands
        )
        signed = truth.random_texture("BC5_SNORM", *shape)
        view = reference_maps.Texture("bc5_signed", *shape, signed.levels)
        for found in (one, two, three):
            out.append(reference_maps.normal_levels(view, found, threads=threads))
            out.append(reference_maps.normal_levels(view, found, offsets=True, threads=threads))
            out.append(reference_maps.gloss_levels(view, gloss, found, threads=threads))
            out.append(reference_maps.highlight_levels(view, gloss, found, threads=threads))
        out.append(reference_maps.filter_angles(one, two, threads=threads))
        out.append(reference_maps.value_levels(view, gloss, threads=threads))
        pixels = np.random.default_rng(1).integers(0, 256, (*shape, 4), np.uint8)
        color = reference_maps.Texture("bc3", *shape, truth.random_texture("BC3_SRGB", *shape).levels)
        out.append(
            reference_maps.color_levels(color, pixels, encoded=True, alpha_cutoff=0.5, threads=threads)
        )
    return out


def test_threads_do_not_change_a_bit() -> None:
    assert measured(1) == measured(2) == measured(7)


@pytest.mark.parametrize("wrap", WRAPS)
def test_texels_whose_taps_or_area_leave_their_island_are_not_measured(wrap: tuple[bool, bool]) -> None:
    shape = (32, 48)
    heights = some_heights(*shape)
    islands = np.full(shape, -1, np.int32)
    islands[2:20, 3:22], islands[4:32, 22:40], islands[:, 44:] = 0, 1, 2
    field = ground(heights, "central", wrap, islands=islands)
    reach = 4
    rows, columns = (
        np.arange(-reach, n + reach) % n
        if wrap[1 - axis]
        else np.clip(np.arange(-reach, n + reach), 0, n - 1)
        for axis, n in enumerate(shape)
    )
    if not wrap[1]:
        rows = mirrored(shape[0], reach)
    if not wrap[0]:
        columns = mirrored(shape[1], reach)
    inside = islands >= 0
    for j in range(2 * reach + 1):
        for i in range(2 * reach + 1):
            inside &= islands[np.ix_(rows[j : j + shape[0]], columns[i : i + shape[1]])] == islands
    texture = truth.random_texture("RG8_SNORM", *shape)
    exact = settled(field)
    count = len(texture.levels)
    masks = [truth.mean(inside[:, :, None].astype(float), k)[:, :, 0] > 1 - 1e-9 for k in range(count)]
    assert masks[0].any() and masks[1].any() and not masks[-1].any()
    chain = [truth.normalised(truth.mean(exact, k)) for k in range(count)]
    near(levels.normal_levels(texture, field), truth.angles(texture, chain, masks))
    offsets = exact[:, :, :2] - exact[inside][:, :2].mean(axis=0)
    chain = [truth.rebuilt(truth.mean(offsets, k)) for k in range(count)]
    near(levels.dudv_levels(texture, field), truth.angles(texture, chain, masks))
    gloss = np.random.default_rng(3).random((*shape, 2), np.float32)
    baked = truth.random_texture("RG8_UNORM", *shape)
    near(levels.gloss_levels(baked, gloss, field), gloss_truth(baked, gloss, exact, masks))


def mirrored(size: int, reach: int) -> np.ndarray:
    at = np.arange(-reach, size + reach)
    edge = np.clip(at, 0, size - 1)
    return np.clip(2 * edge - at, 0, size - 1)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: reference_maps.Texture("unorm8", 4, 4, [bytes(15)], 1),
        lambda: reference_maps.Texture("bc9", 4, 4, [bytes(16)], 1),
        lambda: reference_maps.Texture("unorm8", 0, 4, [b""], 1),
        lambda: reference_maps.HeightMap(np.zeros((2, 2)), taps=([], [1.0]), scale=(1, 1), wrap=(True, True)),
        lambda: reference_maps.HeightMap(
            np.zeros((0, 2)), taps=taps("central"), scale=(1, 1), wrap=(True, True)
        ),
        lambda: levels.value_levels(Texture("R8_UNORM", 2, 2, (bytes(4),)), np.zeros((2, 3, 1), np.float32)),
        lambda: levels.value_levels(Texture("R8_UNORM", 2, 2, (bytes(4),)), np.zeros((2, 2, 2), np.float32)),
        lambda: taps("smooth1"),
        lambda: taps("sobel"),
    ],
)
def test_what_does_not_fit_is_refused(wrong: Callable[[], Any]) -> None:
    with pytest.raises((ValueError, KeyError)):
        wrong()


def test_a_large_map_is_measured_in_little_memory(root: Path) -> None:
    """2048^2 normals, 22 MB of heights and texture: measuring adds some rows and the largest errors alone."""
    script = PEAK + (
        "import numpy as np\n"
        "from paradize.data import HeightMap\n"
        "from paradize.metrics import levels\n"
        "from tests.pipeline.map_truth import random_texture\n"
        "heights = np.zeros((2048, 2048), np.float32)\n"
        "texture = random_texture('BC5_SNORM', 2048, 2048)\n"
        "before = peak()\n"
        "levels.normal_levels(texture, HeightMap(heights, (1, 1), (True, True), 'fourth'))\n"
        "print(peak() - before)\n"
    )
    found = subprocess.run([sys.executable, "-c", script], cwd=root, capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    assert int(found.stdout) < 12 << 20

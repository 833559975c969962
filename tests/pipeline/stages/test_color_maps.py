"""Promises of baked colours and cube maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.bakers.color import bake_color, color_texture, color_values
from paradize.bakers.cubemap import bake_cubemap
from paradize.errors import SourceError
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.levels import color_levels
from paradize.metrics.texels import decode_texels
from paradize.scene.budget import METRICS
from tests.pipeline.heights import save
from tests.sweeps import sweep


def test_colour_with_alpha_from_another_file(tmp_path: Path) -> None:
    color = save(tmp_path / "c.png", np.full((36, 36, 3), 90, np.uint8))
    hole = np.full((36, 36, 1), 255, np.uint8)
    hole[4:12, 4:12] = 0
    product = bake_color(color, alpha=save(tmp_path / "a.png", hole))
    assert product.format == "BC3_SRGB"
    assert np.array_equal(decode_texels(decode_ktx2(product.data))[:, :, 3] * 255, hole[:, :, 0])


def test_alpha_that_is_coarser_than_its_colour_is_enlarged_with_a_warning(tmp_path: Path) -> None:
    color = save(tmp_path / "c.png", np.full((16, 16, 3), 90, np.uint8))
    small = np.full((4, 8, 1), 255, np.uint8)
    small[:, 4:] = 0
    product = bake_color(color, alpha=save(tmp_path / "b.png", small))
    alpha = decode_texels(decode_ktx2(product.data))[:, :, 3]
    assert (alpha[:, :7] == 1.0).all() and (alpha[:, 9:] == 0.0).all()
    (warning,) = product.warnings
    assert "b.png: 8 x 4 texels of alpha are enlarged to 16 x 16" in warning


def test_alpha_that_is_finer_than_its_colour_keeps_every_texel(tmp_path: Path) -> None:
    color = save(tmp_path / "c.png", np.full((4, 16, 3), 90, np.uint8))
    fine = np.where(np.indices((32, 32)).sum(axis=0) % 4 < 2, 255, 0).astype(np.uint8)[:, :, None]
    product = bake_color(color, alpha=save(tmp_path / "b.png", fine), uncompressed=True)
    texels = decode_texels(decode_ktx2(product.data))
    assert (texels[:, :, 3] * 255 == fine[:, :, 0]).all() and (texels[..., :3] * 255 == 90).all()
    (warning,) = product.warnings
    assert "c.png: 16 x 4 texels of the colour map are enlarged to 32 x 32" in warning


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize(("channel", "at"), [("r", 0), ("g", 1), ("b", 2), ("a", 3)])
def test_alpha_is_the_channel_that_its_material_names(
    tmp_path: Path, channel: str, at: int, inverted: bool
) -> None:
    color = save(tmp_path / "c.png", np.full((16, 16, 3), 90, np.uint8))
    pixels = np.zeros((16, 16, 4), np.uint8)
    for k in range(4):
        pixels[4 * k : 4 * k + 4, :, k] = 255
    path = save(tmp_path / "a.png", pixels)
    product = bake_color(color, alpha=path, alpha_channel=channel, alpha_inverted=inverted)
    alpha = decode_texels(decode_ktx2(product.data))[:, :, 3] * 255
    assert np.array_equal(alpha, 255 - pixels[:, :, at] if inverted else pixels[:, :, at])


@pytest.mark.parametrize("opaque", [True, False])
def test_a_mask_is_read_as_grey_where_its_alpha_is_opaque_else_as_alpha(tmp_path: Path, opaque: bool) -> None:
    color = save(tmp_path / "c.png", np.full((16, 16, 3), 90, np.uint8))
    pixels = np.full((16, 16, 4), 255, np.uint8)
    pixels[:4, :, :3] = 0
    pixels[:, :4, 3] = 255 if opaque else 0
    product = bake_color(color, alpha=save(tmp_path / "a.png", pixels), alpha_channel="luminance")
    alpha = decode_texels(decode_ktx2(product.data))[:, :, 3] * 255
    assert np.array_equal(alpha, pixels[:, :, 0 if opaque else 3])


@pytest.mark.parametrize("fmt", ["BC3_SRGB", "BC7_SRGB"])
def test_what_is_transparent_takes_no_precision_from_the_coarse_levels_of_the_rest(fmt: str) -> None:
    """Pale columns end in a dark rim, and the transparent rows below take the rim's colour."""
    values = np.full((64, 64, 4), 255, np.uint8)
    values[:48, :, :3] = (230 + 25 * np.sin(np.arange(64) / 9)).clip(0, 255).astype(np.uint8)[:, None]
    values[47] = (40, 40, 40, 255)
    values[48:] = (40, 40, 40, 0)
    texture = color_texture(values, fmt, encoded=True, alpha_cutoff=None, tier="balanced")
    plain = color_texture(values, "RGBA8_SRGB", encoded=True, alpha_cutoff=None, tier="balanced")
    found, wanted = (decode_texels(one, 4) for one in (texture, plain))
    seen = wanted[:, :, 3] > 0
    assert seen.any() and not seen.all()
    assert np.ptp(wanted[seen][:, 0]) < 0.2
    assert np.abs(found - wanted)[seen].max() < 0.04


def test_an_opaque_alpha_channel_costs_nothing(tmp_path: Path) -> None:
    pixels = np.full((36, 36, 4), 255, np.uint8)
    assert bake_color(save(tmp_path / "o.png", pixels)).format == "BC1_RGB_SRGB"


@pytest.mark.parametrize("shape", [(8, 8, 3), (32, 32, 3), (4, 64, 4)])
def test_a_picture_of_few_texels_keeps_each_of_them(shape: tuple[int, int, int], tmp_path: Path) -> None:
    """A block of BC1 has 16 texels and two colours: swatches of one texel each came out as others."""
    pixels = np.random.default_rng(7).integers(0, 256, shape, dtype=np.uint8)
    product = bake_color(save(tmp_path / "a.png", pixels))
    assert product.format == "RGBA8_SRGB"
    kept = decode_texels(decode_ktx2(product.data))[:, :, : shape[2]]
    seen = pixels if shape[2] == 3 else np.where(pixels[:, :, 3:] > 0, pixels, kept * 255)
    assert np.abs(255.0 * kept - seen).max() <= 1.0


@pytest.mark.parametrize("alpha", ["cut out", "apart from the colours"])
def test_tier_exact_leaves_no_more_of_colour_or_of_alpha_than_the_tiers_below(
    alpha: str, tmp_path: Path
) -> None:
    """BC7 where alpha is an edge; BC3, which has bytes for alpha alone, where it is faint noise."""
    rng = np.random.default_rng(2)
    y, x = np.mgrid[:64, :64]
    rgba = np.stack([x * 3, y * 3, x + y, np.where((x // 9 + y // 7) % 2, 255, 0)], axis=2).astype(np.float32)
    rgba += rng.normal(0, 12, rgba.shape) * (1, 1, 1, 0)
    if alpha != "cut out":
        rgba[:, :, 3] = rng.integers(100, 108, (64, 64))
    save(tmp_path / "a.png", rgba.clip(0, 255).astype(np.uint8))
    made = {tier: bake_color(tmp_path / "a.png", tier=tier) for tier in ("balanced", "exact")}
    assert made["exact"].format == ("BC7_SRGB" if alpha == "cut out" else "BC3_SRGB")
    assert (made["exact"].reason is None) == (alpha == "cut out"), made["exact"].reason
    for metric in METRICS.keys() & made["exact"].errors.keys():
        assert made["exact"].errors[metric] >= made["balanced"].errors[metric], metric


def cut_out() -> npt.NDArray[np.uint8]:
    """Spots of leaves, (128, 128, 4), with soft edges of a few texels, on nothing."""
    rng = np.random.default_rng(4)
    y, x = np.mgrid[:128, :128]
    veins = np.stack([60 + x % 23 * 3, 120 + y % 17 * 4, 40 + (x + y) % 11 * 3], axis=2)
    color = veins + rng.normal(0, 6, veins.shape)
    inside = np.sin(x / 9.0) + np.cos(y / 11.0) + 0.4 * np.sin((x + 2 * y) / 5.0)
    alpha = np.clip(inside * 400 + 100, 0, 255)
    return np.dstack([color, alpha]).clip(0, 255).astype(np.uint8)


def test_alpha_of_a_cut_out_takes_no_more_from_colour_than_it_needs(tmp_path: Path) -> None:
    """Alpha is as exact as in BC3, and all that is left goes to colour: where alpha weighs as much as suits
    noise, colour is a decibel worse."""
    product = bake_color(save(tmp_path / "leaves.png", cut_out()), tier="exact")
    below = bake_color(tmp_path / "leaves.png", tier="balanced").errors
    assert product.format == "BC7_SRGB" and product.reason is None
    assert product.errors["alpha_psnr_db"] >= below["alpha_psnr_db"]
    values, encoded, _ = color_values(tmp_path / "leaves.png", None, (False, False), None)
    heavy = color_texture(
        values, "BC7_SRGB", encoded=encoded, alpha_cutoff=0.5, tier="exact", alpha_weight=16.0
    )
    level = color_levels(heavy, values, encoded=encoded, alpha_cutoff=0.5)[0]
    assert product.errors["color_psnr_db"] > level["psnr_db"] + 1.0
    assert product.errors["color_psnr_db"] > below["color_psnr_db"] + 2.0


def grainy() -> np.ndarray:
    """A part of the cut-out whose colours are noisy: BC7 has a texel farther off in it than BC3 has."""
    part = cut_out()[:64, :64].astype(int)
    part[:, :, :3] += np.random.default_rng(2).integers(-60, 60, (64, 64, 3))
    return part.clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("name", sweep(["made", "corpus"], test=["made"]))
def test_a_worst_texel_alone_holds_no_picture_back_from_bc7(
    tmp_path: Path, request: pytest.FixtureRequest, name: str
) -> None:
    """Budgets name PSNR of colour and of alpha."""
    if name == "made":
        picture = save(tmp_path / "grainy.png", grainy())
    else:
        picture = request.getfixturevalue("corpus") / "textures/leaf.png"
    made = {tier: bake_color(picture, tier=tier) for tier in ("balanced", "exact")}
    assert made["exact"].errors["color_max"] > made["balanced"].errors["color_max"]
    assert made["exact"].format == "BC7_SRGB" and made["exact"].reason is None


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

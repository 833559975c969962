"""BC7: the decoder reads what OpenImageIO's reads, and the encoder keeps its promises."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.data import Texture
from paradize.kernels.bc7 import QUALITIES, encode_bc7
from paradize.metrics.texels import decode_texels
from paradize.metrics.texels_bc7 import decode_bc7
from tests.pipeline.map_truth import differences
from tests.sweeps import sample

U8 = npt.NDArray[np.uint8]


def oiio_texels(blocks: bytes, width: int, height: int, folder: Path) -> U8:
    """The texels that OpenImageIO reads from a DX10 DDS file of these BC7 blocks."""
    header = b"DDS " + struct.pack("<7I", 124, 0x81007, height, width, len(blocks), 0, 1) + bytes(44)
    header += struct.pack("<2I4s5I", 32, 4, b"DX10", 0, 0, 0, 0, 0) + struct.pack("<5I", 0x1000, 0, 0, 0, 0)
    path = folder / "blocks.dds"
    path.write_bytes(header + struct.pack("<5I", 98, 3, 0, 1, 0) + blocks)
    hint = oiio.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), hint)
    assert source is not None, oiio.geterror()
    return np.asarray(source.read_image(oiio.UINT8))


def decoded(blocks: bytes, width: int, height: int) -> U8:
    texture = Texture("BC7_UNORM", width, height, (blocks,))
    return np.rint(decode_texels(texture) * 255).astype(np.uint8)


def squares(rgba: U8, blocks: bytes) -> npt.NDArray[np.int64]:
    """The squared errors (h / 4, w / 4, texel, channel) of every 4 x 4 block; the sides divide by four."""
    height, width = rgba.shape[:2]
    off = (decoded(blocks, width, height).astype(np.int64) - rgba) ** 2
    return (
        off.reshape(height // 4, 4, width // 4, 4, 4)
        .transpose(0, 2, 1, 3, 4)
        .reshape(height // 4, width // 4, 16, 4)
    )


def picture(height: int, width: int, *, alpha: bool, seed: int = 0) -> U8:
    """Smooth ramps, edges and noise, changing from block to block."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    ramps = np.stack([x * 3 + y, 255 - x * 2 + y, x + y * 4, y * 3 - x], axis=2) % 256
    edges = np.where(((x * 3 + y * 2) // 13 % 2)[:, :, None] == 1, 200, ramps)
    kind = rng.integers(0, 3, (height // 4 + 1, width // 4 + 1)).repeat(4, 0).repeat(4, 1)[:height, :width]
    noise = rng.integers(0, 256, (height, width, 4))
    mixed = np.choose(kind[:, :, None], [ramps, edges, (edges * 3 + noise) // 4]).astype(np.uint8)
    if not alpha:
        mixed[:, :, 3] = 255
    return mixed


@pytest.mark.parametrize("quality", QUALITIES)
def test_alpha_that_is_nearly_opaque_is_no_opaque_alpha(quality: str) -> None:
    rgba = picture(16, 16, alpha=False)
    rgba[:, :, 3] = 254
    found = decoded(encode_bc7(rgba, quality=quality), 16, 16)[:, :, 3]
    assert (found == 254).mean() > 0.5


@pytest.mark.parametrize("mode", range(8))
def test_blocks_of_random_bits_read_as_openimageio_reads_them(mode: int, tmp_path: Path) -> None:
    blocks = np.random.default_rng(mode).integers(0, 256, (128 * 64, 16), dtype=np.uint8)
    blocks[:, 0] = blocks[:, 0] & (255 ^ ((2 << mode) - 1)) | 1 << mode
    ours = decode_bc7(blocks).reshape(64, 128, 4, 4, 4).transpose(0, 2, 1, 3, 4).reshape(256, 512, 4)
    assert np.array_equal(ours, oiio_texels(blocks.tobytes(), 512, 256, tmp_path))


def test_the_reserved_mode_is_transparent_black() -> None:
    blocks = np.full((3, 16), 255, np.uint8)
    blocks[:, 0] = 0
    assert not decode_bc7(blocks).any()


@pytest.mark.parametrize("quality", QUALITIES)
@pytest.mark.parametrize(("alpha", "weight"), [(False, 1.0), (True, 1.0), (True, 16.0)])
def test_no_block_is_worse_than_mode_6_between_smallest_and_largest(
    quality: str, alpha: bool, weight: float
) -> None:
    rgba = picture(64, 256, alpha=alpha)
    blocks = rgba.reshape(16, 4, 64, 4, 4).transpose(0, 2, 1, 3, 4).reshape(16, 64, 16, 4).astype(np.int64)
    # One low bit for all ends, as simple as can be: codes that are odd, sixteen places, nearest of them.
    low, high = blocks.min(axis=2) | 1, blocks.max(axis=2) | 1
    weights = np.array([0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64])[:, None]
    palette = (low[:, :, None] * (64 - weights) + high[:, :, None] * weights + 32) >> 6
    counted = np.array([1, 1, 1, weight])
    baseline = ((palette[:, :, :, None] - blocks[:, :, None]) ** 2 @ counted).min(axis=2).sum(axis=2)
    made = encode_bc7(rgba, quality=quality, alpha_weight=weight)
    error = (squares(rgba, made) @ counted).sum(axis=2)
    assert error.sum() < 0.8 * baseline.sum()
    # Quicker searches may round the ends a little worse than the diagonal's; exact never does.
    assert (error <= baseline * (1.0 if quality == "exact" else 1.05)).all()


def test_no_opaque_block_leaves_more_at_a_later_tier_in_sum_or_at_its_worst_texel() -> None:
    rgba = picture(128, 256, alpha=False, seed=6)
    last = [np.full((32, 64), 1 << 40)] * 2
    for quality in QUALITIES:
        left = squares(rgba, encode_bc7(rgba, quality=quality))
        found = [left.sum(axis=(2, 3)), left.max(axis=(2, 3))]
        assert all((now <= before).all() for now, before in zip(found, last, strict=True))
        last = found


@pytest.mark.parametrize("weight", [1.0, 5.0, 32.0])
def test_no_block_with_alpha_leaves_more_at_a_later_tier_as_alpha_is_weighed(weight: float) -> None:
    rgba = picture(128, 256, alpha=True, seed=6)
    last = np.full((32, 64), 1e12)
    for quality in QUALITIES:
        left = squares(rgba, encode_bc7(rgba, quality=quality, alpha_weight=weight)).sum(axis=2)
        found = left @ (1, 1, 1, weight)
        assert (found <= last).all()
        last = found


def test_the_more_alpha_weighs_the_less_of_it_is_left_and_the_more_of_colour() -> None:
    rgba = picture(128, 256, alpha=True, seed=8)
    left = [
        squares(rgba, encode_bc7(rgba, quality="exact", alpha_weight=weight)).sum(axis=(0, 1, 2))
        for weight in (1.0, 4.0, 16.0, 64.0)
    ]
    alpha, color = [int(one[3]) for one in left], [int(one[:3].sum()) for one in left]
    assert alpha == sorted(alpha, reverse=True) and color == sorted(color)
    assert 2 * alpha[-1] < alpha[0] and color[-1] > color[0]


@pytest.mark.parametrize("weight", [0.0, 0.5, 65.0, float("nan")])
def test_a_weight_of_alpha_out_of_its_range_is_refused(weight: float) -> None:
    with pytest.raises(ValueError, match="1 to 64"):
        encode_bc7(picture(8, 8, alpha=True), alpha_weight=weight)


def test_an_alpha_of_all_or_nothing_is_exact_whatever_the_colours() -> None:
    rgba = picture(64, 256, alpha=False, seed=7)
    y, x = np.mgrid[:64, :256]
    rgba[:, :, 3] = np.where((x * 3 + y * 5) // 11 % 2, 255, 0)
    made = decoded(encode_bc7(rgba, quality="exact", alpha_weight=16.0), 256, 64)
    assert np.array_equal(made[:, :, 3], rgba[:, :, 3])


@pytest.mark.parametrize("quality", QUALITIES)
def test_opaque_blocks_stay_opaque(quality: str) -> None:
    rgba = picture(64, 256, alpha=True, seed=3)
    rgba[:, ::2][:, :64, 3] = 255
    rgba[:, 1::2][:, :64, 3] = 255
    assert (decoded(encode_bc7(rgba, quality=quality), 256, 64)[:, :128, 3] == 255).all()


@pytest.mark.parametrize("quality", QUALITIES)
def test_every_block_of_one_colour_is_exact(quality: str) -> None:
    rng = np.random.default_rng(5)
    colors = rng.integers(0, 256, (4, 256, 4), dtype=np.uint8)
    colors[0] = np.arange(256)[:, None]
    colors[1, :, 3] = 255
    rgba = colors.repeat(4, axis=0).repeat(4, axis=1)
    assert np.array_equal(decoded(encode_bc7(rgba, quality=quality), 1024, 16), rgba)


@pytest.mark.parametrize("quality", QUALITIES)
def test_every_size_repeats_its_last_row_and_column(quality: str) -> None:
    rgba = picture(9, 9, alpha=True, seed=1)
    for height in range(1, 10):
        for width in range(1, 10):
            part = rgba[:height, :width]
            below, right = -height % 4, -width % 4
            padded = np.pad(part, ((0, below), (0, right), (0, 0)), mode="edge")
            assert encode_bc7(part, quality=quality) == encode_bc7(padded, quality=quality)


@pytest.mark.parametrize("quality", QUALITIES)
def test_bytes_do_not_depend_on_threads_or_bands(quality: str) -> None:
    rgba = picture(72, 260, alpha=True, seed=2)
    whole = encode_bc7(rgba, quality=quality, threads=1)
    assert encode_bc7(rgba, quality=quality, threads=2) == whole
    assert b"".join(encode_bc7(rgba[at : at + 24], quality=quality) for at in range(0, 72, 24)) == whole


@pytest.mark.parametrize(
    ("name", "gain_db"),
    sample(
        [
            ("made/textures/photo.png", 0.1),
            ("made/textures/leaf.png", 0.3),
            ("corpus/textures/BeachStones.jpg", 0.3),
            ("corpus/images/astc-encoder/ldr-rgba-00.png", 0.3),
        ],
        every=2,
    ),
)
def test_more_effort_is_never_worse_by_a_picture(
    name: str, gain_db: float, source: Callable[[str], Path]
) -> None:
    hint = oiio.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)
    pixels = np.asarray(oiio.ImageInput.open(str(source(name)), hint).read_image(oiio.UINT8))[:256, :256]
    if pixels.shape[2] == 3:
        pixels = np.dstack([pixels, np.full_like(pixels[:, :, :1], 255)])
    pixels = np.ascontiguousarray(pixels)
    truth = pixels / np.float64(255)
    found = [
        differences(decoded(encode_bc7(pixels, quality=quality), 256, 256) / 255, truth)["psnr_db"]
        for quality in QUALITIES
    ]
    assert found == sorted(found) and found[2] > found[0] + gain_db, found


def test_every_mode_is_of_use() -> None:
    rgba = np.concatenate([picture(256, 256, alpha=alpha, seed=4) for alpha in (False, True)])
    first = np.frombuffer(encode_bc7(rgba, quality="exact"), np.uint8).reshape(-1, 16)[:, 0].astype(int)
    assert set(np.unique(first & -first)) == {1 << mode for mode in range(8)}


def test_the_same_blocks_as_ever() -> None:
    # A change here changes every artifact of tier exact: it must be meant.
    opaque = {"fast": "9ec63808a7a061b0", "balanced": "44c0be22ea06d662", "exact": "74690a8170df7aab"}
    alpha = {"fast": "a5f1a01504df60d9", "balanced": "572bad7bed483ed4", "exact": "de4c3f03f363966e"}
    for golden, has_alpha in ((opaque, False), (alpha, True)):
        rgba = picture(64, 128, alpha=has_alpha)
        assert {q: hashlib.sha256(encode_bc7(rgba, quality=q)).hexdigest()[:16] for q in QUALITIES} == golden


def test_wrong_inputs_are_refused() -> None:
    rgba = picture(8, 8, alpha=False)
    for wrong in (rgba[:, :, :3], rgba.astype(np.float32), rgba[0], rgba[:0]):
        with pytest.raises(ValueError, match="shape"):
            encode_bc7(wrong)
    with pytest.raises(ValueError, match="quality"):
        encode_bc7(rgba, quality="best")

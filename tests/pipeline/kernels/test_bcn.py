"""Promises of the block compressors, judged by a decoder in numpy that shares nothing with them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.data import Texture
from paradize.kernels import bcn
from paradize.metrics.texels import decode_texels
from paradize.readers.image import read_image
from tests.pipeline.map_truth import differences, equal_ends
from tests.sweeps import sample


def decoded(name: str, data: bytes, height: int, width: int) -> np.ndarray:
    return decode_texels(Texture(name, width, height, (data,)))


def as_dds(fourcc: bytes, data: bytes, height: int, width: int) -> bytes:
    """The blocks as a DDS file, for another decoder to read."""
    head = np.zeros(32, "<u4")
    head[0] = int.from_bytes(b"DDS ", "little")
    head[1:8] = [124, 0x81007, height, width, len(data), 0, 1]
    head[19:22] = [32, 4, int.from_bytes(fourcc, "little")]
    head[27] = 0x1000
    return head.tobytes() + data


def interleaved(first: bytes, second: bytes) -> bytes:
    """BC4 blocks of two channels as BC5."""
    halves = [np.frombuffer(data, np.uint8).reshape(-1, 8) for data in (first, second)]
    return np.concatenate(halves, axis=1).tobytes()


@pytest.mark.parametrize(
    ("fourcc", "name", "channels"),
    [
        (b"DXT1", "BC1_RGB_UNORM", 3),
        (b"DXT5", "BC3_UNORM", 4),
        (b"ATI1", "BC4_UNORM", 1),
        (b"ATI2", "BC5_UNORM", 2),
    ],
)
def test_our_decoder_agrees_with_openimageios(
    tmp_path: Path, fourcc: bytes, name: str, channels: int
) -> None:
    rng = np.random.default_rng(8)
    size = {"BC1_RGB_UNORM": 8, "BC4_UNORM": 8}.get(name, 16)
    codes = rng.integers(0, 256, 16 * size, dtype=np.uint8)
    equal_ends({"BC1_RGB_UNORM": "BC1_RGB_SRGB", "BC3_UNORM": "BC3_SRGB"}.get(name, name), codes, every=2)
    data = codes.tobytes()
    path = tmp_path / "a.dds"
    path.write_bytes(as_dds(fourcc, data, 16, 16))
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), hints)
    assert source is not None, oiio.geterror()
    theirs = source.read_image(0, 0, 0, source.spec().nchannels, oiio.FLOAT).reshape(16, 16, -1)
    ours = decoded(name, data, 16, 16)
    assert np.abs(theirs[:, :, :channels] - ours[:, :, :channels]).max() < 2.1 / 255  # they round in between


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 255), st.integers(0, 255), st.integers(0, 255), st.integers(0, 255))
def test_a_block_of_one_colour_is_as_near_as_bc1_can_be(red: int, green: int, blue: int, alpha: int) -> None:
    block = np.full((4, 4, 4), (red, green, blue, alpha), np.uint8)
    found = decoded("BC3_UNORM", bcn.encode_bc3(block), 4, 4) * 255
    assert np.abs(found - block).max(axis=(0, 1))[3] < 1e-4
    assert (np.abs(found - block).max(axis=(0, 1))[:3] <= [2.01, 1.01, 2.01]).all()


@settings(deadline=None, max_examples=60)
@given(st.floats(-1, 1), st.floats(0, 2), st.integers(0, 1000))
def test_bc4_errs_by_less_than_half_a_step_in_the_mean_square(low: float, width: float, seed: int) -> None:
    values = (low + width * np.random.default_rng(seed).random((4, 4, 1))).clip(-1, 1).astype(np.float32)
    spread = float(values.max() - values.min())
    found = decoded("BC5_SNORM", bcn.encode_values(values.repeat(2, 2), signed=True), 4, 4)
    assert np.square(found - values).mean() <= (spread / 14 + 0.51 / 127) ** 2


def test_zero_is_exact_in_signed_blocks() -> None:
    found = decoded("BC5_SNORM", bcn.encode_values(np.zeros((8, 8, 2), np.float32), signed=True), 8, 8)
    assert (found == 0).all()


def test_values_at_the_ends_of_the_range_use_the_other_mode() -> None:
    values = np.full((4, 4, 1), 0.5, np.float32)
    values[0, :2], values[3, :2] = 0, 1
    values[1] += 0.02
    found = decoded("BC4_UNORM", bcn.encode_values(values, signed=False), 4, 4)
    assert np.abs(found - values).max() < 1 / 255
    data = bcn.encode_values(values, signed=False)
    assert data[0] <= data[1]


@settings(deadline=None, max_examples=30)
@given(st.integers(1, 9), st.integers(1, 9))
def test_sizes_that_blocks_do_not_divide_repeat_the_edge(height: int, width: int) -> None:
    rng = np.random.default_rng(height * 10 + width)
    rgba = rng.integers(0, 256, (height, width, 4), dtype=np.uint8)
    padded = np.pad(rgba, ((0, -height % 4), (0, -width % 4), (0, 0)), mode="edge")
    for quality in ("fast", "balanced"):
        assert bcn.encode_bc3(rgba, quality=quality) == bcn.encode_bc3(padded, quality=quality)
    values = rng.random((height, width, 2), np.float32)
    wide = np.pad(values, ((0, -height % 4), (0, -width % 4), (0, 0)), mode="edge")
    assert bcn.encode_values(values, signed=False) == bcn.encode_values(wide, signed=False)


def test_one_thread_and_many_give_the_same_blocks() -> None:
    rng = np.random.default_rng(9)
    rgba = rng.integers(0, 256, (36, 20, 4), dtype=np.uint8)
    values = rng.random((36, 20, 2), np.float32)
    assert bcn.encode_bc1(rgba, threads=1) == bcn.encode_bc1(rgba, threads=5)
    assert bcn.encode_bc3(rgba, threads=1) == bcn.encode_bc3(rgba, threads=5)
    assert bcn.encode_values(values, signed=True, threads=1) == bcn.encode_values(
        values, signed=True, threads=5
    )


@pytest.mark.parametrize(
    ("name", "bc1_db", "bc4_db"),
    sample(
        [("made/textures/photo.png", 35.5, 42.5), ("corpus/images/png-image-rs/kodim02.png", 36.5, 45.0)],
        every=2,
    ),
)
def test_a_photograph_keeps_its_quality(
    source: Callable[[str], Path], name: str, bc1_db: float, bc4_db: float
) -> None:
    pixels = read_image(source(name)).pixels[:512, :768]
    rgba = np.dstack([np.rint(pixels * 255), np.full(pixels.shape[:2], 255)]).astype(np.uint8)
    bc1 = decoded("BC1_RGB_UNORM", bcn.encode_bc1(rgba), *rgba.shape[:2])
    assert differences(bc1, pixels)["psnr_db"] > bc1_db
    green = np.ascontiguousarray(pixels[:, :, 1:2])
    bc4 = decoded("BC4_UNORM", bcn.encode_values(green, signed=False), *rgba.shape[:2])
    assert differences(bc4, green)["psnr_db"] > bc4_db


def test_bands_of_block_rows_are_the_image() -> None:
    rng = np.random.default_rng(10)
    rgba = rng.integers(0, 256, (22, 300, 4), dtype=np.uint8)
    for quality in ("fast", "balanced"):
        upper, lower = (bcn.encode_bc3(part, quality=quality) for part in (rgba[:12], rgba[12:]))
        assert upper + lower == bcn.encode_bc3(rgba, quality=quality)
    normals = rng.random((22, 30, 3), np.float32)
    bands = [bcn.encode_values(normals[at : at + 8, :, :2], signed=True) for at in (0, 8, 16)]
    assert b"".join(bands) == bcn.encode_values(normals[:, :, :2].copy(), signed=True)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.int8, np.float32])
@pytest.mark.parametrize("channels", [1, 2])
def test_strides_between_texels_and_rows_are_free(kind: type, channels: int) -> None:
    rng = np.random.default_rng(11)
    signed = kind == np.int8
    for texel in range(channels, 6):
        for width in (3, 70):
            whole = (rng.random((9, width + 2, texel)) * 200 - (100 if signed else 0)).astype(kind)
            some = whole[::2, 1:-1, :channels]
            for quality in ("fast", "balanced"):
                packed = bcn.encode_values(some.copy(), signed=signed, quality=quality)
                assert bcn.encode_values(some, signed=signed, quality=quality) == packed
    flipped = whole[::-1, ::-1, :channels]
    assert bcn.encode_values(flipped, signed=signed) == bcn.encode_values(flipped.copy(), signed=signed)


def test_blocks_of_fast_do_not_know_where_in_a_row_they_stand() -> None:
    """However many are encoded side by side."""
    rng = np.random.default_rng(13)
    rgba = rng.integers(0, 256, (4, 4 * 71, 4), dtype=np.uint8)
    values = rng.random((4, 4 * 71, 2), np.float32)
    encoders = (
        lambda at: bcn.encode_bc1(rgba[:, at], quality="fast"),
        lambda at: bcn.encode_bc3(rgba[:, at], quality="fast"),
        lambda at: bcn.encode_values(rgba[:, at, :1].copy(), signed=False, quality="fast"),
        lambda at: bcn.encode_values(rgba[:, at, :2], signed=False, quality="fast"),
        lambda at: bcn.encode_values(values[:, at], signed=True, quality="fast"),
    )
    for encode in encoders:
        alone = [encode(slice(4 * k, 4 * k + 4)) for k in range(71)]
        assert b"".join(alone) == encode(slice(None))


def test_codes_of_integers_are_the_floats_of_the_same_value() -> None:
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16, 1)
    as_float = codes.astype(np.float32) / np.float32(255)
    for values in (codes, codes.astype(np.uint16) * 257):
        ours = decoded("BC4_UNORM", bcn.encode_values(values, signed=False), 16, 16)
        assert (
            np.abs(ours - decoded("BC4_UNORM", bcn.encode_values(as_float, signed=False), 16, 16)).max()
            < 1e-3
        )
    signed = codes.view(np.int8)
    data = bcn.encode_values(signed, signed=True)
    assert np.abs(decoded("BC5_SNORM", interleaved(data, data), 16, 16)[:, :, :1] * 127 - signed).max() < 4


def test_colour_without_alpha_is_colour_of_alpha_255() -> None:
    rgb = np.random.default_rng(12).integers(0, 256, (11, 70, 3), dtype=np.uint8)
    rgba = np.concatenate([rgb, np.full_like(rgb[:, :, :1], 255)], axis=2)
    assert bcn.encode_bc1(rgb) == bcn.encode_bc1(rgba)
    assert bcn.encode_bc3(rgb) == bcn.encode_bc3(rgba)


def test_wrong_arrays_are_refused() -> None:
    with pytest.raises(ValueError, match="shape"):
        bcn.encode_bc1(np.zeros((4, 4, 2), np.uint8))
    with pytest.raises(ValueError, match="shape"):
        bcn.encode_values(np.zeros((4, 4, 3), np.float32), signed=False)
    with pytest.raises(ValueError, match="shape"):
        bcn.encode_bc3(np.zeros((0, 4, 4), np.uint8))
    with pytest.raises(ValueError, match="int8"):
        bcn.encode_values(np.zeros((4, 4, 1), np.int8), signed=False)
    with pytest.raises(ValueError, match="uint8"):
        bcn.encode_values(np.zeros((4, 4, 1), np.uint8), signed=True)
    with pytest.raises(ValueError, match="quality"):
        bcn.encode_bc1(np.zeros((4, 4, 4), np.uint8), quality="best")

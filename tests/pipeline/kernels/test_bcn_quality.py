"""How good the block compressors' tiers are: against the naive encoder, the best there is, and peers."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from paradize.data import Texture
from paradize.kernels import bcn
from paradize.metrics.texels import decode_texels
from tests.sweeps import tries

# sha256 of what the tiers make of one picture: other bytes are another version of the encoder.
GOLDEN = {
    "bc3 fast": "08923b4da3b5551e73d9dafbddf773c9ac9020431d519ccd821f6b6cd0be2d30",
    "bc3 balanced": "243018a2cbdb90da2e11c45a88a0114c56a118ab42cddeb0dc4bd4bf6e1a9afb",
    "bc3 exact": "91a8a1a8fa94b46eaf9fbd4f51f576aeb2f79a8cfbd2b45b6841bc8ba29b3b06",
    "bc5 fast": "e799a5615f0b962fbb4a16b96d6f8ea079b78aa3a2f0ac21e9829a2c96216b54",
    "bc5 balanced": "1c6acbd89f1c388da13503d66c67573f9a13259a84f56f076af16e266d119e67",
    "bc5 exact": "4d36ab9944670351c2a8bdc5b9eaa61d4485377e31aea8157afd6d416b4f6d5a",
}


def decoded(name: str, data: bytes, height: int, width: int) -> np.ndarray:
    """In codes: 0..255, or -127..127."""
    texels = decode_texels(Texture(name, width, height, (data,))).astype(np.float64)
    return texels * (127 if name.endswith("SNORM") else 255)


def of_blocks(errors: np.ndarray) -> np.ndarray:
    """Squared errors (h, w, c) summed over each block."""
    height, width = errors.shape[:2]
    return errors.reshape(height // 4, 4, width // 4, -1).sum(axis=(1, 3)).ravel()


def worst_of_blocks(errors: np.ndarray) -> np.ndarray:
    """The largest of errors (h, w, c) in each block."""
    height, width = errors.shape[:2]
    return errors.reshape(height // 4, 4, width // 4, 4, -1).max(axis=(1, 3, 4)).ravel()


def bc1_off(rgb: np.ndarray, quality: str) -> np.ndarray:
    found = decoded("BC1_RGB_UNORM", bcn.encode_bc1(rgb, quality=quality), *rgb.shape[:2])
    return np.abs(found[:, :, :3] - rgb)


def bc1_errors(rgb: np.ndarray, quality: str) -> np.ndarray:
    return of_blocks(np.square(bc1_off(rgb, quality)))


def bc4_off(values: np.ndarray, quality: str) -> np.ndarray:
    """values (h, w, 1) float32, -1..1."""
    one = np.frombuffer(bcn.encode_values(values, signed=True, quality=quality), np.uint8).reshape(-1, 8)
    found = decoded("BC5_SNORM", np.concatenate([one, one], axis=1).tobytes(), *values.shape[:2])
    return np.abs(found[:, :, :1] - values.astype(np.float64) * 127)


def bc4_errors(values: np.ndarray, quality: str) -> np.ndarray:
    return of_blocks(np.square(bc4_off(values, quality)))


def degrees_off(normals: np.ndarray, quality: str) -> np.ndarray:
    """Angles (h, w, 1) between unit vectors (h, w, 3) and those rebuilt from BC5."""
    xy = decoded("BC5_SNORM", bcn.encode_values(normals[:, :, :2], signed=True, quality=quality), 64, 64)
    xy = xy[:, :, :2] / 127
    z = np.sqrt(np.maximum(0, 1 - np.square(xy).sum(axis=2, keepdims=True)))
    shown = np.concatenate([xy, z], axis=2)
    shown /= np.linalg.norm(shown, axis=2, keepdims=True)
    chord = np.linalg.norm(shown - normals, axis=2, keepdims=True)
    return np.degrees(2 * np.arcsin(chord / 2))


def naive_bc1(rgb: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of four colours between the codes of the least and the largest of each channel: the squared error of
    each block, and the largest difference of a channel."""
    blocks = rgb.reshape(rgb.shape[0] // 4, 4, -1, 4, 3).transpose(0, 2, 1, 3, 4).reshape(-1, 16, 3)
    tops = np.array([31, 63, 31])
    ends = [np.rint(edge / 255 * tops) * 255 / tops for edge in (blocks.min(axis=1), blocks.max(axis=1))]
    palette = np.stack([ends[0] + (ends[1] - ends[0]) * k / 3 for k in range(4)], axis=1)
    off = blocks[:, :, None] - palette[:, None]
    square = np.square(off).sum(axis=3)
    taken = np.take_along_axis(off, square.argmin(axis=2)[:, :, None, None], axis=2)
    return square.min(axis=2).sum(axis=1), np.abs(taken).max(axis=(1, 2, 3))


def naive_bc4(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of eight values between the codes of the least and the largest."""
    codes = values.astype(np.float64)[:, :, 0] * 127
    blocks = codes.reshape(codes.shape[0] // 4, 4, -1, 4).transpose(0, 2, 1, 3).reshape(-1, 16)
    low, high = np.rint(blocks.min(axis=1)), np.rint(blocks.max(axis=1))
    palette = low[:, None] + (high - low)[:, None] * np.arange(8) / 7
    off = np.abs(blocks[:, :, None] - palette[:, None]).min(axis=2)
    return np.square(off).sum(axis=1), off.max(axis=1)


def random_values(seed: int) -> np.ndarray:
    """(64, 64, 1) float32, -1..1: blocks of every width, noisy, of few values, and touching the ends."""
    rng = np.random.default_rng(seed)
    width = 10 ** rng.uniform(-3, 0.4, (16, 1, 16, 1))
    start = rng.uniform(-1.2, 1, (16, 1, 16, 1))
    shape = rng.random((16, 4, 16, 4))
    shape = np.where(rng.random((16, 1, 16, 1)) < 0.3, np.rint(shape * 2) / 2, shape)
    return (start + width * shape).clip(-1, 1).astype(np.float32).reshape(64, 64, 1)


def random_colours(seed: int) -> np.ndarray:
    """(64, 64, 3) uint8: a line of every length and direction through each block, and noise about it."""
    rng = np.random.default_rng(seed)
    start, direction = rng.uniform(0, 255, (2, 16, 1, 16, 1, 3))
    length = 10 ** rng.uniform(-2, 0, (16, 1, 16, 1, 1))
    noise = 10 ** rng.uniform(-1, 2, (16, 1, 16, 1, 1))
    along = rng.random((16, 4, 16, 4, 1)) * length
    colours = start + (direction - start) * along + noise * rng.normal(size=(16, 4, 16, 4, 3))
    return colours.clip(0, 255).astype(np.uint8).reshape(64, 64, 3)


@settings(deadline=None, max_examples=tries(25))
@given(st.integers(0, 2**32))
def test_no_block_of_values_is_worse_at_a_later_tier(seed: int) -> None:
    values = random_values(seed)
    last = np.full(256, np.inf)
    for quality in bcn.QUALITIES:
        errors = bc4_errors(values, quality)
        assert (errors <= last * (1 + 1e-4) + 0.02).all()  # sums in single precision, of up to 2e5
        last = errors


@settings(deadline=None, max_examples=tries(25))
@given(st.integers(0, 2**32))
def test_no_block_of_colours_is_worse_at_a_later_tier(seed: int) -> None:
    colours = random_colours(seed)
    fast, balanced, exact = (bc1_errors(colours, quality) for quality in bcn.QUALITIES)
    assert (balanced <= fast * (1 + 1e-4) + 0.1).all()
    assert (exact <= balanced * (1 + 1e-4) + 0.1).all()


@settings(deadline=None, max_examples=tries(25))
@given(st.integers(0, 2**32))
def test_no_texel_of_a_block_is_farther_off_than_the_worst_at_an_earlier_tier(seed: int) -> None:
    colours, values = random_colours(seed), random_values(seed)
    for off in (lambda q: bc1_off(colours, q), lambda q: bc4_off(values, q)):
        fast, balanced, exact = (worst_of_blocks(off(quality)) for quality in bcn.QUALITIES)
        assert (balanced <= fast + 1e-3).all()
        assert (exact <= balanced + 1e-3).all()


def test_blocks_of_bytes_are_in_order_where_texels_stand_halfway_between_two_places() -> None:
    rng = np.random.default_rng(6)
    spans = rng.integers(0, 40, (64, 1, 64, 1, 1)) * rng.integers(0, 3, (64, 4, 64, 4, 3))
    rgb = (rng.integers(0, 256, (64, 1, 64, 1, 3)) + spans).clip(0, 255).astype(np.uint8).reshape(256, 256, 3)
    last = np.full((2, 64 * 64), np.inf)
    for quality in bcn.QUALITIES:
        one = np.frombuffer(bcn.encode_values(rgb[:, :, :1], signed=False, quality=quality), np.uint8)
        twice = np.repeat(one.reshape(-1, 1, 8), 2, axis=1).tobytes()
        value_off = np.abs(decoded("BC5_UNORM", twice, 256, 256)[:, :, :1] - rgb[:, :, :1])
        worst = np.stack([worst_of_blocks(bc1_off(rgb, quality)), worst_of_blocks(value_off)])
        assert (worst <= last + 1e-3).all()
        last = worst


@settings(deadline=None, max_examples=tries(25))
@given(st.integers(0, 2**32))
@example(368)
def test_no_block_of_vectors_is_turned_farther_at_a_later_tier(seed: int) -> None:
    xy = np.concatenate([random_values(seed), random_values(seed + 1)], axis=2)
    xy /= np.maximum(1, np.linalg.norm(xy, axis=2, keepdims=True))
    z = np.sqrt(np.maximum(0, 1 - np.square(xy).sum(axis=2, keepdims=True)))
    normals = np.concatenate([xy, z], axis=2).astype(np.float32)
    last = [np.full(256, np.inf)] * 2
    for quality in bcn.QUALITIES:
        off = degrees_off(normals, quality)
        found = [of_blocks(off), worst_of_blocks(off)]
        for now, before in zip(found, last, strict=True):
            assert (now <= before * 1.001 + 0.01).all()
        last = found


@settings(deadline=None, max_examples=tries(25))
@given(st.integers(0, 2**32))
def test_no_block_is_worse_than_the_naive_one(seed: int) -> None:
    """But in fast, or where that would have a texel farther off than the fast tier has any."""
    colours, values = random_colours(seed), random_values(seed)
    kinds = (
        (*naive_bc1(colours), lambda q: bc1_off(colours, q), 0.8),
        (*naive_bc4(values), lambda q: bc4_off(values, q), 1.0),
    )
    for naive, naive_worst, off, share in kinds:
        fast = off("fast")
        assert np.square(fast).sum() < naive.sum()
        taken = naive_worst < worst_of_blocks(fast) - 1e-2
        for quality in ("balanced", "exact"):
            errors = of_blocks(np.square(off(quality)))
            assert (errors[taken] <= naive[taken] * (1 + 1e-4) + 0.1).all()
            assert errors.sum() < share * naive.sum()


@pytest.mark.parametrize("quality", bcn.QUALITIES)
def test_two_colours_are_each_as_near_as_their_codes(quality: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        pair = rng.integers(0, 256, (2, 3))
        which = rng.integers(0, 2, (4, 4))
        colours = pair[which].astype(np.uint8)
        tops = np.array([31, 63, 31])
        nearest = np.rint(pair / 255 * tops) * 255 / tops
        best = np.square(nearest[which] - colours).sum()
        assert bc1_errors(colours, quality).sum() <= best + 0.1


@pytest.mark.parametrize("quality", bcn.QUALITIES)
def test_black_and_white_stay_themselves(quality: str) -> None:
    colours = np.zeros((8, 8, 3), np.uint8)
    colours[2:5, 3:] = 255
    assert (
        np.abs(decoded("BC1_RGB_UNORM", bcn.encode_bc1(colours, quality=quality), 8, 8) - colours).max()
        < 1e-3
    )


@pytest.mark.parametrize("quality", bcn.QUALITIES)
def test_a_slow_gradient_has_no_bands(quality: str) -> None:
    ramp = np.linspace(40, 72, 1024)
    colours = np.repeat(np.rint(ramp)[None, :, None], 3, axis=2).repeat(4, axis=0).astype(np.uint8)
    found = decoded("BC1_RGB_UNORM", bcn.encode_bc1(colours, quality=quality), 4, 1024)[:, :, :3]
    assert np.abs(found - colours).max() < 2.5  # a code of red is 8.2 apart
    assert len(np.unique(found[:, :, 0].round(3))) >= 10  # of 32 / 2.74 that thirds of a code have


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32))
def test_alpha_of_a_cut_out_is_exact(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rgba = rng.integers(0, 256, (16, 16, 4), dtype=np.uint8)
    rgba[:, :, 3] = rng.integers(0, 2, (16, 16)) * 255
    for quality in bcn.QUALITIES:
        found = decoded("BC3_UNORM", bcn.encode_bc3(rgba, quality=quality), 16, 16)
        assert (np.abs(found[:, :, 3] - rgba[:, :, 3]) < 1e-4).all()


@pytest.mark.parametrize("quality", bcn.QUALITIES)
def test_a_narrow_range_beside_the_ends_of_the_range_keeps_its_steps(quality: str) -> None:
    rng = np.random.default_rng(14)
    codes = rng.integers(20, 200, (16, 1, 16, 1)) + rng.integers(0, 11, (16, 4, 16, 4))
    ends = np.array([0, 255])[rng.integers(0, 2, (16, 1, 16, 1))]
    alpha = np.where(rng.random((16, 4, 16, 4)) < 0.3, ends, codes).reshape(64, 64, 1).astype(np.uint8)
    rgba = np.concatenate([np.full((64, 64, 3), 99, np.uint8), alpha], axis=2)
    found = decoded("BC3_UNORM", bcn.encode_bc3(rgba, quality=quality), 64, 64)[:, :, 3:]
    assert (
        np.abs(found - alpha).max() <= 2
    )  # a fifth of ten codes, rounded; a seventh of the block is up to 32


@pytest.mark.parametrize("quality", bcn.QUALITIES)
def test_flat_normals_are_exactly_flat_beside_steep_ones(quality: str) -> None:
    normals = np.zeros((16, 16, 3), np.float32)
    normals[:, :, 2] = 1
    normals[4:8, 8:12] = (0.6, -0.8, 0)
    data = bcn.encode_values(normals[:, :, :2], signed=True, quality=quality)
    found = decoded("BC5_SNORM", data, 16, 16)
    flat = (normals[:, :, :2] == 0).all(axis=2)
    assert (found[flat] == 0).all()


def test_the_exact_tier_of_values_is_nearly_the_best_there_is() -> None:
    """Of what leaves no texel farther off than the balanced tier does."""
    rng = np.random.default_rng(5)
    codes = rng.integers(0, 24, (64, 1, 1)) + rng.random((64, 4, 4)) * rng.uniform(2, 30, (64, 1, 1))
    low, high = np.meshgrid(np.arange(64), np.arange(64), indexing="ij")
    pairs = np.stack([low[low < high], high[low < high]], axis=1).astype(np.float64)
    palettes = pairs[:, :1] + (pairs[:, 1:] - pairs[:, :1]) * np.arange(8) / 7
    best, ours = 0.0, dict.fromkeys(bcn.QUALITIES, 0.0)
    for block in codes:
        step = (pairs[:, 1] - pairs[:, 0]) / 7
        place = np.rint((block.reshape(1, 16) - pairs[:, :1]) / step[:, None]).clip(0, 7)
        gaps = block.reshape(1, 16) - np.take_along_axis(palettes, place.astype(np.int64), axis=1)
        values = (block / 127).astype(np.float32)[:, :, None]
        near = np.abs(gaps).max(axis=1) <= bc4_off(values, "balanced").max() + 1e-3
        best += np.square(gaps).sum(axis=1)[near].min()
        for quality in bcn.QUALITIES:
            ours[quality] += bc4_errors(values, quality).sum()
    assert ours["exact"] <= best * 1.02
    assert ours["balanced"] <= best * 1.15
    assert ours["fast"] <= best * 1.4


def test_the_bytes_are_those_of_every_other_machine() -> None:
    y, x = np.mgrid[:60, :76]
    rgba = np.stack([x * 3 + y, (x * y) % 251, x * x // 24, 255 - y * 4], axis=2).astype(np.uint8)
    values = (rgba[:, :, :2].astype(np.float32) - np.float32(128)) / np.float32(128)
    found = {}
    for quality in bcn.QUALITIES:
        found[f"bc3 {quality}"] = hashlib.sha256(bcn.encode_bc3(rgba, quality=quality)).hexdigest()
        data = bcn.encode_values(values, signed=True, quality=quality)
        found[f"bc5 {quality}"] = hashlib.sha256(data).hexdigest()
    assert found == GOLDEN


@pytest.mark.deep
def test_every_picture_is_as_far_ahead_of_the_peers_as_promised(sources: Path) -> None:
    etcpak = pytest.importorskip("etcpak", reason="peers are of the bench: run `make bench` once")
    quicktex = pytest.importorskip("quicktex", reason="peers are of the bench: run `make bench` once")
    encoder = pytest.importorskip("quicktex.s3tc.bc1").BC1Encoder(5)
    seen = 0
    for path in sorted(sources.rglob("*.jpg")):
        source = oiio.ImageInput.open(str(path))
        if source is None:
            oiio.geterror()
            continue
        if source.spec().nchannels != 3 or min(source.spec().width, source.spec().height) < 64:
            continue
        pixels = source.read_image(0, 0, 0, 3, oiio.UINT8)
        if pixels is None:
            source.geterror()
            continue
        height, width = (side // 4 * 4 for side in pixels.shape[:2])
        rgb = pixels[:height, :width]
        rgba = np.dstack([rgb, np.full((height, width), 255, np.uint8)])
        errors = [
            np.square(decoded("BC1_RGB_UNORM", data, height, width)[:, :, :3] - rgb).mean()
            for data in (
                bcn.encode_bc1(rgba, quality="fast"),
                bcn.encode_bc1(rgba, quality="balanced"),
                etcpak.compress_bc1(rgba.tobytes(), width, height),
                encoder.encode(quicktex.RawTexture.frombytes(rgba.tobytes(), width, height)).tobytes(),
            )
        ]
        fast, balanced, theirs, quick = (10 * np.log10(255**2 / max(error, 1e-6)) for error in errors)
        assert fast >= theirs + 1 or theirs > 60, path.name
        assert balanced >= quick - 0.5, path.name
        seen += 1
    assert seen > 1

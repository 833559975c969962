"""Promises of the fused maps of a picture: what the stages make one after the other."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.data import Image
from paradize.kernels import normals
from paradize.kernels.maps import Levels
from paradize.kernels.normals import MaterialMaps, empty_maps, material_maps, normals_from_heights
from paradize.stages.compress import unorm
from paradize.stages.gloss import GlossSettings, gloss_map
from paradize.stages.height import height_from_color, luminance_plane
from tests.pipeline.heights import waves

FOURTH = [2 / 3, -1 / 12]
NAMES = [field.name for field in fields(MaterialMaps)]


def picture(shape: tuple[int, int, int], kind: type, seed: int = 0) -> np.ndarray:
    values = np.random.default_rng(seed).random(shape)
    return values.astype(np.float32) if kind is np.float32 else (values * np.iinfo(kind).max).astype(kind)


def check(color: np.ndarray, made: MaterialMaps, **asked: object) -> None:
    """That the maps are those of the stages, du/dv within 5/8 of a code of one mean, its sums zero."""
    kind = {1: 8, 2: 16, 4: 32}[color.dtype.itemsize]
    image = Image(color, "srgb" if asked.get("encoded", True) else "linear", kind)
    heights = height_from_color(image, asked.get("levels"))
    assert np.array_equal(made.height, unorm(heights, 65535))
    shared = {key: asked[key] for key in ("scale", "wrap", "green_down") if key in asked}
    vectors = normals_from_heights(heights, derivative=FOURTH, **shared)
    coded = normals_from_heights(heights, derivative=FOURTH, encoding="rgb8", **shared)
    assert np.array_equal(made.normal, coded)
    gloss = GlossSettings(
        asked.get("gloss_levels", Levels()),
        asked.get("specular", (0.0, 1.0)),
        asked.get("smoothness", (0.3, 0.6)),
    )
    assert np.array_equal(made.gloss, unorm(gloss_map(luminance_plane(image), gloss), 255))
    assert not made.dudv.astype(np.int64).sum(axis=(0, 1)).any()
    wanted = vectors[:, :, :2].astype(np.float64)
    for c in (0, 1):
        less = 127 * (wanted[:, :, c] - wanted[:, :, c].mean())
        off = made.dudv[:, :, c] - less
        if np.abs(less).max() > 125.5:  # some codes may have to be cut off
            continue
        assert np.abs(off).max() < 1
        assert (off.max() - off.min()) / 2 <= 0.5 + 1 / 8 + 1 / 64


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("shape", [(1, 1, 3), (1, 70, 4), (9, 1, 3), (33, 200, 3), (33, 200, 4)])
def test_the_maps_are_those_of_the_stages(kind: type, shape: tuple[int, int, int]) -> None:
    color = picture(shape, kind)
    shared = {"scale": (5.0, 4.0), "wrap": (True, False)}
    check(color, material_maps(color, derivative=FOURTH, **shared), **shared)
    more = shared | {
        "green_down": True,
        "levels": Levels(0.1, 0.7, 1.0, 1.3, 0.05, True),
        "gloss_levels": Levels(0.9, 0.0, 2.2),
        "specular": (0.2, 0.9),
        "smoothness": (1.0, 0.0),
        "encoded": False,
    }
    check(color, material_maps(color, derivative=FOURTH, **more), **more)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 999), st.integers(1, 20), st.integers(1, 140), st.sampled_from([0.0, 0.01, 1.0, 20.0]))
def test_dudv_sums_to_zero_on_any_picture(seed: int, rows: int, columns: int, scale: float) -> None:
    color = picture((rows, columns, 3), np.uint8, seed)
    color[: rows // 2] = 77  # half of it flat: most codes move one way
    shared = {"scale": (scale, scale), "wrap": (False, True)}
    check(color, material_maps(color, derivative=FOURTH, **shared), **shared)


def test_dudv_that_must_be_cut_off_still_sums_to_zero() -> None:
    ramp = np.linspace(0, 255, 250).astype(np.uint8)
    ramp[200:] = ramp[200:][::-1]
    color = np.repeat(np.broadcast_to(ramp[None, :, None], (8, 250, 1)), 3, axis=2)
    for scale in (300.0, -300.0, 1e6):
        made = material_maps(color, derivative=FOURTH, scale=(scale, 1.0), wrap=(True, True))
        assert not made.dudv.astype(np.int64).sum(axis=(0, 1)).any()
        assert np.abs(made.dudv[:, :, 0].astype(int)).max() == 127
        assert made.dudv.min() >= -127


def test_threads_and_instruction_sets_do_not_change_a_bit_and_arrays_are_used_again() -> None:
    color = picture((41, 333, 3), np.uint8)
    color[20:30] = 3
    for scale in (3.0, 1e9, 1e25):
        shared = {"derivative": FOURTH, "scale": (scale, scale), "wrap": (True, True)}
        whole = material_maps(color, threads=1, **shared)
        room = empty_maps(41, 333)
        others = [material_maps(color, threads=n, **shared) for n in (2, 7)]
        others += [material_maps(color, width=width, **shared) for width in normals.widths()]
        others += [material_maps(color, out=room, **shared)]
        assert others[-1] is room
        for other in others:
            for name in NAMES:
                assert np.array_equal(getattr(whole, name), getattr(other, name)), name


def test_a_smooth_picture_keeps_its_dudv_close_to_the_normal() -> None:
    heights = waves(64, 96, 4)
    color = np.repeat(((heights - heights.min()) / np.ptp(heights))[:, :, None], 3, axis=2)
    made = material_maps(color, derivative=FOURTH, scale=(4.0, 4.0), wrap=(True, True), encoded=False)
    vectors = made.normal.astype(np.float64) * (2 / 255) - 1
    less = vectors[:, :, :2] - vectors[:, :, :2].mean(axis=(0, 1))
    assert np.abs(made.dudv / 127 - less).max() < 0.0095


def test_wrong_arrays_are_refused() -> None:
    color = picture((4, 5, 3), np.uint8)
    shared = {"derivative": FOURTH, "scale": (1.0, 1.0), "wrap": (True, True)}
    room = empty_maps(4, 6)
    for wrong, more in [
        (color[:, :, :2], {}),
        (color.astype(np.float64), {}),
        (color[:0], {}),
        (color, {"out": room}),
        (color, {"specular": (0.0, 1.5)}),
        (color, {"derivative": []}),
    ]:
        with pytest.raises(ValueError):
            material_maps(wrong, **(shared | more))

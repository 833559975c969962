"""Promises of heights from colour: the formula of stages/height.py, against float64."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.data import Image
from paradize.kernels.maps import Levels
from paradize.stages.height import height_from_color, height_from_height
from tests.sweeps import tries

LEVELS = st.builds(
    Levels,
    black=st.floats(-0.5, 0.45),
    white=st.floats(0.55, 1.5),
    gamma=st.floats(0.2, 5.0),
    contrast=st.floats(-3.0, 4.0),
    brightness=st.floats(-1.0, 1.0),
    invert=st.booleans(),
)


def shaped(t: np.ndarray, levels: Levels) -> np.ndarray:
    t = np.clip((t - levels.black) / (levels.white - levels.black), 0, 1)
    t = t ** (1 / levels.gamma)
    t = np.clip((t - 0.5) * levels.contrast + 0.5 + levels.brightness, 0, 1)
    return 1 - t if levels.invert else t


def luminance(codes: np.ndarray, *, encoded: bool) -> np.ndarray:
    v = codes / np.float64(np.iinfo(codes.dtype).max)
    linear = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4) if encoded else v
    return np.asarray(linear[:, :, :3] @ [0.2126, 0.7152, 0.0722])


@settings(deadline=None, max_examples=tries(60))
@given(
    st.integers(0, 1000),
    LEVELS,
    st.sampled_from([np.uint8, np.uint16]),
    st.sampled_from([3, 4]),
    st.sampled_from(["srgb", "linear", "data"]),
)
def test_heights_from_colour_are_the_formula_in_float64(
    seed: int, levels: Levels, kind: type, channels: int, space: str
) -> None:
    codes = np.random.default_rng(seed).integers(0, np.iinfo(kind).max + 1, (9, 7, channels)).astype(kind)
    found = height_from_color(Image(codes, space, np.iinfo(kind).bits), levels)
    y = luminance(codes, encoded=space == "srgb")
    truth = shaped(y, levels)
    # float32 luminance is off by some 1e-7; where the levels are steep they magnify that.
    near = [np.abs(shaped(y + d, levels) - truth) for d in (-2e-7, 2e-7)]
    assert found.dtype == np.float32
    assert (np.abs(found - truth) <= 2e-7 + np.maximum(*near)).all()


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 1000), LEVELS)
def test_levels_of_a_height_picture_are_the_formula_in_float64(seed: int, levels: Levels) -> None:
    values = np.random.default_rng(seed).random((8, 9, 1), np.float32)
    found = height_from_height(Image(values, "data", 32), levels)
    assert np.abs(found - shaped(values[:, :, 0].astype(np.float64), levels)).max() < 1e-7


def test_the_order_is_points_then_gamma_then_contrast_then_brightness_then_invert() -> None:
    t = np.float32([[[0.35]]])
    levels = Levels(black=0.1, white=0.6, gamma=2.0, contrast=0.5, brightness=0.1, invert=True)
    expected = 1 - ((np.sqrt((0.35 - 0.1) / 0.5) - 0.5) * 0.5 + 0.5 + 0.1)
    assert height_from_height(Image(t, "data", 32), levels)[0, 0] == pytest.approx(expected, abs=1e-7)


def test_swapped_points_invert_and_extremes_stay_within_zero_and_one() -> None:
    t = np.linspace(0, 1, 33, dtype=np.float32)[None, :, None]
    swapped = height_from_height(Image(t, "data", 32), Levels(black=1.0, white=0.0))
    assert np.allclose(swapped, 1 - t[:, :, 0], atol=1e-7)
    for levels in (
        Levels(contrast=1e6),
        Levels(brightness=-1e6),
        Levels(black=0.5, white=0.5000001),
        Levels(gamma=1e-3),
        Levels(gamma=1e6),
    ):
        found = height_from_height(Image(t, "data", 32), levels)
        assert ((found >= 0) & (found <= 1)).all()

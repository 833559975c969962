"""Promises of de-stepping: heights of a coarse source, smooth again, and never far from what it said."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.errors import BakeError
from paradize.kernels import filter as kernel
from paradize.stages.destep import STEP_8_BIT, destep, destep_pixels
from tests.pipeline.heights import angles_between, normals, rounded, sinusoids, up
from tests.sweeps import sample, tries

BOTH = (True, True)


def furthest(found: np.ndarray, source: np.ndarray) -> float:
    """The largest distance from the source; float64 holds differences of float32 of one size exactly."""
    return float(np.abs(found.astype(np.float64) - source.astype(np.float64)).max())


@settings(deadline=None, max_examples=tries(60))
@given(
    st.integers(0, 10_000),
    st.integers(1, 40),
    st.integers(1, 40),
    st.sampled_from([STEP_8_BIT, 0.1, 1e-6, 1e-30, 1e29, 3.0]),
    st.sampled_from([2, 5, 256]),
    st.tuples(st.booleans(), st.booleans()),
)
def test_every_value_stays_within_half_a_step_of_its_source_exactly(
    seed: int, rows: int, columns: int, step: float, codes: int, wrap: tuple[bool, bool]
) -> None:
    rng = np.random.default_rng(seed)
    source = (rng.integers(0, codes, (rows, columns)) * step).astype(np.float32)
    found = destep(source, step, wrap=wrap)
    assert found.shape == source.shape
    assert furthest(found, source) <= step / 2


def test_heights_far_from_zero_stay_within_half_a_step_too() -> None:
    source = (1000 + np.random.default_rng(0).integers(0, 9, (64, 64)) * 0.001).astype(np.float32)
    assert furthest(destep(source, 0.001), source) <= 0.0005
    steps_of_a_float = destep(source, 1e-6)  # finer than float32 holds there: nothing may move
    assert np.array_equal(steps_of_a_float, source)


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (9, 7), (64, 64)])
@pytest.mark.parametrize("level", [0.0, 0.3, -7.5, 1e30])
@pytest.mark.parametrize("wrap", [(False, False), BOTH])
def test_a_constant_stays_as_it_is(shape: tuple[int, int], level: float, wrap: tuple[bool, bool]) -> None:
    flat = np.full(shape, level, np.float32)
    assert np.array_equal(destep(flat, wrap=wrap), flat)


@pytest.mark.parametrize("slope", sample([0.03, 0.1, 0.3, 1.0, 1.7, 6.2], every=2))
@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_a_ramp_in_steps_becomes_a_slope(slope: float, turn: float) -> None:
    y, x = np.mgrid[0:96, 0:256]
    truth = slope * (x + turn * y)
    stepped = (np.rint(truth) * STEP_8_BIT).astype(np.float32)
    found = destep(stepped) / STEP_8_BIT
    inside = (slice(16, -16), slice(40, -40))  # at the ends of the map half a terrace is all that is known
    raw = np.abs(np.diff(np.rint(truth), axis=1) - slope)[inside].max()
    assert np.abs(np.diff(found, axis=1) - slope)[inside].max() <= max(0.05, 0.08 * raw)
    assert np.abs(found - truth)[inside].max() < 0.3
    assert (np.diff(found, axis=1)[inside] > 0).all()


def test_a_cliff_stays_where_it_stands_and_nothing_rings_beside_it() -> None:
    for low, high in [(10, 200), (100, 140), (30, 50)]:
        codes = np.full((40, 64), low)
        codes[:, 32:] = high
        found = destep((codes * STEP_8_BIT).astype(np.float32)) / STEP_8_BIT
        assert np.abs(found - codes).max() < 0.15  # steps
        assert np.diff(found, axis=1)[:, 31].min() > high - low - 0.3


def test_texture_of_many_steps_per_texel_is_left_alone() -> None:
    source = (np.random.default_rng(0).integers(0, 256, (64, 64)) * STEP_8_BIT).astype(np.float32)
    assert furthest(destep(source), source) < 0.05 * STEP_8_BIT


@pytest.mark.parametrize(
    ("shortest", "longest", "rms_slope", "limit", "gain"),
    # limit: degrees between normals of the de-stepped heights, by the fourth-order filter, and the truth (the
    # best plain filter on the steps themselves makes 1.58 of the first). gain: how much better than with
    # steps.
    sample(
        [(32, 256, 1.0, 0.6, 12), (16, 128, 1.0, 1.0, 5), (8, 64, 1.0, 1.75, 1.4), (4, 16, 1.0, 1.7, 0.95)],
        every=2,
    ),
)
def test_normals_of_de_stepped_heights_are_far_nearer_to_the_truth(
    shortest: int, longest: int, rms_slope: float, limit: float, gain: float
) -> None:
    for seed in range(3):
        field, dx, dy = sinusoids(384, shortest, longest, seed, rms_slope=rms_slope)
        heights, span = rounded(field, 8)
        truth = up(dx, dy)

        def error(plane: np.ndarray, span: float = span, truth: np.ndarray = truth) -> float:
            found = normals(plane, scale=(span, span), wrap=BOTH)
            return float(angles_between(found, truth).mean())

        smooth = error(destep(heights, wrap=BOTH))
        assert smooth <= limit
        assert smooth * gain <= error(heights)


def test_gentle_hills_lose_their_terraces() -> None:
    field, dx, dy = sinusoids(512, 64, 256, 4, rms_slope=0.02)
    stepped = (np.rint(field * 2) / 2).astype(np.float32)  # some 20 texels to a step
    truth = up(dx, dy)

    def error(plane: np.ndarray) -> float:
        found = normals(plane, wrap=BOTH)
        return float(angles_between(found, truth).mean())

    assert error(destep(stepped, 0.5, wrap=BOTH)) < error(stepped) / 5


@pytest.mark.parametrize("shape", [(61, 97), (96, 40), (33, 33)])
@pytest.mark.parametrize("wrap", [(False, False), (True, False), BOTH])
def test_rows_and_columns_are_treated_alike(shape: tuple[int, int], wrap: tuple[bool, bool]) -> None:
    y, x = np.mgrid[: shape[0], : shape[1]]
    steps = np.round(3 * np.sin(x / 23 + 1) * np.cos(y / 31) + 0.02 * x).astype(np.float32)
    found = destep(steps, 1.0, wrap=wrap)
    turned = destep(np.ascontiguousarray(steps.T), 1.0, wrap=wrap[::-1]).T
    assert np.abs(found - turned).max() < 1e-3
    assert np.abs(found - steps).max() > 0.2


def test_a_wrapped_map_has_no_seam() -> None:
    field, _, _ = sinusoids(128, 32, 128, 1)
    heights, _ = rounded(field, 8)
    rolled = np.roll(heights, (64, 64), (0, 1))
    back = np.roll(destep(rolled, wrap=BOTH), (-64, -64), (0, 1))
    assert np.abs(back - destep(heights, wrap=BOTH)).max() < 1e-6


def test_the_result_does_not_depend_on_threads_and_the_source_stays() -> None:
    source = (np.random.default_rng(1).integers(0, 6, (151, 131)) * STEP_8_BIT).astype(np.float32)
    kept = source.copy()
    one = kernel.destep(source, step=STEP_8_BIT, wrap=(True, False), threads=1)
    for threads in (2, 3, 7):
        assert np.array_equal(
            kernel.destep(source, step=STEP_8_BIT, wrap=(True, False), threads=threads), one
        )
    assert np.array_equal(source, kept)


def test_every_channel_of_a_picture_is_de_stepped_by_itself() -> None:
    y, x = np.mgrid[0:32, 0:48]
    codes = np.dstack([x // 9, y // 7, np.full_like(x, 3)])
    pixels = (codes * STEP_8_BIT).astype(np.float32)
    found = pixels.copy()
    destep_pixels(found)
    assert furthest(found, pixels) <= STEP_8_BIT / 2
    for c in range(3):
        assert np.array_equal(found[:, :, c], destep(np.ascontiguousarray(pixels[:, :, c])))


@pytest.mark.parametrize("step", [0.0, -1.0, np.nan, np.inf])
def test_a_step_that_is_none_is_refused(step: float) -> None:
    with pytest.raises(BakeError, match="step"):
        destep(np.zeros((4, 4), np.float32), step)

"""Promises of kernels/normals: normals of height fields by any separable taps, and of given slopes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.errors import SourceError
from paradize.kernels import normals
from paradize.kernels.normals import normals_from_heights, normals_from_slopes
from tests.pipeline.heights import angles_between, waves
from tests.pipeline.map_truth import normals as true_normals
from tests.sweeps import tries

TAPS: dict[str, tuple[list[float], list[float]]] = {
    "central": ([1 / 2], [1.0]),
    "scharr": ([1 / 2], [10 / 16, 3 / 16]),
    "fourth": ([2 / 3, -1 / 12], [1.0]),
    "sixth": ([3 / 4, -3 / 20, 1 / 60], [1.0]),
    "eighth": ([4 / 5, -1 / 5, 4 / 105, -1 / 280], [1.0]),
    "tenth": ([5 / 6, -5 / 21, 5 / 84, -5 / 504, 1 / 1260], [1.0]),
    "fourth smoothed": ([2 / 3, -1 / 12], [1 / 2, 1 / 4]),
    "long": ([k / 110 for k in range(1, 6)], [1 / 3, 2 / 9, 1 / 9]),
    "wide": ([1 / 2], [1 / 5, 1 / 5, 1 / 5]),
}
WRAPS = list(product([False, True], repeat=2))


def made(heights: np.ndarray, name: str = "fourth", **more: object) -> np.ndarray:
    derivative, smooth = TAPS[name]
    arguments: dict[str, object] = {"scale": (1.0, 1.0), "wrap": (False, False)} | more
    return normals_from_heights(
        np.ascontiguousarray(heights, np.float32), derivative=derivative, smooth=smooth, **arguments
    )


def reference(heights: np.ndarray, name: str, **more: tuple[float, float]) -> np.ndarray:
    return true_normals(heights, TAPS[name], **more)


@pytest.mark.parametrize("name", TAPS)
@settings(deadline=None, max_examples=tries(25))
@given(
    st.integers(0, 1000),
    st.integers(1, 9),
    st.integers(1, 40),
    st.sampled_from(WRAPS),
    st.sampled_from([1e-6, 1.0, 1e6]),
)
def test_normals_agree_with_float64(
    name: str, seed: int, rows: int, columns: int, wrap: tuple[bool, bool], strength: float
) -> None:
    heights = np.random.default_rng(seed).random((rows, columns), np.float32)
    scale = (2.0 * strength, 3.0 * strength)
    found = made(heights, name, scale=scale, wrap=wrap).astype(np.float64)
    assert angles_between(found, reference(heights, name, scale=scale, wrap=wrap)).max() < 1e-3
    assert np.abs((found * found).sum(axis=2) - 1).max() < 1e-6


@pytest.mark.parametrize("name", TAPS)
@settings(deadline=None, max_examples=tries(15))
@given(
    st.tuples(st.integers(1, 6), st.integers(1, 35)),
    st.floats(-(2.0**99), 2.0**99, width=32),
    st.floats(-1e6, 1e6),
    st.sampled_from(WRAPS),
)
def test_flat_ground_is_exactly_up(
    name: str, shape: tuple[int, int], level: float, scale: float, wrap: tuple[bool, bool]
) -> None:
    flat = np.full(shape, level, np.float32)
    found = made(flat, name, scale=(scale, scale), wrap=wrap)
    assert found.tobytes() == np.broadcast_to(np.float32([0, 0, 1]), (*shape, 3)).tobytes()


@pytest.mark.parametrize("name", TAPS)
def test_a_ramp_of_89_9_degrees_is_right_up_to_its_edges_and_green_points_up(name: str) -> None:
    slope = 572.9572133543032  # tan of 89.9 degrees
    ramp = np.arange(37, dtype=np.float32)[None, :].repeat(8, 0)
    sine, cosine = np.sin(np.radians(89.9)), np.cos(np.radians(89.9))
    along = made(ramp, name, scale=(slope, 1.0)).astype(np.float64)
    assert angles_between(along, np.broadcast_to([-sine, 0, cosine], along.shape)).max() < 1e-3
    down = made(ramp.T, name, scale=(1.0, slope)).astype(np.float64)
    assert angles_between(down, np.broadcast_to([0, sine, cosine], down.shape)).max() < 1e-3
    flipped = made(ramp.T, name, scale=(1.0, slope), green_down=True)
    assert np.array_equal(flipped * np.float32([1, -1, 1]), made(ramp.T, name, scale=(1.0, slope)))


def test_a_step_of_one_texel_and_a_wave_of_two_are_what_their_taps_say() -> None:
    step = np.zeros((1, 9), np.float32)
    step[:, 5:] = 1
    found = made(step, "central").astype(np.float64)
    assert np.array_equal(found[0, :, 0] < 0, [False] * 4 + [True] * 2 + [False] * 3)
    assert np.allclose(found[0, 4], np.array([-0.5, 0, 1]) / np.sqrt(1.25), atol=1e-7)
    fastest = np.tile(np.float32([0, 1]), (6, 8))  # h[+k] equals h[-k] everywhere
    for name in TAPS:
        assert (made(fastest, name, wrap=(True, True)) == [0, 0, 1]).all()


@pytest.mark.parametrize("name", TAPS)
@pytest.mark.parametrize("size", [1e-30, 1e30])
def test_heights_of_any_size_are_right(name: str, size: float) -> None:
    heights = (waves(8, 40, 3, 4.0).astype(np.float64) * size).astype(np.float32)
    for scale in ((1 / size, 2 / size), (1.0, 1.0), (1e30, 1e30), (1e-35, 1e-35)):
        found = made(heights, name, scale=scale, wrap=(True, True)).astype(np.float64)
        assert angles_between(found, reference(heights, name, scale=scale, wrap=(True, True))).max() < 1e-3, (
            scale
        )
    huge = made(np.float32([[0, 3e38, -3e38, 0]]), name).astype(np.float64)
    assert np.abs((huge * huge).sum(axis=2) - 1).max() < 1e-6


def test_slopes_beyond_float_leave_the_rows_beside_them_alone() -> None:
    heights = np.random.default_rng(1).random((9, 33), np.float32)
    cliff = heights.copy()
    cliff[4] *= np.float32(1e37)
    found = made(cliff, "central", scale=(5, 5))
    assert np.array_equal(found[:3], made(heights, "central", scale=(5, 5))[:3])
    assert angles_between(found.astype(np.float64), reference(cliff, "central", scale=(5, 5))).max() < 1e-3


@settings(deadline=None, max_examples=25)
@given(
    st.integers(0, 1000), st.sampled_from(sorted(TAPS)), st.integers(1, 9), st.integers(1, 20), st.booleans()
)
def test_a_wrapped_tile_is_the_middle_of_its_three_by_three_repetition(
    seed: int, name: str, rows: int, columns: int, steep: bool
) -> None:
    tile = np.random.default_rng(seed).random((rows, columns), np.float32)
    scale = (1e25, 1e25) if steep else (20.0, 20.0)
    wrapped = made(tile, name, scale=scale, wrap=(True, True))
    reach = 1 + 5 // min(rows, columns)
    repeated = made(np.tile(tile, (2 * reach + 1, 2 * reach + 1)), name, scale=scale)
    middle = repeated[reach * rows : (reach + 1) * rows, reach * columns : (reach + 1) * columns]
    assert np.array_equal(wrapped, middle)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 1000), st.sampled_from(sorted(TAPS)), st.sampled_from(WRAPS))
def test_rotating_the_heights_rotates_the_normals(seed: int, name: str, wrap: tuple[bool, bool]) -> None:
    heights = np.random.default_rng(seed).random((7, 12), np.float32)
    found = made(heights, name, scale=(3, 2), wrap=wrap)
    turned = made(np.rot90(heights), name, scale=(2, 3), wrap=wrap[::-1])
    back = np.rot90(turned, -1)  # (x, y) of the turned map is (-y, x) of this one
    assert np.abs(np.dstack([back[:, :, 1], -back[:, :, 0], back[:, :, 2]]) - found).max() < 1e-6


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 1000), st.sampled_from(sorted(TAPS)), st.integers(-20, 20))
def test_scaling_heights_is_scaling_slopes_bit_for_bit(seed: int, name: str, power: int) -> None:
    heights = np.random.default_rng(seed).random((6, 19), np.float32)
    larger = made(heights * np.float32(2.0**power), name)
    assert np.array_equal(larger, made(heights, name, scale=(2.0**power, 2.0**power)))


@pytest.mark.parametrize("name", TAPS)
def test_rows_threads_and_instruction_sets_do_not_change_a_bit(name: str) -> None:
    rng = np.random.default_rng(5)
    heights = rng.random((23, 75), np.float32)
    heights[7, 30] = 3e37  # a steep row among the others
    islands = (rng.random((23, 75)) * 1.05).astype(np.int32)
    for more in ({}, {"islands": islands}, {"wrap": (True, True)}):
        whole = made(heights, name, threads=1, **more)
        for threads in (2, 7):
            assert np.array_equal(whole, made(heights, name, threads=threads, **more))
        for width in normals.widths():
            assert np.array_equal(whole, made(heights, name, width=width, **more))
        for first, last in ((0, 5), (5, 20), (20, 23), (4, 4)):
            part = made(heights, name, rows=(first, last), **more)
            assert np.array_equal(whole[first:last], part)


def test_normals_from_slopes_are_those_of_the_heights_they_came_from() -> None:
    heights = waves(20, 30, 2)
    field = np.pad(heights.astype(np.float64), 1, mode="wrap")
    dx = ((field[1:-1, 2:] - field[1:-1, :-2]) / 2).astype(np.float32)
    dy = ((field[2:, 1:-1] - field[:-2, 1:-1]) / 2).astype(np.float32)
    for scale, green_down in product([(2.0, 3.0), (1e25, 1e-25), (1e35, 1e35)], [False, True]):
        wanted = made(heights, "central", scale=scale, wrap=(True, True), green_down=green_down)
        found = normals_from_slopes(dx, dy, scale=scale, green_down=green_down)
        assert np.abs(found - wanted).max() < 1e-6


@pytest.mark.parametrize("name", TAPS)
def test_green_points_down_on_islands_too(name: str) -> None:
    rng = np.random.default_rng(12)
    heights, islands = (
        rng.random((20, 30), np.float32),
        np.arange(30, dtype=np.int32) // 7 + np.zeros((20, 1), np.int32),
    )
    up = made(heights, name, islands=islands)
    assert np.array_equal(made(heights, name, islands=islands, green_down=True), up * np.float32([1, -1, 1]))


def test_a_map_too_large_for_the_caches_is_what_its_bands_are() -> None:
    """4.4 MB of normals, whose rows end beside the ends of cache lines."""
    heights = np.random.default_rng(13).random((600, 607), np.float32)
    bands = [made(heights, "central", rows=(first, first + 75)) for first in range(0, 600, 75)]
    assert made(heights, "central").tobytes() == np.concatenate(bands).tobytes()


@pytest.mark.parametrize("name", TAPS)
def test_no_slope_crosses_from_one_island_to_another(name: str) -> None:
    islands = np.zeros((16, 24), np.int32)
    islands[:, 12:] = 1
    y, x = np.mgrid[0:16, 0:24].astype(np.float32)
    left, right = 0.25 * x - 0.125 * y, 100 - 0.5 * y
    found = made(np.where(islands == 0, left, right), name, islands=islands)
    for part, plane in ((np.s_[:, :12], left), (np.s_[:, 12:], right)):
        assert np.abs(found[part] - made(plane, name)[part].astype(float)).max() < 1e-6


def test_texels_alone_on_their_island_are_flat_and_pairs_take_what_they_have() -> None:
    heights = np.float32([[0, 5, 7, 100, 3]])
    islands = np.int32([[0, 1, 1, 2, -1]])
    for name in TAPS:
        found = made(heights, name, islands=islands)
        slope = np.where(found[0, :, 2] > 0, -found[0, :, 0] / found[0, :, 2], np.inf)
        assert np.allclose(slope[:4], [0, 2, 2, 0], atol=1e-6), name  # the last lies outside


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [(0, 0), (4, 13), (8, 32)])
def test_a_height_that_is_not_finite_is_refused_with_its_place(bad: float, place: tuple[int, int]) -> None:
    heights = np.zeros((9, 33), np.float32)
    heights[place] = bad
    heights[8, 32] = bad
    for threads, wrap, islands in product((1, 2, 7), (False, True), (None, np.zeros((9, 33), np.int32))):
        with pytest.raises(SourceError, match=f"row {place[0]}, column {place[1]}: a height is"):
            made(heights, threads=threads, wrap=(wrap, wrap), islands=islands)
    with pytest.raises(SourceError, match=f"row {place[0]}, column {place[1]}: a slope is"):
        normals_from_slopes(np.zeros_like(heights), heights, scale=(1, 1))


def test_wrong_arrays_are_refused() -> None:
    heights = np.zeros((4, 5), np.float32)
    wrong = [
        {"heights": heights.astype(np.float64)},
        {"heights": heights[0]},
        {"derivative": []},
        {"derivative": [np.nan]},
        {"smooth": np.ones(100)},
        {"islands": np.zeros((4, 4), np.int32)},
        {"rows": (2, 5)},
        {"scale": (np.inf, 1.0)},
    ]
    right = {"heights": heights, "derivative": [0.5], "scale": (1.0, 1.0), "wrap": (True, True)}
    normals_from_heights(**right)
    for change in wrong:
        with pytest.raises(ValueError):
            normals_from_heights(**(right | change))

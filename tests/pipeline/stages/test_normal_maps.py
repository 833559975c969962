"""Promises of normals from heights, of UV islands and of gutters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from paradize.data import Group, HeightMap, Mesh
from paradize.errors import BakeError, SourceError
from paradize.kernels import maps
from paradize.stages import filters, gutter
from paradize.stages.normal import normal_rows
from tests.pipeline.heights import angles_between, normals, rounded, sinusoids, up, waves
from tests.pipeline.map_truth import normals as true_normals
from tests.processor_time import ratio
from tests.sweeps import sample, tries

FILTERS = ("central", "scharr", "fourth", "eighth", "smooth2", "quintic4", "septic7", "smooth16")


def taps(name: str) -> tuple[np.ndarray, np.ndarray]:
    return filters.TAPS[name].derivative, filters.TAPS[name].smooth


@pytest.mark.parametrize("name", sample(FILTERS, every=2))
@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (2, 2), (5, 6)])
@settings(deadline=None, max_examples=tries(12))
@given(st.floats(-(2.0**99), 2.0**99, width=32), st.floats(1e-6, 1e6), st.booleans(), st.booleans())
def test_flat_ground_is_exactly_up(
    name: str, shape: tuple[int, int], level: float, scale: float, wrap_x: bool, wrap_y: bool
) -> None:
    flat = np.full(shape, level, np.float32)
    found = normals(flat, filter_name=name, scale=(scale, scale), wrap=(wrap_x, wrap_y))
    assert np.array_equal(found, np.broadcast_to(np.float32([0, 0, 1]), (*shape, 3)))


@pytest.mark.parametrize("name", FILTERS)
def test_a_ramp_has_one_normal_up_to_the_edges_and_green_points_up_the_image(name: str) -> None:
    y, x = np.mgrid[0:19, 0:33].astype(np.float32)
    found = normals(0.5 * x - 0.25 * y, filter_name=name)
    expected = np.array([-0.5, -0.25, 1.0]) / np.sqrt(0.25 + 0.0625 + 1)
    assert np.abs(found - expected).max() < 1e-6
    down = normals(0.5 * x - 0.25 * y, filter_name=name, green_down=True)
    assert np.abs(down - expected * [1, -1, 1]).max() < 1e-6


@pytest.mark.parametrize(("name", "held"), [("central", False), ("smooth3", True)])
def test_green_down_turns_y_over_and_nothing_else(name: str, held: bool) -> None:
    heights, codes = waves(16, 24, 1, 6.0), None
    if held:
        heights, _ = rounded(heights, 8)
        codes = np.arange(256, dtype=np.float32) / np.float32(255)
    ground = HeightMap(heights, (2.0, 3.0), (True, True), name, height_levels=codes, clamp_slopes=held)
    found = [normal_rows(replace(ground, green_down=down), 0, 16) for down in (False, True)]
    assert np.abs(found[0][:, :, 1]).max() > 0.01
    assert np.abs(found[1] - found[0] * np.float32([1, -1, 1])).max() < 1e-7


@pytest.mark.parametrize("name", FILTERS)
def test_a_ramp_of_89_9_degrees_is_right(name: str) -> None:
    slope = 572.9572133543032  # tan of 89.9 degrees
    found = normals(
        np.arange(32, dtype=np.float32)[None, :].repeat(8, 0), filter_name=name, scale=(slope, 1.0)
    )
    truth = np.array([-np.sin(np.radians(89.9)), 0, np.cos(np.radians(89.9))])
    assert angles_between(found.astype(np.float64), np.broadcast_to(truth, found.shape)).max() < 1e-3


@settings(deadline=None, max_examples=25)
@example(987, "smooth16", 41227.0)  # one texel's terms cancel to a slope of 0.9
@given(st.integers(0, 1000), st.sampled_from(FILTERS), st.floats(1e-6, 1e6))
def test_scaled_heights_keep_their_slopes_to_rounding_of_the_terms(
    seed: int, name: str, factor: float
) -> None:
    heights = waves(8, 10, seed, 4.0).astype(np.float64)
    one = normals(heights, scale=(factor, factor), filter_name=name, wrap=(True, True)).astype(np.float64)
    truth = true_normals(heights.astype(np.float32), taps(name), scale=(factor, factor), wrap=(True, True))
    # float32 rounds by one part in 2^24 of the terms that a slope is summed from; a slope that is off by d
    # turns its normal by at most d times the normal's z.
    derivative, smooth = (np.abs(weights).sum() for weights in taps(name))
    terms = factor * derivative * smooth * np.abs(heights).max()
    allowed = 2.5 * 2.0**-24 * (1 + terms * truth[:, :, 2])
    assert (np.radians(angles_between(one, truth)) <= allowed).all()
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
    times = 2 * (16 // min(rows, columns) + 1) + 1  # so that no tap of the middle one leaves the map
    repeated = normals(np.tile(tile, (times, times)), filter_name=name, scale=(20, 20))
    y, x = times // 2 * rows, times // 2 * columns
    assert np.array_equal(wrapped, repeated[y : y + rows, x : x + columns])


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
        truth = true_normals(heights, taps(name), scale=(2.0, 3.0), wrap=wrap)
        assert angles_between(found, truth).max() < 1e-3


@pytest.mark.parametrize("name", FILTERS)
def test_bands_of_rows_are_the_rows_of_the_whole(name: str) -> None:
    heights = waves(40, 32, 3, 6.0)
    ground = HeightMap(heights, (2.0, 3.0), (True, True), name)
    whole = normal_rows(ground, 0, 40, threads=3)
    for first, last in [(0, 7), (7, 8), (8, 40)]:
        assert np.array_equal(normal_rows(ground, first, last), whole[first:last])


def test_fourth_order_normals_of_smooth_heights_are_within_a_tenth_of_a_degree_of_the_truth() -> None:
    heights, dx, dy = sinusoids(256, 8, 64, 1)
    means = {
        name: angles_between(
            normals(heights, filter_name=name, wrap=(True, True)).astype(np.float64), up(dx, dy)
        ).mean()
        for name in ("central", "fourth", "eighth")
    }
    assert means["eighth"] < 0.01
    assert means["fourth"] < 0.1
    assert means["fourth"] < means["central"] < 2


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("size", [1e-30, 1.0, 1e30])
def test_heights_of_any_size_give_the_normals_of_their_slopes(name: str, size: float) -> None:
    heights = waves(20, 24, 5, 6.0)
    found = normals(heights * np.float32(size), filter_name=name, scale=(1 / size, 1 / size))
    plain = normals(heights, filter_name=name)
    assert np.abs(found - plain).max() < 1e-5


@pytest.mark.parametrize("name", ["central", "smooth5"])
def test_a_height_that_is_no_number_is_refused_with_its_place(name: str) -> None:
    heights = np.zeros((12, 9), np.float32)
    for bad in (np.nan, np.inf, -np.inf):
        heights[4, 7] = bad
        with pytest.raises(SourceError, match="row 4, column 7"):
            normals(heights, filter_name=name)


def test_waves_of_two_texels_have_no_slope_whatever_the_filter() -> None:
    heights = np.tile(np.float32([0, 1]), (8, 8))
    for name in FILTERS:
        found = normals(heights, filter_name=name, wrap=(True, True))
        assert np.abs(found - np.float32([0, 0, 1])).max() < 1e-6


def test_a_step_is_a_slope_beside_it_and_flat_ground_beyond_the_reach() -> None:
    heights = np.zeros((8, 64), np.float32)
    heights[:, 32:] = 1
    for name in FILTERS:
        found = normals(heights, filter_name=name)
        reach = len(filters.TAPS[name].derivative)
        assert np.array_equal(found[:, : 32 - reach, 0], np.zeros((8, 32 - reach)))
        assert np.array_equal(found[:, 32 + reach :, 0], np.zeros((8, 32 - reach)))
        assert (found[:, 31:33, 0] < -0.05).all()


def test_an_unknown_filter_is_refused() -> None:
    with pytest.raises(BakeError, match=r"'sobel'.*central"):
        normals(waves(8, 8, 1), filter_name="sobel")


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


def test_triangles_over_one_another_on_one_picture_cost_no_more_than_their_rows() -> None:
    """A wall of which each of 2,000 faces shows the whole picture but a border."""
    square = np.float32([(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9)])
    uvs = np.tile(square, (1000, 1))
    faces = np.uint32([(0, 1, 2), (0, 2, 3)])
    triangles = (faces[None] + 4 * np.arange(1000, dtype=np.uint32)[:, None, None]).reshape(-1, 3)
    ids = np.arange(2000, dtype=np.int32)
    drawn = maps.rasterise(uvs, triangles, ids, height=256, width=256, work_limit=2e6)
    assert np.array_equal(drawn, maps.rasterise(uvs[:4], faces, ids[:2], height=256, width=256))

    def draw(uvs: npt.NDArray[np.float32], triangles: npt.NDArray[np.uint32]) -> None:
        maps.rasterise(uvs, triangles, ids[: len(triangles)], height=1024, width=1024)

    assert ratio(lambda: draw(uvs, triangles), lambda: draw(uvs[:4], faces)) < 60.0
    tiled = maps.rasterise(uvs * np.float32(3.0), triangles, ids, height=64, width=64, work_limit=4e6)
    assert np.array_equal(
        tiled, maps.rasterise(uvs[:4] * np.float32(3.0), faces, ids[:2], height=64, width=64)
    )


def test_the_mask_holds_the_groups_named_by_group_or_material_and_unknown_names_are_told() -> None:
    for name in ("right", "leaf"):
        mask = gutter.group_mask(two_quads(), [name], height=10, width=16)
        assert mask[:, 10:].all()
        assert not mask[:, :10].any()
    with pytest.raises(BakeError, match="'bark'"):
        gutter.group_mask(two_quads(), ["bark"], height=4, width=4)


@pytest.mark.parametrize("name", FILTERS)
def test_no_slope_crosses_from_one_island_to_another(name: str) -> None:
    islands = np.zeros((24, 40), np.int32)
    islands[:, 20:] = 1
    y, x = np.mgrid[0:24, 0:40].astype(np.float32)
    left, right = 0.25 * x, 100 - 0.5 * y
    heights = np.where(islands == 0, left, right)
    found = normals(heights, filter_name=name, islands=islands)
    assert np.abs(found[:, :20] - normals(left, filter_name=name)[:, :20]).max() < 1e-5
    assert np.abs(found[:, 20:] - normals(right, filter_name=name)[:, 20:]).max() < 1e-5


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

"""Patches of terrain: neighbours share their border vertices at any levels, and each keeps its bounds."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.data import Heightfield
from paradize.kernels.terrain import Corners, patch
from paradize.metrics.terrain import patch_error
from paradize.stages.terrain import pixels_mesh
from tests.pipeline.height_grids import height_grids
from tests.sweeps import tries

F32 = npt.NDArray[np.float32]
Pixel = tuple[int, int]


def noise(rows: int, columns: int, seed: int = 0) -> F32:
    heights: F32 = np.random.default_rng(seed).normal(size=(rows, columns)).astype(np.float32)
    return heights


def hills(rows: int, columns: int) -> F32:
    z, x = np.mgrid[0:rows, 0:columns].astype(np.float64)
    return (4.0 * np.sin(x / 9.0) * np.cos(z / 7.0) + 0.05 * noise(rows, columns)).astype(np.float32)


def spike(rows: int, columns: int) -> F32:
    heights = np.zeros((rows, columns), np.float32)
    heights[rows // 2, columns // 3] = 9.0
    return heights


FIELDS: dict[str, F32] = {
    "plane": np.add.outer(np.arange(40) * 0.5, np.arange(50) * 0.25).astype(np.float32),
    "constant": np.full((33, 33), 5.0, np.float32),
    "spike": spike(37, 61),
    "step": np.repeat(np.array([[0.0] * 21 + [4.0] * 12], np.float32), 29, axis=0),
    "noise": noise(45, 35),
    "hills": hills(65, 65),
    "2 x 2": np.array([[0.0, 1.0], [2.0, -1.0]], np.float32),
    "2 x N": noise(2, 64),
    "N x 2": noise(50, 2),
}
LEVELS = 6


def root_side(shape: tuple[int, int]) -> int:
    return 1 << max(3, int(max(shape) - 2).bit_length())


def halves(corners: Corners) -> list[Corners]:
    """The two patches that a patch's hypotenuse, cut in its middle, leaves."""
    right, a, b = corners
    middle = ((a[0] + b[0]) // 2, (a[1] + b[1]) // 2)
    return [(middle, right, a), (middle, b, right)]


def levels(shape: tuple[int, int]) -> list[list[Corners]]:
    """All patches over a field, level by level; the finest have legs of 2 pixels or less."""
    side = root_side(shape)
    found: list[list[Corners]] = [[((0, side), (0, 0), (side, side)), ((side, 0), (side, side), (0, 0))]]
    while len(found) <= LEVELS:
        found.append([half for corners in found[-1] for half in halves(corners)])
    return found


def tolerance(level: int) -> float:
    return float(0.1 * np.sqrt(2.0) ** (LEVELS - level))


def made(heights: F32, corners: Corners, level: int) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.uint32]]:
    return patch(heights, corners, tolerance(level), tolerance(level), tolerance(level + 1))


def side_pixels(vertices: npt.NDArray[np.int32], a: Pixel, b: Pixel) -> list[Pixel]:
    """The vertices on the segment a - b, in reading order."""
    at = vertices.astype(np.int64)
    on = (b[0] - a[0]) * (at[:, 1] - a[1]) == (b[1] - a[1]) * (at[:, 0] - a[0])
    for k in (0, 1):
        on &= (at[:, k] >= min(a[k], b[k])) & (at[:, k] <= max(a[k], b[k]))
    return sorted((int(row), int(column)) for row, column in at[on])


def doubled_areas(
    vertices: npt.NDArray[np.int32], triangles: npt.NDArray[np.uint32]
) -> npt.NDArray[np.int64]:
    at = vertices.astype(np.int64)[triangles]
    d, e = at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]
    return np.asarray(d[:, 1] * e[:, 0] - e[:, 1] * d[:, 0])


@pytest.mark.parametrize("name", FIELDS)
def test_neighbours_share_their_border_at_every_pair_of_levels(name: str) -> None:
    """A side is a hypotenuse of one level and a leg of the level above: whoever has it has its vertices."""
    heights = FIELDS[name]
    borders: dict[tuple[Pixel, Pixel], list[Pixel]] = {}
    pairs = 0
    for level, patches in enumerate(levels(heights.shape)):
        for corners in patches:
            vertices, _ = made(heights, corners, level)
            if len(vertices) == 0:
                continue
            right, p, q = corners
            for a, b in ((p, q), (right, p), (q, right)):
                key = min(a, b), max(a, b)
                found = side_pixels(vertices, a, b)
                pairs += key in borders
                assert borders.setdefault(key, found) == found, (level, corners)
    assert pairs > 0


def test_wide_bounds_of_the_sides_leave_the_inside_its_own() -> None:
    """No side gets a vertex, however far it is off, and every pixel that lies on none keeps the bound."""
    bound = 0.5
    row, column = np.mgrid[0:33, 0:33]
    sides = (row % 32 == 0) | (column % 32 == 0) | (row == column)
    heights = np.where(sides & (row % 32 + column % 32 > 0), np.float32(50), noise(33, 33, 4))
    for corners, inside in [
        (((0, 32), (0, 0), (32, 32)), (row > 0) & (column < 32) & (column > row)),
        (((32, 0), (32, 32), (0, 0)), (row < 32) & (column > 0) & (column < row)),
    ]:
        vertices, triangles = patch(heights, corners, bound, 1e9, 1e9)
        on_a_side = ~inside[vertices[:, 0], vertices[:, 1]]
        assert on_a_side.sum() == 3 < len(vertices)
        places = np.column_stack([row[inside], column[inside], np.ones(inside.sum())])
        for corner in vertices[triangles]:
            shares = places @ np.linalg.inv(np.column_stack([corner, np.ones(3)]))
            here = (shares > -1e-9).all(axis=1)
            off = shares @ heights[corner[:, 0], corner[:, 1]] - heights[inside]
            assert np.abs(off[here]).max(initial=0.0) < bound + 1e-6


@pytest.mark.parametrize("name", FIELDS)
def test_each_level_covers_the_field_exactly_once(name: str) -> None:
    heights = FIELDS[name]
    rows, columns = heights.shape
    for level, patches in enumerate(levels(heights.shape)):
        area = 0
        for corners in patches:
            vertices, triangles = made(heights, corners, level)
            areas = doubled_areas(vertices, triangles)
            assert (areas > 0).all()
            area += int(areas.sum())
        assert area == 2 * (rows - 1) * (columns - 1)


@pytest.mark.parametrize("name", FIELDS)
def test_every_pixel_of_a_patch_keeps_its_bound(name: str) -> None:
    heights = FIELDS[name]
    field = Heightfield(heights, 1.0 * heights.shape[1] - 1.0, 1.0 * heights.shape[0] - 1.0)
    worst = 0.0
    for level, patches in enumerate(levels(heights.shape)):
        for corners in patches:
            vertices, triangles = made(heights, corners, level)
            if len(vertices) == 0:
                continue
            error = patch_error(pixels_mesh(field, vertices, triangles), field, corners)
            assert error.max_m <= tolerance(level) * (1.0 + 1e-6), (level, corners)
            assert (error.holes, error.flipped, error.strays) == (0, 0, 0), (level, corners)
            worst = max(worst, error.max_m)
    assert worst > 0.0 or name in ("plane", "constant", "2 x 2")


places = st.tuples(st.integers(-9, 25), st.integers(-9, 25))


@given(height_grids(20), places, st.integers(1, 20), st.integers(0, 7), st.sampled_from([0.0, 0.3, 5.0]))
@settings(max_examples=tries(150), deadline=None)
def test_any_patch_of_any_field_keeps_its_bound(
    heights: F32, right: Pixel, leg: int, turn: int, bound: float
) -> None:
    legs = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]
    a, b = legs[turn], legs[(turn + 2) % 8]
    corners = (
        right, (right[0] + leg * a[0], right[1] + leg * a[1]), (right[0] + leg * b[0], right[1] + leg * b[1])
    )  # fmt: skip
    vertices, triangles = patch(heights, corners, bound, bound, bound)
    swapped = patch(heights, (corners[0], corners[2], corners[1]), bound, bound, bound)[0]
    for p, q in ((corners[1], corners[2]), (corners[0], corners[1]), (corners[0], corners[2])):
        assert side_pixels(vertices, p, q) == side_pixels(swapped, p, q)
    assert (doubled_areas(vertices, triangles) > 0).all()
    field = Heightfield(heights, heights.shape[1] - 1.0, heights.shape[0] - 1.0)
    if len(vertices):
        error = patch_error(pixels_mesh(field, vertices, triangles), field, corners)
        assert error.max_m <= bound + 1e-5
        assert (error.holes, error.flipped, error.strays) == (0, 0, 0)


def test_a_bound_of_zero_makes_what_is_not_flat_a_vertex() -> None:
    heights = noise(33, 33)
    vertices, triangles = patch(heights, ((0, 0), (0, 32), (32, 0)), 0.0, 0.0, 0.0)
    assert len(vertices) == 33 * 34 // 2 and len(triangles) == 32 * 32
    flat = np.full((33, 33), 7.0, np.float32)
    assert len(patch(flat, ((0, 0), (0, 32), (32, 0)), 0.0, 0.0, 0.0)[1]) == 1


def test_looser_borders_stay_as_they_are_whatever_the_inside_needs() -> None:
    heights = noise(33, 33)
    corners: Corners = ((16, 16), (0, 0), (0, 32))
    vertices, _ = patch(heights, corners, 0.0, 100.0, 100.0)
    assert side_pixels(vertices, (0, 0), (0, 32)) == [(0, 0), (0, 32)]
    assert side_pixels(vertices, (16, 16), (0, 0)) == [(0, 0), (16, 16)]
    inner = sum(1 for row in range(1, 16) for column in range(row + 1, 32 - row))
    assert len(vertices) == 3 + inner


def test_the_number_of_vertices_can_be_limited_worst_first() -> None:
    heights = noise(129, 129)
    corners: Corners = ((0, 0), (0, 128), (128, 0))
    field = Heightfield(heights, 128.0, 128.0)
    errors = []
    for most in (300, 1000, 3000):
        vertices, triangles = patch(heights, corners, 0.0, 3.0, 3.0, most_vertices=most)
        assert len(vertices) == most
        errors.append(patch_error(pixels_mesh(field, vertices, triangles), field, corners).rms_m)
    assert errors == sorted(errors, reverse=True)


def test_the_metric_of_a_patch_sees_holes_flips_strays_and_its_error() -> None:
    heights = np.zeros((9, 9), np.float32)
    corners: Corners = ((0, 0), (0, 8), (8, 0))
    vertices, triangles = patch(heights, corners, 1.0, 1.0, 1.0)
    higher = heights.copy()
    higher[2, 3] = 3.0
    field = Heightfield(higher, 8.0, 8.0)
    mesh = pixels_mesh(Heightfield(heights, 8.0, 8.0), vertices, triangles)
    error = patch_error(mesh, field, corners)
    assert error.max_m == 3.0 and error.worst == (2, 3) and error.holes == 0
    assert error.rms_m == pytest.approx(3.0 / np.sqrt(45.0))
    assert patch_error(mesh, field, ((0, 0), (0, 4), (4, 0))).strays > 0
    assert patch_error(mesh, field, ((8, 8), (0, 8), (8, 0))).holes == 45 - 9
    turned = pixels_mesh(field, vertices, np.ascontiguousarray(triangles[:, ::-1]))
    assert patch_error(turned, field, corners).flipped == 1
    assert patch_error(turned, field, corners).holes == 45
    assert patch_error(turned, field, corners).max_m == np.inf  # it covers nothing


@pytest.mark.parametrize(
    "corners", [((2, 2), (2, 6), (6, 2)), ((6, 6), (6, 2), (2, 6)), ((4, 4), (2, 2), (6, 2))]
)
def test_what_a_mesh_covers_one_pixel_beyond_its_patch_is_strayed(corners: Corners) -> None:
    field = Heightfield(np.zeros((9, 9), np.float32), 8.0, 8.0)
    whole = np.array([[0, 0], [0, 8], [8, 8], [8, 0]], np.int32)
    mesh = pixels_mesh(field, whole, np.array([[0, 1, 2], [0, 2, 3]], np.uint32))
    rows, columns = (np.array(axis) for axis in zip(*corners, strict=True))
    around = (np.ptp(rows) + 3) * (np.ptp(columns) + 3)
    inside = 15 if np.ptp(columns) == 4 else 9
    error = patch_error(mesh, field, corners)
    assert (error.holes, error.strays) == (0, around - inside)


def test_patches_are_the_same_on_many_threads() -> None:
    heights = hills(65, 65)
    patches = [corners for level in levels((65, 65)) for corners in level]
    alone = [patch(heights, corners, 0.2, 0.2, 0.1) for corners in patches]
    with ThreadPoolExecutor(4) as pool:
        beside = list(pool.map(lambda corners: patch(heights, corners, 0.2, 0.2, 0.1), patches))
    for mine, theirs in zip(alone, beside, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(mine, theirs, strict=True))


@pytest.mark.parametrize(
    "corners",
    [
        ((0, 0), (0, 4), (5, 0)),
        ((0, 0), (0, 4), (0, 8)),
        ((0, 0), (0, 0), (0, 0)),
        ((0, 0), (1, 2), (2, -1)),
        ((0, 0), (0, 1 << 21), (1 << 21, 0)),
    ],
)
def test_what_is_no_patch_is_refused(corners: Corners) -> None:
    with pytest.raises(ValueError):
        patch(np.zeros((9, 9), np.float32), corners, 1.0, 1.0, 1.0)


def test_bad_fields_and_tolerances_are_refused() -> None:
    corners: Corners = ((0, 0), (0, 4), (4, 0))
    for bad in (-1.0, float("nan")):
        with pytest.raises(ValueError):
            patch(np.zeros((9, 9), np.float32), corners, bad, 1.0, 1.0)
    for heights in (np.zeros((1, 9), np.float32), np.zeros((9, 9)), np.zeros((18, 18), np.float32)[::2, ::2]):
        with pytest.raises(ValueError):
            patch(heights, corners, 1.0, 1.0, 1.0)  # type: ignore[arg-type]
    outside = patch(np.zeros((9, 9), np.float32), ((0, 20), (0, 24), (4, 20)), 1.0, 1.0, 1.0)
    assert outside[0].shape == (0, 2) and outside[1].shape == (0, 3)
    touching = patch(np.zeros((9, 9), np.float32), ((8, 8), (8, 12), (12, 8)), 1.0, 1.0, 1.0)
    assert len(touching[1]) == 0

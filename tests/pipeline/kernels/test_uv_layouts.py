"""UV layouts as texels, against every texel tried with every triangle and with every covered texel."""

from __future__ import annotations

from itertools import product

import numpy as np
import numpy.typing as npt
import pytest

from paradize.kernels import maps

ROWS, COLUMNS = 16, 32


def doubled_areas(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def drawn(corners: npt.NDArray[np.float64], touched: bool) -> npt.NDArray[np.int32]:
    """corners: (m, 3, 2) texels of triangles that all have area, inside the map. The square of a texel and a
    triangle overlap where neither an edge of the one nor of the other lies between them."""
    edges = np.roll(corners, -1, axis=1) - corners
    across = np.stack([-edges[..., 1], edges[..., 0]], axis=-1)
    across[doubled_areas(corners) < 0] *= -1
    middle = np.stack(np.meshgrid(np.arange(COLUMNS) + 0.5, np.arange(ROWS) + 0.5), axis=-1)[:, :, None]
    off = (across * (middle[..., None, :] - corners)).sum(axis=-1)  # (rows, columns, m, 3)
    inside = (off >= 0).all(axis=-1)
    overlaps = (off + 0.5 * np.abs(across).sum(axis=-1) > 0).all(axis=-1)
    overlaps &= (corners.min(axis=1) < middle + 0.5).all(axis=-1)
    overlaps &= (corners.max(axis=1) > middle - 0.5).all(axis=-1)
    first = np.where(overlaps.any(axis=-1) & touched, overlaps.argmax(axis=-1), -1)
    return np.where(inside.any(axis=-1), inside.argmax(axis=-1), first).astype(np.int32)


@pytest.mark.parametrize("touched", [False, True])
@pytest.mark.parametrize("share", [1, 8])
def test_a_texel_shows_the_first_triangle_over_its_centre_else_the_first_that_it_overlaps(
    share: int, touched: bool
) -> None:
    """Corners lie at whole texels or at eighths, so that centres and corners of texels lie on edges."""
    rng = np.random.default_rng(share)
    large = rng.integers(0, [COLUMNS * share + 1, ROWS * share + 1], (8, 3, 2))
    small = rng.integers(0, [COLUMNS * share - 3 * share, ROWS * share - 3 * share], (24, 1, 2))
    corners = np.concatenate([small + rng.integers(0, 3 * share + 1, (24, 3, 2)), large]) / share
    corners = corners[doubled_areas(corners) != 0]
    for kept in (corners[:3], corners[-3:], corners):
        uvs = (kept / (COLUMNS, ROWS)).reshape(-1, 2).astype(np.float32)
        triangles = np.arange(3 * len(kept), dtype=np.uint32).reshape(-1, 3)
        ids = np.arange(len(kept), dtype=np.int32)
        expected = drawn(kept, touched)
        for shift in ([0, 0], [-3, 2]):  # UVs repeat
            moved = uvs + np.float32(shift)
            found = maps.rasterise(moved, triangles, ids, height=ROWS, width=COLUMNS, touched=touched)
            assert np.array_equal(found, expected)


@pytest.mark.parametrize("wrap_y", [False, True])
def test_of_covered_texels_as_near_in_one_row_the_left_one_is_taken(wrap_y: bool) -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        rows, columns = rng.integers(1, 16, 2)
        covered = rng.random((rows, columns)) < 0.2
        covered[rng.integers(rows), rng.integers(columns)] = True
        found = maps.nearest_covered(covered, wrap=(False, wrap_y)).ravel()
        y, x = np.divmod(np.arange(rows * columns), columns)
        down = np.abs(y[:, None] - y)
        down = np.minimum(down, rows - down) if wrap_y else down
        apart = np.where(covered.ravel(), down**2 + (x[:, None] - x) ** 2, 1 << 30)
        as_near = (apart == apart.min(axis=1, keepdims=True)) & (y == y[found][:, None])
        assert np.array_equal(as_near.argmax(axis=1), found)


def test_triangles_whose_corners_lie_at_one_place_of_the_image_share_an_island() -> None:
    """Whether by a vertex or by two with equal coordinates, at the first corner or at the last."""
    uvs = np.float32([[0, 0], [1, 0], [0, 1], [2, 2], [3, 2], [0, 1], [5, 5], [6, 5], [5, 6], [7, 7]])
    triangles = np.array([[6, 7, 8], [0, 1, 2], [3, 4, 5], [9, 9, 4]], np.uint32)
    assert maps.uv_islands(uvs, triangles).tolist() == [0, 1, 1, 1]


def test_a_triangle_without_area_shows_every_texel_that_its_line_crosses() -> None:
    """And none that lies farther from it than the next."""
    share = np.linspace(0, 1, 2000)[:, None]
    for a, b in np.random.default_rng(2).random((20, 2, 2)):
        x, y = ((1 - share) * a + share * b).T * [[COLUMNS], [ROWS]]
        crossed = np.zeros((ROWS, COLUMNS), np.bool_)
        crossed[y.astype(int), x.astype(int)] = True
        beside = np.pad(crossed, 1)
        beside = np.any([np.roll(beside, move, (0, 1)) for move in product((-1, 0, 1), repeat=2)], axis=0)
        for corners in ([a, b, b], [b, a, a], [a, b, a]):
            found = line_texels(corners)
            assert found[crossed].all()
            assert not found[~beside[1:-1, 1:-1]].any()


@pytest.mark.parametrize("edge", [0, 1])
def test_a_line_on_the_map_s_edge_stays_on_its_side_of_the_map(edge: int) -> None:
    for axis, length in enumerate((COLUMNS, ROWS)):
        corners = np.full((3, 2), float(edge))
        corners[1:, 1 - axis] = 1 - edge
        found = line_texels(corners).any(axis=axis)
        assert found.tolist() == [k == edge * (length - 1) for k in range(length)]


def line_texels(corners: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    uvs, triangle = np.asarray(corners, np.float32), np.array([[0, 1, 2]], np.uint32)
    return maps.rasterise(uvs, triangle, np.zeros(1, np.int32), height=ROWS, width=COLUMNS) == 0

"""The tree of a terrain's patches: every cut covers the ground once and has no cracks; errors are those that
an independent judge finds."""

from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from paradize.bakers.terrain.grow import MOST_VERTICES, Grower
from paradize.bakers.terrain.tree import Tree, columns_of
from paradize.data import Heightfield, Mesh
from paradize.errors import BakeError
from paradize.formats.glb.quantised import decoded_mesh
from paradize.formats.scene.terrain_tables import check_tree
from paradize.metrics.terrain import patch_error
from paradize.stages.terrain_tree import Blocks, Shape, tolerance
from paradize.visibility.query import VisibilityQuery
from tests.pipeline.terrain_cut import drawn, split_diamonds
from tests.sweeps import sample

PIXELS = 500.0


def rough(rows: int, columns: int, seed: int = 5) -> Heightfield:
    """Hills with a plain and a cliff, so that patches differ in how much they need."""
    rng = np.random.default_rng(seed)
    r, c = np.mgrid[0:rows, 0:columns].astype(np.float64)
    heights = 3.0 * np.sin(r / 9.0) * np.cos(c / 7.0) + 0.3 * rng.standard_normal((rows, columns))
    heights[: rows // 3, : columns // 2] = -1.0
    heights[rows // 2 :, columns // 2 :] += 6.0
    return Heightfield(heights.astype(np.float32), float(columns - 1), 0.5 * (rows - 1))


def grown(ground: Heightfield, leaf_px: int = 8, query: VisibilityQuery | None = None) -> tuple[Grower, Tree]:
    grower = Grower(ground, max_error_m=0.2, leaf_px=leaf_px, sand_repeat=3.0, query=query)
    return grower, grower.grow()


def tables_of(tree: Tree) -> dict[str, Any]:
    count = len(tree.patches)
    return columns_of(tree, [0] * count, list(range(count)))


FIELDS = {
    "square": rough(65, 65),
    "wide": rough(20, 75),
    "tall": rough(61, 13),
    "small": rough(2, 2),
    "line": rough(2, 40),
}


@pytest.fixture(scope="module", params=list(FIELDS))
def whole(request: pytest.FixtureRequest) -> tuple[Grower, Tree, list[Mesh], dict[str, Any]]:
    grower, tree = grown(FIELDS[request.param])
    return grower, tree, [grower.mesh(patch) for patch in tree.patches], tables_of(tree)


def some_cuts(tables: dict[str, Any], count: int) -> list[list[bool]]:
    """Cuts of eyes near and far, and those of whole levels."""
    rng = np.random.default_rng(3)
    eyes = [tuple(float(x) for x in rng.uniform(-40, 40, 3) * [1, 0.3, 1]) for _ in range(count)]
    cuts = [split_diamonds(tables, eye, float(10 ** rng.uniform(0, 3)), 0.1) for eye in eyes]  # type: ignore[arg-type]
    levels = tables["diamonds"]["level"]
    return cuts + [[level < top for level in levels] for top in range(max(levels, default=0) + 2)]


def test_the_tolerance_grows_by_two_a_level_from_the_finest_or_from_the_least() -> None:
    for up in range(8):
        assert tolerance(10 - up, 10, 0.3, 0.1) == pytest.approx(0.3 * 2**up, rel=1e-12)
        least = 0.01 if up == 0 else 0.1 * 2**up
        assert tolerance(10 - up, 10, 0.01, 0.1) == pytest.approx(least, rel=1e-12)


@pytest.mark.parametrize(("rows", "columns"), [(17, 17), (25, 9), (13, 30), (33, 10), (2, 9)])
def test_a_patch_exists_where_the_field_leaves_some_area_of_it(rows: int, columns: int) -> None:
    """Every patch that halving gives, whether or not the one above it exists."""
    shape = Shape(rows, columns, 2)
    side = shape.leaf_px << shape.depth
    level = [((side, 0), (0, 0), (side, side)), ((0, side), (side, side), (0, 0))]
    for _ in range(shape.finest + 1):
        for corners in level:
            left = np.array(shape.clipped(corners)).reshape(-1, 2)
            after = np.roll(left, -1, axis=0)
            area = abs((left[:, 0] * after[:, 1] - left[:, 1] * after[:, 0]).sum()) / 2
            assert shape.exists(corners) == (area > 1e-9), corners
        level = [
            half
            for a, b, c in level
            for middle in [((b[0] + c[0]) // 2, (b[1] + c[1]) // 2)]
            for half in ((middle, a, b), (middle, c, a))
        ]


def test_every_cut_covers_every_point_of_the_rectangle_once(whole: Any) -> None:
    grower, tree, _, tables = whole
    rows, columns = grower.shape.rows, grower.shape.columns
    rng = np.random.default_rng(9)
    places = rng.uniform([0, 0], [rows - 1, columns - 1], (400, 2))
    inside = np.stack([_holds(patch.corners, places) for patch in tree.patches])
    for split in some_cuts(tables, 40):
        assert (inside[drawn(tables, split)].sum(axis=0) == 1).all()


def _holds(corners: Any, places: np.ndarray) -> np.ndarray:
    """Which places (n, 2) lie in a triangle; places on an edge have no chance."""
    sides = []
    for (r0, c0), (r1, c1) in pairwise([*corners, corners[0]]):
        sides.append((r1 - r0) * (places[:, 1] - c0) - (c1 - c0) * (places[:, 0] - r0))
    signs = np.sign(np.stack(sides))
    return np.asarray((signs == signs[0]).all(axis=0))


def test_a_split_diamond_has_all_that_stands_above_it_split(whole: Any) -> None:
    tables = whole[3]
    patches = tables["patches"]
    for split in some_cuts(tables, 40):
        for p, d in enumerate(patches["diamond"]):
            if d >= 0 and split[d]:
                assert patches["made_by"][p] == -1 or split[patches["made_by"][p]]


def test_errors_and_spheres_alone_make_every_cut_whole(whole: Any) -> None:
    """No eye wants a diamond without wanting what makes its patches: so it may be split where it stands."""
    tables = whole[3]
    diamonds, patches = tables["diamonds"], tables["patches"]
    rng = np.random.default_rng(4)
    for _ in range(300):
        eye, pixels = rng.uniform(-40, 40, 3), 10 ** rng.uniform(0, 3)
        wants = [
            error * pixels > max(0.1, math.dist(eye, center) - radius * (1 + 1e-5))
            for error, center, radius in zip(
                diamonds["error_m"], diamonds["center"], diamonds["radius_m"], strict=True
            )
        ]
        for p, d in enumerate(patches["diamond"]):
            if d >= 0 and wants[d] and patches["made_by"][p] >= 0:
                assert wants[patches["made_by"][p]]


def border(mesh: Mesh) -> set[tuple[bytes, bytes]]:
    """Edges of one triangle alone, each end as the bits of its position, normal, tangent and both UVs."""
    assert mesh.normals is not None and mesh.tangents is not None
    assert mesh.uvs is not None and mesh.uvs1 is not None
    bits = np.concatenate([mesh.positions, mesh.normals, mesh.tangents, mesh.uvs, mesh.uvs1], axis=1)
    ends = [row.tobytes() for row in bits]
    edges: Counter[tuple[bytes, bytes]] = Counter()
    for triangle in mesh.triangles.tolist():
        for a, b in pairwise([*triangle, triangle[0]]):
            edges[min(ends[a], ends[b]), max(ends[a], ends[b])] += 1
    return {edge for edge, count in edges.items() if count == 1}


def on_rim(edge: tuple[bytes, bytes], ground: Heightfield) -> bool:
    (x0, _, z0), (x1, _, z1) = (np.frombuffer(end, np.float32)[:3] for end in edge)
    half_x, half_z = np.float32(ground.size_x_m / 2), np.float32(ground.size_z_m / 2)
    return bool((x0 == x1 and abs(x0) == half_x) or (z0 == z1 and abs(z0) == half_z))


def test_no_cut_has_a_crack_or_a_t_junction(whole: Any) -> None:
    """An edge that is the border of one drawn patch is that of exactly one other, bit by bit, or on the
    rim."""
    grower, _, meshes, tables = whole
    rims = [border(mesh) for mesh in meshes]
    outer = {edge for rim in rims for edge in rim if on_rim(edge, grower.heightfield)}
    for split in some_cuts(tables, 30):
        edges = Counter(edge for p in drawn(tables, split) for edge in rims[p])
        assert max(edges.values()) <= 2
        alone = {edge for edge, count in edges.items() if count == 1}
        assert not alone ^ (outer & edges.keys())


def test_every_pair_of_patches_that_a_cut_may_show_shares_its_border_bit_by_bit(whole: Any) -> None:
    """Walks each shared border of each pair, of one level or of two that follow each other."""
    grower, tree, meshes, _ = whole
    sides: dict[frozenset[tuple[float, float]], list[tuple[int, int]]] = {}
    for p, patch in enumerate(tree.patches):
        a, b, c = patch.corners
        for level, ends in ((patch.level, (b, c)), (patch.level + 1, (a, b)), (patch.level + 1, (c, a))):
            sides.setdefault(frozenset(ends), []).append((p, level))
    walked = 0
    for side, owners in sides.items():
        assert len({level for _, level in owners}) == 1  # an edge is of one level, whoever has it
        lines = [_along(meshes[p], grower.heightfield, tuple(side)) for p, _ in owners]
        for line in lines[1:]:
            assert line == lines[0]
            walked += len(line)
    assert walked > 0 or len(tree.patches) < 3


def _along(mesh: Mesh, ground: Heightfield, ends: Any) -> list[bytes]:
    """The vertices of a mesh on the line between two pixels, in order: their bits."""
    rows, columns = ground.heights_m.shape
    assert mesh.normals is not None and mesh.tangents is not None
    r = (mesh.positions[:, 2] / ground.size_z_m + 0.5) * (rows - 1)
    c = (mesh.positions[:, 0] / ground.size_x_m + 0.5) * (columns - 1)
    (r0, c0), (r1, c1) = sorted(ends)
    on = np.abs((r1 - r0) * (np.rint(c) - c0) - (c1 - c0) * (np.rint(r) - r0)) == 0
    bits = np.concatenate([mesh.positions, mesh.normals, mesh.tangents], axis=1)[on]
    order = np.lexsort((np.rint(c[on]), np.rint(r[on])))
    return [bits[k].tobytes() for k in order]


def test_the_error_of_a_patch_is_what_brute_force_finds(whole: Any) -> None:
    grower, tree, meshes, _ = whole
    heights = grower.heightfield.heights_m
    rows, columns = heights.shape
    for patch, mesh in zip(tree.patches, meshes, strict=True):
        r = (mesh.positions[:, 2].astype(np.float64) / grower.heightfield.size_z_m + 0.5) * (rows - 1)
        c = (mesh.positions[:, 0].astype(np.float64) / grower.heightfield.size_x_m + 0.5) * (columns - 1)
        r, c = (np.rint(k).astype(int)[mesh.triangles] for k in (r, c))
        # Every pixel of every triangle's box: `at` is the triangle, `row` and `column` the pixel.
        tall, wide = np.ptp(r, axis=1) + 1, np.ptp(c, axis=1) + 1
        at = np.repeat(np.arange(len(r)), tall * wide)
        number = np.arange(len(at)) - np.repeat(np.cumsum(tall * wide) - tall * wide, tall * wide)
        row, column = r.min(axis=1)[at] + number // wide[at], c.min(axis=1)[at] + number % wide[at]
        (ri, rj, rk), (ci, cj, ck) = r[at].T, c[at].T
        area = (rj - ri) * (ck - ci) - (cj - ci) * (rk - ri)
        u = (rj - row) * (ck - column) - (cj - column) * (rk - row)
        v = (rk - row) * (ci - column) - (ck - column) * (ri - row)
        w = area - u - v
        inside = (u * area >= 0) & (v * area >= 0) & (w * area >= 0)
        y = mesh.positions[:, 1].astype(np.float64)[mesh.triangles][at]
        height = (np.stack([u, v, w], axis=1) * y).sum(axis=1) / area
        worst = np.abs(height - heights[row, column])[inside].max()
        covered = np.unique(row[inside] * columns + column[inside])
        error = patch.error  # apart: to print a patch, and with it the tree, takes pytest minutes
        assert error is not None
        assert error.max_m == pytest.approx(worst, rel=1e-4, abs=1e-5)
        assert len(covered) >= patch.area_px
        if patch.level == grower.shape.finest:
            assert worst <= 0.2


def test_errors_never_fall_towards_the_roots(whole: Any) -> None:
    check_tree(whole[3] | {"tiles": ["terrain_mesh"]})  # a diamond holds those below it
    patches, diamonds = whole[3]["patches"], whole[3]["diamonds"]
    for p, d in enumerate(patches["diamond"]):
        if d >= 0 and patches["made_by"][p] >= 0:
            assert diamonds["error_m"][d] <= diamonds["error_m"][patches["made_by"][p]]


def test_spheres_hold_their_meshes(whole: Any) -> None:
    _, tree, meshes, _ = whole
    for patch, mesh in zip(tree.patches, meshes, strict=True):
        away = np.linalg.norm(mesh.positions.astype(np.float64) - patch.sphere.center, axis=1)
        assert away.max() <= patch.sphere.radius_m * (1 + 1e-6)


@pytest.mark.deep
def test_noise_fills_16_bit_indices_and_no_more() -> None:
    """A coarse patch that would need every pixel keeps to the limit, and says what that costs."""
    rng = np.random.default_rng(1)
    ground = Heightfield(rng.uniform(-50, 50, (385, 385)).astype(np.float32), 384.0, 384.0)
    grower = Grower(ground, max_error_m=0.01, leaf_px=256, sand_repeat=1.0, query=None)
    tree = grower.grow()
    assert max(patch.sizes[0] for patch in tree.patches) <= MOST_VERTICES
    roots = [patch for patch in tree.patches if patch.level == 0]
    assert all(patch.error and patch.error.max_m > 1.0 for patch in roots)
    assert all(p.error and p.error.max_m <= 0.01 for p in tree.patches if p.level == grower.shape.finest)


NOISE = np.random.default_rng(0).standard_normal((70, 90))
SPIKE = np.pad([[100.0]], 40)
EXTREMES: dict[str, tuple[np.ndarray, float, float, float]] = {
    # heights, size along x and z, tolerance: metres
    "a millimetre": (NOISE * 1e-6, 1e-3, 1e-3, 1e-7),
    "a thousand kilometres": (NOISE * 1e3, 1e6, 1e6, 1.0),
    "heights of 1e6": (NOISE * 1e6, 100.0, 100.0, 10.0),
    "heights of 1e-6": (NOISE * 1e-6, 100.0, 100.0, 1e-8),
    "two pixels": (NOISE[:2, :2], 1.0, 1.0, 0.01),
    "two rows": (NOISE[:2], 89.0, 1.0, 0.01),
    "two columns": (NOISE[:, :2], 1.0, 69.0, 0.01),
    "a spike": (SPIKE, 80.0, 80.0, 0.5),
    "a step": (np.where(np.arange(81)[:, None] > 40, 10.0, 0.0) * np.ones(81), 80.0, 80.0, 0.5),
    "long pixels": (NOISE, 1e5, 1.0, 0.05),
    "no error": (NOISE, 89.0, 69.0, 0.0),
}


@pytest.mark.parametrize(("name", "leaf_px"), sample(product(EXTREMES, [16, 13, 256]), every=4))
def test_extremes_keep_the_bound_at_the_finest_level(name: str, leaf_px: int) -> None:
    heights, size_x_m, size_z_m, bound_m = EXTREMES[name]
    ground = Heightfield(np.ascontiguousarray(heights, np.float32), size_x_m, size_z_m)
    grower = Grower(ground, max_error_m=bound_m, leaf_px=leaf_px, sand_repeat=1.0, query=None)
    tree = grower.grow()
    check_tree(tables_of(tree) | {"tiles": ["terrain_mesh"]})
    finest = [p.error for p in tree.patches if p.level == grower.shape.finest]
    assert finest and all(error and error.max_m <= max(bound_m, 1e-12) for error in finest)


def test_a_bound_that_codes_cannot_hold_is_refused() -> None:
    ground = Heightfield((NOISE * 100).astype(np.float32), 89.0, 69.0)
    grower = Grower(ground, max_error_m=1e-4, leaf_px=16, sand_repeat=1.0, query=None, quantise=True)
    with pytest.raises(BakeError, match="16-bit positions reach no less") as raised:
        grower.grow()
    assert raised.value.place and raised.value.mend


# -- geometry


@pytest.mark.parametrize(("rows", "columns", "leaf"), [(65, 65, 8), (33, 9, 4), (2, 2, 8), (50, 71, 8)])
def test_the_patches_of_a_level_tile_the_field(rows: int, columns: int, leaf: int) -> None:
    shape = Shape(rows, columns, leaf)
    level = shape.roots()
    for count in shape.count():
        assert len(level) == count
        areas = [_area(shape.clipped(corners)) for corners in level]
        assert min(areas) > 0
        assert sum(areas) == pytest.approx((rows - 1) * (columns - 1))
        level = [half for corners in level for half in shape.halves(corners)]


def _area(polygon: list[tuple[float, float]]) -> float:
    return abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in pairwise([*polygon, polygon[0]]))) / 2


def test_blocks_know_the_range_of_what_they_touch() -> None:
    heights = FIELDS["wide"].heights_m
    blocks = Blocks.of(heights, 4)
    for r0, r1, c0, c1 in ((0, 19, 0, 74), (3, 9, 17, 18), (16, 19, 70, 74), (4, 8, 4, 8)):
        low, high = blocks.range([(r0, c0), (r1, c1)])
        part = heights[r0 : r1 + 1, c0 : c1 + 1]
        assert low <= part.min() and high >= part.max()
    assert blocks.range([(4.0, 4.0), (8.0, 8.0)]) == (
        heights[4:9, 4:9].min(),
        heights[4:9, 4:9].max(),
    )


# -- codes


def test_codes_keep_the_bound_and_leave_no_crack() -> None:
    ground = FIELDS["tall"]
    grower = Grower(ground, max_error_m=0.2, leaf_px=8, sand_repeat=3.0, query=None, quantise=True)
    tree = grower.grow()
    assert grower.grid is not None
    finest = [p for p in tree.patches if p.level == grower.shape.finest]
    assert finest and all(p.error and p.error.max_m <= 0.2 for p in finest)
    rims = []
    for patch in tree.patches:
        codes = grower.quantised(grower.mesh(patch))
        assert codes is not None and codes.grid == grower.grid
        assert patch.error == patch_error(decoded_mesh(grower.mesh(patch), codes), ground, patch.corners)
        rims.append(border(decoded_mesh(grower.mesh(patch), codes)))
    tables = tables_of(tree)
    outer = {edge for rim in rims for edge in rim if on_rim(edge, ground)}
    for split in some_cuts(tables, 20):
        edges = Counter(edge for p in drawn(tables, split) for edge in rims[p])
        assert set(edges.values()) == {1, 2}
        alone = {edge for edge, count in edges.items() if count == 1}
        assert not alone ^ (outer & edges.keys())


def test_codes_of_all_patches_have_the_same_types() -> None:
    """The sand's coordinates of the first corner's patches lie in 0 to 1, those of others beyond: a player
    draws a tile in one call, with one layout of vertices."""
    for sand_repeat, uvs in ((3.0, np.float32), (0.5, np.uint16)):
        grower = Grower(
            rough(33, 33), max_error_m=0.2, leaf_px=8, sand_repeat=sand_repeat, query=None, quantise=True
        )
        codes = [grower.quantised(grower.mesh(patch)) for patch in grower.grow().patches]
        types = {
            tuple(part.dtype for part in (found.uvs, found.uvs1, found.normals) if part is not None)
            for found in codes
            if found
        }
        assert len(types) == 1
        assert types.pop()[:2] == (np.dtype(uvs), np.dtype(np.uint16))

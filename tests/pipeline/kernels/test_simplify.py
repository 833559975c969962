"""Promises of kernels/simplify: what simplified meshes keep, where they stop, how far off they are."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from paradize.bakers.mesh.lods import Plan, make_levels
from paradize.data import Mesh
from paradize.kernels.mesh import number_rows, topology
from paradize.kernels.simplify import Simplified, simplify
from paradize.metrics.surface import Original
from paradize.stages import lod
from tests.pipeline.shapes import cube, grid, sphere
from tests.sweeps import sample


def made(mesh: Mesh, target: int, **more: Any) -> Simplified:
    """A mesh's positions, uvs and normals, as far as there are any, simplified."""
    columns = [values for values in (mesh.uvs, mesh.normals) if values is not None]
    arguments: dict[str, Any] = {"seams": number_rows(mesh.positions)[0]}
    if columns:
        arguments["attributes"] = np.concatenate(columns, axis=1)
        arguments["unit"] = None if mesh.normals is None else arguments["attributes"].shape[1] - 3
    return simplify(mesh.positions.astype(np.float64), mesh.triangles, target=target, **(arguments | more))


def as_mesh(found: Simplified) -> Mesh:
    return Mesh(found.positions.astype(np.float32), found.triangles)


def closed(found: Simplified) -> bool:
    shape = topology(found.place[found.triangles], len(found.place))
    return shape.border.count == shape.non_manifold.count == shape.turned.count == 0


def split_cube(cells: int) -> Mesh:
    """A cube of six grids, whose edges share positions."""
    corners = cube()
    flat = grid(cells)
    points = []
    for k in range(6):
        a, b, _, d = corners.positions[
            [corners.triangles[2 * k][0], corners.triangles[2 * k][1], 0, corners.triangles[2 * k + 1][2]]
        ].astype(np.float64)
        x, z = flat.positions[:, :1].astype(np.float64), flat.positions[:, 2:].astype(np.float64)
        points.append(a + z * (b - a) + x * (d - a))
    count = len(flat.positions)
    faces = np.concatenate([flat.triangles + k * count for k in range(6)]).astype(np.uint32)
    return Mesh(np.concatenate(points).astype(np.float32), faces)


def strip(twists: int, cells: int = 60) -> Mesh:
    """A band of `cells` by 4 quads, closed after so many half turns."""
    u, v = np.meshgrid(np.arange(cells) * (2 * np.pi / cells), np.arange(5) / 4 - 0.5, indexing="ij")
    bent = u * twists / 2
    points = np.stack(
        [
            (1 + 0.4 * v * np.cos(bent)) * np.cos(u),
            0.4 * v * np.sin(bent),
            (1 + 0.4 * v * np.cos(bent)) * np.sin(u),
        ],
        axis=-1,
    )
    number = np.arange(cells * 5).reshape(cells, 5)
    after = np.concatenate([number[1:], number[:1, ::-1] if twists % 2 else number[:1]])
    a, b, c, d = number[:, :-1], after[:, :-1], after[:, 1:], number[:, 1:]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return Mesh(points.reshape(-1, 3).astype(np.float32), faces.astype(np.uint32))


@pytest.mark.parametrize("seed", range(4))
def test_no_triangle_of_a_plane_turns_over(seed: int) -> None:
    """Vertices of a ragged sheet, moved within it: nothing but the turn of a triangle says that it folds."""
    rng = np.random.default_rng(seed)
    sheet = grid(20)
    points = sheet.positions.astype(np.float64)
    within = (np.abs(points[:, [0, 2]] - 0.5) < 0.49).all(axis=1)
    points[within] += rng.uniform(-0.012, 0.012, (int(within.sum()), 3)) * [1, 0, 1]
    middles = points[sheet.triangles].mean(axis=1)
    ragged = sheet.triangles[np.abs(middles[:, 0] - 0.5) > 0.2 * np.sin(9 * middles[:, 2]) ** 2]
    for target in (len(ragged) // 3, len(ragged) // 8):
        found = simplify(points, ragged, target=target, seams=np.arange(len(points)))
        corners = found.positions[found.triangles]
        up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 1]
        assert len(up) < len(ragged) // 2 and (up > 0).all()


def test_a_flat_square_becomes_two_triangles_and_stays_where_it_was() -> None:
    found = made(grid(40), 2)
    assert len(found.triangles) == 2
    assert found.stop == "target"
    assert Original(grid(40)).distance(as_mesh(found))["error_max"] < 1e-6


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_a_linear_image_stays_where_it_lies_on_the_surface(weight: float) -> None:
    ground = grid(40, height=0.1)
    found = made(ground, 300, weights=[weight] * 5)
    assert np.abs(found.attributes[:, :2] - found.positions[:, [0, 2]]).max() < 2e-3
    flat = grid(40)
    turned = (flat.uvs @ np.array([[3.0, -2.0], [1.0, 5.0]]) + 7).astype(np.float32)
    found = made(Mesh(flat.positions, flat.triangles, uvs=turned), 20, weights=[weight] * 2)
    wanted = found.positions[:, [0, 2]] @ np.array([[3.0, -2.0], [1.0, 5.0]]) + 7
    assert np.abs(found.attributes - wanted).max() < 1e-5


def test_straight_borders_stay_straight() -> None:
    found = made(grid(30, height=0.05), 200)
    edges = found.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    pairs, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    ends = found.positions[pairs[count == 1]][..., [0, 2]]
    off = np.minimum(np.abs(ends), np.abs(ends - 1)).min(axis=-1)
    assert off.max() < 2e-4


def test_holes_stay_open_and_their_borders_never_touch() -> None:
    """By Euler's formula for a sheet, and by the two border edges of each border vertex."""
    sheet = grid(16)
    points = sheet.positions.astype(np.float64)
    points[:, 1] = 0.02 * np.random.default_rng(0).normal(size=len(points))
    cell = (points[sheet.triangles].mean(axis=1)[:, [0, 2]] * 16).astype(int)
    faces = sheet.triangles[~(cell % 3 == 1).all(axis=1)]
    found = simplify(points, faces, target=60, seams=np.arange(len(points)))
    rows = found.place[found.triangles]
    edges = np.sort(rows[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    pairs, count = np.unique(edges, axis=0, return_counts=True)
    assert len(rows) < 150 and count.max() == 2
    assert len(np.unique(rows)) - len(pairs) + len(rows) == 1 - 25
    assert (np.unique(pairs[count == 1], return_counts=True)[1] == 2).all()


def test_a_cube_becomes_twelve_triangles_with_its_corners() -> None:
    found = made(split_cube(12), 12)
    assert len(found.triangles) == 12
    assert closed(found)
    corners = np.unique(np.round(found.positions, 5), axis=0)
    assert np.array_equal(corners, np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]))


@pytest.mark.parametrize("target", [2000, 400, 60])
def test_a_sphere_stays_closed_at_its_seam(target: int) -> None:
    ball = sphere(48)
    found = made(ball, target)
    assert target - 2 < len(found.triangles) <= target
    assert closed(found)
    assert np.abs(np.linalg.norm(found.attributes[:, 2:], axis=1) - 1).max() < 1e-6
    # The seam is still one: u runs from 0 to 1 and no triangle spans the picture.
    u = found.attributes[found.triangles][..., 0]
    assert (u.max(axis=1) - u.min(axis=1)).max() < 0.75


def test_vertices_of_one_place_share_their_position_to_the_last_bit() -> None:
    found = made(sphere(32), 300)
    first = np.unique(found.place, return_index=True)[1]
    assert len(first) < len(found.place)
    assert np.array_equal(found.positions, found.positions[first[found.place]])


def test_an_image_slides_less_than_a_triangle_on_a_sphere() -> None:
    found = made(sphere(64), 1500)
    where = found.positions / np.linalg.norm(found.positions, axis=1)[:, None]
    v = np.arccos(np.clip(where[:, 1], -1, 1)) / np.pi
    assert np.sqrt(np.mean((found.attributes[:, 1] - v) ** 2)) < 2e-3


def test_what_did_not_move_is_as_it_was() -> None:
    ball = sphere(24)
    found = made(ball, 1000)
    source = ball.positions[found.vertex].astype(np.float64)
    kept = (found.positions == source).all(axis=1)
    assert kept.sum() > 50
    columns = np.concatenate([ball.uvs, ball.normals], axis=1)
    still = kept & (found.attributes == columns[found.vertex]).all(axis=1)
    assert still.sum() > 0.9 * kept.sum()


def test_no_triangle_is_degenerate_or_folded() -> None:
    for mesh in (sphere(48), split_cube(10), grid(40, height=0.1)):
        found = made(mesh, len(mesh.triangles) // 20)
        corners = found.positions[found.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.linalg.norm(normal, axis=1) > 1e-9).all()
        assert all(len(set(row)) == 3 for row in found.place[found.triangles].tolist())
    ball = made(sphere(48), 300)
    corners = ball.positions[ball.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", normal, corners.sum(axis=1)) > 0).all()


def test_groups_keep_their_common_border() -> None:
    ground = grid(24)
    groups = (ground.positions[ground.triangles][:, :, 0].mean(axis=1) > 0.5).astype(np.uint32)
    found = made(ground, 4, groups=groups)
    assert len(found.triangles) <= 8
    corners = found.positions[found.triangles]
    side = groups[found.triangle]
    assert corners[side == 0][..., 0].max() < 0.5 + 1e-6
    assert corners[side == 1][..., 0].min() > 0.5 - 1e-6


def test_cards_do_not_vanish() -> None:
    card = grid(2)
    count, spots = len(card.positions), np.random.default_rng(4).random((50, 3)) * 40
    points = np.concatenate([card.positions + spot for spot in spots]).astype(np.float32)
    faces = np.concatenate([card.triangles + k * count for k in range(50)]).astype(np.uint32)
    found = made(Mesh(points, faces), 20, kept_area=0.75)
    corners = found.positions[found.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert np.isclose(area.sum(), 50, rtol=1e-4)
    assert len(found.triangles) == 100
    assert found.stop == "nothing"


@pytest.mark.parametrize("twists", sample([0, 1, 2], every=2))
def test_bands_keep_their_rims_and_their_kind(twists: int) -> None:
    band = strip(twists)
    before = topology(band.triangles, len(band.positions))
    found = made(band, 120)
    after = topology(found.place[found.triangles], len(found.place))
    assert len(found.triangles) <= 124
    assert after.components == before.components == 1
    assert after.non_manifold.count == 0
    assert after.turned.count == before.turned.count
    assert Original(band).distance(as_mesh(found))["error_max"] < 0.01


def test_two_cubes_that_share_an_edge_do_not_come_apart() -> None:
    one = split_cube(6)
    both = Mesh(
        np.concatenate([one.positions, one.positions + np.array([1, 1, 0], np.float32)]),
        np.concatenate([one.triangles, one.triangles + len(one.positions)]).astype(np.uint32),
    )
    before = topology(number_rows(both.positions)[0][both.triangles], len(both.positions))
    found = made(both, 44)
    after = topology(found.place[found.triangles], len(found.place))
    assert before.non_manifold.count == after.non_manifold.count == 6
    assert before.border.count == after.border.count == 0
    assert len(found.triangles) == 44
    assert Original(both).distance(as_mesh(found))["error_max"] < 1e-6


def test_degenerate_triangles_are_left_out_and_empty_meshes_stay_empty() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0]], np.float64)
    faces = np.array([[0, 1, 2], [0, 3, 1], [1, 1, 2]], np.uint32)
    found = simplify(points, faces, target=10, seams=[0, 1, 2, 0])
    assert found.triangle.tolist() == [0]
    assert len(simplify(points, faces[:0], target=0).triangles) == 0
    flat = simplify(points * [1, 0, 0], faces[:1], target=0)
    assert (len(flat.triangles), flat.stop) == (1, "nothing")


def test_a_mesh_without_any_area_ends_as_it_is() -> None:
    ball = sphere(12)
    line = Mesh(ball.positions * np.array([1, 0, 0], np.float32), ball.triangles, uvs=ball.uvs)
    found = made(line, 4, seams=np.arange(len(line.positions)), weights=[0.05] * 2)
    assert found.stop == "nothing"
    assert np.isfinite(found.positions).all() and np.isfinite(found.attributes).all()


def planks(count: int, size: tuple[float, float, float] = (2, 0.04, 0.15)) -> Mesh:
    """Boxes side by side, every face with vertices of its own."""
    sides = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * np.array(size)
    one = corner[sides.reshape(-1)]
    out = corner[sides].mean(axis=1) - corner.mean(axis=0)
    normals = np.repeat(out / np.linalg.norm(out, axis=1)[:, None], 4, axis=0)
    quads = 4 * np.arange(6 * count)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    places = np.concatenate([one + np.array([0, 0, size[2] * 1.13 * k]) for k in range(count)])
    return Mesh(
        places.astype(np.float32),
        quads.reshape(-1, 3).astype(np.uint32),
        normals=np.tile(normals, (count, 1)).astype(np.float32),
        uvs=np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (6 * count, 1)).astype(np.float32),
    )


@pytest.mark.parametrize(("each", "least", "most_rms"), [(8, 0.99, 0.009), (6, 0.99, 0.014), (4, 0.8, 0.022)])
def test_planks_lose_their_thickness_before_their_width(each: int, least: float, most_rms: float) -> None:
    deck = planks(40)
    found = made(deck, 40 * each, weights=[0.01] * 2 + [0.001] * 3)
    assert len(found.triangles) == 40 * each
    corners = found.positions[found.triangles]
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 1] / 2
    for seen in (up[up > 0].sum(), -up[up < 0].sum()):
        assert seen > least * 40 * 2 * 0.15
    size = float(np.linalg.norm(np.ptp(deck.positions, axis=0)))
    assert Original(deck).distance(as_mesh(found))["error_rms"] * size < most_rms


def test_a_level_of_broken_boxes_is_not_made_and_the_reason_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("paradize.bakers.mesh.lods._SAMPLES", 50_000)  # whose p99 decides, as in any bake
    steps, notes = make_levels(planks(20, (1, 1, 1)), Plan(count=2), "balanced")
    assert len(steps) == 1
    (result,) = [note for note in notes if "triangles turn normals by" in note]
    assert 'set lods_by = "screen_size" or "error" in a scene, or give `paradize mesh` --' in result
    steps, _ = make_levels(planks(20), Plan(count=2), "balanced")
    assert len(steps) == 2 and steps[1].errors["normal_mean_deg"] <= 15


@pytest.mark.deep
def test_a_million_cards_keep_their_area() -> None:
    count = 1_000_000
    random = np.random.default_rng(1)
    square = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]) * 1e-3
    points = ((random.random((count, 1, 3)) - 0.5) * 0.577 + square).reshape(-1, 3)
    one = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    faces = (one + 4 * np.arange(count, dtype=np.uint32)[:, None, None]).reshape(-1, 3)
    uvs = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32), (count, 1))
    found = simplify(points, faces, target=500_000, attributes=uvs, weights=[0.05] * 2, kept_area=0.75)
    assert (len(found.triangles), found.stop) == (2 * count, "nothing")
    assert found.triangles.max() < len(found.positions) == 4 * count
    corners = found.positions[found.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    card = area[0::2] + area[1::2]
    assert card.min() > (1 - 1e-9) * 1e-6 and card.max() < (1 + 1e-9) * 1e-6


@pytest.mark.parametrize("size", [1e-30, 1e30])
def test_sizes_far_from_1_end_with_a_mesh(size: float) -> None:
    ball = sphere(16)
    places = number_rows(ball.positions)[0]
    found = simplify(ball.positions.astype(np.float64) * size, ball.triangles, target=100, seams=places)
    assert closed(found) and len(found.triangles) <= len(ball.triangles)
    assert np.isfinite(found.positions).all()
    assert np.abs(found.positions).max() <= 2 * size


@pytest.mark.parametrize("exponent", [-100, 100])
def test_a_level_of_another_size_is_the_same_level(exponent: int) -> None:
    """2^100 is about 1e30."""
    ball = sphere(24)
    scale = np.float32(2.0**exponent)
    want = lod.simplify(ball, 300).mesh
    found = lod.simplify(replace(ball, positions=ball.positions * scale), 300).mesh
    assert found.triangles.tobytes() == want.triangles.tobytes()
    assert found.positions.tobytes() == (want.positions * scale).tobytes()


def test_an_offset_of_a_million_diagonals_changes_no_choice() -> None:
    """Quarters, which float32 holds at 2^21 too; what moves is rounded to them."""
    flat = grid(4)
    x, z = flat.positions[:, 0], flat.positions[:, 2]
    ground = replace(flat, positions=np.stack([x, np.round(4 * x * z) / 4, z], axis=1).astype(np.float32))
    want = lod.simplify(ground, 20).mesh
    found = lod.simplify(replace(ground, positions=ground.positions + np.float32(2**21)), 20).mesh
    assert len(found.triangles) == len(want.triangles) <= 20
    corners = found.positions[found.triangles].astype(np.float64) - 2**21
    assert np.abs(corners - want.positions[want.triangles]).max() <= 0.126


@pytest.mark.deep
def test_the_order_of_triangles_changes_errors_by_less_than_a_tenth() -> None:
    ball = sphere(40)
    errors = []
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(len(ball.triangles))
        mixed = Mesh(ball.positions, np.ascontiguousarray(ball.triangles[order]))
        errors.append(Original(ball).distance(as_mesh(made(mixed, 400)))["error_rms"])
    assert max(errors) < 1.1 * min(errors)


def test_two_runs_are_equal() -> None:
    one, two = made(sphere(40), 500), made(sphere(40), 500)
    assert one.positions.tobytes() == two.positions.tobytes()
    assert one.attributes.tobytes() == two.attributes.tobytes()
    assert one.triangles.tobytes() == two.triangles.tobytes()


def test_misuse_is_refused() -> None:
    points, faces = cube().positions.astype(np.float64), cube().triangles
    for arguments in (
        {"attributes": np.zeros((3, 2))},
        {"attributes": np.full((8, 1), np.nan)},
        {"attributes": np.zeros((8, 33))},
        {"attributes": np.zeros((8, 2)), "weights": [1.0]},
        {"attributes": np.zeros((8, 2)), "weights": [1.0, -1.0]},
        {"attributes": np.zeros((8, 2)), "unit": 0},
        {"seams": np.zeros(3)},
        {"seams": np.full(8, 8)},
        {"groups": np.zeros(3)},
        {"kept_area": 2.0},
    ):
        with pytest.raises(ValueError):
            simplify(points, faces, target=4, **arguments)
    with pytest.raises(ValueError, match="index 8 of 8"):
        simplify(points, faces + 1, target=4)
    with pytest.raises(ValueError, match="positions"):
        simplify(np.where(points > 0, np.inf, points), faces, target=4)
    with pytest.raises(ValueError, match="target"):
        simplify(points, faces, target=-1)


@pytest.mark.parametrize("normals", [((1, 0, 0), (0, 0, 1)), ((0.6, 0.8, 0), (-0.6, 0.8, 0))])
def test_a_line_where_only_normals_part_stays_though_nothing_weighs_them(
    normals: tuple[tuple[float, float, float], ...],
) -> None:
    """A flat sheet of two halves: on the line between them each vertex stands twice."""
    half = grid(12)
    count = len(half.positions)
    points = half.positions.astype(np.float64)
    sheet = np.concatenate([points - [1, 0, 0], points])
    places = np.arange(2 * count)
    for k in np.flatnonzero(points[:, 0] == 0):
        (left,) = np.flatnonzero((points[:, 0] == 1) & (points[:, 2] == points[k, 2]))
        places[count + k] = left
    faces = np.concatenate([half.triangles, half.triangles + np.uint32(count)])
    found = simplify(
        sheet,
        faces,
        target=40,
        attributes=np.repeat(np.float32(normals), count, axis=0),
        unit=0,
        seams=places,
    )
    side = found.triangle >= len(half.triangles)
    x = found.positions[found.triangles][..., 0]
    assert len(found.triangles) <= 40 and x[~side].max() < 1e-6 and x[side].min() > -1e-6

"""Validation and normals: what no tool can use is dropped and told; missing normals are computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.data import Group, Mesh
from paradize.errors import SourceError
from paradize.kernels.mesh import UNKNOWN_SMOOTHING, corner_normals, number_rows
from paradize.kernels.reference import Surface
from paradize.metrics.surface import Original
from paradize.stages.normals import complete_normals
from paradize.stages.split import split_by
from paradize.stages.tangents import tangent_frames
from paradize.stages.validate import messages, validate_mesh
from paradize.stages.weld import weld
from tests.pipeline.shapes import cube, grid, soup, sphere
from tests.sweeps import tries


def test_a_sound_mesh_comes_through_unchanged() -> None:
    mesh = sphere(8)
    sound, report = validate_mesh(mesh)
    assert np.array_equal(sound.positions, mesh.positions) and np.array_equal(sound.triangles, mesh.triangles)
    assert report.closed and report.counted_twice and messages(report) == []
    assert report.topology.components == 1


def test_degenerate_and_repeated_triangles_are_dropped_and_told_with_their_line() -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0), (0, 0, 0), (9, 9, 9)]
    faces = [(0, 1, 2), (0, 1, 1), (0, 1, 3), (0, 1, 4), (1, 2, 0), (2, 1, 0)]
    sound, report = validate_mesh(soup(points, faces))
    assert report.kept.tolist() == [True, False, False, False, False, True]
    assert (report.degenerate, report.doubled, report.unused_vertices) == (3, 1, 3)
    assert len(sound.positions) == 3
    result = messages(report, np.arange(10, 16, dtype=np.uint32))
    assert result[0] == "3 degenerate triangles dropped (first: line 11)"
    assert result[1] == "1 triangle that repeats an earlier one dropped (first: line 14)"


def test_triangles_of_another_material_on_the_same_vertices_are_a_layer_and_stay() -> None:
    """A sticker on a wall; one of the sticker's own material is a repeat wherever it comes."""
    wall, sticker = ("wall", "wall"), ("sticker", "sticker")
    runs = [Group(*wall, 0, 1), Group(*sticker, 1, 2), Group(*wall, 3, 1), Group("again", "sticker", 4, 1)]
    faces = [(0, 1, 2), (1, 2, 0), (2, 0, 1), (3, 2, 1), (0, 1, 2)]
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]
    sound, report = validate_mesh(replace(soup(points, faces), groups=tuple(runs)))
    assert report.kept.tolist() == [True, True, False, True, False]
    assert [group.material for group in sound.groups] == ["wall", "sticker", "wall"]
    assert messages(report)[0] == "2 triangles that repeat an earlier one dropped (first: triangle 2)"


def test_slivers_are_kept() -> None:
    _, report = validate_mesh(soup([(0, 0, 0), (1, 0, 0), (0.5, 1e-30, 0)], [(0, 1, 2)]))
    assert report.degenerate == 0


@pytest.mark.parametrize("scale", [1e-30, 1e30])
def test_size_makes_no_triangle_degenerate(scale: float) -> None:
    _, report = validate_mesh(sphere(8, radius=scale))
    assert report.degenerate == 0 and report.closed


def test_borders_non_manifold_edges_and_turned_windings_are_counted() -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)]
    _, report = validate_mesh(soup(points, [(0, 1, 2), (1, 0, 3), (0, 1, 4)]))
    assert report.topology.non_manifold.count == 1 and report.topology.border.count == 6
    _, report = validate_mesh(soup(points, [(0, 1, 2), (0, 1, 3)]))
    assert report.topology.turned.count == 1
    assert any("wound against" in text for text in messages(report))


def test_a_surface_without_a_border_is_closed_where_all_faces_turn_alike() -> None:
    box = cube()
    assert validate_mesh(box)[1].closed
    faces = box.triangles.copy()
    faces[3] = faces[3, ::-1]
    turned = validate_mesh(replace(box, triangles=faces))[1]
    assert (turned.topology.border.count, turned.topology.turned.count, turned.closed) == (0, 3, False)


def test_images_without_area_are_counted() -> None:
    """On a line that leans; and a right angle that stands on its tip, which has area."""
    points, faces = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]
    for uvs, count in (([(0, 0), (0.5, 0.25), (1, 0.5)], 1), ([(0, 0), (0.5, 0.5), (0.5, -0.5)], 0)):
        mesh = replace(soup(points, faces), uvs=np.array(uvs, np.float32))
        assert validate_mesh(mesh)[1].zero_area_uvs == count
        mesh = replace(mesh, groups=(Group("part", "wood", 0, 1),))
        assert validate_mesh(mesh, mapped={"wood"})[1].zero_area_uvs == count
        assert validate_mesh(mesh, mapped={"another"})[1].zero_area_uvs == 0, "nothing reads them"


def everything(mesh: Mesh) -> Mesh:
    """With a second layout and colours, different at every vertex."""
    count = len(mesh.positions)
    rng = np.random.default_rng(4)
    return replace(mesh, uvs1=rng.random((count, 2), np.float32), colors=rng.random((count, 4), np.float32))


@pytest.mark.parametrize(
    "stage",
    [
        tangent_frames,
        lambda mesh: weld(mesh, 0.2)[0],
        lambda mesh: complete_normals(replace(mesh, normals=None), crease_deg=45.0)[0],
        lambda mesh: split_by(mesh, uvs=mesh.uvs[mesh.triangles]),
        lambda mesh: validate_mesh(mesh)[0],
    ],
)
def test_what_a_corner_carries_stays_with_it(stage: Callable[[Mesh], Mesh]) -> None:
    mesh = everything(sphere(8))
    found = stage(mesh)
    for name in ("uvs", "uvs1", "colors"):
        kept = getattr(found, name)
        assert kept is not None and len(kept) == len(found.positions), name
        assert np.array_equal(kept[found.triangles], getattr(mesh, name)[mesh.triangles]), name


def test_bow_ties_and_components_are_counted() -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)]
    _, report = validate_mesh(soup(points, [(0, 1, 2), (0, 3, 4)]))
    found = report.topology
    assert (found.components, found.bow_tie.count, len(set(found.island.tolist()))) == (2, 1, 1)
    _, report = validate_mesh(soup([*points, (0, 0, 1), (0, 1, 1)], [(0, 1, 2), (0, 3, 4), (0, 5, 6)]))
    assert report.topology.bow_tie.count == 1  # a vertex, however many fans touch there
    _, report = validate_mesh(soup(points, [(0, 1, 2), (0, 1, 4)]))
    assert (report.topology.turned.count, report.topology.bow_tie.count) == (1, 0)


def test_a_moebius_strip_is_turned_somewhere() -> None:
    count = 12
    points: list[tuple[float, float, float]] = []
    for i in range(count):
        a = 2 * np.pi * i / count
        for side in (-0.3, 0.3):
            r = 1 + side * np.cos(a / 2)
            points.append((float(r * np.cos(a)), float(r * np.sin(a)), float(side * np.sin(a / 2))))
    faces = []
    for i in range(count):
        a, b = 2 * i, 2 * i + 1
        c, d = (2 * i + 2, 2 * i + 3) if i + 1 < count else (1, 0)
        faces += [(a, c, b), (b, c, d)]
    _, report = validate_mesh(soup(points, faces))
    assert report.topology.turned.count == 1 and not report.closed
    assert report.topology.border.count == 2 * count


@pytest.mark.parametrize(
    "broken",
    [
        replace(cube(), positions=np.full((8, 3), np.nan, np.float32)),
        replace(cube(), triangles=np.array([[0, 1, 8]], np.uint32)),
        replace(cube(), triangles=np.zeros((0, 3), np.uint32)),
        replace(cube(), normals=np.full((8, 3), np.inf, np.float32)),
        replace(cube(), uvs=np.zeros((7, 2), np.float32)),
        replace(cube(), groups=(Group("a", "b", 1, 11),)),
        soup([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)]),
    ],
)
def test_what_cannot_be_a_mesh_is_refused_with_its_file(broken: Mesh) -> None:
    with pytest.raises(SourceError, match=r"broken\.obj"):
        validate_mesh(broken, "broken.obj")


@given(st.lists(st.tuples(*[st.integers(0, 7)] * 3), min_size=1, max_size=60))
@settings(max_examples=tries(150), deadline=None)
def test_any_faces_over_a_cube_are_mended_or_refused(faces: list[tuple[int, int, int]]) -> None:
    mesh = replace(cube(), triangles=np.array(faces, np.uint32))
    try:
        sound, report = validate_mesh(mesh)
    except SourceError:
        assert all(len(set(face)) < 3 for face in faces)
        return
    assert report.kept.sum() == len(sound.triangles)
    assert report.degenerate + report.doubled + len(sound.triangles) == len(faces)
    again, second = validate_mesh(sound)
    assert second.kept.all() and np.array_equal(again.triangles, sound.triangles)


# --- normals ---


def angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1))).max())


def test_computed_normals_of_a_sphere_point_outwards() -> None:
    mesh, computed = complete_normals(replace(sphere(32), normals=None), crease_deg=45.0)
    assert computed == len(mesh.triangles) and mesh.normals is not None
    assert angle_deg(mesh.normals.astype(float), mesh.positions.astype(float)) < 0.5


def test_a_cube_is_flat_by_its_crease_angle_and_smooth_by_its_smoothing_group() -> None:
    flat, _ = complete_normals(cube(), crease_deg=45.0)
    assert flat.normals is not None
    assert len(flat.positions) == 24
    assert set(np.abs(flat.normals).max(axis=1).tolist()) == {1.0}
    smooth, _ = complete_normals(cube(), np.full(12, 3, np.uint32), crease_deg=45.0)
    assert smooth.normals is not None
    assert len(smooth.positions) == 8
    assert np.allclose(np.abs(smooth.normals), 1 / np.sqrt(3), atol=1e-6)
    off, _ = complete_normals(cube(), np.zeros(12, np.uint32), crease_deg=45.0)
    assert len(off.positions) == 24


@pytest.mark.parametrize(("degrees", "count"), [(44.0, 4), (46.0, 6), (-44.0, 4), (-46.0, 6)])
def test_a_fold_of_more_than_45_degrees_is_an_edge(degrees: float, count: int) -> None:
    turn = np.radians(degrees)
    points = [(0, 0, 0), (0, 0, 1), (1, 0, 0), (-np.cos(turn), np.sin(turn), 0)]
    folded, _ = complete_normals(soup(points, [(0, 1, 2), (1, 0, 3)]), crease_deg=45.0)
    assert len(folded.positions) == count


def test_normals_do_not_depend_on_how_faces_are_cut() -> None:
    """Weighted by angle: a corner of a cube has the same normal whichever diagonals its faces have."""
    normals = corner_normals(cube().positions, cube().triangles, np.full(12, 1, np.uint32), crease_deg=45.0)
    assert np.allclose(np.abs(normals), 1 / np.sqrt(3), atol=1e-6)


def test_smoothing_groups_do_not_mix() -> None:
    """A ridge of eight triangles: each takes its normals from those of its own group at the same corner."""
    mesh = grid(2)
    groups = np.array([1, 1, 1, 1, 2, 2, UNKNOWN_SMOOTHING, 0], np.uint32)
    bent = mesh.positions.copy()
    bent[:, 1] = np.abs(bent[:, 0] - 0.5)
    normals = corner_normals(bent, mesh.triangles, groups, crease_deg=180.0)
    corners = bent[mesh.triangles].astype(np.float64)
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    for t, vertices in enumerate(mesh.triangles):
        for k, vertex in enumerate(vertices):
            total = np.zeros(3)
            for u, at in np.argwhere(mesh.triangles == vertex):
                if u == t or (groups[u] == groups[t] != 0):
                    a, b = (corners[u, (at + side) % 3] - corners[u, at] for side in (1, 2))
                    cosine = a @ b / np.linalg.norm(a) / np.linalg.norm(b)
                    total += np.arccos(cosine) * faces[u]
            assert np.allclose(normals[t, k], total / np.linalg.norm(total), atol=1e-6)


def test_faces_back_to_back_keep_their_own_normals() -> None:
    """Their sum is nothing, whatever the crease angle."""
    normals = corner_normals(
        np.float32([[0, 0, 0], [1, 0, 0], [0, 0, 1]]),
        np.array([[0, 1, 2], [0, 2, 1]], np.uint32),
        np.array([1, 1], np.uint32),
        crease_deg=45.0,
    )
    assert np.allclose(normals, np.reshape([[0, -1, 0], [0, 1, 0]], (2, 1, 3)), atol=1e-6)


def test_given_normals_stay_and_are_made_unit() -> None:
    ball = sphere(6)
    assert ball.normals is not None
    long, computed = complete_normals(replace(ball, normals=ball.normals * np.float32(7)), crease_deg=45.0)
    assert computed == 0 and long.normals is not None
    assert np.allclose(long.normals, ball.normals, atol=1e-6)
    assert np.array_equal(long.triangles, ball.triangles)
    holed = ball.normals.copy()
    holed[40] = 0
    mended, computed = complete_normals(replace(ball, normals=holed), crease_deg=45.0)
    assert computed == int((ball.triangles == 40).any(axis=1).sum()) and mended.normals is not None
    assert np.allclose(np.linalg.norm(mended.normals, axis=1), 1, atol=1e-6)


# --- the metric ---


def test_distance_of_parallel_squares_is_their_gap() -> None:
    a = grid(4)
    b = replace(a, positions=a.positions + np.array([0, 0.25, 0], np.float32))
    found = Original(a).distance(b, 1000)
    assert found == {key: pytest.approx(0.25 / np.sqrt(2), rel=1.01e-3) for key in found}


def test_a_spike_between_vertices_of_the_other_surface_is_found_from_both_sides() -> None:
    a = grid(1)
    tip = np.array([[0.25, 0.5, 0.5]], np.float32)
    spiked = Mesh(
        np.concatenate([a.positions, tip]), np.concatenate([a.triangles, [[0, 1, 4]]]).astype(np.uint32)
    )
    for first, second, diagonal in ((a, spiked, 2**0.5), (spiked, a, 1.5)):
        found = Original(first).distance(second, 1000)
        assert found["error_max_lower"] == pytest.approx(0.5 / diagonal, rel=1e-5)
        assert 0.5 / diagonal <= found["error_max"] <= 1.00101 * 0.5 / diagonal


@pytest.mark.parametrize("corner", range(3))
def test_a_groove_under_the_middle_of_an_edge_is_found(corner: int) -> None:
    points = np.array([(0, 0, 0), (2, 0, 0), (1, 0, 1), (1, -0.1, 0)], np.float32)
    flat = np.roll(np.array([[0, 1, 2]], np.uint32), corner, axis=1)
    bent = np.array([[0, 3, 2], [3, 1, 2]], np.uint32)
    found = Surface(points, flat).distance_to(Surface(points, bent), samples=0)[0]
    assert found == pytest.approx(brute(np.array([1.0, 0, 0]), points[bent].astype(float)), rel=1e-12)


@pytest.mark.parametrize("threads", [1, 3])
def test_distances_are_those_of_brute_force_and_do_not_depend_on_threads(threads: int) -> None:
    a, b = sphere(10), sphere(7, offset=(0.1, -0.2, 0.05))
    there, back = (Surface(mesh.positions, mesh.triangles) for mesh in (a, b))
    found = there.distance_to(back, samples=0, threads=threads)
    assert found == there.distance_to(back, samples=0, threads=2)
    corners = b.positions[b.triangles].astype(float)
    largest = max(brute(p, corners) for p in a.positions[np.unique(a.triangles)].astype(float))
    assert found[0] >= largest * (1 - 1e-12)
    assert found[0] == pytest.approx(largest, rel=0.02)


def brute(p: np.ndarray, corners: np.ndarray) -> float:
    """Distance to the nearest of many triangles by trying barycentric points, then the three sides."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    n = np.cross(b - a, c - a)
    n /= np.linalg.norm(n, axis=1)[:, None]
    foot = p - ((p - a) * n).sum(1)[:, None] * n
    inside = np.ones(len(a), bool)
    best = np.full(len(a), np.inf)
    for s, e in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(e - s, foot - s) * n).sum(1) >= 0
        t = np.clip(((p - s) * (e - s)).sum(1) / ((e - s) ** 2).sum(1), 0, 1)
        best = np.minimum(best, np.linalg.norm(p - s - t[:, None] * (e - s), axis=1))
    best = np.where(inside, np.abs(((p - a) * n).sum(1)), best)
    return float(best.min())


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
def test_the_measured_fraction_does_not_depend_on_size(scale: float) -> None:
    a, b = sphere(8, radius=scale), sphere(5, radius=scale)
    found = Original(a).distance(b, 2000)
    known = Original(sphere(8)).distance(sphere(5), 2000)
    assert found["error_max"] == pytest.approx(known["error_max"], rel=2e-3)
    assert found["error_rms"] == pytest.approx(known["error_rms"], rel=1e-3)


def test_rows_are_numbered_in_order_of_first_use() -> None:
    rows = np.array([[1, 2], [0, 0], [1, 2], [-0.0, 0], [3, 3]], np.float32)
    index, first = number_rows(rows)
    assert index.tolist() == [0, 1, 0, 1, 2] and first.tolist() == [0, 1, 4]

"""The draw order: the same triangles, quicker to draw, and the same on every run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.mesh.bake import bake_mesh
from paradize.data import Group, Mesh
from paradize.errors import BakeError
from paradize.formats.glb.reader import decode_glb
from paradize.kernels.reference.draw import draw_cost
from paradize.metrics.draw import draw_costs
from paradize.readers.obj import read_obj
from paradize.stages import order
from paradize.stages.order import draw_order
from tests.pipeline.shapes import cube, grid, soup, sphere
from tests.sweeps import tries


def shuffled(mesh: Mesh, seed: int = 1) -> Mesh:
    rng = np.random.default_rng(seed)
    return replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[rng.permutation(len(mesh.triangles))]))


def corners(mesh: Mesh, group: Group | None = None) -> list[bytes]:
    """Each triangle's corners with all that they hold, the smallest first, sorted: what a mesh draws."""
    triangles = mesh.triangles[group.first : group.first + group.count] if group else mesh.triangles
    values = [
        getattr(mesh, name)
        for name in ("positions", "normals", "tangents", "uvs", "uvs1", "colors")
        if getattr(mesh, name) is not None
    ]
    rows = np.concatenate(values, axis=1)[triangles]
    found = []
    for a, b, c in rows:
        turns = [np.concatenate(t).tobytes() for t in ((a, b, c), (b, c, a), (c, a, b))]
        found.append(min(turns))
    return sorted(found)


def test_the_set_of_triangles_stays_exactly_the_same() -> None:
    mesh = sphere(12)
    half = len(mesh.triangles) // 3
    groups = (Group("a", "x", 0, half), Group("b", "y", half, len(mesh.triangles) - half))
    rng = np.random.default_rng(6)
    more = {"uvs1": rng.random((len(mesh.positions), 2), np.float32)}
    more["colors"] = rng.random((len(mesh.positions), 4), np.float32)
    mesh = replace(shuffled(mesh), groups=groups, **more)
    done = draw_order(mesh)
    assert done.groups == groups
    for group in groups:
        assert corners(done, group) == corners(mesh, group)
    assert len(done.positions) == len(mesh.positions)


@given(
    st.lists(st.tuples(*[st.integers(0, 9)] * 3).filter(lambda t: len(set(t)) == 3), min_size=1, max_size=40)
)
@settings(max_examples=tries(60), deadline=None)
def test_any_triangles_come_back(faces: list[tuple[int, int, int]]) -> None:
    points = np.random.default_rng(3).normal(size=(10, 3)).astype(np.float32)
    mesh = Mesh(points, np.array(faces, np.uint32), groups=(Group("g", "m", 0, len(faces)),))
    assert corners(draw_order(mesh)) == corners(mesh)


def test_vertices_stand_in_the_order_of_their_first_use_and_unused_ones_are_gone() -> None:
    mesh = soup([(9, 9, 9), (0, 0, 0), (1, 0, 0), (8, 8, 8), (0, 1, 0)], [(4, 1, 2)])
    done = draw_order(mesh)
    seen = list(dict.fromkeys(done.triangles.reshape(-1).tolist()))
    assert seen == list(range(len(done.positions))) == [0, 1, 2]
    assert corners(done) == corners(mesh)


@pytest.mark.parametrize("mesh", [sphere(60), grid(60, height=0.2)])
def test_a_shuffled_mesh_is_transformed_and_fetched_next_to_once(mesh: Mesh) -> None:
    before, after = draw_costs(shuffled(mesh)), draw_costs(draw_order(shuffled(mesh)))
    assert before["atvr"] > 5 and before["overfetch"] > 5
    assert after["acmr"] < 0.75 and after["atvr"] < 1.45 and after["overfetch"] < 1.5


def overdraw(mesh: Mesh, side: int = 64) -> float:
    """Pixels shaded per pixel covered, seen from +Z, with a depth test and front faces only."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    at = (mesh.positions - low) * (side / (high - low).max())
    depth, shaded = np.full((side, side), -np.inf), 0
    for a, b, c in at[mesh.triangles].astype(np.float64):
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area <= 0:
            continue
        left, top = np.ceil(np.minimum(np.minimum(a, b), c)[:2] - 0.5).astype(int)
        right, bottom = np.floor(np.maximum(np.maximum(a, b), c)[:2] + 0.5).astype(int)
        y, x = np.mgrid[top:bottom, left:right] + 0.5
        weights = [
            ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area
            for p, q in ((b, c), (c, a), (a, b))
        ]
        z = weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2]
        seen = depth[top:bottom, left:right]
        nearer = (np.min(weights, axis=0) >= 0) & (z > seen)
        seen[nearer] = z[nearer]
        shaded += int(nearer.sum())
    return shaded / int(np.isfinite(depth).sum())


def test_what_hides_is_drawn_before_what_is_hidden() -> None:
    balls = [sphere(12, radius=r) for r in (1.0, 2.0, 3.0, 4.0)]
    shift = np.cumsum([0] + [len(b.positions) for b in balls])
    nested = Mesh(
        np.concatenate([b.positions for b in balls]),
        np.concatenate([b.triangles + s for b, s in zip(balls, shift, strict=False)]).astype(np.uint32),
    )
    assert overdraw(nested) > 1.85  # the innermost first: (1 + 4 + 9 + 16) / 16
    assert overdraw(draw_order(nested)) < 1.2


def test_the_same_mesh_gives_the_same_order_at_any_size_and_place() -> None:
    mesh = shuffled(sphere(20))
    done = draw_order(mesh)
    assert np.array_equal(done.triangles, draw_order(mesh).triangles)
    for scale in (2.0**-100, 2.0**100):
        moved = replace(mesh, positions=(mesh.positions * np.float32(scale)))
        found = draw_order(moved)
        assert np.array_equal(found.triangles, done.triangles)
        assert np.array_equal(found.positions, done.positions * np.float32(scale))


def test_flat_thin_and_point_like_meshes_are_put_in_order() -> None:
    for points in (np.zeros((3, 3)), np.eye(3) * [1, 0, 0], np.full((3, 3), 3e38)):
        mesh = Mesh(points.astype(np.float32), np.array([[0, 1, 2], [2, 1, 0]], np.uint32))
        assert corners(draw_order(mesh)) == corners(mesh)


def test_unsound_indices_are_refused_before_the_library_sees_them() -> None:
    for faces in (np.array([[0, 1, 8]], np.uint32), np.zeros((0, 3), np.uint32)):
        with pytest.raises(BakeError, match="no triangles, or an index beyond"):
            draw_order(replace(cube(), triangles=faces))


def test_other_triangles_than_were_given_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = order._overdraw

    def turned(out: int, *rest: object) -> None:
        honest(out, *rest)
        import ctypes

        values = (ctypes.c_uint32 * 3).from_address(out)
        values[0], values[1] = values[1], values[0]

    monkeypatch.setattr(order, "_overdraw", turned)
    with pytest.raises(BakeError, match="other triangles"):
        draw_order(sphere(6))


def test_the_costs_are_those_counted_by_hand() -> None:
    # Two triangles that share an edge, a cache that holds two: the fourth corner misses, and so do the rest.
    strip = np.array([[0, 1, 2], [2, 1, 3]], np.uint32)
    assert draw_cost(strip, 4, [16], cache=16, lines=4) == (2.0, 1.0, 1.0)
    acmr, atvr, _ = draw_cost(np.array([[0, 1, 2], [0, 1, 2]], np.uint32), 3, [16], cache=2, lines=4)
    assert (acmr, atvr) == (3.0, 2.0)  # first in, first out, and always the wrong one out
    far = np.array([[0, 100, 200]], np.uint32)
    assert draw_cost(far, 201, [16], cache=16, lines=4)[2] == 4.0  # a line of 64 bytes for each 16
    for index, lines in ((4, 1), (5, 2)):  # of 12 bytes: 48 to 60 lie in one line, 60 to 72 in two
        one = np.full((1, 3), index, np.uint32)
        assert draw_cost(one, 6, [12], cache=16, lines=4) == (1.0, 1.0, lines * 64 / 12)
    with pytest.raises(ValueError, match="index 3 of 3"):
        draw_cost(np.array([[0, 1, 3]], np.uint32), 3, [16])


def test_what_a_vertex_holds_is_fetched_stream_by_stream() -> None:
    """Of each of six streams one line of 64 bytes; a vertex holds 72."""
    three = {"normals": 3, "tangents": 4, "uvs": 2, "uvs1": 2, "colors": 4}
    arrays = {name: np.zeros((3, width), np.float32) for name, width in three.items()}
    full = Mesh(np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32), **arrays)
    assert draw_costs(full) == {"acmr": 3.0, "atvr": 1.0, "overfetch": 1.778}  # 6 * 64 / (3 * 72)
    for name, width in three.items():
        lone = replace(full, **(dict.fromkeys(three) | {name: arrays[name]}))
        assert draw_costs(lone)["overfetch"] == float(f"{128 / (3 * (12 + 4 * width)):.4g}"), name


def test_a_bake_states_what_each_level_costs_to_draw_and_keeps_its_positions(
    root: Path,
) -> None:
    path = root / "raw_assets/palm/palm.obj"
    made = bake_mesh(path, lods=2)
    for level, report in zip(decode_glb(made.glb), made.report["lods"], strict=True):
        after = draw_costs(level.mesh)
        assert {k: report["draw"][k] for k in after} == after
        assert after["acmr"] <= report["draw"]["acmr_before"]
    source = read_obj(path).mesh
    level0 = decode_glb(made.glb)[0].mesh
    assert {p.tobytes() for p in level0.positions} == {
        p.tobytes() for p in source.positions[source.triangles].reshape(-1, 3)
    }


@pytest.mark.parametrize("lods", [1, 3])
def test_a_bake_puts_every_level_in_order(tmp_path: Path, lods: int) -> None:
    mesh = shuffled(grid(24, height=0.1))
    rows = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.positions]
    rows += [f"f {a} {b} {c}" for a, b, c in (mesh.triangles + 1).tolist()]
    (tmp_path / "field.obj").write_text("\n".join(rows))
    made = bake_mesh(tmp_path / "field.obj", lods=lods)
    assert len(made.lods) == lods
    first = made.report["lods"][0]["draw"]
    assert first["acmr"] < 0.6 * first["acmr_before"]
    for level in made.lods:
        used = level.mesh.triangles.reshape(-1)
        _, places = np.unique(used, return_index=True)
        assert (np.diff(places) > 0).all()

"""Which parts of a mesh `check` holds for turned inside out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from paradize.checks.inside_out import find_turned, inside_out
from paradize.data import Group, Mesh
from tests.pipeline.shapes import sphere


def turned(mesh: Mesh) -> Mesh:
    return replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))


def joined(*meshes: Mesh, apart: float = 0.0) -> Mesh:
    """The meshes as one, each `apart` metres further along x."""
    starts = np.cumsum([0, *(len(mesh.positions) for mesh in meshes)])
    shift = np.array([1.0, 0.0, 0.0], np.float32) * np.float32(apart)
    positions = [mesh.positions + k * shift for k, mesh in enumerate(meshes)]
    triangles = [mesh.triangles + np.uint32(start) for mesh, start in zip(meshes, starts, strict=False)]
    return Mesh(np.concatenate(positions), np.concatenate(triangles))


def smaller(mesh: Mesh) -> Mesh:
    return replace(mesh, positions=mesh.positions * np.float32(0.5))


BALL = sphere(8)


def test_a_closed_part_that_faces_inwards_is_found_and_no_other() -> None:
    assert inside_out(BALL) == []
    (found,) = inside_out(joined(BALL, turned(BALL), apart=5.0))
    assert found.tolist() == [False] * len(BALL.triangles) + [True] * len(BALL.triangles)


def test_a_cavity_is_sound_and_a_hull_round_a_model_is_not() -> None:
    assert inside_out(joined(BALL, turned(smaller(BALL)))) == []
    assert len(inside_out(joined(turned(BALL), smaller(BALL)))) == 1


def test_open_parts_sheets_of_two_sides_and_half_turned_parts_are_not_judged() -> None:
    part = turned(BALL)
    assert inside_out(replace(part, triangles=part.triangles[1:])) == []
    sheet = replace(BALL, triangles=BALL.triangles[:1])
    assert inside_out(joined(sheet, turned(sheet))) == []
    half = part.triangles.copy()
    half[::2] = half[::2, ::-1]
    assert inside_out(replace(part, triangles=half)) == []


def test_a_sheet_whose_normals_point_to_its_back_is_found_where_that_is_culled() -> None:
    positions = np.array([[0, 0, 0], [2, 0, 0], [0, 0, 1], [1, 0, 0], [0, 0, 2]], np.float32)
    normals = np.tile(np.array([0, 1, 0], np.float32), (5, 1))
    triangles = np.array([[0, 1, 2], [0, 4, 3]], np.uint32)  # the first is seen from below
    mesh = Mesh(positions, triangles, normals=normals, groups=(Group("a", "a", 0, 2),))
    (found,) = find_turned(mesh, ["a"], "f")  # half of it: the rest may be in order, and is lit otherwise
    assert found.what == "normals of 50% of its surface point away from the side that is drawn"
    narrower = replace(mesh, positions=positions.copy())
    narrower.positions[1] = (0.5, 0, 0)
    assert list(find_turned(narrower, ["a"], "f")) == []
    wider = replace(mesh, positions=positions.copy())
    wider.positions[1] = (6, 0, 0)
    (found,) = find_turned(wider, ["a"], "f")
    assert (found.code, found.what[:27]) == ("PZ234", "normals of 75% of its surfa")
    assert list(find_turned(wider, [], "f")) == []
    assert list(find_turned(replace(wider, triangles=triangles[:, ::-1]), ["a"], "f")) == []


def test_sheets_there_twice_and_upright_leaves_whose_normals_point_up_are_no_fault() -> None:
    """Rounding decides which half of the one is larger, and on which side of the other a normal lies."""
    rng = np.random.default_rng(2)
    for size in (1.0, 1e16):
        corners = size * rng.normal(size=(500, 3, 3))
        facets = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facets /= np.linalg.norm(facets, axis=1)[:, None]
        front = np.arange(1500, dtype=np.uint32).reshape(-1, 3)
        both = np.concatenate([front, front[:, ::-1]])
        twice = Mesh(corners.reshape(-1, 3).astype(np.float32), both, groups=(Group("a", "a", 0, len(both)),))
        normals = np.repeat(facets, 3, axis=0).astype(np.float32)
        with np.errstate(all="raise"):
            assert list(find_turned(replace(twice, normals=normals), ["a"], "f")) == []
            (found,) = find_turned(
                replace(twice, normals=-normals, triangles=front, groups=(Group("a", "a", 0, 500),)),
                ["a"], "f",
            )  # fmt: skip
        assert found.what.startswith("normals of 100% of")
    leaves = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]], np.float32)
    up = np.tile(np.array([0.0, 1.0, -0.05], np.float32), (3, 1))
    mesh = Mesh(leaves, np.array([[0, 1, 2]], np.uint32), normals=up, groups=(Group("a", "a", 0, 1),))
    assert list(find_turned(mesh, ["a"], "f")) == []

"""Which parts of a mesh `check` holds for turned inside out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from paradize.checks.inside_out import inside_out
from paradize.data import Mesh
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

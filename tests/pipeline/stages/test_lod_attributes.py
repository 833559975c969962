"""Attributes of levels of detail: colours follow their vertices, normals are compared side with side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers.mesh.bake import bake_mesh
from paradize.bakers.mesh.lods import Plan, make_levels
from paradize.data import Group, Mesh
from paradize.errors import BakeError
from paradize.metrics.mapped_normal import normal_error
from paradize.metrics.surface import Original
from paradize.stages.lod import Simplified, simplify
from paradize.stages.reproject import take_attributes
from paradize.stages.split import split_by
from paradize.tiers import SEAM_SIMPLIFIERS
from tests.pipeline.shapes import cube, grid, sphere


@pytest.mark.parametrize("method", SEAM_SIMPLIFIERS)
@pytest.mark.parametrize("share", [2, 8])
def test_colours_follow_their_vertices_however_many_there_come_to_be(method: str, share: int) -> None:
    """Two balls that touch in a vertex, each face an edge of its own, so that normals are let go."""
    ball = sphere(12)
    places = np.concatenate([ball.positions, ball.positions + np.float32([0, 2, 0])])
    triangles = np.concatenate([ball.triangles, ball.triangles + np.uint32(len(ball.positions))])
    corners = places[triangles].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    positions = corners.reshape(-1, 3).astype(np.float32)
    mesh = Mesh(
        positions,
        np.arange(len(positions), dtype=np.uint32).reshape(-1, 3),
        normals=np.repeat(normals, 3, axis=0).astype(np.float32),
        colors=np.concatenate([(positions + 1) / 4, np.ones((len(positions), 1))], axis=1).astype(np.float32),
        groups=(Group("balls", "paint", 0, len(triangles)),),
    )
    level = simplify(mesh, len(triangles) // share, method).mesh
    assert len(level.triangles) < len(triangles)
    assert level.normals is not None and len(level.normals) == len(level.positions)
    assert level.colors is not None and len(level.colors) == len(level.positions)
    assert np.abs(level.colors[:, :3] - (level.positions + 1) / 4).max() < 0.2


def test_a_mesh_whose_attributes_are_not_its_vertices_is_not_split() -> None:
    mesh = grid(2)
    stale = replace(mesh, colors=np.zeros((len(mesh.positions) + 1, 4), np.float32))
    with pytest.raises(BakeError, match="10 colors for 9 vertices"):
        split_by(stale, uvs=np.zeros((len(mesh.triangles), 3, 2), np.float32))


def test_a_pinched_coloured_box_is_baked(tmp_path: Path) -> None:
    """Its open sides share corners that come apart, so that a level has more vertices than were joined."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    rows = [f"v {x} {y} {z} {x} {y} {z}" for x, y, z in corners]
    faces = ("1 3 7 5", "1 2 4 3", "5 6 8 7", "3 4 8 7", "1 2 6 5", "2 6 8 4")
    path = tmp_path / "box.obj"
    path.write_text("\n".join([*rows, *(f"f {face}" for face in faces)]) + "\n")
    for level in bake_mesh(path).lods:
        assert level.mesh.colors is not None
        assert np.abs(level.mesh.colors[:, :3] - level.mesh.positions).max() < 0.5


def test_what_is_taken_from_the_source_is_mixed_from_the_three_corners_there() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float64) + 1000
    normals = np.eye(3)
    triangle = np.array([[0, 1, 2]], np.uint32)
    source = Mesh(corners.astype(np.float32), triangle, normals=normals.astype(np.float32))
    weights = np.array([[0.6, 0.3, 0.1], [0.2, 0.5, 0.3], [0.25, 0.25, 0.5]])
    simple = Mesh((weights @ corners).astype(np.float32), triangle)
    found = take_attributes(source, simple, ("normals",)).normals
    unit = weights / np.linalg.norm(weights, axis=1)[:, None]
    assert found is not None and np.abs(found - unit).max() < 1e-3  # places are floats at 1000 metres


def test_attributes_come_from_what_faces_the_same_way_though_a_wall_is_nearer() -> None:
    """A floor and a wall at its rim; above the floor, close to the wall, lies a triangle that faces up."""
    floor, wall = grid(4), grid(4)
    count = len(floor.positions)
    upright = wall.positions[:, [1, 0, 2]] * np.float32([1, 1, 1])  # x = 0, facing +X
    source = Mesh(
        np.concatenate([floor.positions, upright]).astype(np.float32),
        np.concatenate([floor.triangles, wall.triangles[:, ::-1] + count]),
        normals=np.repeat(np.float32([[0, 1, 0], [1, 0, 0]]), count, axis=0),
    )
    low = np.array([(0.02, 0.1, 0.3), (0.02, 0.1, 0.7), (0.08, 0.1, 0.5)], np.float32)
    found = take_attributes(source, Mesh(low, np.array([[0, 1, 2]], np.uint32)), ("normals",)).normals
    assert found is not None and np.array_equal(found, np.tile(np.float32([0, 1, 0]), (3, 1)))


# --- normals ---


def plank(thickness: float) -> Mesh:
    """A closed board of 1 x 1 with hard edges; a thickness of 0 leaves two sheets back to back."""
    base = cube()
    corners = (base.positions * np.float32([1, thickness, 1]))[base.triangles].astype(float)
    flat = np.cross(
        *(base.positions[base.triangles][:, k] - base.positions[base.triangles][:, 0] for k in (1, 2))
    )
    kept = np.abs(flat[:, 1]) > 0 if thickness == 0 else np.ones(len(flat), bool)
    corners = corners[kept]
    normals = (flat / np.linalg.norm(flat, axis=1)[:, None])[kept]
    count = len(corners)
    return Mesh(
        corners.reshape(-1, 3).astype(np.float32),
        np.arange(3 * count, dtype=np.uint32).reshape(-1, 3),
        normals=np.repeat(normals, 3, axis=0).astype(np.float32),
        groups=(Group("plank", "wood", 0, count),),
    )


@pytest.mark.parametrize("height", [0.0, 0.01, 0.02])
def test_the_underside_of_a_plank_that_became_a_sheet_is_compared_with_the_underside(height: float) -> None:
    board, sheet = plank(0.02), plank(0.0)
    sheet = replace(sheet, positions=sheet.positions + np.float32([0, height, 0]))
    found = normal_error(board, sheet, 20_000)
    assert found["normal_mean_deg"] < 8 and found["normal_p99_deg"] < 91  # its narrow sides are gone


def test_a_turned_mesh_is_off_by_half_a_turn_and_turned_planks_too() -> None:
    for mesh in (sphere(24), plank(0.02)):
        assert mesh.normals is not None
        inside_out = replace(mesh, triangles=mesh.triangles[:, ::-1].copy(), normals=-mesh.normals)
        assert normal_error(mesh, inside_out, 5000)["normal_mean_deg"] > 150
        assert normal_error(mesh, replace(mesh, normals=-mesh.normals), 5000)["normal_mean_deg"] > 179


@pytest.mark.parametrize("method", SEAM_SIMPLIFIERS)
def test_how_large_an_image_is_drawn_does_not_matter(method: str) -> None:
    """The same texture on a quarter of the sides holds the surface as much."""
    ball = sphere(24)
    assert ball.uvs is not None
    small = replace(ball, uvs=ball.uvs * np.float32(0.25))
    found = [simplify(mesh, 300, method).mesh for mesh in (ball, small)]
    assert np.array_equal(found[0].positions, found[1].positions)
    assert np.array_equal(found[0].triangles, found[1].triangles)


@pytest.mark.deep
def test_a_texture_that_would_slide_is_held_at_next_to_no_cost_of_shape(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The jetty's planks: boxes that become sheets, whose ends pull the wood along."""
    jetty = root / "raw_assets/jetty/jetty.obj"
    monkeypatch.setattr("paradize.bakers.mesh.lods._SAMPLES", 50_000)  # whose p99 decides, as in any bake
    held = bake_mesh(jetty, lods=3).report
    monkeypatch.setattr("paradize.bakers.mesh.lods._UV_WEIGHTS", ())
    loose = bake_mesh(jetty, lods=3).report
    assert not any("slid" in warning for warning in held["warnings"])
    last, before = held["lods"][2], loose["lods"][2]
    assert before["uv_shift_p99"] > 0.02 > 1.5 * last["uv_shift_p99"]
    assert any("slid" in text and "fewer levels or a larger ratio" in text for text in loose["warnings"])
    assert last["error_rms"] < 1.2 * before["error_rms"]
    assert last["triangles"] <= 1.02 * before["triangles"]


def test_how_far_a_texture_slid_is_told_only_where_its_uvs_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slid = dict.fromkeys(("uv_shift_p99", "uv_shift_max"), 0.5)
    monkeypatch.setattr("paradize.bakers.mesh.lods.uv_shift", lambda *_: slid)
    ball = sphere(12)
    lines = [f"v {x} {y} {z}" for x, y, z in ball.positions.tolist()]
    lines += [f"vt {u} {v}" for u, v in ball.positions[:, :2].tolist()]
    lines += ["f " + " ".join(f"{at}/{at}" for at in row) for row in (ball.triangles + 1).tolist()]
    (tmp_path / "ball.obj").write_text("\n".join(lines) + "\n")
    for attributes, told in (
        (None, True),
        (("POSITION", "NORMAL", "TEXCOORD_0"), True),
        (("POSITION", "NORMAL"), False),
    ):
        report = bake_mesh(tmp_path / "ball.obj", lods=2, attributes=attributes).report
        assert any("slid" in text for text in report["warnings"]) == told, attributes


def test_what_is_held_with_more_weight_stays_inside_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """A level whose texture slid is taken again only where the new one is as near as was asked."""
    tried = []

    def slid(judge: Original, level: Mesh, samples: int) -> dict[str, float]:
        far = float(level.positions.max()) > 1.5  # the one that was moved away: no slide at all
        return dict.fromkeys(("uv_shift_p99", "uv_shift_max"), 0.0 if far else 0.5)

    def moved(mesh: Mesh, target: int, *, uv_weight: float = 1.0, **more: Any) -> Simplified:
        level = simplify(mesh, target, **more)
        if uv_weight == 1.0:
            return level
        tried.append(uv_weight)
        away = level.mesh.positions + np.float32([1, 0, 0])
        return replace(level, mesh=replace(level.mesh, positions=away))

    monkeypatch.setattr("paradize.bakers.mesh.lods.uv_shift", slid)
    monkeypatch.setattr("paradize.bakers.mesh.lods.simplify", moved)
    steps, _ = make_levels(sphere(12), Plan(count=2, limit=0.05), "balanced")
    assert tried and len(steps) == 2 and steps[1].errors["error_max"] <= 0.05

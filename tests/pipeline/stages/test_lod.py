"""Levels of detail: fewer triangles, seams closed, thin parts kept, errors measured, reasons told."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.mesh.bake import bake_mesh
from paradize.data import Group, Mesh
from paradize.errors import BakeError, SourceError
from paradize.formats.glb.reader import decode_glb
from paradize.metrics.surface import Original
from paradize.stages.lod import simplify
from paradize.stages.validate import validate_mesh
from paradize.tiers import SEAM_SIMPLIFIERS, TIERS
from tests.pipeline.shapes import grid, sphere
from tests.sweeps import sweep, tries


def areas(mesh: Mesh) -> np.ndarray:
    p = mesh.positions[mesh.triangles].astype(float)
    return 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)


@pytest.mark.parametrize("tier", sweep(TIERS, test=["balanced"]))
def test_every_level_has_fewer_triangles_and_stays_near(tmp_path: Path, tier: str) -> None:
    mesh = sphere(20)
    levels = bake_mesh(write_obj(tmp_path / "ball.obj", mesh), tier=tier).lods
    counts = [len(level.mesh.triangles) for level in levels]
    assert len(levels) == 4 and counts == sorted(counts, reverse=True)
    for level, most in zip(levels[1:], (0.004, 0.01, 0.03), strict=True):
        assert Original(mesh).distance(level.mesh, 5000)["error_max"] < most
    assert counts[3] < 0.15 * counts[0]


@pytest.mark.parametrize("method", SEAM_SIMPLIFIERS)
def test_a_mesh_that_cannot_lose_triangles_says_what_holds_them(method: str) -> None:
    """Ten triangles that share no edge: each is a part that would vanish."""
    positions = np.zeros((30, 3), np.float32)
    positions[:, 0] = np.repeat(np.arange(10), 3) * 2.0
    positions[1::3, 0] += 1.0
    positions[2::3, 2] = -1.0
    normals = np.tile(np.array([0, 1, 0], np.float32), (30, 1))
    mesh = Mesh(positions, np.arange(30, dtype=np.uint32).reshape(10, 3), normals=normals)
    note = simplify(mesh, 4, method).note
    assert note.startswith("10 triangles where 4 were asked: ")
    assert note.endswith(("hold the rest", "belong to parts that would vanish"))


@pytest.mark.parametrize("method", SEAM_SIMPLIFIERS)
def test_a_texture_seam_stays_closed_and_the_texture_stays_in_place(method: str) -> None:
    mesh = sphere(24)
    level = simplify(mesh, len(mesh.triangles) // 4, method).mesh
    _, report = validate_mesh(level)
    assert report.topology.border.count == 0
    assert level.uvs is not None
    p = level.positions.astype(float)
    p /= np.linalg.norm(p, axis=1)[:, None]
    u = (np.degrees(np.arctan2(-p[:, 2], p[:, 0])) / 360) % 1.0
    v = np.degrees(np.arccos(np.clip(p[:, 1], -1, 1))) / 180
    away = np.abs(p[:, 1]) < 0.9
    slid = np.abs(level.uvs[:, 0] - u)
    assert np.minimum(slid, 1 - slid)[away].max() < 0.02
    assert np.abs(level.uvs[:, 1] - v)[away].max() < 0.02
    spans = level.uvs[level.triangles][:, :, 0]
    assert (spans.max(axis=1) - spans.min(axis=1)).max() <= 0.5


@pytest.mark.parametrize("method", SEAM_SIMPLIFIERS)
def test_borders_between_materials_stay_closed_and_triangles_keep_their_material(method: str) -> None:
    mesh = grid(16, height=0.05)
    half = mesh.positions[mesh.triangles][:, :, 0].mean(axis=1) > 0.5
    triangles = np.concatenate([mesh.triangles[~half], mesh.triangles[half]])
    count = int((~half).sum())
    mesh = replace(
        mesh,
        triangles=triangles,
        groups=(Group("a", "left", 0, count), Group("b", "right", count, len(half) - count)),
    )
    level = simplify(mesh, len(half) // 4, method).mesh
    assert [group.material for group in level.groups] == ["left", "right"]
    _, report = validate_mesh(level)
    assert report.topology.components == 1
    for group in level.groups:
        x = level.positions[level.triangles[group.first : group.first + group.count]][:, :, 0].mean(axis=1)
        assert (x < 0.55).all() if group.material == "left" else (x > 0.45).all()


@pytest.mark.parametrize("method", SEAM_SIMPLIFIERS)
def test_an_open_border_stays_where_it_is(method: str) -> None:
    mesh = grid(24)
    level = simplify(mesh, len(mesh.triangles) // 8, method).mesh
    assert areas(level).sum() == pytest.approx(1, rel=1e-5)
    assert np.allclose(level.positions.min(axis=0), [0, 0, 0], rtol=0, atol=1e-7)
    assert np.allclose(level.positions.max(axis=0), [1, 0, 1], rtol=0, atol=1e-7)


def cards(count: int) -> Mesh:
    one = grid(2)
    assert one.uvs is not None and one.normals is not None
    rng = np.random.default_rng(3)
    places = rng.random((count, 1, 3)) * 20
    return Mesh(
        (one.positions[None] + places).reshape(-1, 3).astype(np.float32),
        (one.triangles[None] + np.arange(count)[:, None, None] * 9).reshape(-1, 3).astype(np.uint32),
        normals=np.tile(one.normals, (count, 1)),
        uvs=np.tile(one.uvs, (count, 1)),
        groups=(Group("leaves", "leaf", 0, count * 8),),
    )


@pytest.mark.parametrize("method", SEAM_SIMPLIFIERS)
def test_leaf_cards_do_not_vanish(tmp_path: Path, method: str) -> None:
    mesh = cards(200)
    baked = [level.mesh for level in bake_mesh(write_obj(tmp_path / "cards.obj", mesh)).lods]
    assert len(baked) > 1
    for level in [*baked, simplify(mesh, len(mesh.triangles) // 4, method).mesh]:
        found = validate_mesh(level)[1].topology
        assert len(np.unique(found.island)) == 200
        assert areas(level).sum() > 0.45 * areas(mesh).sum()


@pytest.mark.parametrize("method", SEAM_SIMPLIFIERS)
def test_where_every_face_is_an_island_of_the_texture_no_triangle_reaches_over_two(
    tmp_path: Path, method: str
) -> None:
    ball = sphere(12)
    count, cells = len(ball.triangles), 32
    corner = np.array([[0.2, 0.2], [0.8, 0.2], [0.2, 0.8]])
    cell = np.stack([np.arange(count) % cells, np.arange(count) // cells], axis=1)
    assert ball.normals is not None
    apart = Mesh(
        ball.positions[ball.triangles].reshape(-1, 3),
        np.arange(3 * count, dtype=np.uint32).reshape(-1, 3),
        normals=ball.normals[ball.triangles].reshape(-1, 3),
        uvs=((cell[:, None] + corner) / cells).reshape(-1, 2).astype(np.float32),
        groups=(Group("ball", "skin", 0, count),),
    )
    level = simplify(apart, count // 3, method)
    assert len(level.mesh.triangles) < 0.4 * count and level.seams_kept == (method == "paradize")
    assert level.mesh.uvs is not None
    found = level.mesh.uvs[level.mesh.triangles] * cells
    assert (np.floor(found) == np.floor(found[:, :1])).all()
    assert ((found % 1 > 0.19) & (found % 1 < 0.81)).all()
    _, report = validate_mesh(level.mesh)
    assert report.topology.border.count == 0
    made = bake_mesh(write_obj(tmp_path / "apart.obj", apart))
    assert not any("stretched beside them" in warning for warning in made.report["warnings"])
    assert made.report["lods"][-1]["uv_shift_max"] > 0
    assert simplify(ball, count // 3, method).seams_kept


def test_a_chain_that_cannot_go_on_says_why(tmp_path: Path) -> None:
    (tmp_path / "lone.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    made = bake_mesh(tmp_path / "lone.obj")
    assert len(made.lods) == 1
    assert any("no level after lod0: few enough triangles: 1" in text for text in made.report["warnings"])


@pytest.mark.parametrize("method", SEAM_SIMPLIFIERS)
@pytest.mark.parametrize(("scale", "offset"), [(1e-20, 0.0), (1e20, 0.0), (1.0, 1e5)])
def test_size_and_place_change_little(method: str, scale: float, offset: float) -> None:
    mesh = sphere(16)
    moved = replace(mesh, positions=(mesh.positions * np.float32(scale) + np.float32(offset)))
    level = simplify(moved, 400, method).mesh
    assert len(level.triangles) <= 440
    assert Original(moved).distance(level, 3000)["error_max"] < 0.02


def test_an_unknown_method_is_an_error() -> None:
    with pytest.raises(BakeError, match="no simplifier 'best'; use one of paradize"):
        simplify(sphere(4), 10, "best")


@given(st.integers(0, 2**32 - 1), st.sampled_from(SEAM_SIMPLIFIERS), st.floats(0.05, 0.95))
@settings(max_examples=tries(25), deadline=None)
def test_any_triangles_are_simplified_or_left(seed: int, method: str, ratio: float) -> None:
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 4, (30, 3)).astype(np.float32)
    raw = Mesh(
        points,
        rng.integers(0, 30, (80, 3)).astype(np.uint32),
        normals=np.tile(np.array([0, 0, 1], np.float32), (30, 1)),
        uvs=rng.random((30, 2)).astype(np.float32),
    )
    try:
        mesh, _ = validate_mesh(raw)
    except SourceError:
        return
    level = simplify(mesh, max(1, int(len(mesh.triangles) * ratio)), method).mesh
    assert 0 < len(level.triangles) <= len(mesh.triangles)
    assert int(level.triangles.max()) < len(level.positions) and np.isfinite(level.positions).all()


# --- bake_mesh ---


def write_obj(path: Path, mesh: Mesh) -> Path:
    assert mesh.uvs is not None and mesh.normals is not None
    rows = ["mtllib none.mtl"]
    rows += [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.positions.astype(float).tolist()]
    rows += [f"vt {u!r} {1 - v!r}" for u, v in mesh.uvs.astype(float).tolist()]
    rows += [f"vn {x!r} {y!r} {z!r}" for x, y, z in mesh.normals.astype(float).tolist()]
    rows += ["f " + " ".join(f"{i}/{i}/{i}" for i in face) for face in (mesh.triangles + 1).tolist()]
    path.write_text("\n".join(rows) + "\n")
    return path


def test_a_baked_file_holds_what_its_report_says(tmp_path: Path) -> None:
    mesh = sphere(16)
    made = bake_mesh(write_obj(tmp_path / "ball.obj", mesh))
    levels = decode_glb(made.glb)
    assert made.report["triangles"] == len(mesh.triangles)
    assert [len(level.mesh.triangles) for level in levels] == [
        entry["triangles"] for entry in made.report["lods"]
    ]
    assert len(levels) == 4
    assert made.report["lods"][0]["error_max"] == 0
    for level, entry in zip(levels[1:], made.report["lods"][1:], strict=True):
        found = Original(levels[0].mesh).distance(level.mesh, 20000)
        assert found["error_rms"] == pytest.approx(entry["error_rms"], rel=0.05)
        assert entry["error_rms"] <= entry["error_p99"] <= entry["error_max"]
        assert level.error_max == entry["error_max"] > 0
        assert level.mesh.tangents is not None
    assert any("none.mtl" in warning for warning in made.report["warnings"])


def test_level_0_keeps_the_positions_of_the_source(tmp_path: Path) -> None:
    mesh = sphere(8, radius=0.1, offset=(1 / 3, 7.7, -1e-3))
    made = bake_mesh(write_obj(tmp_path / "ball.obj", mesh))
    found = decode_glb(made.glb)[0].mesh
    triangles = [
        sorted(min(np.roll(t, -k, 0).tolist() for k in range(3)) for t in m.absolute_positions[m.triangles])
        for m in (found, mesh)
    ]  # the draw order is free
    assert triangles[0] == triangles[1]


def test_no_level_exceeds_the_asked_error(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "ball.obj", sphere(16))
    made = bake_mesh(path, max_error=0.012)
    assert all(entry["error_max"] <= 0.012 for entry in made.report["lods"])
    assert len(made.report["lods"]) >= 2
    assert any(entry["error_max"] > 0.012 for entry in bake_mesh(path).report["lods"])
    exact = bake_mesh(path, max_error=0.0)
    assert len(exact.report["lods"]) == 1
    assert any("limit 0" in warning for warning in exact.report["warnings"])


def test_one_lod_is_the_source_alone(tmp_path: Path) -> None:
    made = bake_mesh(write_obj(tmp_path / "ball.obj", sphere(4)), lods=1)
    assert len(decode_glb(made.glb)) == 1


def test_materials_become_one_run_each_in_every_level(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "ball.obj", sphere(12))
    lines = path.read_text().splitlines()
    mixed = []
    for at, line in enumerate(lines):
        mixed += [f"usemtl {'wood' if at // 40 % 2 else 'iron'}", line] if line.startswith("f ") else [line]
    path.write_text("\n".join(mixed))
    made = bake_mesh(path)
    for level in decode_glb(made.glb):
        assert sorted(group.material for group in level.mesh.groups) == ["iron", "wood"]


def test_the_same_source_gives_the_same_bytes(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "ball.obj", sphere(10))
    assert bake_mesh(path).glb == bake_mesh(path).glb


@pytest.mark.deep
def test_the_same_bytes_come_from_a_lesser_processor(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "ball.obj", sphere(10))
    script = (
        "import hashlib, pathlib, sys; from paradize.bakers.mesh.bake import bake_mesh;"
        "print([hashlib.sha256(bake_mesh(pathlib.Path(sys.argv[1]), tier=t).glb).hexdigest()"
        " for t in ('fast', 'balanced')])"
    )
    lesser = {
        "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA",
    }
    found = [
        subprocess.run(
            [sys.executable, "-W", "error", "-c", script, str(path)],
            env={**os.environ, **more},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for more in ({}, lesser)
    ]
    assert found[0] == found[1] and len(found[0]) > 128


def test_a_tier_that_is_not_there_is_told(tmp_path: Path) -> None:
    made = bake_mesh(write_obj(tmp_path / "ball.obj", sphere(6)), tier="auto")
    assert made.report["tier"] == "balanced"
    assert any("'auto'" in warning for warning in made.report["warnings"])

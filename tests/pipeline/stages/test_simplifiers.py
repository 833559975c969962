"""Simplifiers by name: what each keeps, what it refuses and in which words, the same bytes on each run."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from paradize.bakers.mesh.bake import bake_mesh
from paradize.bakers.mesh.lods import Plan, make_levels
from paradize.data import Group
from paradize.errors import BakeError
from paradize.kernels import openmesh
from paradize.metrics.surface import Original
from paradize.stages.lod import simplifier_version, simplify
from paradize.stages.lod.positions import POSITIONS_ONLY, fast_simplify
from paradize.stages.validate import validate_mesh
from paradize.tiers import SEAM_SIMPLIFIERS, SIMPLIFIERS
from paradize.tradeoff.plan import FileOptions, file_groups
from paradize.tradeoff.timing import TrialGroup
from tests.pipeline.shapes import grid, sphere
from tests.pipeline.stages.test_lod import write_obj

needs_openmesh = pytest.mark.skipif(not openmesh.BUILT, reason="built without OpenMesh")
NAMES = [pytest.param(name, marks=needs_openmesh) if name == "openmesh" else name for name in SIMPLIFIERS]
LIBRARIES = [name for name in NAMES if name not in SEAM_SIMPLIFIERS]


@pytest.mark.parametrize("name", NAMES)
def test_each_makes_levels_that_are_measured_and_named(tmp_path: Path, name: str) -> None:
    made = bake_mesh(write_obj(tmp_path / "ball.obj", sphere(20)), simplifier=name)
    assert (made.report["simplifier"], made.report["simplifier_version"]) == (name, simplifier_version(name))
    assert (made.report["simplifier_version"] is None) == (name == "paradize")
    counts = [level["triangles"] for level in made.report["lods"]]
    assert len(counts) == 4 and counts == sorted(counts, reverse=True)
    for lod, report in zip(made.lods[1:], made.report["lods"][1:], strict=True):
        mesh = lod.mesh
        assert mesh.uvs is not None and mesh.normals is not None and mesh.tangents is not None
        assert validate_mesh(mesh)[1].topology.border.count == 0
        # An independent, sampled distance lies inside the bounds that are told.
        found = Original(made.lods[0].mesh).distance(mesh, 5000)["error_max"]
        assert 0 < found <= 1.01 * report["error_max"] < 0.1
        assert report["normal_mean_deg"] < 15
        assert report["uv_shift_p99"] < 0.05 or name in POSITIONS_ONLY


@pytest.mark.parametrize(
    "name",
    [
        *SEAM_SIMPLIFIERS,
        pytest.param("fast-simplification", marks=pytest.mark.deep),
        pytest.param("openmesh", marks=[pytest.mark.deep, needs_openmesh]),
    ],
)
def test_each_gives_the_same_bytes_for_any_threads_and_runs(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_obj(tmp_path / "ball.obj", sphere(16))
    made = []
    for threads in ("1", "3", "3"):
        monkeypatch.setenv("PARADIZE_THREADS", threads)
        made.append(bake_mesh(path, simplifier=name).glb)
    assert made[0] == made[1] == made[2]


@pytest.mark.deep
def test_each_makes_another_mesh(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "ball.obj", sphere(16))
    names = [name for name in SIMPLIFIERS if name != "openmesh" or openmesh.BUILT]
    assert len({bake_mesh(path, simplifier=name).glb for name in names}) == len(names)


@pytest.mark.parametrize("name", LIBRARIES)
@pytest.mark.parametrize(("scale", "offset"), [(1e-6, 0.0), (1.0, 5.0), (1e6, 5.0)])
def test_neither_size_nor_place_matters_to_a_library(name: str, scale: float, offset: float) -> None:
    ball = sphere(16)
    moved = replace(ball, positions=(ball.positions + np.float32(offset)) * np.float32(scale))
    target = len(ball.triangles) // 4
    level = simplify(moved, target, name).mesh
    assert len(level.triangles) <= 1.1 * target
    assert Original(moved).distance(level, 5000)["error_max"] < 0.02


@pytest.mark.parametrize("name", LIBRARIES)
def test_texture_coordinates_are_taken_from_the_source_and_seams_are_told(name: str) -> None:
    steps, notes = make_levels(sphere(24), Plan(count=2, simplifier=name), "balanced")
    assert not steps[1].seams_kept and steps[1].errors["uv_shift_p99"] > 0
    assert any(
        "seams were not kept, so the texture is stretched beside them" in note
        and "'paradize' to keep" in note
        for note in notes
    )
    bare, notes = make_levels(replace(sphere(24), uvs=None), Plan(count=2, simplifier=name), "balanced")
    assert bare[1].mesh.uvs is None and not [note for note in notes if "seams" in note]


@needs_openmesh
def test_openmesh_moves_no_vertex() -> None:
    ball = sphere(16)
    level = simplify(ball, len(ball.triangles) // 4, "openmesh").mesh
    known = {tuple(place) for place in np.round(ball.positions.astype(float), 6).tolist()}
    assert {tuple(place) for place in np.round(level.positions.astype(float), 6).tolist()} <= known


@pytest.mark.parametrize("name", LIBRARIES)
def test_several_materials_are_refused(tmp_path: Path, name: str) -> None:
    mesh = grid(8, height=0.1)
    half = len(mesh.triangles) // 2
    groups = (Group("a", "left", 0, half), Group("b", "right", half, len(mesh.triangles) - half))
    path = write_obj(tmp_path / "two.obj", mesh)
    lines = path.read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("f "))
    lines[first + half : first + half] = ["usemtl right"]
    lines[first:first] = ["usemtl left"]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(BakeError, match=rf"two.obj: simplifier: 2 materials.*{name}.*take the simplifier"):
        bake_mesh(path, simplifier=name)
    with pytest.raises(BakeError, match="2 materials"):
        simplify(replace(mesh, groups=groups), half, name)


@needs_openmesh
def test_openmesh_refuses_what_is_no_manifold(tmp_path: Path) -> None:
    path = tmp_path / "fin.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n")
    what = r"fin.obj: simplifier: .* not a manifold: .* of its 3 triangles; take"
    with pytest.raises(BakeError, match=what):
        bake_mesh(path, simplifier="openmesh")
    assert bake_mesh(path, simplifier="meshoptimizer").lods


def test_an_unknown_name_is_refused(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "ball.obj", sphere(4))
    with pytest.raises(BakeError, match=r"ball.obj: no simplifier 'magic'; use one of paradize, mesho"):
        bake_mesh(path, simplifier="magic")


@pytest.mark.parametrize(
    ("found", "kept", "what"),
    [
        ([[np.nan, 0, 0]] * 3, [[0, 1, 2]], "not finite"),
        (np.eye(3), [[0, 1, 3]], "indices beyond its 3 vertices"),
        (np.eye(3), [[0, -1, 2]], "indices beyond its 3 vertices"),
    ],
)
def test_what_a_library_returns_is_looked_at(
    monkeypatch: pytest.MonkeyPatch, found: Any, kept: Any, what: str
) -> None:
    broken = SimpleNamespace(simplify=lambda *_, **__: (np.array(found, float), np.array(kept)))
    monkeypatch.setitem(sys.modules, "fast_simplification", broken)
    with pytest.raises(BakeError, match=what):
        fast_simplify(np.eye(3), np.array([[0, 1, 2]], np.uint32), 1)


def test_a_triangle_that_names_a_vertex_twice_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    folded = SimpleNamespace(simplify=lambda *_, **__: (np.eye(3), np.array([[0, 1, 2], [0, 1, 1]])))
    monkeypatch.setitem(sys.modules, "fast_simplification", folded)
    _, triangles = fast_simplify(np.eye(3), np.array([[0, 1, 2]], np.uint32), 1)
    assert triangles.tolist() == [[0, 1, 2]]


def test_tier_exact_is_ours_alone(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "ball.obj", sphere(8))
    report = bake_mesh(path, tier="exact", simplifier="meshoptimizer").report
    assert report["tier"] == "balanced" and any("no tier 'exact'" in text for text in report["warnings"])


@pytest.mark.deep
def test_measure_has_a_point_of_each_that_can_do_the_source(tmp_path: Path) -> None:
    whole = write_obj(tmp_path / "ball.obj", sphere(8))

    def levels_of(path: Path) -> TrialGroup:
        return next(group for group in file_groups(path, FileOptions()) if "surface_max" in group.metrics)

    levels = levels_of(whole)
    built = set() if openmesh.BUILT else {"openmesh"}
    assert {one.tier for one in levels.trials} == {"balanced", "exact", *SIMPLIFIERS[1:]} - built
    assert {one.tier: one.series for one in levels.trials}["meshoptimizer"] == "meshoptimizer"
    assert not [one.tier for one in levels.trials if one.tier in SIMPLIFIERS and one.row is not None]
    for one in levels.trials[2:]:
        found = one.call(**one.arguments, runs=1)
        assert found.levels[1]["surface_max"] > 0 and found.bytes and found.seconds
    fin = tmp_path / "fin.obj"
    fin.write_text(whole.read_text() + "v 3 0 0\nv 4 0 0\nv 3 1 0\nv 3 0 1\nv 3 -1 0\n"
                   "f -5/1 -4/2 -3/3\nf -5/1 -4/2 -2/3\nf -5/1 -4/2 -1/3\n")  # fmt: skip
    levels = levels_of(fin)
    assert "openmesh" not in {one.tier for one in levels.trials}
    assert not openmesh.BUILT or "openmesh cannot do it: the surface is not a manifold" in levels.note


def test_the_command_line_takes_the_name_and_tells_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from paradize.cli.main import main

    path = write_obj(tmp_path / "ball.obj", sphere(8))
    out = tmp_path / "ball.glb"
    assert main(["mesh", str(path), "-o", str(out), "--simplifier", "meshoptimizer", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["simplifier"] == "meshoptimizer" and report["simplifier_version"]


def test_tier_auto_takes_no_other_simplifier_than_the_one_that_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from paradize.cli.main import main

    path = write_obj(tmp_path / "ball.obj", sphere(8))
    for name in SEAM_SIMPLIFIERS:
        more = ["--tier", "auto", "--budget", "surface_max=0.2", "--simplifier", name]
        assert main(["mesh", str(path), "-o", str(tmp_path / "ball.glb"), *more, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["simplifier"] == name

"""Unwrappers by name: sound layouts of any mesh, one message where xatlas is missing, the same bytes."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import PackageNotFoundError
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from paradize.bakers.mesh.atlas import with_atlas
from paradize.bakers.mesh.bake import bake_mesh
from paradize.data import Mesh
from paradize.errors import BakeError, ParadizeError
from paradize.metrics.atlas import atlas_quality
from paradize.stages.atlas import make_atlas
from paradize.stages.unwrappers import unwrapper_version, xatlas_charts
from paradize.tiers import UNWRAPPERS
from paradize.tradeoff.plan import FileOptions, file_groups
from tests.pipeline.bakers.mesh.test_atlas import bare, bumpy, cards, moebius, require_sound, rough
from tests.pipeline.shapes import cube, grid, soup, sphere
from tests.pipeline.stages.test_lod import write_obj
from tests.sweeps import sample, sweep

needs_xatlas = pytest.mark.skipif(unwrapper_version("xatlas") is None, reason="xatlas is not installed")
FIN = soup([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, -1, 0)], [(0, 1, 2), (0, 1, 3), (0, 1, 4)])
ONE = soup([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])


def unwrapped(mesh: Mesh) -> Mesh:
    return make_atlas(mesh, unwrapper="xatlas")


def two_sizes() -> Mesh:
    """A ball, and another of a ten-thousandth of its size."""
    ball = bare(sphere(12))
    points = np.concatenate([ball.positions, ball.positions * np.float32(1e-4) + np.float32(3)])
    faces = np.concatenate([ball.triangles, ball.triangles + len(ball.positions)])
    return Mesh(points, faces.astype(np.uint32))


def file_of(folder: Path, mesh: Mesh) -> Path:
    """The mesh as an OBJ without texture coordinates."""
    path = folder / "bare.obj"
    rows = ["v {!r} {!r} {!r}".format(*row) for row in mesh.positions.astype(float).tolist()]
    rows += ["f {} {} {}".format(*face) for face in (mesh.triangles + 1).tolist()]
    path.write_text("\n".join(rows) + "\n")
    return path


@needs_xatlas
@pytest.mark.parametrize(
    "mesh",
    sample([
        *(cube(), moebius(), cards(300), cards(2), bare(grid(12, height=0.3)), bare(sphere(24)), ONE, FIN),
        *(two_sizes(), bumpy(24, 0.05, 1), rough(24, 0.2, 1)),
        soup([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2), (0, 1, 2), (2, 1, 0)]),
        Mesh(np.random.default_rng(2).normal(size=(900, 3)).astype(np.float32),
             np.arange(900, dtype=np.uint32).reshape(-1, 3)),
    ], every=4),
)  # fmt: skip
def test_xatlas_gives_every_kind_of_mesh_a_sound_layout_of_all_its_triangles(mesh: Mesh) -> None:
    made = unwrapped(mesh)
    require_sound(atlas_quality(made))
    assert np.array_equal(made.positions[made.triangles], mesh.positions[mesh.triangles])


@needs_xatlas
@pytest.mark.parametrize(
    ("scale", "offset"), sample(product([1e-30, 1e-6, 1.0, 1e9, 1e30], [0.0, 1e4]), every=9)
)
def test_neither_size_nor_place_matters_to_xatlas(scale: float, offset: float) -> None:
    ball = bare(sphere(6))
    moved = replace(ball, positions=(ball.positions + np.float32(offset)) * np.float32(scale))
    quality = atlas_quality(unwrapped(moved))
    require_sound(quality)
    assert quality["stretch"] < 1.05 and quality["packing"] > 0.4
    low, _, high = quality["texels_per_m"]
    assert 0 < low <= high < 1.6 * low


@needs_xatlas
def test_slivers_and_triangles_without_an_area_keep_the_rest_sound() -> None:
    box = cube()
    points = np.concatenate([box.positions, [[0.5, 0, 0], [0.5, 1e-6, 0]]]).astype(np.float32)
    faces = np.concatenate([box.triangles, [[0, 8, 4], [0, 4, 9]]]).astype(np.uint32)
    quality = atlas_quality(unwrapped(Mesh(points, faces)))
    assert (quality["overlap"], quality["flipped"], quality["near"]) == (0.0, 0, 0)
    for flat in ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 0, 0)] * 3):
        with pytest.raises(BakeError, match="no triangle has an area"):
            unwrapped(soup([(float(x), float(y), float(z)) for x, y, z in flat], [(0, 1, 2)]))


def test_what_is_no_mesh_stops_at_the_door(tmp_path: Path) -> None:
    points, faces = np.eye(3), np.array([[0, 1, 2]], np.uint32)
    for given in ((points * np.nan, faces), (points, faces + 1), (points, faces[:0])):
        with pytest.raises(BakeError, match="only sound meshes"):
            xatlas_charts(*given)
    path = file_of(tmp_path, ONE)
    path.write_text(path.read_text().replace("1.0", "nan", 1))
    with pytest.raises(ParadizeError, match=r"bare.obj.*(nan|finite)"):
        bake_mesh(path, atlas=True, unwrapper="xatlas")


@pytest.mark.deep
@needs_xatlas
def test_the_bytes_are_the_same_on_every_run_and_on_one_core(tmp_path: Path) -> None:
    path = file_of(tmp_path, rough(16, 0.1, 1))
    made = [bake_mesh(path, atlas=True, lods=1, unwrapper="xatlas").glb for _ in range(2)]
    if hasattr(os, "sched_setaffinity"):  # workers inherit it
        cores = os.sched_getaffinity(0)
        try:
            os.sched_setaffinity(0, {min(cores)})
            made.append(bake_mesh(path, atlas=True, lods=1, unwrapper="xatlas").glb)
        finally:
            os.sched_setaffinity(0, cores)
    assert len(set(made)) == 1
    assert made[0] != bake_mesh(path, atlas=True, lods=1).glb


@needs_xatlas
@pytest.mark.parametrize("name", sweep(UNWRAPPERS, test=["xatlas"]))
def test_the_report_names_the_unwrapper_and_measures_it(tmp_path: Path, name: str) -> None:
    report = bake_mesh(file_of(tmp_path, bare(sphere(8))), atlas=True, unwrapper=name).report
    assert report["unwrapper"] == name and (report["unwrapper_version"] is None) == (name == "paradize")
    assert report["layout"]["stretch"] < 1.1 and report["layout"]["texels_per_m"][0] > 0
    assert len(report["lods"]) > 1
    bare_report = bake_mesh(file_of(tmp_path, bare(sphere(8))), unwrapper=name).report
    assert bare_report["unwrapper"] is bare_report["layout"] is None


def pretending(uvs: Any, *, triangles: Any = None) -> Callable[..., Any]:
    """A module xatlas that returns these coordinates of the corners, one vertex each."""

    class Atlas:
        width = height = 1
        texels_per_unit = 1.0

        def add_mesh(self, positions: Any, indices: Any) -> None:
            self.indices = indices

        def generate(self, *_: Any) -> None:
            pass

        def __getitem__(self, _: int) -> tuple[Any, Any, Any]:
            return None, self.indices if triangles is None else triangles, np.array(uvs, np.float32)

    return SimpleNamespace(  # type: ignore[return-value]
        Atlas=Atlas, PackOptions=SimpleNamespace, ChartOptions=SimpleNamespace
    )


SQUARE = soup([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)])


@pytest.mark.parametrize(
    ("uvs", "triangles", "what"),
    [
        ([[np.nan, 0]] * 4, None, "not finite"),
        ([[0, 0]] * 4, np.zeros((3, 3), np.uint32), "3 triangles for 2"),
        ([[0, 0]] * 4, np.full((2, 3), 9, np.uint32), "2 triangles for 2"),
    ],
)
def test_what_xatlas_returns_is_looked_at(
    monkeypatch: pytest.MonkeyPatch, uvs: Any, triangles: Any, what: str
) -> None:
    monkeypatch.setitem(sys.modules, "xatlas", pretending(uvs, triangles=triangles))
    with pytest.raises(BakeError, match=what):
        xatlas_charts(SQUARE.positions.astype(float), SQUARE.triangles)


def test_mirrored_charts_are_turned_and_triangles_left_out_are_laid_flat(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for uvs in ([[0, 0], [-1, 0], [-1, 1], [0, 1]], [[0, 0]] * 4, [[0, 0], [1, 0], [1, 1], [0, 0]]):
        monkeypatch.setitem(sys.modules, "xatlas", pretending(uvs))
        chart, corners, count = xatlas_charts(SQUARE.positions.astype(float), SQUARE.triangles)
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        assert (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > 0).all()
        assert count == len(set(chart.tolist())) == (1 if len({tuple(uv) for uv in uvs}) == 4 else 2)


def test_triangles_that_meet_in_an_edge_of_three_are_charts_of_their_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "xatlas", pretending([[0, 0], [1, 0], [0, 1], [0.5, 0.5], [0, -1]]))
    assert xatlas_charts(FIN.positions.astype(float), FIN.triangles)[2] == 3


def test_charts_that_lie_over_themselves_are_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A fan of 8 triangles that xatlas is made to wind twice round its middle."""
    monkeypatch.setattr("paradize.stages.unwrappers.version", lambda _: "0")
    monkeypatch.setattr(
        "paradize.bakers.mesh.atlas.call_isolated", lambda _, call, given, **__: call(**given)
    )
    ring = np.arange(9) * (2 * np.pi / 8)
    points = np.concatenate([[[0, 0, 0]], np.stack([np.cos(ring), np.sin(ring), ring / 9], axis=1)])
    fan = Mesh(points.astype(np.float32), np.array([(0, k + 1, k + 2) for k in range(8)], np.uint32))
    for turns, sound in ((1, True), (2, False)):
        wound = np.concatenate([[[0, 0]], np.stack([np.cos(turns * ring), np.sin(turns * ring)], axis=1)])
        monkeypatch.setitem(sys.modules, "xatlas", pretending(wound))
        if sound:
            assert with_atlas(fan, tmp_path / "a.obj", "balanced", "xatlas")[1]
            continue
        with pytest.raises(
            BakeError, match=r"a.obj: the atlas of xatlas is not sound.*twice; take .*'paradize"
        ):
            with_atlas(fan, tmp_path / "a.obj", "balanced", "xatlas")


def test_where_xatlas_is_missing_one_message_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def missing(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr("paradize.stages.unwrappers.version", missing)
    path = file_of(tmp_path, cube())
    with pytest.raises(BakeError, match=r"bare.obj: unwrapper: xatlas is not installed; .*take .*'paradize'"):
        bake_mesh(path, atlas=True, unwrapper="xatlas")
    layouts = next(group for group in file_groups(path, FileOptions()) if group.stage == "atlas")
    assert "xatlas" not in {one.tier for one in layouts.trials} and "not installed" in layouts.note
    with pytest.raises(BakeError, match=r"no unwrapper 'magic'; use one of paradize, xatlas"):
        bake_mesh(path, atlas=True, unwrapper="magic")


@pytest.mark.deep
@needs_xatlas
def test_measure_has_a_point_of_each(tmp_path: Path) -> None:
    layouts = next(
        group for group in file_groups(file_of(tmp_path, cube()), FileOptions()) if group.stage == "atlas"
    )
    assert [one.tier for one in layouts.trials] == ["fast", "balanced", "exact", "xatlas"]
    assert layouts.trials[3].series == "xatlas" and layouts.trials[3].row is None
    for one in layouts.trials:
        (found,) = one.call(**one.arguments, runs=1).levels
        assert found["atlas_seam_length"] > 0 and found["atlas_stretch"] == pytest.approx(1, abs=1e-3)


def test_measure_has_layouts_of_a_model_whose_own_lies_over_itself_as_mesh_makes_one(tmp_path: Path) -> None:
    ball = sphere(8)
    assert ball.uvs is not None
    folded = replace(ball, uvs=np.abs(ball.uvs - np.float32(0.5)))
    for mesh, made in ((folded, True), (ball, False)):
        path = write_obj(tmp_path / "ball.obj", mesh)
        assert (bake_mesh(path, atlas=True, lods=1).report["layout"] is not None) == made
        assert ("atlas" in {group.stage for group in file_groups(path, FileOptions())}) == made


@pytest.mark.deep
@needs_xatlas
def test_the_command_line_makes_a_layout_by_the_one_that_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from paradize.cli.main import main

    plain, painted = file_of(tmp_path, cube()), write_obj(tmp_path / "ball.obj", sphere(8))
    for path, more, unwrapper in (
        (plain, ["--unwrapper", "xatlas"], "xatlas"),
        (plain, ["--atlas"], "paradize"),
        (plain, [], None),
        (painted, ["--unwrapper", "xatlas"], None),
    ):
        assert main(["mesh", str(path), "-o", str(tmp_path / "out.glb"), *more, "--json"]) == 0
        report = json.loads(capsys.readouterr().out)
        assert report["unwrapper"] == unwrapper
    assert any("no atlas made" in text for text in report["warnings"])

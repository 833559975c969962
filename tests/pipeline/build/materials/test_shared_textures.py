"""Textures that turn out equal are published once, whichever objects and maps use them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import paradize.build.tasks
from paradize.artifact import Artifact
from paradize.build.bake import bake
from paradize.build.materials.shared_textures import equal_textures
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.checks import CheckOptions, check_paths
from paradize.explain.facts import explain
from paradize.explain.words import overview
from paradize.export.scene import export
from paradize.scene.budget import METRICS
from paradize.scene.map_sets import MapSet, SceneMaps
from tests.pipeline.material_scene import make_panels, noise, squares
from tests.pipeline.scenes import write_image

HEAD = """
[scene]
name = "pair"
[budget]
color_psnr_db = 20.0
"""
OBJECT = """
[[object]]
name = "{name}"
mesh = "{name}.obj"
lods = 1
{more}
[[object.instance]]
position = [0.0, 0.0, {z}]
"""


@pytest.fixture(autouse=True)
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))


def scene_of(folder: Path, *objects: str) -> Path:
    text = make_panels(folder).read_text()
    write_image(folder / "tiles.png", noise(7, size=128))
    path = folder / "pair.toml"
    path.write_text(HEAD + "".join(objects) + text[text.index("[flight]") :])
    return path


def model(folder: Path, name: str, low: float, high: float) -> None:
    """An OBJ whose file and triangles are its own."""
    (folder / f"{name}.obj").write_text(f"# {name}\n" + squares(["wall"], "wall.mtl", low=low, high=high))


def baked(scene: Path, out: Path) -> tuple[BakeReport, dict[str, Any]]:
    report = bake(scene, out, BuildOptions(jobs=1))
    assert not report.errors, report.errors
    return report, json.loads((out / "scene.json").read_text())


@pytest.fixture
def two_of_one_layout(tmp_path: Path) -> Path:
    folder = tmp_path / "s"
    objects = [OBJECT.format(name=name, more="", z=z) for name, z in (("far", -60.0), ("near", 0.0))]
    path = scene_of(folder, *objects)
    (folder / "wall.mtl").write_text("newmtl wall\nmap_Kd tiles.png\n")
    for name in ("far", "near"):
        model(folder, name, 0.0, 1.0)
    return path


def test_equal_textures_of_two_layouts_are_one_file_as_fine_as_the_nearest_needs(
    two_of_one_layout: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    report, manifest = baked(two_of_one_layout, out)
    textures = {one.name: one.also for one in report.artifacts if one.kind == "texture"}
    assert textures == {"far_color": ["near_color"], "far_normal": ["near_normal"]}
    assert len(list(out.glob("*.ktx2"))) == 2
    walls = [item["materials"]["wall"]["maps"] for item in manifest["objects"]]
    assert [(maps["color"], maps["normal"]) for maps in walls] == [("far_color", "far_normal")] * 2
    artifact = manifest["artifacts"]["far_color"]
    assert artifact["also"] == ["near_color"] and artifact["required_detail"]["left_out"] == 0
    assert artifact["gutter"]["islands"] == 1 and artifact["errors"]["color_psnr_db"] > 30.0
    assert artifact["first_needed_s"] == 0.0
    assert not list(check_paths([out]))
    rows = {row[0]: row for row in overview(explain(two_of_one_layout, out=out))}
    assert rows["near_color"][2:] == ("no file", "is far_color", "-")
    assert export(out, tmp_path / "all.glb") is not None
    again, _ = baked(two_of_one_layout, out)
    assert [one.also for one in again.artifacts] == [one.also for one in report.artifacts]


def test_a_texture_that_became_shared_is_neither_gone_nor_new(
    two_of_one_layout: Path, tmp_path: Path
) -> None:
    mtl = two_of_one_layout.with_name("wall.mtl")
    near = two_of_one_layout.with_name("near.obj")
    whole = mtl.read_text()
    write_image(mtl.with_name("other.png"), noise(8, size=128))
    mtl.with_name("other.mtl").write_text(whole.replace("tiles", "other"))
    own = near.read_text()
    near.write_text(own.replace("wall.mtl", "other.mtl"))
    baked(two_of_one_layout, tmp_path / "apart")
    near.write_text(own)
    baked(two_of_one_layout, tmp_path / "shared")
    for now, was in (("shared", "apart"), ("apart", "shared")):
        found = check_paths([tmp_path / now], CheckOptions(against=tmp_path / was))
        assert not [finding for finding in found if finding.code == "PZ422"]


def test_a_waiver_of_a_shared_texture_names_the_file_that_stands_for_it(
    two_of_one_layout: Path, tmp_path: Path
) -> None:
    waiver = '[[waiver]]\nrule = "PZ401"\nartifact = "near_color"\nreason = "it is far"\nuntil = 2999-01-01\n'
    text = two_of_one_layout.read_text()
    two_of_one_layout.write_text(text.replace("color_psnr_db = 20.0", "color_psnr_db = 90.0", 1) + waiver)
    _, manifest = baked(two_of_one_layout, tmp_path / "out")
    assert manifest["check"]["waivers"][0]["artifact"] == "far_color"


def test_a_picture_that_is_colour_and_emission_is_one_file_with_the_errors_of_both(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    path = scene_of(folder, OBJECT.format(name="sign", more="", z=0.0))
    (folder / "wall.mtl").write_text("newmtl wall\nmap_Kd tiles.png\nKe 1 1 1\nmap_Ke tiles.png\n")
    model(folder, "sign", 0.0, 3.0)
    report, manifest = baked(path, tmp_path / "out")
    maps = manifest["objects"][0]["materials"]["wall"]["maps"]
    assert maps["color"] == maps["emission"] == "sign_color"
    one = next(one for one in report.artifacts if one.name == "sign_color")
    assert one.also == ["sign_emission"] and {"color_psnr_db", "emission_psnr_db"} <= one.errors.keys()
    assert all(metric in METRICS or metric.endswith("_max") for metric in one.errors)
    assert not list(check_paths([tmp_path / "out"]))


@pytest.mark.parametrize(
    "other",
    [{"sha256": "b" * 64}, {"max_level": 3}, {"gutter": None}, {"gutter": {"bound": 0.25}}],
    ids=["other bytes", "another coarsest level", "no layout", "another bound"],
)
def test_textures_that_are_sampled_in_other_ways_stay_apart(other: dict[str, Any]) -> None:
    one = Artifact("a_color", "texture", "ktx2", "a" * 64, max_level=2, gutter={"bound": 0.125})
    maps = SceneMaps(tuple(MapSet(name, {"x": ("wall",)}) for name in ("a", "b", "c")), {})
    known = {"a_color": one, "b_color": replace(one, name="b_color", **other), "c_color": one}
    assert equal_textures(maps, known) == [["a_color", "c_color"]]


def test_jobs_with_one_key_bake_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two sets of one picture, since one of the materials has normals beside it."""
    folder = tmp_path / "s"
    objects = [OBJECT.format(name=name, more="", z=0.0) for name in ("plain", "bumpy")]
    path = scene_of(folder, *objects)
    for name, more in (("plain", ""), ("bumpy", "norm wood_n.png\n")):
        (folder / f"{name}.mtl").write_text(f"newmtl wall\nmap_Kd tiles.png\n{more}")
        (folder / f"{name}.obj").write_text(squares(["wall"], f"{name}.mtl", low=0.0, high=3.0))
    ran: list[str] = []
    run = paradize.build.tasks.run_build_jobs

    def counted(options: Any, jobs: Any, on_outcome: Any = None) -> Any:
        ran.extend(job.name for job in jobs)
        return run(options, jobs, on_outcome)

    monkeypatch.setattr(paradize.build.tasks, "run_build_jobs", counted)
    report, _ = baked(path, tmp_path / "out")
    assert [name for name in ran if name.endswith("colour")] == ["plain colour"]
    color = next(one for one in report.artifacts if one.name == "plain_color")
    assert color.also == ["bumpy_color"] and color.status == "baked"

"""`occlusion = "mesh"`: who asks for it gets a map that is cast from the mesh, and nobody else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.checks import check_paths
from paradize.cli import main as cli
from paradize.explain.facts import explain
from paradize.explain.words import overview, render
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.texels import decode_texels
from tests.pipeline.material_scene import make_panels, noise
from tests.pipeline.scenes import write_image
from tests.pipeline.shapes import CORNER_OBJ

SCENE = """
[scene]
name = "corner"
[[object]]
name = "nook"
mesh = "corner.obj"
lods = 1
occlusion = "mesh"
occlusion_px = 64
[[object.instance]]
position = [0.0, 0.0, 0.0]
[flight]
duration_s = 4.0
eye = [{ position = [3, 1, 4] }, { position = [2, 1, 4] }, { position = [4, 2, 5] }]
target = [{ position = [0, 0.5, 0] }, { position = [0, 0.5, 0] }, { position = [0, 0.5, 0] }]
"""


@pytest.fixture(autouse=True)
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))


def make(folder: Path, *changes: tuple[str, str], obj: str = CORNER_OBJ) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "corner.obj").write_text(obj)
    text = SCENE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "corner.toml").write_text(text)
    return folder / "corner.toml"


def baked(scene: Path, out: Path, tier: str | None = None) -> tuple[BakeReport, dict[str, Any]]:
    report = bake(scene, out, BuildOptions(jobs=1, tier=tier))
    assert not report.errors, report.errors
    return report, json.loads((out / "scene.json").read_text())


def texels(out: Path, manifest: dict[str, Any], name: str) -> np.ndarray:
    file = out / manifest["artifacts"][name]["file"]
    return decode_texels(decode_ktx2(file.read_bytes(), file))


def test_a_model_without_any_picture_gets_its_occlusion(tmp_path: Path) -> None:
    scene = make(tmp_path / "s")
    _, manifest = baked(scene, tmp_path / "out")
    (item,) = manifest["objects"]
    assert {k: v for k, v in item["materials"]["stone"]["maps"].items() if v} == {
        "occlusion": "nook_occlusion"
    }
    artifact = manifest["artifacts"]["nook_occlusion"]
    assert 0.0 < artifact["errors"]["occlusion_cast_p99"] < 0.03
    shown = texels(tmp_path / "out", manifest, "nook_occlusion")
    assert shown.shape == (64, 64, 1)  # metalness takes no room
    assert shown.min() < 0.6 and shown.max() > 0.85
    assert not [one for one in check_paths([tmp_path / "out"]) if one.fails]
    (result,) = explain(scene, "nook_occlusion").artifacts
    assert "cast from the mesh" in result["reason"]


def test_who_does_not_ask_gets_none(tmp_path: Path) -> None:
    report, _ = baked(make(tmp_path / "s", ('occlusion = "mesh"\n', "")), tmp_path / "out")
    assert "nook_occlusion" not in {one.name for one in report.artifacts}


def test_what_no_pass_reads_is_not_baked(tmp_path: Path) -> None:
    """An object that casts shadows alone."""
    shadow = ("[flight]", "[shadow]\nextent_m = 20.0\n[flight]")
    scene = make(tmp_path / "s", ("lods = 1", 'lods = 1\nviews = ["shadow"]'), shadow)
    report, _ = baked(scene, tmp_path / "out")
    assert "nook_occlusion" not in {one.name for one in report.artifacts}


def test_metalness_stands_beside_the_occlusion(tmp_path: Path) -> None:
    metal = ("[[object.instance]]", '[object.material.stone]\nmetalness = "metal.png"\n[[object.instance]]')
    scene = make(tmp_path / "s", metal)
    write_image(scene.parent / "metal.png", noise(3, 1, 128))
    report, manifest = baked(scene, tmp_path / "out")
    message = [*report.warnings, *(text for one in report.artifacts for text in one.warnings)]
    assert not any("enlarged" in text for text in message)
    shown = texels(tmp_path / "out", manifest, "nook_occlusion")
    assert shown.shape == (128, 128, 2) and np.ptp(shown[:, :, 1]) > 0.3 and shown[:, :, 0].min() < 0.6


def test_a_wall_with_holes_holds_back_no_light(tmp_path: Path) -> None:
    mask = '[object.material.wall]\nalpha_mode = "mask"\nalpha_cutoff = 0.5\n[[object.instance]]'
    obj = CORNER_OBJ.replace("f 1/5", "usemtl wall\nf 1/5")
    darkest = {}
    for name, changes in (("solid", ()), ("holes", (("[[object.instance]]", mask),))):
        scene = make(tmp_path / name, *changes, obj=obj)
        _, manifest = baked(scene, tmp_path / f"out_{name}")
        floor = manifest["objects"][0]["materials"]["stone"]["maps"]["occlusion"]
        shown = texels(tmp_path / f"out_{name}", manifest, floor)[:, :24] if floor else np.ones(1)
        darkest[name] = float(shown.min())
    assert darkest["solid"] < 0.6 and darkest["holes"] == 1.0


def test_occlusion_is_cast_from_the_normals_that_are_drawn(tmp_path: Path) -> None:
    """Across the edge of floor and wall normals are smooth up to `crease_deg`."""
    cast = {}
    for crease in ("0", "180"):
        scene = make(tmp_path / crease, ("lods = 1", f"lods = 1\ncrease_deg = {crease}"))
        _, manifest = baked(scene, tmp_path / f"out_{crease}")
        cast[crease] = texels(tmp_path / f"out_{crease}", manifest, "nook_occlusion")
    assert np.abs(cast["0"] - cast["180"]).max() > 0.1


def test_a_drawn_occlusion_stays_and_others_get_theirs(tmp_path: Path) -> None:
    """wood and leaf of the panels bring none; metal does. The leaf has holes, and holds back no light."""
    scene = make_panels(tmp_path / "s")
    scene.write_text(scene.read_text().replace("lods = 1", 'lods = 1\nocclusion = "mesh"\nocclusion_px = 64'))
    _, manifest = baked(scene, tmp_path / "out")
    artifacts = manifest["artifacts"]
    assert "occlusion_cast_p99" not in artifacts["panel_metal_occlusion"]["errors"]
    assert "occlusion_cast_p99" in artifacts["panel_wood_occlusion"]["errors"]


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [("vt 0.95", "vt 3.95", "its UVs repeat"), ("vt ", "# ", "it has no texture coordinates")],
)
def test_without_a_place_for_each_texel_there_is_none_and_a_warning_says_why(
    tmp_path: Path, old: str, new: str, why: str
) -> None:
    obj = CORNER_OBJ.replace(old, new)
    if new == "# ":
        obj = "\n".join(" ".join(word.split("/")[0] for word in line.split()) for line in obj.splitlines())
    report, _ = baked(make(tmp_path / "s", obj=obj), tmp_path / "out")
    assert "nook_occlusion" not in {one.name for one in report.artifacts}
    assert any("no occlusion is cast" in text and why in text for text in report.warnings)


@pytest.mark.parametrize(("last", "taken"), [("1.03", True), ("3.95", False)])
def test_a_scene_and_maps_cast_the_same_models(
    tmp_path: Path, last: str, taken: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    """UVs a little wider than a tile are a layout; wider ones are not, and both say so in the same words."""
    scene = make(
        tmp_path / "s", obj=CORNER_OBJ.replace("vt 0.05", "vt -0.02").replace("vt 0.95", f"vt {last}")
    )
    report, _ = baked(scene, tmp_path / "out")
    words = ["maps", str(tmp_path / "s/corner.obj"), "-o", str(tmp_path / "maps"), "--only", "occlusion"]
    assert cli.main([*words, "--occlusion-px", "64"]) == (0 if taken else 1)
    assert taken == ("nook_occlusion" in {one.name for one in report.artifacts})
    why = "its UVs repeat (3.97 tiles wide, up to 1.1 are taken), so that a texel has no place of its own"
    assert taken or (why in capsys.readouterr().err and any(why in text for text in report.warnings))
    assert not list(check_paths([tmp_path / "out"]))


def test_explain_says_where_all_is_lit(tmp_path: Path) -> None:
    flat = "usemtl stone\nv 0 0 0\nv 1 0 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 3/3 2/2\n"
    scene = make(tmp_path / "s", obj=flat)
    baked(scene, tmp_path / "out")
    result = explain(scene, out=tmp_path / "out")
    (row,) = (row for row in overview(result) if row[0] == "nook_occlusion")
    assert row[2:4] == ("no file", "all texels 1")
    assert "all its texels are equal (1)" in render(result)


def test_auto_takes_the_cheapest_tier_inside_the_budget(tmp_path: Path) -> None:
    tiers = {}
    for limit in (0.2, 0.012):
        budget = ("[flight]", f"[budget]\nocclusion_cast_p99 = {limit}\n[flight]")
        scene = make(tmp_path / f"s{limit}", budget)
        _, manifest = baked(scene, tmp_path / f"out{limit}", "auto")
        tiers[limit] = manifest["artifacts"]["nook_occlusion"]["tier"]
    assert tiers == {0.2: "fast", 0.012: "exact"}

"""A budget that nothing measures cannot be kept: every command refuses it before it bakes."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.build.single_file import bake_single
from paradize.checks import check_paths
from paradize.errors import ParadizeError
from paradize.scene.baker_settings import BakerSettings, MapSettings, MeshSettings, TerrainSettings
from paradize.scene.budget import METRICS
from tests.pipeline.scenes import make_cove
from tests.pipeline.small_scenes import without_object

MAPS = MapSettings(strength=4.0)
MESH = MeshSettings(lods=2)
TERRAIN = TerrainSettings(size_m=(20.0, 20.0), height_m=4.0, max_error_m=0.1)


@pytest.mark.parametrize(
    ("kind", "file", "settings"),
    [
        ("maps", "wood.png", MAPS),
        ("maps", "wood.png", replace(MAPS, fmt="png")),
        *(("maps", "wood.png", replace(MAPS, only=[name])) for name in MAPS.only),
        ("mesh", "post.obj", MESH),
        ("mesh", "post.obj", replace(MESH, quantise={})),
        ("terrain", "height.png", TERRAIN),
        ("terrain", "height.png", replace(TERRAIN, quantise=True)),
    ],
)
def test_each_metric_is_measured_or_refused_before_anything_is_read(
    tmp_path: Path, kind: str, file: str, settings: BakerSettings
) -> None:
    make_cove(tmp_path)
    made = bake_single(kind, tmp_path / file, settings, tier="fast", budget={})
    measured = {metric for errors in made.errors.values() for metric in errors} & METRICS.keys()
    assert measured
    for metric in METRICS.keys() - measured:
        with pytest.raises(ParadizeError, match=f"--budget {metric}: nothing that this") as caught:
            bake_single(kind, tmp_path / "gone", settings, tier="auto", budget={metric: 0.0})
        assert all(name in str(caught.value) for name in measured)


def test_the_command_line_exits_1_and_writes_nothing(
    tmp_path: Path, paradize_here: Callable[..., Any]
) -> None:
    make_cove(tmp_path)
    for words in (
        ["maps", tmp_path / "wood.png", "-o", tmp_path / "out", "--budget", "color_psnr_db=30,folder_mb=1"],
        [
            "mesh",
            tmp_path / "post.obj",
            "-o",
            tmp_path / "out/a.glb",
            "--budget",
            "normal_p99_deg=3,gpu_mb=1",
        ],
    ):
        done = paradize_here(*words, "--json")
        errors = json.loads(done.stdout)["error"]
        assert done.returncode == 1 and len(errors) == 2 and not (tmp_path / "out").exists()
        assert all("--budget" in text and "cannot be kept" in text for text in errors)


def test_a_scene_refuses_a_budget_of_what_it_does_not_hold(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = make_cove(tmp_path / "scene")
    scene.write_text(scene.read_text() + "[budget]\nquantise_max = 0.1\nsurface_max = { soft = 1 }\n")
    with pytest.raises(ParadizeError, match=r"budget\.quantise_max: nothing in this scene measures it"):
        bake(scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("metric", ["folder_mb", "gpu_mb"])
def test_a_scene_of_more_bytes_than_its_budget_is_told_and_auto_bakes_none(
    tmp_path: Path, metric: str
) -> None:
    scene = without_object(make_cove(tmp_path / "scene"))
    text = scene.read_text()
    scene.write_text(f"{text}[budget]\n{metric} = 0.01\n")
    made = bake(scene, tmp_path / "out", BuildOptions(tier="fast"))
    assert not made.errors and any(text.startswith(f"scene: {metric} is") for text in made.warnings)
    (finding,) = [one for one in check_paths([tmp_path / "out"]) if one.metric == metric]
    assert any(finding.what == text for text in made.warnings), "check finds the same"
    auto = bake(scene, tmp_path / "auto", BuildOptions(tier="auto"))
    assert [f"budget.{metric}: {metric} is" in str(error) for error in auto.errors] == [True]
    assert not (tmp_path / "auto" / "scene.json").exists()
    scene.write_text(f"{text}[budget]\n{metric} = {{ soft = 0.01 }}\n")
    soft = bake(scene, tmp_path / "auto", BuildOptions(tier="auto"))
    assert not soft.errors and any("soft budget 0.01" in text for text in soft.warnings)

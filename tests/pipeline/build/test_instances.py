"""A table of instances is a source of the bake like any other."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from tests.pipeline.scenes import make_cove


def test_a_changed_table_of_instances_reaches_the_scene_without_baking_what_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = make_cove(tmp_path / "cove")
    table = scene.parent / "posts.csv"
    text = scene.read_text().replace("[[object]]", '[[object]]\ninstances = "posts.csv"')
    scene.write_text(text.replace("lods = 3", "lods = 1"))  # more are measured, which takes longer
    out = tmp_path / "out"
    found = []
    for text in ("x,y,z,pitch_deg,scale\n4,0,3,90,-2\n", "x,y,z,pitch_deg,scale\n4,0,3,180,-2\n"):
        table.write_text(text)
        report = bake(scene, out, BuildOptions())
        assert not report.errors
        found.append(json.loads((out / "scene.json").read_text())["objects"][0]["instances"])
        again = bake(scene, out, BuildOptions())
        assert not again.errors and all(one.status == "reused" for one in again.artifacts)
    assert len(found[0]) == len(found[1]) > 1
    assert found[0][:-1] == found[1][:-1]
    turns = [instances[-1]["rotation"] for instances in found]
    assert turns[0] == pytest.approx([0.5**0.5, 0, 0, 0.5**0.5]) and turns[1] == pytest.approx([1, 0, 0, 0])
    assert found[1][-1]["scale"] == [-2, -2, -2] and found[1][-1]["position"] == [4, 0, 3]
    assert report.artifacts and all(one.status == "reused" for one in report.artifacts if one.kind != "mesh")

"""Files that a model names are sources of the bake like the model."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from tests.pipeline.scenes import make_cove


def test_a_material_file_that_moves_uvs_bakes_the_mesh_and_its_maps_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = make_cove(tmp_path / "cove")
    scene.write_text(
        scene.read_text().replace("lods = 3", "lods = 1")
    )  # more are measured, which takes longer
    library, out = scene.parent / "post.mtl", tmp_path / "out"
    hashes = []
    for scale in ("1 1", "0.5 0.5", "1 1"):
        library.write_text(f"newmtl wood\nmap_Kd -s {scale} wood.png\n")
        report = bake(scene, out, BuildOptions())
        assert not report.errors
        artifacts = json.loads((out / "scene.json").read_text())["artifacts"]
        hashes.append({name: artifacts[name]["sha256"] for name in ("post_mesh", "post_color")})
        status = {one.name: one.status for one in report.artifacts}
        assert status["sand_color"] == ("baked" if len(hashes) == 1 else "reused")
    assert hashes[0] == hashes[2]  # from the store
    assert all(hashes[0][name] != hashes[1][name] for name in hashes[0])

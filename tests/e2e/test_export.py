"""The files of `paradize export` open elsewhere: the Khronos validator finds nothing, three.js flies along.

The picture of the poster's moment is left for a person in build/report/three/export.png.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.build.bake import bake
from paradize.export.scene import export
from tests.e2e.three import ExportPage, camera, three_page
from tests.pictures import save
from tests.pipeline.material_scene import make_panels
from tests.pipeline.scenes import make_cove
from tests.places import ROOT
from tests.sweeps import sweep

SIZE = (640, 360)
SECONDS = {"cove": (0.0, 2.5, 5.0, 7.99), "island": (0.0, 40.0, 113.0, 239.99)}


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ExportPage]:
    with three_page("show_export.html", ExportPage, tmp_path_factory) as page:
        yield page


@pytest.fixture(scope="module", params=sweep(["cove", "island"], test=["cove"]))
def exported(
    request: pytest.FixtureRequest,
    paradize: Callable[..., subprocess.CompletedProcess[str]],
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[Path, Path, dict[str, Any]]:
    """The folder of a baked scene, the GLB that it is exported to, and what was told of it. The cove's
    ground becomes a small picture."""
    top = tmp_path_factory.mktemp("export")
    path = top / f"{request.param}.glb"
    if request.param == "island":
        baked = request.getfixturevalue("island")
        done = paradize("export", baked, "-o", path, "--json")
        assert done.returncode == 0, done.stderr
        return baked, path, json.loads(done.stdout)
    baked = top / "baked"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(top / "store"))
        assert not bake(make_cove(top / "scene"), baked).errors
        for module in ("scene", "heights"):
            patch.setattr(f"paradize.export.{module}.GROUND_TEXELS", 256)
        return baked, path, asdict(export(baked, path))


def test_khronos_validator_finds_nothing_in_an_exported_scene(
    exported: tuple[Path, Path, dict[str, Any]], node: Callable[..., Any]
) -> None:
    result = node("validate_gltf.mjs", [exported[1]])[str(exported[1])]
    assert (result["errors"], result["warnings"]) == (0, 0), result["messages"]


@pytest.mark.deep
def test_three_flies_along_the_path_that_scene_json_tells(
    exported: tuple[Path, Path, dict[str, Any]], page: ExportPage
) -> None:
    baked, path, result = exported
    found = page.show(path.read_bytes(), SECONDS[path.stem], SIZE)
    manifest = json.loads((baked / "scene.json").read_text())
    assert found["duration_s"] == pytest.approx(manifest["flight"]["duration_s"], abs=1e-3)
    assert found["triangles"] == result["triangles"]
    for second, pose in zip(SECONDS[path.stem], found["poses"], strict=True):
        eye, target = camera(manifest, second)
        look = (target - eye) / np.linalg.norm(target - eye)
        matrix = np.array(pose).reshape(4, 4).T
        # float32 places of some 100 m; the keys' own error is told.
        assert np.linalg.norm(matrix[:3, 3] - eye) < result["errors"]["path_export_m_max"] + 1e-4, second
        angle = np.degrees(np.linalg.norm(-matrix[:3, 2] - look))
        assert angle < result["errors"]["path_export_deg_max"] + 1e-3, second
    if path.stem != "island":
        return
    picture = page.drawn[113.0]
    folder = ROOT / "build/report/three"
    folder.mkdir(parents=True, exist_ok=True)
    save(folder / "export.png", picture[:, :, :3].astype(np.float32) / np.float32(255))
    # The poster's moment: sky above, sand below, and the palm's dark fronds somewhere between.
    sky, sand = (
        picture[20:60, :, :3].reshape(-1, 3).mean(axis=0),
        picture[-20:, 20:200, :3].reshape(-1, 3).mean(axis=0),
    )
    assert sky[2] > sky[0] + 30 and sand[0] > sand[2] + 20
    assert len(np.unique(picture.reshape(-1, 4), axis=0)) > 5000


def test_khronos_validator_finds_nothing_in_materials_of_every_kind(
    node: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, out, path = make_panels(tmp_path / "s", lods=2), tmp_path / "out", tmp_path / "panels.glb"
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    assert not bake(scene, out).errors
    export(out, path)
    result = node("validate_gltf.mjs", [path])[str(path)]
    assert (result["errors"], result["warnings"]) == (0, 0), result["messages"]

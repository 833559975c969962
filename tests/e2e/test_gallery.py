"""A gallery of models that others made bakes, looks as a person approved it, and looks the same when three.js
shows its export: OBJ, STL and glTF with all kinds of materials, mirrored and stretched.

The pairs of pictures are left for a person in build/e2e.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.build.bake import bake
from paradize.cli.main import main
from paradize.export.scene import export
from tests.e2e.model_pictures import tone_mapped
from tests.e2e.three import ExportPage, three_page
from tests.made.gallery import MADE, MIRRORED, SKY, UNEVEN, UPRIGHT, Exhibit, make_gallery, write_models
from tests.pictures import flip_map, load, require_like, save, worst_tile
from tests.sweeps import sweep

SIZE = (448, 252)
SECOND = 2.5
MAX_FLIP, MAX_TILE_FLIP = 0.05, 0.2
OTHERS = (
    Exhibit("building", "gltf/kaykit-city-builder/building_B.gltf", size_m=2.0),
    Exhibit(
        "wagon",
        "gltf/kaykit-city-builder/car_stationwagon.gltf",
        stands=(UPRIGHT, MIRRORED, UNEVEN),
        table=True,
    ),
    Exhibit("light", "gltf/kaykit-city-builder/trafficlight_B.gltf", size_m=2.0),
    Exhibit("bridge", "obj-kits/kenney-hexagon-kit/bridge.obj"),
    Exhibit("avocado", "obj-materials/avocado/avocado.obj", stands=(MIRRORED,)),
    Exhibit("alien", "obj-materials/alien/alien.obj"),
    Exhibit("room", "obj-materials/fully_featured/fully_featured.obj", "bleed = 0.3\n"),  # narrow gutters
    Exhibit("rainbow", "obj-materials/rainbow_box/rainbow_box.obj"),
    Exhibit(
        "truck",
        "gltf/khronos/CesiumMilkTruck-glTF-Draco/CesiumMilkTruck.gltf",
        stands=(UPRIGHT, MIRRORED),
    ),
    Exhibit("garden", "gltf/3d-demo-data/japanese-bridge-garden/scene.glb"),
    Exhibit("box", "gltf/khronos/BoxVertexColors-glTF/BoxVertexColors.gltf"),
    Exhibit("house", "gltf/playcanvas/house/house.glb"),
    Exhibit("cube", "gltf/playcanvas/playcanvas-cube/playcanvas-cube.glb", stands=(UNEVEN,)),
    Exhibit("table", "gltf/playcanvas/glass-table/glass-table.glb"),
    Exhibit("tree", "gltf/aframe/tree1/tree1.glb"),
    Exhibit("portal", "gltf/playcanvas/portal/portal.glb"),
    Exhibit("pyramid", "gltf/drake/fully_textured_pyramid/fully_textured_pyramid.gltf"),
    Exhibit("character", "gltf/kenney-platformer/character.glb"),
)
FEW = tuple(one for one in MADE if one.name in {"tree", "stool", "window", "fern"})
SOURCES = {"few": FEW, "made": MADE, "corpus": OTHERS}


@pytest.fixture(scope="module", params=["made", "corpus"])
def gallery(
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """The baked folder."""
    folder = tmp_path_factory.mktemp(request.param) / "scene"
    exhibits = SOURCES[request.param]
    if request.param != "corpus":
        write_models(folder)
    else:
        corpus: Path = request.getfixturevalue("corpus")
        for beside in {Path(one.file).parent for one in exhibits}:
            shutil.copytree(corpus / beside, folder / beside)
    scene = make_gallery(folder, exhibits)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(folder / "store"))
        assert not bake(scene, folder.parent / "baked").errors
    return folder.parent / "baked"


@pytest.fixture(scope="module")
def exported(gallery: Path) -> Path:
    """With a picture of the ground half as wide as `paradize export` makes it."""
    path = gallery.parent / "gallery.glb"
    with pytest.MonkeyPatch.context() as patch:
        for module in ("scene", "heights"):
            patch.setattr(f"paradize.export.{module}.GROUND_TEXELS", 1024)
        export(gallery, path)
    return path


def name_of(gallery: Path) -> str:
    return next(name for name in SOURCES if name in gallery.parent.name)


@pytest.mark.parametrize("gallery", sweep(SOURCES, test=["few"]), indirect=True)
def test_a_gallery_of_models_of_others_passes_check(
    gallery: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(gallery)]) == 0, capsys.readouterr()
    found = {item["name"]: item for item in json.loads((gallery / "scene.json").read_text())["objects"]}
    for one in SOURCES[name_of(gallery)]:
        mirrored = [np.prod(instance["scale"]) < 0 for instance in found[one.name]["instances"]]
        assert mirrored == [np.prod(factors) < 0 for _, factors in one.stands], one.name
    modes = {material["alpha_mode"] for item in found.values() for material in item["materials"].values()}
    assert modes == {"opaque", "mask", "blend"}
    maps = {
        kind
        for item in found.values()
        for material in item["materials"].values()
        for kind in material["maps"]
        if material["maps"][kind]
    }
    assert maps >= {"color", "normal", "gloss", "occlusion", "emission"}


@pytest.mark.deep
def test_khronos_validator_finds_nothing_in_a_gallery_and_its_export(
    gallery: Path, exported: Path, node: Callable[..., Any]
) -> None:
    files = [exported, *(path for path in sorted(gallery.glob("*.glb")) if "terrain" not in path.name)]
    results = node("validate_gltf.mjs", files)
    assert len(results) == len(files) > 12
    assert {path: one for path, one in results.items() if one["errors"] or one["warnings"]} == {}


@pytest.mark.deep
def test_a_gallery_of_made_models_looks_as_approved(
    gallery: Path, root: Path, player: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    rendered = root / "build/golden" / "gallery.png"
    if name_of(gallery) != "made":
        rendered = root / "build/e2e/gallery_corpus_sea.png"
    rendered.parent.mkdir(parents=True, exist_ok=True)
    picture = [
        "--time",
        SECOND,
        "--size",
        "x".join(map(str, SIZE)),
        "--check-finite",
        "--screenshot",
        rendered,
    ]
    done = player(gallery, *picture)
    assert done.returncode == 0, done.stderr
    if name_of(gallery) == "made":
        require_like(root / "tests/golden/gallery.png", rendered)


@pytest.mark.deep
def test_three_shows_an_exported_gallery_as_the_player_does_without_its_sea(
    gallery: Path,
    exported: Path,
    root: Path,
    player: Callable[..., subprocess.CompletedProcess[str]],
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """One camera, one sun, a sky of one colour that lights from all sides, no shadows, one tone curve."""
    rendered = gallery.parent / "player.png"
    without = ["--disable", "water,shadow,reflection,refraction", "--reference", 8]
    at = ["--time", SECOND, "--size", "x".join(map(str, SIZE)), "--screenshot", rendered]
    done = player(gallery, *without, *at)
    assert done.returncode == 0, done.stderr
    with three_page("show_export.html", ExportPage, tmp_path_factory) as page:
        hidden = ["sky", "water", "sea"]
        page.show(exported.read_bytes(), (SECOND,), SIZE, sky=SKY, hidden=hidden)
        light = page.drawn[SECOND]
    manifest = json.loads((gallery / "scene.json").read_text())
    ours, theirs = load(rendered), tone_mapped(light[:, :, :3], manifest["exposure"])
    beside = root / f"build/e2e/gallery_{name_of(gallery)}.png"
    beside.parent.mkdir(parents=True, exist_ok=True)
    save(beside, np.hstack([ours, theirs]))
    error = flip_map(theirs, ours)
    message = f"FLIP {error.mean():.4f}, of the worst tile {worst_tile(error):.3f}: {beside}"
    assert error.mean() <= MAX_FLIP and worst_tile(error) <= MAX_TILE_FLIP, message

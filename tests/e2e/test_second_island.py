"""An archipelago of files that nobody here wrote bakes, passes `check`, and renders; one of files made here
too."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.pictures import changed, load
from tests.sweeps import sweep

FACES = ("px", "nx", "py", "ny", "pz", "nz")
MADE = {
    "height.png": "height/islands_16.png",
    "sand.jpg": "textures/beach.jpg",
    "stones.jpg": "textures/planks.jpg",
    "waves.jpg": "textures/waves.jpg",
    "dock.jpg": "textures/planks.jpg",
    "palm.obj": "obj-kits/made/plain.obj",
    "plain.mtl": "obj-kits/made/plain.mtl",
    "dock.obj": "tangent/made/vase.obj",
    "crab.obj": "obj-kits/made/urn.obj",
    "kit.mtl": "obj-kits/made/kit.mtl",
    "palette.png": "obj-kits/made/palette.png",
    **{f"{face}.jpg": f"sky/made/{face}.jpg" for face in FACES},
}
OTHERS = {
    "height.png": "height/srtm_archipelago_257.png",
    "sand.jpg": "textures/coast_sand_rocks_02_diff_1k.jpg",
    "stones.jpg": "textures/BeachStones.jpg",
    "waves.jpg": "water/playcanvas_caustics.jpg",
    "dock.jpg": "textures/woodfloor043/WoodFloor043_1K_Color.jpg",
    "palm.obj": "obj-kits/quaternius/nature_pack-PalmTree_1.obj",
    "nature_pack-PalmTree_1.mtl": "obj-kits/quaternius/nature_pack-PalmTree_1.mtl",
    "dock.obj": "obj-kits/quaternius/cute_fish_pack-Dock_Long.obj",
    "cute_fish_pack-Dock_Long.mtl": "obj-kits/quaternius/cute_fish_pack-Dock_Long.mtl",
    "crab.obj": "obj-kits/quaternius/platformer_game_pack-Crab.obj",
    "platformer_game_pack-Crab.mtl": "obj-kits/quaternius/platformer_game_pack-Crab.mtl",
    **{f"{face}.jpg": f"sky/studio_garden/studio_garden_{face}.jpg" for face in FACES},
}

SIZE_M = 3000.0
SCENE = """
[scene]
name = "archipelago"
poster_s = 0.0

[sun]
azimuth_deg = 140.0
elevation_deg = 40.0

[fog]
density_per_m = 0.0005

[sky]
faces = ["px.jpg", "nx.jpg", "py.jpg", "ny.jpg", "pz.jpg", "nz.jpg"]

[shadow]
size = 1024
extent_m = 80.0
center = [{x}, {y}, {z}]

[reflection]
scale = 0.5

[refraction]
scale = 0.5

[terrain]
heightmap = "height.png"
size_m = [3000.0, 3000.0]
height_m = 85.0
base_m = -3.0
max_error_m = 0.5
sand_color = "sand.jpg"
sand_repeat = 250.0
effect_color = "stones.jpg"

[water]
waves = "waves.jpg"
size_m = 6000.0
wave_repeat = 300.0

[[object]]
name = "palm"
mesh = "palm.obj"
[[object.instance]]
position = [{x}, {y}, {z}]
scale = 2.0

[[object]]
name = "dock"
mesh = "dock.obj"
color = "dock.jpg"
[[object.instance]]
position = [{dock_x}, {dock_y}, {dock_z}]
scale = 0.6

[[object]]
name = "crab"
mesh = "crab.obj"
[[object.instance]]
position = [{crab_x}, {y}, {crab_z}]
scale = 60.0

[flight]
duration_s = 30.0
near_m = 0.3

{waypoints}
"""


def dry_place_by_the_sea(heights_m: np.ndarray, size_m: float) -> tuple[float, float, float]:
    """(x, y, z) of a pixel 1 to 3 m above the sea with much water within 40 m, nearest to the middle."""
    n = heights_m.shape[0]
    step = size_m / (n - 1)
    reach = int(40 / step)
    best = None
    for j in range(reach, n - reach):
        for i in range(reach, n - reach):
            if 1.0 < heights_m[j, i] < 3.0:
                around = heights_m[j - reach : j + reach + 1, i - reach : i + reach + 1]
                if (around < 0).mean() > 0.4:
                    distance = (i - n / 2) ** 2 + (j - n / 2) ** 2
                    if best is None or distance < best[0]:
                        best = (distance, i, j)
    assert best is not None
    _, i, j = best
    return i * step - size_m / 2, float(heights_m[j, i]), j * step - size_m / 2


def ground_m(heights_m: np.ndarray, size_m: float, x: float, z: float) -> float:
    """The highest ground or sea within a pixel of a place: a camera above it stands in the open."""
    n = heights_m.shape[0]
    i, j = (round((v + size_m / 2) / size_m * (n - 1)) for v in (x, z))
    return max(0.0, float(heights_m[j - 1 : j + 2, i - 1 : i + 2].max()))


def towards_the_sea(heights_m: np.ndarray, size_m: float, x: float, z: float) -> tuple[float, float]:
    """Unit (x, z) from a place to the middle of the water within 60 m."""
    n = heights_m.shape[0]
    step = size_m / (n - 1)
    axis = np.arange(n) * step - size_m / 2
    dx, dz = axis[None, :] - x, axis[:, None] - z
    near = (dx * dx + dz * dz < 60.0**2) & (heights_m < 0)
    toward = np.array(
        [np.broadcast_to(dx, near.shape)[near].mean(), np.broadcast_to(dz, near.shape)[near].mean()]
    )
    out = toward / np.hypot(*toward)
    return float(out[0]), float(out[1])


@pytest.fixture(scope="module", params=sweep(["made", "corpus"], test=["made"]))
def archipelago(
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
    paradize: Callable[..., subprocess.CompletedProcess[str]],
) -> Path:
    """The baked folder of the second island."""
    folder = tmp_path_factory.mktemp("archipelago")
    files: Path = request.getfixturevalue(request.param)
    for name, source in {"made": MADE, "corpus": OTHERS}[request.param].items():
        shutil.copy(files / source, folder / name)
    heights_m = load_grey(folder / "height.png") * 85.0 - 3.0
    x, y, z = dry_place_by_the_sea(heights_m, SIZE_M)
    out_x, out_z = towards_the_sea(heights_m, SIZE_M, x, z)
    eye = []
    for angle in np.arange(6) * np.pi / 3:
        ex, ez = x + 24 * out_x + 3 * np.cos(angle), z + 24 * out_z + 3 * np.sin(angle)
        eye.append((ex, ground_m(heights_m, SIZE_M, ex, ez) + 3.0, ez))
    waypoints = "".join(
        f"[[flight.eye]]\nposition = [{p[0]:.3f}, {p[1]:.3f}, {p[2]:.3f}]\n"
        f"[[flight.target]]\nposition = [{x + 0.1 * k:.3f}, {y + 2.0:.3f}, {z:.3f}]\n"
        for k, p in enumerate(eye)
    )
    scene = folder / "archipelago.toml"
    places = {"x": f"{x:.3f}", "y": f"{y:.3f}", "z": f"{z:.3f}"}
    places |= {"dock_x": f"{x + 9 * out_x:.3f}", "dock_y": "-1.7", "dock_z": f"{z + 9 * out_z:.3f}"}
    places |= {"crab_x": f"{x + 3 * out_x:.3f}", "crab_z": f"{z + 3 * out_z:.3f}"}
    scene.write_text(SCENE.format(waypoints=waypoints, **places))
    fresh = {**os.environ, "PARADIZE_STORE": str(folder / "store")}
    result = paradize("bake", scene, "-o", folder / "baked", "--json", env=fresh)
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert report["failed"] == 0
    assert report["baked"] == len(report["artifacts"])
    return folder / "baked"


def load_grey(path: Path) -> np.ndarray:
    """(h, w) float64 in 0..1, read with another library than the pipeline's stages use here."""
    import OpenImageIO as oiio

    picture = oiio.ImageBuf(str(path))
    assert not picture.has_error
    return np.asarray(picture.get_pixels(oiio.FLOAT)[..., 0], dtype=np.float64)


@pytest.mark.deep
def test_archipelago_passes_check(
    archipelago: Path, paradize: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    result = paradize("check", archipelago)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.deep
def test_archipelago_glbs_are_valid(archipelago: Path, node: Callable[..., Any]) -> None:
    results = node("validate_gltf.mjs", sorted(archipelago.glob("*.glb")))
    assert results
    assert {file: r for file, r in results.items() if r["errors"]} == {}


@pytest.mark.deep
def test_models_without_textures_keep_their_materials_colours(archipelago: Path) -> None:
    scene = json.loads((archipelago / "scene.json").read_text())
    palm = next(item for item in scene["objects"] if item["name"] == "palm")
    assert not any(material["maps"]["color"] for material in palm["materials"].values())
    (library,) = {path for path in archipelago.parent.glob("*.mtl") if "newmtl Green" in path.read_text()}
    (kd,) = re.findall(r"newmtl Green\b[^K]*(?:K[^d][^K]*)*Kd (\S+) (\S+) (\S+)", library.read_text())
    assert palm["materials"]["Green"]["color"] == pytest.approx([float(value) for value in kd], rel=1e-5)


@pytest.mark.deep
def test_archipelago_renders_with_every_object_in_view(
    archipelago: Path, player: Callable[..., subprocess.CompletedProcess[str]], root: Path
) -> None:
    picture = root / "build/e2e/archipelago.png"
    picture.parent.mkdir(parents=True, exist_ok=True)
    arguments = ["--time", 3, "--size", "480x270", "--check-finite", "--screenshot"]
    result = player(archipelago, *arguments, picture)
    assert result.returncode == 0, result.stderr
    bare = picture.with_name("archipelago_bare.png")
    assert player(archipelago, "--disable", "objects", *arguments, bare).returncode == 0
    assert changed(picture, bare).mean() > 0.02
    pixels = load(picture)
    assert pixels.std() > 0.08
    assert (pixels.max(axis=2) < 4 / 255).mean() < 0.02  # no black holes


@pytest.mark.deep
def test_archipelago_from_above_and_from_the_beach_has_no_cracks(
    archipelago: Path, player: Callable[..., subprocess.CompletedProcess[str]], root: Path, tmp_path: Path
) -> None:
    """Where neither sky nor sea nor objects are drawn, what shows through a crack is black."""
    manifest = json.loads((archipelago / "scene.json").read_text())
    duration_s = manifest["flight"]["duration_s"]
    x, y, z = manifest["objects"][0]["instances"][0]["position"]
    for name, eye, target, covered in (
        ("above", (x + 40, 260.0, z + 200), (x, 0.0, z), 0.0),
        ("high", (x, 1200.0, z + 50), (x, 0.0, z), 0.0),
        ("beach", (x, y + 2.5, z), (x - 300, y - 100, z - 100), 0.5),
    ):
        still = [[[v, 0.0, 0.0, 0.0] for v in place] for place in (eye, target)]
        manifest["flight"] |= {
            "far_m": 8000.0,
            "segments": [{"eye": still[0], "target": still[1], "roll": [0.0, 0.0, 0.0, 0.0]}],
            "time_table": [[0.0, 0.0, 1.0 / duration_s], [duration_s, 1.0, 1.0 / duration_s]],
            "waypoint_u": [0],
        }
        folder = tmp_path / name
        folder.mkdir()
        for artifact in manifest["artifacts"].values():
            (folder / artifact["file"]).symlink_to(archipelago / artifact["file"])
        (folder / "scene.json").write_text(json.dumps(manifest))
        picture = root / f"build/e2e/archipelago_{name}.png"
        picture.parent.mkdir(parents=True, exist_ok=True)
        arguments = ["--size", "480x270", "--check-finite", "--screenshot"]
        assert player(folder, *arguments, picture).returncode == 0
        bare = tmp_path / f"{name}_bare.png"
        assert player(folder, "--disable", "sky,water,objects,post", *arguments, bare).returncode == 0
        pixels = load(bare)[int(covered * 270) :]
        assert (pixels.max(axis=2) == 0).sum() == 0, name

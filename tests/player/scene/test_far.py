"""Far from the origin the player draws the same picture as near it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers.quantise import quantised_levels
from paradize.data import Lod
from paradize.formats.glb.encode import encode_glb
from tests.pictures import difference, load
from tests.player import synthetic
from tests.sweeps import sample, sweep

Vec = tuple[float, float, float]
HOME: Vec = (0.0, 0.0, 0.0)
PLACES = {
    "metres 1e6": (1e6, 0.0, -1e6),
    "a map's grid": (499_980.25, 431.5, 5_234_567.75),
    "1e7": (-1e7, 0.0, 0.0),
}
YAW_RAD = 0.4  # of the synthetic scene's box


def moved(scene: dict[str, Any], by: Vec) -> dict[str, Any]:
    """Moves flight, shadow square and particles; the caller moves the object."""
    for segment in scene["flight"]["segments"]:
        for key in ("eye", "target"):
            for row, shift in zip(segment[key], by, strict=True):
                row[0] += shift
    scene["shadow"]["center"] = [a + b for a, b in zip(scene["shadow"]["center"], by, strict=True)]
    for field in scene["particles"]:
        field["center"] = [a + b for a, b in zip(field["center"], by, strict=True)]
    return scene


def dry(folder: Path) -> dict[str, Any]:
    """The synthetic scene without terrain and sea, which cannot be moved."""
    synthetic.write_scene(folder)
    scene: dict[str, Any] = json.loads((folder / "scene.json").read_text())
    assert scene["shadow"] and scene["particles"] and scene["sky"]
    return scene | dict.fromkeys(("terrain", "water", "reflection", "refraction"))


def picture(folder: Path, scene: dict[str, Any], player: Callable[..., Any]) -> Path:
    used = {"box_mesh", "box_color", "sky"}
    scene["artifacts"] = {name: entry for name, entry in scene["artifacts"].items() if name in used}
    scene["streaming"] = sorted(used)
    (folder / "scene.json").write_text(json.dumps(scene))
    out = folder / "a.png"
    result = player(
        folder, "--time", 2.5, "--size", "192x108", "--screenshot", out, "--debug", "--check-finite"
    )
    assert result.returncode == 0, result.stderr
    return out


def assert_alike(home: Path, far: Path) -> None:
    assert float(np.ptp(load(home))) > 0.3, "nothing is seen"
    found = difference(home, far)
    assert found["outliers"] <= 0.002 and found["flip"] < 0.002 and found["tile"] < 0.02, found


@pytest.mark.parametrize("place", sweep(PLACES, test=["a map's grid"]))
def test_a_moved_scene_gives_the_same_picture(tmp_path: Path, player: Callable[..., Any], place: str) -> None:
    home = picture(tmp_path / "home", dry(tmp_path / "home"), player)
    by = PLACES[place]
    scene = moved(dry(tmp_path / "far"), by)
    for instance in scene["objects"][0]["instances"]:
        instance["position"] = [a + b for a, b in zip(instance["position"], by, strict=True)]
    assert_alike(home, picture(tmp_path / "far", scene, player))


@pytest.mark.parametrize(("quantise", "place"), sample(product([False, True], PLACES.values()), every=4))
def test_a_mesh_with_distant_vertices_is_drawn_like_a_near_one(
    tmp_path: Path, player: Callable[..., Any], place: Vec, quantise: bool
) -> None:
    home = picture(tmp_path / "home", dry(tmp_path / "home"), player)
    folder = tmp_path / "far"
    x, y, z = place
    turned = (x * cos(YAW_RAD) + z * sin(YAW_RAD), y, z * cos(YAW_RAD) - x * sin(YAW_RAD))
    scene = moved(dry(folder), turned)
    box = scene["objects"][0]
    assert box["instances"] == [synthetic.instance([0.0, 0.0, 0.0], YAW_RAD)]
    box["center"] = [a + b for a, b in zip(box["center"], place, strict=True)]
    mesh = replace(synthetic.box(), origin=place)
    lods: tuple[Lod, ...] = (Lod(mesh, 0.0, 0.0), Lod(mesh, 0.02, 0.01))
    glb = encode_glb(quantised_levels(lods) if quantise else lods, "box")
    (folder / "box_mesh.glb").write_bytes(glb)
    entry = {"bytes": len(glb), "sha256": hashlib.sha256(glb).hexdigest()}
    scene["artifacts"]["box_mesh"] |= entry
    assert_alike(home, picture(folder, scene, player))

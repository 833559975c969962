"""The switch between two levels of detail, in the player's pictures at the very distance where it happens."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.data import Mesh
from paradize.formats.glb.reader import decode_glb
from paradize.kernels.mesh import number_rows, topology
from tests.conftest import RENDER_ENVIRONMENT
from tests.pictures import flip_map
from tests.places import ROOT
from tests.player.posed import FOV_RAD, HEIGHT, WIDTH, Posed, Vec, pixel

Player = Callable[..., Any]
DIRECTIONS = ((1.0, 0.15, 0.2), (-0.3, 0.1, 1.0), (-0.8, 0.5, -0.6), (0.2, 1.2, 0.7), (0.6, -0.3, -1.0))
FLIP = 0.01  # over the box, the mean of the directions
# Of one direction. A picture of a hundred pixels a side with four samples each has a grain of its own.
FLIP_OF_ONE = 0.015


def alone(posed: Posed, name: str) -> dict[str, Any]:
    """The scene with one instance of one object, its centre at the origin, and the sky."""
    scene = posed.scene() | dict.fromkeys(("terrain", "water", "reflection", "refraction"))
    item = next(one for one in scene["objects"] if one["name"] == name)
    item["instances"] = [
        {"position": [-v for v in item["center"]], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]}
    ]
    if "light_sets" in item:  # by instance
        item["light_sets"] = [0]
    maps = {one for material in item["materials"].values() for one in material["maps"].values() if one}
    used = {item["mesh"], *maps, *([scene["sky"]["cubemap"]] if scene["sky"] else [])}
    scene["artifacts"] = {key: entry for key, entry in scene["artifacts"].items() if key in used}
    scene["fog"]["density_per_m"] = 0.0
    if scene["shadow"]:
        scene["shadow"] |= {"center": [0, 0, 0], "extent_m": 2.2 * item["radius_m"]}
    return scene | {
        "objects": [item],
        "particles": [],
        "sounds": [],
        "music": None,
        "free_camera": None,
        "streaming": sorted(used),
    }


def drawn_at(scene: dict[str, Any], level: int) -> dict[str, Any]:
    """The scene with this level at any distance."""
    item = scene["objects"][0]
    lods = [lod | {"error_m": 0.0 if k <= level else 1e6} for k, lod in enumerate(item["lods"])]
    return scene | {"objects": [item | {"lods": lods}]}


def switch_flip(posed: Posed, name: str, level: int, directions: tuple[Vec, ...]) -> list[float]:
    """FLIP over the object's box between this level and the one before, where this one takes over."""
    scene = alone(posed, name)
    item = scene["objects"][0]
    pixels_at_1m = 0.5 * HEIGHT / np.tan(0.5 * FOV_RAD)
    away_m = item["lods"][level]["error_m"] * pixels_at_1m / scene["lod_error_px"] + item["radius_m"]
    finest = decode_glb((posed.source / scene["artifacts"][item["mesh"]]["file"]).read_bytes())[0].mesh
    used = finest.absolute_positions[finest.triangles.reshape(-1)] - item["center"]
    corners = list(itertools.product(*zip(used.min(axis=0), used.max(axis=0), strict=True)))
    found = []
    for direction in directions:
        eye = tuple(float(v) for v in away_m * np.array(direction) / np.linalg.norm(direction))
        at = np.array([pixel(eye, (0.0, 0.0, 0.0), corner) for corner in corners])  # type: ignore[arg-type]
        (left, top), (right, bottom) = (
            np.floor(at.min(axis=0)).astype(int),
            np.ceil(at.max(axis=0)).astype(int),
        )
        assert left >= 0 and top >= 0 and right <= WIDTH and bottom <= HEIGHT, "it does not fit the picture"
        before, after = (
            posed.render(eye, (0.0, 0.0, 0.0), scene=drawn_at(scene, k))  # type: ignore[arg-type]
            for k in (level - 1, level)
        )
        found.append(float(flip_map(before, after)[top:bottom, left:right].mean()))
    return found


def headless_player(*arguments: object, **_: object) -> subprocess.CompletedProcess[str]:
    """As the fixture `player`, for the command line."""
    command = [str(ROOT / "build/bin/paradize-player"), "--headless", *map(str, arguments)]
    environment = {**os.environ, **RENDER_ENVIRONMENT}
    return subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment, check=False)


def drawn_levels(scene: dict[str, Any], name: str) -> list[int]:
    """The levels after the first that are drawn larger than a pixel."""
    item = next(one for one in scene["objects"] if one["name"] == name)
    never = 1.999 * item["radius_m"] * scene["lod_error_px"]
    return [level for level, lod in enumerate(item["lods"]) if 0.0 < lod["error_m"] < never]


def require_quiet(posed: Posed, name: str, levels: list[int], directions: tuple[Vec, ...]) -> None:
    for level in levels:
        found = switch_flip(posed, name, level, directions)
        assert np.mean(found) <= FLIP and max(found) <= FLIP_OF_ONE, f"{name} lod{level}: {found}"


def test_on_the_island_every_drawn_level_keeps_the_bars_without_a_map_of_its_own(island: Path) -> None:
    """99 % of its normals, with the maps and weighted by what they cover in pixels, lie within 10 degrees of
    the finest level's where it takes over, and the switch is not seen."""
    scene = json.loads((island / "scene.json").read_text())
    drawn = 0
    for item in scene["objects"]:
        for level in drawn_levels(scene, item["name"]):
            facts = scene["artifacts"][item["mesh"]]["levels"][level]
            assert facts["seen_p99_deg"] <= 10.0 and facts["seen_flip"] <= FLIP, (item["name"], level)
            drawn += 1
    assert drawn >= 10


# The first levels of tall, fan, branch and both rocks take over where they do not fit these pictures.
SWITCHES = {"palm": [1], "tall": [2], "young": [1], "shell": [1], "log": [1], "boulder": [2], "slab": [2]}


@pytest.mark.deep
@pytest.mark.parametrize("name", SWITCHES)
def test_on_the_island_a_switch_is_not_seen(island: Path, player: Player, tmp_path: Path, name: str) -> None:
    posed = Posed(island, player, tmp_path)
    assert set(SWITCHES[name]) <= set(drawn_levels(posed.scene(), name))
    require_quiet(posed, name, SWITCHES[name], DIRECTIONS)


def parts(mesh: Mesh) -> np.ndarray[Any, Any]:
    """(n, 2, 3): the boxes of the connected parts of a mesh."""
    place, first = number_rows(mesh.positions)
    found = topology(place[mesh.triangles].astype(np.uint32), len(first))
    corners = [
        mesh.positions[mesh.triangles[found.component == k].reshape(-1)] for k in range(found.components)
    ]
    return np.array([[one.min(axis=0), one.max(axis=0)] for one in corners])


@pytest.mark.deep
def test_on_the_island_a_drawn_level_keeps_every_part_to_a_pixel(island: Path) -> None:
    scene = json.loads((island / "scene.json").read_text())
    for item in scene["objects"]:
        entry = scene["artifacts"][item["mesh"]]
        lods = [one.mesh for one in decode_glb((island / entry["file"]).read_bytes())]
        finest = parts(lods[0])
        diagonal = np.linalg.norm(finest[:, 1].max(axis=0) - finest[:, 0].min(axis=0))
        for level in drawn_levels(scene, item["name"]):
            off = np.abs(finest[:, None] - parts(lods[level])[None]).max(axis=(2, 3)).min(axis=1)
            assert off.max() * entry["levels"][level]["seen_px"] / diagonal <= 1.0, (item["name"], level)


def print_switches(folder: Path, player: Player, scratch: Path) -> None:
    """Prints each switch of a baked scene whose objects stand still: the bake's FLIP, and the player's."""
    posed = Posed(folder, player, scratch)
    scene = posed.scene()
    for item in scene["objects"]:
        levels = scene["artifacts"][item["mesh"]]["levels"]
        for level, facts in enumerate(levels[1:], start=1):
            words = f"{item['name']} {level}: {facts['triangles']} triangles at {facts['seen_px']:.3g} pixels"
            if level not in drawn_levels(scene, item["name"]):
                print(f"{words}: not drawn, {facts['seen_flip']:.4f}")
                continue
            try:
                found = switch_flip(posed, item["name"], level, DIRECTIONS)
            except AssertionError as error:
                print(f"{words}: {error}")
                continue
            print(f"{words}: {facts['seen_flip']:.4f}, drawn {np.mean(found):.4f}, at most {max(found):.4f}")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        for path in sys.argv[1:]:
            print_switches(Path(path), headless_player, Path(scratch))

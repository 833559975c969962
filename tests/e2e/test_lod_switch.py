"""The switch between two levels of detail, in the player's pictures at the very distance where it happens."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.formats.glb.reader import decode_glb
from tests.pictures import flip_map
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


def require_quiet(posed: Posed, name: str, directions: tuple[Vec, ...]) -> None:
    item = next(one for one in posed.scene()["objects"] if one["name"] == name)
    assert len(item["lods"]) > 1
    for level in range(1, len(item["lods"])):
        found = switch_flip(posed, name, level, directions)
        assert np.mean(found) <= FLIP and max(found) <= FLIP_OF_ONE, f"{name} lod{level}: {found}"


@pytest.mark.deep
@pytest.mark.parametrize("name", ["palm", "jetty"])
def test_on_the_island_a_switch_is_not_seen(island: Path, player: Player, tmp_path: Path, name: str) -> None:
    require_quiet(Posed(island, player, tmp_path), name, DIRECTIONS)

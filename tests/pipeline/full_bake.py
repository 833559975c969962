"""A bake that asks a scene for nothing: what the path-aware one is compared with.

Full is everything that the bakers make of the sources without knowing who reads it, in the scene's own
settings and formats: of every picture all four maps (of a height map too) beside its colour, all mips; all
levels of detail with all attributes; every patch of the terrain at the same error; sky and sound.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers.maps.bake import bake_maps
from paradize.build import publish
from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.map_table import DERIVED
from paradize.scene import requirements as require
from paradize.scene.daytime import key_skies
from paradize.scene.jobs import Requirements
from paradize.scene.settings import Scene, load_scene, sound_files
from tests.pictures import flip_map, load
from tests.places import ROOT

PLAYER = ROOT / "build" / "bin" / "paradize-player"
MOMENTS_S = (5.0, 22.0, 40.0, 62.0, 85.0, 113.0, 140.0, 165.0, 190.0, 214.0)  # of the island's flight
ATTRIBUTES = ["POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "COLOR_0", "_SWAY"]


@dataclass(frozen=True)
class Sizes:
    """Bytes: of the path-aware bake's artifacts, of the full bake's, of these by name, and of the largest
    source that the path-aware one reads, with its name."""

    path: int
    full: int
    parts: dict[str, int]
    source: int
    source_name: str

    @property
    def share(self) -> float:
        return self.path / self.full


def full_bake(scene: Path, out: Path, options: BuildOptions) -> BakeReport:
    """The scene with every mip, level, attribute and patch, so that it can be played; maps that no pass reads
    are not in it, for there is no place for them in a scene."""
    require_only = require.require

    def everything(known: Scene, colors: dict[str, Any]) -> Requirements:
        found = require_only(known, colors)
        for job in found.jobs:
            if job.baker == "terrain":
                job.settings["flight_views"] = None
            if job.baker == "mesh":
                job.settings["attributes"] = ATTRIBUTES
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("paradize.build.bake.require", everything)
        patch.setattr(publish, "find_required_detail", lambda *_, **__: {})
        return bake(scene, out, options)


def artifact_bytes(folder: Path) -> dict[str, int]:
    """Bytes of each artifact that a folder's scene.json names."""
    manifest = json.loads((folder / "scene.json").read_text())
    return {name: (folder / entry["file"]).stat().st_size for name, entry in manifest["artifacts"].items()}


def measure_sizes(scene_path: Path, path_aware: Path, full: Path) -> Sizes:
    """Of two bakes of a scene. Maps that the full bake's folder lacks are baked here, for their size."""
    scene = load_scene(scene_path)
    parts = artifact_bytes(full)
    for owner, picture, source in pictures_of(scene):
        absent = [name for name in DERIVED if f"{owner}_{name}" not in parts]
        if absent:
            made = bake_maps(picture, only=absent, source=source, tier="fast", measure=False)
            parts |= {f"{owner}_{name}": len(product.data) for name, product in made.items()}
    sources = sources_of(scene)
    largest = max(sources, key=lambda path: path.stat().st_size)
    return Sizes(
        sum(artifact_bytes(path_aware).values()),
        sum(parts.values()),
        parts,
        largest.stat().st_size,
        largest.name,
    )


def pictures_of(scene: Scene) -> list[tuple[str, Path, str]]:
    """(owner, picture, color or height) of each picture that the scene names; a height map beside a colour
    is a picture of its own."""
    found: list[tuple[str, Path | None, str]] = []
    if terrain := scene.terrain:
        found += [("sand", terrain.sand_color, "color"), ("effect", terrain.effect_color, "color")]
        found += [("sand_height", terrain.sand_height, "height")]
        found += [("effect_height", terrain.effect_height, "height")]
    if scene.water:
        found.append(("water", scene.water.waves, "height"))
    found += [(item.name, item.color, "color") for item in scene.objects]
    return [(owner, picture, source) for owner, picture, source in found if picture is not None]


def sources_of(scene: Scene) -> Sequence[Path]:
    """The files that the scene names."""
    found = [picture for _, picture, _ in pictures_of(scene)]
    found += [item.mesh for item in scene.objects]
    found += [item.alpha for item in scene.objects if item.alpha]
    found += [scene.terrain.heightmap] if scene.terrain else []
    found += [face for sky in key_skies(scene) for face in sky.faces]
    found += [scene.clouds.picture] if scene.clouds else []
    return [*found, *sound_files(scene.sounds, scene.music)]


def frames_apart(
    path_aware: Path, full: Path, moments_s: tuple[float, ...], folder: Path
) -> dict[str, float]:
    """The worst of all moments: FLIP's mean and largest pixel, PSNR in dB (infinite where frames are equal),
    and how many frames are the same byte by byte."""
    flips, largest, squares, same = [], [], [], 0
    for moment in moments_s:
        pictures = []
        for scene in (path_aware, full):
            file = folder / f"{scene.name}_{moment:g}.png"
            at = ["--headless", "--time", f"{moment:g}", "--mute"]
            subprocess.run([PLAYER, scene, *at, "--screenshot", file], check=True, capture_output=True)
            pictures.append(load(file))
        error = flip_map(pictures[1], pictures[0])
        flips.append(float(error.mean()))
        largest.append(float(error.max()))
        squares.append(float(np.mean((pictures[0] - pictures[1]) ** 2)))
        same += bool((pictures[0] == pictures[1]).all())
    worst = max(squares)
    psnr_db = float("inf") if worst == 0.0 else -10.0 * float(np.log10(worst))
    return {"flip_mean": max(flips), "flip_max": max(largest), "psnr_db": psnr_db, "same": float(same)}

"""Smooth edges and soft shadows, where they are wanted."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio

from tests.player.synthetic import identity, texture, write_scene

Player = Callable[..., "subprocess.CompletedProcess[str]"]


def render(player: Player, scene: Path, out: Path, *arguments: object) -> Any:
    """(180, 320) float in 0..255: the mean of the channels."""
    result = player(scene, "--size", "320x180", "--time", 2.5, "--screenshot", out, *arguments)
    assert result.returncode == 0, result.stderr
    return oiio.ImageBuf(str(out)).get_pixels(oiio.UINT8).astype(float).mean(axis=2)


def edit(scene: Path, change: Callable[[dict[str, Any]], None]) -> None:
    manifest = json.loads((scene / "scene.json").read_text())
    change(manifest)
    (scene / "scene.json").write_text(json.dumps(manifest))


def white_box(folder: Path) -> Path:
    """A white box on black, lit from all sides."""
    scene = write_scene(folder, bare=True)
    data = texture("RGBA8_SRGB", np.full((64, 64, 4), 255, dtype=np.uint8))
    (scene / "box_color.ktx2").write_bytes(data)

    def change(manifest: dict[str, Any]) -> None:
        manifest["artifacts"]["box_color"] |= identity(data)
        manifest["fog"]["density_per_m"] = 0.0
        manifest["ambient"] = {"color": [1.0, 1.0, 1.0], "intensity": 3.0}
        manifest["sun"]["intensity"] = 0.0
        for material in manifest["objects"][0]["materials"].values():
            material["specular"] = 0.0

    edit(scene, change)
    return scene


def test_outlines_are_smooth(player: Player, tmp_path: Path) -> None:
    picture = render(player, white_box(tmp_path / "box"), tmp_path / "a.png")
    steps = np.abs(np.diff(picture, axis=1))
    crossings = np.count_nonzero(np.diff((picture > 25).astype(int), axis=1))
    assert crossings > 100
    assert np.count_nonzero(steps > 0.7 * picture.max()) < 0.1 * crossings  # from full to none in one pixel


def test_shadows_are_soft_near_the_camera_and_not_blurred_far_away(player: Player, tmp_path: Path) -> None:
    pictures = {}
    for blur_m in (0.0, 3.0, 40.0):
        scene = write_scene(tmp_path / str(blur_m))

        def change(manifest: dict[str, Any], blur_m: float = blur_m) -> None:
            manifest["shadow"] |= {"size": 1024, "blur_distance_m": blur_m}
            manifest["particles"] = []

        edit(scene, change)
        pictures[blur_m] = render(player, scene, tmp_path / "a.png")
    # The shadow is more than 3 m from the eye: no pixel is blurred.
    assert np.array_equal(pictures[0.0], pictures[3.0])
    changed = np.abs(pictures[0.0] - pictures[40.0]) > 4
    assert 0.0005 < changed.mean() < 0.1  # only along the shadow's edge

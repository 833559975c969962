"""Sparkles and beams are mirrored in the sea from the first frame on, where they are in that frame."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.pictures import load
from tests.player.passes.test_point_lights import lamp
from tests.player.posed import differs
from tests.player.synthetic import write_scene

Player = Callable[..., "subprocess.CompletedProcess[str]"]
SPARKLES = {
    "name": "sparkle",
    "center": [0.0, 1.5, 0.0],
    "radius_m": 1.5,
    "count": 60,
    "size_m": [0.3, 0.6],
    "life_per_s": [0.5, 2.0],
    "threshold": 0.05,
    "color": [20.0, 20.0, 20.0],
}


@pytest.mark.parametrize("glows", ["particles", "beams"])
def test_a_picture_alone_mirrors_what_one_that_follows_others_does(
    player: Player, tmp_path: Path, glows: str
) -> None:
    light = lamp([0.0, 0.2, 0.0], intensity=500.0, beam_m=3.0)
    scene = write_scene(tmp_path / "scene", particles=[SPARKLES], lights=[light], objects=[])
    manifest = json.loads((scene / "scene.json").read_text())
    manifest["terrain"] = None
    for name in [name for name in manifest["streaming"] if name.startswith("terrain")]:
        manifest["streaming"].remove(name)
        del manifest["artifacts"][name]
    manifest["water"] |= {"reflection_distortion": 0.0, "specular": 0.0}
    (scene / "scene.json").write_text(json.dumps(manifest))
    off = ["--disable", "beams" if glows == "particles" else "particles"]
    none = ["--disable", "beams,particles"]

    def picture(name: str, *options: object) -> Path:
        result = player(scene, *options, "--wait-resident", "--screenshot", tmp_path / f"{name}.png")
        assert result.returncode == 0, result.stderr
        return tmp_path / f"{name}.png"

    alone = load(picture("alone", "--time", 2.1, *off))
    bare = load(picture("bare", "--time", 2.1, *none))
    played = load(picture("played", "--time", 2.0, "--frames", 4, *off).with_name("played_0003.png"))
    below = np.s_[len(bare) // 2 :]  # the sea
    assert differs(alone[below], bare[below]).mean() > 0.01
    assert differs(alone, played).mean() < 0.001

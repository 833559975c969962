"""The mirror images of the baked island's lamps do not come and go as the camera moves."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.player.posed import Posed, Vec, around, pixel

NIGHT_S = 225.0
STEPS = 8
STEP_M = 0.08


@pytest.fixture(scope="module")
def posed(island: Path, player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Posed:
    return Posed(island, player, tmp_path_factory.mktemp("posed"), frozenset({"lamp"}))


@pytest.mark.deep
def test_the_mirror_image_of_a_lamp_is_steady_from_frame_to_frame(posed: Posed) -> None:
    """As the camera moves, lamps cross the pixels of the mirror's picture, which are larger than they. With
    one sample a pixel 0.65 of the images are gone, with four 0.2."""
    scene = posed.scene() | {"particles": [], "light_shafts": None, "shadow": None}
    scene["daytime"] = json.loads((posed.source / "scene.json").read_text())["daytime"]
    scene["water"] |= {"scroll_per_s": [0.0, 0.0], "reflection_distortion": 0.0}
    for light in scene["lights"]:
        light |= {"flicker": 0.0, "beam_m": 0.0}
    lamps = [light["position"] for light in scene["lights"][:5]]
    light_of = np.zeros((len(lamps), STEPS))
    x, _, z = lamps[0]
    for step in range(STEPS):
        eye: Vec = (x + 14.0 + STEP_M * step, 1.8, z + 20.0)
        target: Vec = (x + STEP_M * step, 0.3, z)
        picture = posed.render(eye, target, time_s=NIGHT_S, scene=scene)
        for i, (lamp_x, lamp_y, lamp_z) in enumerate(lamps):
            image = around(picture, *pixel(eye, target, (lamp_x, -lamp_y, lamp_z)), 3)
            light_of[i, step] = np.clip(image - np.median(image), 0.0, None).sum()
    gone = light_of < 0.4 * light_of.max(axis=1, keepdims=True)
    assert gone.mean() < 0.35

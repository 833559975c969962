"""The manifest's values are those that the scene's fields mean."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from paradize.build.manifest import _wind
from paradize.scene.settings import load_scene
from tests.pipeline.scenes import make_cove


def test_a_wind_from_the_east_blows_to_the_west_and_one_from_the_north_to_the_south(tmp_path: Path) -> None:
    scene = load_scene(make_cove(tmp_path))
    assert _wind(scene) is None
    palms = tuple(replace(item, sway_m=0.5) for item in scene.objects)
    for azimuth_deg, direction in ((90.0, [-1.0, 0.0]), (0.0, [0.0, 1.0])):
        made = _wind(replace(scene, objects=palms, wind=replace(scene.wind, azimuth_deg=azimuth_deg)))
        assert made is not None and made["direction"] == pytest.approx(direction)

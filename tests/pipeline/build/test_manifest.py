"""The manifest's values are those that the scene's fields mean."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from paradize.build.manifest import _wind, pixel_lit
from paradize.scene.settings import load_scene
from tests.pipeline.scenes import make_cove


def test_a_wind_from_the_east_blows_to_the_west_and_one_from_the_north_to_the_south(tmp_path: Path) -> None:
    scene = load_scene(make_cove(tmp_path))
    assert _wind(scene) is None
    palms = tuple(replace(item, sway_m=0.5) for item in scene.objects)
    for azimuth_deg, direction in ((90.0, [-1.0, 0.0]), (0.0, [0.0, 1.0])):
        made = _wind(replace(scene, objects=palms, wind=replace(scene.wind, azimuth_deg=azimuth_deg)))
        assert made is not None and made["direction"] == pytest.approx(direction)


@pytest.mark.parametrize(
    ("of", "beside"),
    [
        ({}, None),
        ({"maps": {"color": "wood_color", "normal": "wood_normal"}}, "its normal map"),
        ({"second": {"maps": {"occlusion": "wood_occlusion"}}}, "its occlusion map"),
        ({"specular": 0.5, "emission": [0.0, 0.1, 0.0]}, "specular 0.5, emission"),
        ({"metalness": 1.0}, "metalness 1"),
        ({"metalness": 1.0, "vertex_lit": False}, None),
    ],
)
def test_light_at_vertices_that_nobody_will_see_is_warned_of(of: dict[str, Any], beside: str | None) -> None:
    """As player/passes/objects_pass.cpp decides it."""
    bare = {"vertex_lit": True, "maps": {"color": "wood_color", "normal": None}, "emission": [0.0, 0.0, 0.0]}
    wood = bare | {"specular": 0.0, "metalness": 0.0} | of
    said = pixel_lit({"name": "post", "materials": {"wood": wood}})
    assert any("strength = 0" in text for text in said) is (beside == "its normal map")
    assert [f"vertex_lit does nothing beside {beside}; leave" in text for text in said] == [True] * bool(
        beside
    )

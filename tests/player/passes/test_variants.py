"""The shader of objects leaves out what a kind of material does not need, and no picture changes by that."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.player.posed import Picture, Posed, Vec, differs

GROVE_EYE: Vec = (4.0, 6.0, -8.0)
GROVE_TARGET: Vec = (25.0, 8.0, -21.0)
UNDER_THE_SEA = {"position": [-80.0, -9.0, 80.0], "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0]}


@pytest.fixture(scope="module")
def posed(island: Path, player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Posed:
    return Posed(island, player, tmp_path_factory.mktemp("posed"))


def grove(scene: dict[str, Any]) -> list[dict[str, Any]]:
    return [item for item in scene["objects"] if item["name"] in ("tall", "young", "grass", "far_grass")]


def seen(posed: Posed, scene: dict[str, Any]) -> Picture:
    return posed.render(GROVE_EYE, GROVE_TARGET, scene=scene, disable="shadow,water,terrain,sky,post")


def quiet(posed: Posed) -> dict[str, Any]:
    """The grove alone, lit in its pixels: of what may be lit at its vertices, these two kinds differ."""
    return lit_in_pixels(alone(posed))


def alone(posed: Posed) -> dict[str, Any]:
    scene = posed.scene() | {"particles": [], "reflection": None, "refraction": None}
    return scene | {"objects": grove(scene)}


def lit_in_pixels(scene: dict[str, Any]) -> dict[str, Any]:
    for item in grove(scene):
        for material in item["materials"].values():
            material["vertex_lit"] = False
    return scene


def sink_one_more(scene: dict[str, Any]) -> None:
    """Adds to each kind one that lies under the sea."""
    for item in grove(scene):
        item["instances"].append(UNDER_THE_SEA)
        item["light_sets"].append(0)  # no lamp reaches it


@pytest.mark.deep
def test_what_stands_ashore_looks_the_same_whether_or_not_another_one_lies_in_the_sea(posed: Posed) -> None:
    scene = quiet(posed)
    whole = seen(posed, scene)
    bare = seen(posed, scene | {"objects": []})
    assert differs(whole, bare).mean() > 0.2, "the grove is seen"
    sink_one_more(scene)
    with_sunken = seen(posed, scene)
    assert not differs(whole, with_sunken, 1.5 / 255.0).any()


@pytest.mark.deep
def test_what_also_lies_in_the_sea_is_lit_in_its_pixels(posed: Posed) -> None:
    scene = alone(posed)
    at_vertices = seen(posed, scene)
    sink_one_more(scene)
    sunken = seen(posed, scene)
    assert differs(at_vertices, sunken, 1.5 / 255.0).any()
    assert np.array_equal(sunken, seen(posed, lit_in_pixels(scene)))


@pytest.mark.deep
def test_no_highlight_looks_as_one_that_is_too_faint_to_see(posed: Posed) -> None:
    scene = quiet(posed)
    matte = seen(posed, scene)
    for item in grove(scene):
        for material in item["materials"].values():
            assert material["specular"] == material["metalness"] == 0.0
            material["specular"] = 1e-6
    assert not differs(matte, seen(posed, scene), 1.5 / 255.0).any()

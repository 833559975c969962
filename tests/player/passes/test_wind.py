"""The wind moves what sways, its shadow and its mirror image, and nothing else: on the baked island."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.player.posed import HEIGHT, WIDTH, Posed, Vec, differs, pixel

EYE: Vec = (-10.0, 3.0, 14.0)  # all of the palm, from the beach
TARGET: Vec = (-23.0, 4.5, 3.5)
MOMENTS = (3.16, 4.2)


@pytest.fixture(scope="module")
def posed(island: Path, player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Posed:
    return Posed(island, player, tmp_path_factory.mktemp("posed"))


def palm_of(scene: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = next(item for item in scene["objects"] if item["name"] == "palm")
    return found


def crown(posed: Posed) -> Vec:
    x, y, z = posed.scene()["particles"][0]["center"]
    return (x, y, z)


def dry(posed: Posed) -> dict[str, Any]:
    """The scene without what else moves: water, its caustics, sparkles, the grove."""
    scene = posed.scene()
    objects = [item for item in scene["objects"] if item["name"] in ("palm", "jetty")]
    return scene | {"water": None, "particles": [], "objects": objects}


def moved(
    posed: Posed, scene: dict[str, Any], eye: Vec = EYE, target: Vec = TARGET, *, off: str = ""
) -> NDArray[np.bool_]:
    """Where the picture changes between the moments."""
    first, second = (posed.render(eye, target, time_s=s, disable=off, scene=scene) for s in MOMENTS)
    return differs(first, second)


@pytest.mark.deep
def test_the_crown_moves_and_the_picture_around_it_does_not(posed: Posed) -> None:
    changed = moved(posed, dry(posed))
    assert changed.mean() > 0.02
    x, y = pixel(EYE, TARGET, crown(posed))
    upper = changed[: HEIGHT // 2]
    assert np.hypot(*(np.argwhere(upper).mean(axis=0) - (y, x))) < WIDTH / 8
    assert not upper[:, : WIDTH // 20].any() and not upper[:, -WIDTH // 20 :].any()


@pytest.mark.deep
def test_its_shadow_moves_with_it_and_nothing_else(posed: Posed) -> None:
    scene, top = dry(posed), crown(posed)
    palm_of(scene)["views"] = ["shadow"]
    sun = scene["sun"]["direction"]
    x, z = (top[k] - sun[k] * (top[1] - 0.4) / sun[1] for k in (0, 2))
    eye, target = (x - 4.0, 7.0, z + 9.0), (x, 0.4, z)
    scene["objects"] = [palm_of(scene)]
    scene["shadow"]["size"] = 1024
    ground = {"disable": "sky,shafts,post", "scene": scene}
    assert moved(posed, scene, eye, target, off=ground["disable"]).mean() > 0.004
    assert not moved(posed, scene, eye, target, off=f"{ground['disable']},shadow").any()
    # Five and ten steps a second.
    for quality, between, after in (("shadow=fast", 3.28, 3.36), ("balanced", 3.18, 3.28)):
        begin, same, next_step = (
            posed.render(eye, target, time_s=s, quality=quality, **ground)
            for s in (MOMENTS[0], between, after)
        )
        assert np.array_equal(begin, same)
        assert not np.array_equal(same, next_step)
    *_, played = posed.play(eye, target, 4, time_s=3.18, **ground)
    assert np.array_equal(played, next_step), "a shadow that was drawn before is drawn anew"


@pytest.mark.deep
def test_the_water_mirrors_it_as_it_leans(posed: Posed) -> None:
    scene = dry(posed) | {"water": posed.scene()["water"]}
    scene["water"] |= {"reflection_distortion": 0.0, "scroll_per_s": [0.0, 0.0]}
    palm_of(scene)["views"] = ["reflection"]
    eye, target = (-6.0, 1.2, 14.0), (-21.0, -4.6, 3.6)  # towards the crown's mirror image
    leaning = moved(posed, scene, eye, target)
    palm_of(scene)["sway"] = None
    assert (leaning & ~moved(posed, scene, eye, target)).mean() > 0.001


@pytest.mark.deep
def test_without_reach_all_stands_still(posed: Posed) -> None:
    scene = dry(posed)
    palm_of(scene)["sway"] = None
    assert not moved(posed, scene).any()


@pytest.mark.deep
def test_a_palm_leans_where_the_wind_blows_and_as_far_as_the_scene_says(posed: Posed) -> None:
    """The wind blows along the picture: the crown leans to one side, and to the other where it blows back."""
    ahead = np.subtract(TARGET, EYE)
    right = np.array([-ahead[2], ahead[0]]) / np.hypot(ahead[0], ahead[2])
    middles = []
    for side, lean_m in ((1.0, 2.0), (-1.0, 2.0), (1.0, 0.5)):
        scene = dry(posed)
        scene["wind"] |= {"direction": (side * right).tolist(), "speed_m_per_s": 0.0, "gust_m": 1e5}
        palm_of(scene)["sway"] = {"lean_m": lean_m, "flutter_m": 0.0}
        picture = posed.render(EYE, TARGET, disable="shadow", scene=scene)
        leaves = picture[: HEIGHT // 2, :, 1] > picture[: HEIGHT // 2, :, 2] + 0.1  # greener than the sky
        middles.append(float(np.argwhere(leaves)[:, 1].mean()))
    assert middles[1] < middles[2] < middles[0]
    # Twice 2 m, and 1.5 m.
    assert 2.0 < (middles[0] - middles[1]) / (middles[0] - middles[2]) < 3.4

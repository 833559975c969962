"""Wings and legs turn about their hinges, with their normals and shadows."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.player.passes.test_materials import AWAY_M, BLACK, STEP, WHITE, Render, quad, render, thing
from tests.player.posed import Posed, differs
from tests.player.synthetic import material, write_scene

__all__ = ["render"]  # the fixture

HALF_M = 0.5


def beating(**changes: Any) -> dict[str, Any]:
    """A motion that stays at its place. Frame 0 shows its phase of 0."""
    beat = {"per_lap": 1, "hinge_m": 0.0, "lift_rad": 0.0, "swing_rad": 0.0, "lag_rad_per_m": 0.0}
    beat |= {"stagger_rad_per_m": 0.0, "glides": 0, "glide_share": 0.0}
    still = {"laps": 1, "radius_m": [0.0, 0.0], "rise_m": 0.0, "bank_rad": 0.0, "ahead": False}
    return still | {"pauses": 0, "pause_share": 0.0, "beat": beat | changes}


def wing(motion: dict[str, Any] | None, surface: dict[str, Any]) -> dict[str, Any]:
    return thing("wing", {"m": material(None, **surface)}, motion=motion)


def extent_m(picture: Any) -> tuple[float, float, float]:
    """Of what is not black, at the eye's distance: its lower and upper end and its width."""
    pixel_m = 2.0 * np.tan(0.45) * AWAY_M / 54
    rows, columns = (np.flatnonzero((picture.max(axis=2) > 0.3).any(axis=axis)) for axis in (1, 0))
    return (27 - rows.max() - 1) * pixel_m, (27 - rows.min()) * pixel_m, len(columns) * pixel_m


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_both_wings_rise_and_sink_together(render: Render, side: float) -> None:
    """Their tips, 0.5 m from the hinge, lag by a quarter turn, or by three, which lifts them."""
    lift_rad = 0.9
    shape = beating(lift_rad=lift_rad, lag_rad_per_m=(2.0 + side) * pi)
    surface = BLACK | {"emission": [1.0, 1.0, 1.0]}
    low, high, width = extent_m(render([wing(shape, surface)], {"wing": quad(size=2.0 * HALF_M)}))
    rise = side * HALF_M * sin(lift_rad)
    assert low == pytest.approx(rise - HALF_M, abs=0.1)
    assert high == pytest.approx(rise + HALF_M, abs=0.1)
    assert width == pytest.approx(2.0 * HALF_M * cos(lift_rad), abs=0.1)


def test_normals_turn_with_the_wings(render: Render) -> None:
    """A wing that leans back, lit from above: turned down, less of it faces the light."""
    lift_rad = 1.0
    leaning = quad((0.0, 1.0, 1.0))
    lit = {}
    for lift in (0.0, lift_rad):
        # All its vertices are one metre from the hinge.
        shape = beating(lift_rad=lift, lag_rad_per_m=0.5 * pi)
        picture = render([wing(shape, WHITE)], {"wing": leaning}, sun=([0.0, 1.0, 0.0], 2.0))
        lit[lift] = float(picture.max())
    assert lit[0.0] == pytest.approx(2.0 / pi * cos(pi / 4), abs=STEP)
    # In the middle, between normals of both sides: their part to the sides cancels out.
    c = cos(lift_rad)
    assert lit[lift_rad] == pytest.approx(2.0 / pi * c / (1.0 + c * c) ** 0.5, abs=0.02)


def test_shadows_beat_too(player: Callable[..., Any], tmp_path: Path) -> None:
    folder = write_scene(tmp_path / "scene")
    posed = Posed(folder, player, tmp_path)
    scene = json.loads((folder / "scene.json").read_text())
    scene |= {"water": None, "particles": []}
    (box,) = scene["objects"]
    box["views"] = ["shadow"]
    folded = box | {"motion": beating(lift_rad=1.2, lag_rad_per_m=0.5 * pi)}
    straight = box | {"motion": beating()}
    eye, target = (-4.0, 5.0, 6.0), (-1.0, 0.0, -1.0)
    shadows = [posed.render(eye, target, scene=scene | {"objects": [one]}) for one in (folded, straight)]
    assert differs(shadows[0], shadows[1]).mean() > 0.01


def test_legs_swing_forwards_and_back(render: Render) -> None:
    """At a phase of 0 both are in front, nearer to the eye."""
    swing_rad = 0.9
    surface = BLACK | {"emission": [1.0, 1.0, 1.0]}
    shape = beating(swing_rad=swing_rad)
    low, high, width = extent_m(render([wing(shape, surface)], {"wing": quad(size=2.0 * HALF_M)}))
    scale = AWAY_M / (AWAY_M - HALF_M * sin(swing_rad))
    assert (low, high) == pytest.approx((-scale * HALF_M, scale * HALF_M), abs=0.1)
    assert width == pytest.approx(scale * 2.0 * HALF_M * cos(swing_rad), abs=0.1)

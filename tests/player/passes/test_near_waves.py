"""Waves lift the sea near the camera of the baked island, and leave the shore as it is."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.player.posed import Picture, Posed, Vec, differs

EYE: Vec = (52.0, 1.0, 63.0)  # as at second 5 of the flight: low over deep water, towards the jetty
TARGET: Vec = (42.0, 0.6, 50.0)
SHORE: Vec = (-8.0, 6.0, -9.0)  # over the inner beach, where the swash runs
SHORE_TARGET: Vec = (-8.0, 0.0, -2.0)


@pytest.fixture(scope="module")
def posed(island: Path, player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Posed:
    return Posed(island, player, tmp_path_factory.mktemp("posed"), frozenset({"jetty"}))


def sea(posed: Posed, **water: object) -> dict[str, Any]:
    """The scene with a sea whose normal map stands still."""
    scene = posed.scene() | {"particles": [], "shadow": None, "light_shafts": None}
    scene["water"] |= {"scroll_per_s": [0.0, 0.0]} | water
    return scene


def seen(posed: Posed, time_s: float, eye: Vec = EYE, target: Vec = TARGET, **water: object) -> Picture:
    return posed.render(eye, target, time_s=time_s, scene=sea(posed, **water))


def frames(posed: Posed) -> list[Picture]:
    """Three frames of playback."""
    return posed.play(EYE, TARGET, 3, time_s=5.0, scene=sea(posed))


@pytest.mark.deep
def test_waves_are_seen_low_over_the_sea(posed: Posed) -> None:
    assert differs(frames(posed)[0], seen(posed, 5.0, wave_height_m=0.0)).mean() > 0.2


@pytest.mark.deep
def test_they_run_and_nothing_jumps_from_one_frame_to_the_next(posed: Posed) -> None:
    for before, after in pairwise(frames(posed)):
        assert differs(before, after, 1 / 255).mean() > 0.05
        assert differs(before, after, 40 / 255).mean() < 0.004


@pytest.mark.deep
def test_the_grid_moves_with_the_eye_and_the_waves_do_not(posed: Posed) -> None:
    """On both sides of a place where the grid goes on by a cell of 1 m."""
    first, second = (seen(posed, 5.0, (x, *EYE[1:]), (x - 10.0, *TARGET[1:])) for x in (52.499, 52.501))
    assert differs(first, second, 24 / 255).mean() < 0.01


@pytest.mark.deep
def test_they_repeat_with_the_flight(posed: Posed) -> None:
    duration_s = posed.scene()["flight"]["duration_s"]
    assert np.array_equal(frames(posed)[0], seen(posed, 5.0 + duration_s))


@pytest.mark.deep
def test_the_waterline_and_its_swash_stay_as_they_are(posed: Posed) -> None:
    with_waves = seen(posed, 7.5, SHORE, SHORE_TARGET)
    without = seen(posed, 7.5, SHORE, SHORE_TARGET, wave_height_m=0.0)
    assert differs(with_waves, without, 2 / 255).mean() < 0.002


@pytest.mark.deep
def test_quality_fast_has_none(island: Path, player: Callable[..., Any], tmp_path: Path) -> None:
    def fast(*args: object) -> Any:
        return player(*args, "--quality", "fast")

    other = Posed(island, fast, tmp_path, frozenset({"jetty"}))
    assert np.array_equal(seen(other, 5.0), seen(other, 5.0, wave_height_m=0.0))

"""Ripples run from the poles of the baked island's jetty."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.player.posed import Picture, Posed, Vec, differs

EYE: Vec = (38.0, 1.5, 50.0)  # as at second 16 of the flight: low before the jetty's head
TARGET: Vec = (38.0, 0.3, 40.0)
TIME_S = 16.0


@pytest.fixture(scope="module")
def posed(island: Path, player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Posed:
    return Posed(island, player, tmp_path_factory.mktemp("posed"), frozenset({"jetty"}))


def sea(posed: Posed, height_m: float = 0.05) -> dict[str, Any]:
    """The scene with a sea whose other waves stand still."""
    scene = posed.scene() | {"particles": [], "shadow": None, "light_shafts": None}
    scene["water"] |= {"scroll_per_s": [0.0, 0.0], "wave_height_m": 0.0}
    scene["water"]["ripples"] |= {"height_m": height_m}
    return scene


def frames(posed: Posed) -> list[Picture]:
    return posed.play(EYE, TARGET, 2, time_s=TIME_S, scene=sea(posed))


@pytest.mark.deep
def test_they_are_seen_round_the_poles_and_nowhere_else(posed: Posed) -> None:
    changed = differs(
        frames(posed)[0], posed.render(EYE, TARGET, time_s=TIME_S, scene=sea(posed, height_m=0.0))
    )
    assert 0.01 < changed.mean() < 0.2
    assert not changed[: len(changed) // 3].any()


@pytest.mark.deep
def test_they_run_repeat_with_the_flight_and_nothing_jumps(posed: Posed) -> None:
    for before, after in pairwise(frames(posed)):
        assert differs(before, after, 2 / 255).mean() > 0.005
        assert differs(before, after, 60 / 255).mean() < 0.004
    lap_later_s = TIME_S + posed.scene()["flight"]["duration_s"]
    assert np.array_equal(frames(posed)[0], posed.render(EYE, TARGET, time_s=lap_later_s, scene=sea(posed)))

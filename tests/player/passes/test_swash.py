"""Waves run up the beach of the baked island: a sheet of water with foam at its edge, wet sand behind it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.player.posed import HEIGHT, Picture, Posed, Vec, differs

EYE: Vec = (-8.0, 6.0, -9.0)  # over the inner beach, towards the lagoon
TARGET: Vec = (-8.0, 0.0, -2.0)
BREAKS_S, RUNS_UP_S, LATER_S = 4.5, 7.5, 10.5  # a wave at this place


@pytest.fixture(scope="module")
def posed(island: Path, player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Posed:
    return Posed(island, player, tmp_path_factory.mktemp("posed"), frozenset({"jetty"}))


def beach(posed: Posed, **water: object) -> dict[str, Any]:
    """The scene with waves that stand still but for those at the shore."""
    scene = posed.scene() | {"particles": [], "shadow": None, "light_shafts": None}
    scene["water"] |= {"scroll_per_s": [0.0, 0.0], "wave_height_m": 0.0} | water
    return scene


def seen(posed: Posed, time_s: float, **water: object) -> Picture:
    return posed.render(EYE, TARGET, time_s=time_s, scene=beach(posed, **water))


def frames(posed: Posed) -> list[Picture]:
    """Three frames of playback as a wave runs up."""
    return posed.play(EYE, TARGET, 3, time_s=RUNS_UP_S, scene=beach(posed))


def foam(picture: Picture, calm: Picture) -> NDArray[np.bool_]:
    """Where it is white instead of sand."""
    return np.asarray((picture - calm)[..., 2] > 40 / 255)


@pytest.mark.deep
def test_waves_run_up_the_beach_with_foam_and_leave_the_dry_sand_alone(posed: Posed) -> None:
    calm = seen(posed, RUNS_UP_S, swash_height_m=0.0)
    running = frames(posed)[0]
    assert differs(running, calm).mean() > 0.08
    assert 0.01 < foam(running, calm).mean() < 0.1
    assert not differs(running, calm)[-HEIGHT // 8 :].any()


@pytest.mark.deep
def test_the_edge_advances_and_the_sand_that_it_left_stays_dark(posed: Posed) -> None:
    calm = seen(posed, RUNS_UP_S, swash_height_m=0.0)
    running = frames(posed)[0]
    foam_row = [
        np.argwhere(foam(one, calm)[:, :120])[:, 0].mean() for one in (seen(posed, BREAKS_S), running)
    ]
    assert foam_row[1] > foam_row[0] + 20  # nearer to the eye, which looks seawards
    # Where the wave was white, some seconds later, sand is darker than it ever was without waves.
    after = (seen(posed, LATER_S) - calm).mean(axis=2)[foam(running, calm)]
    assert (after < -4 / 255).mean() > 0.3


@pytest.mark.deep
def test_they_are_a_function_of_the_second_that_repeats_with_the_flight(posed: Posed) -> None:
    duration_s = posed.scene()["flight"]["duration_s"]
    assert np.array_equal(frames(posed)[0], seen(posed, RUNS_UP_S + duration_s))


@pytest.mark.deep
def test_from_one_frame_to_the_next_nothing_jumps(posed: Posed) -> None:
    """Also where a wave ends and the next one begins, which is somewhere in the picture at any second."""
    for before, after in pairwise(frames(posed)):
        assert differs(before, after, 40 / 255).mean() < 0.004


@pytest.mark.deep
def test_without_height_there_are_none(posed: Posed) -> None:
    first, second = (seen(posed, s, swash_height_m=0.0) for s in (BREAKS_S, RUNS_UP_S))
    assert np.array_equal(first, second)

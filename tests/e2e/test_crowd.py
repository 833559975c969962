"""Many palms on the island: draw calls of every frame."""

from __future__ import annotations

import json
import resource
import statistics
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.made.crowd import write_crowd
from tests.pictures import load

Player = Callable[..., "subprocess.CompletedProcess[str]"]
DAY, NIGHT = (75, 60), (214, 110)  # a second, and the most draw calls of its frames
WITHOUT = {"MESA_EXTENSION_OVERRIDE": "-GL_ARB_multi_draw_indirect"}


@pytest.mark.deep
@pytest.mark.parametrize("second", [DAY[0], NIGHT[0]])
def test_two_thousand_palms_alone_on_the_island_take_at_most_60_draw_calls(
    player: Player, island: Path, tmp_path: Path, second: int
) -> None:
    folder = write_crowd(island, tmp_path / "crowd", 2000, alone=True)
    arguments = ["--time", second, "--frames", 5, "--size", "160x90", "--wait-resident", "--json"]
    result = player(folder, *arguments)
    assert result.returncode == 0, result.stderr
    assert 0 < json.loads(result.stdout)["most_draw_calls"] <= 60


@pytest.mark.deep
@pytest.mark.parametrize(
    ("palms", "second", "limit"),
    [(12, *DAY), (6, *NIGHT), (2000, *DAY), (2000, 77, 60), (2000, *NIGHT)],
)
def test_palms_take_few_draw_calls_in_every_frame(
    player: Player, island: Path, tmp_path: Path, palms: int, second: int, limit: int
) -> None:
    """Five frames: in the first all is drawn, in the fourth the light has turned, so that all cascades of the
    shadow map are drawn anew. By day both levels of the palm are in every view. By night each lamp has a set
    of lights of its own, and so has much of what stands near one."""
    folder = write_crowd(island, tmp_path / "crowd", palms)

    def most(name: str, frames: int, env: dict[str, str] | None = None) -> int:
        arguments = ["--time", second, "--frames", frames, "--size", "160x90", "--wait-resident", "--json"]
        result = player(folder, *arguments, "--screenshot", tmp_path / name, env=env)
        assert result.returncode == 0, result.stderr
        report = json.loads(result.stdout)
        assert report["most_draw_calls"] > report["draw_calls"]  # of the last frame, which draws no shadow
        return int(report["most_draw_calls"])

    assert most("joined.png", 5) <= limit
    if palms < 2000:  # without calls of many draws there are more, and the same picture
        assert most("single.png", 2, WITHOUT) > limit
        names = [f"joined_{i:04}.png" for i in range(2)]
        for name in names:
            ours, other = (load(tmp_path / n) for n in (name, name.replace("joined", "single")))
            assert np.array_equal(ours, other)


@pytest.mark.deep
def test_a_hundred_thousand_instances_load_as_quickly_at_the_end_of_the_flight(
    player: Player, island: Path, tmp_path: Path
) -> None:
    """Nothing is simulated up to the second that playback starts at."""
    folder = write_crowd(island, tmp_path / "crowd", stones=100_000)

    def processor_s(second: int) -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        result = player(folder, "--time", second, "--size", "160x90", "--wait-resident", "--frames", 1)
        assert result.returncode == 0, result.stderr
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    processor_s(239), processor_s(0)  # compile the shaders
    turns = [(processor_s(239), processor_s(0)) for _ in range(5)]
    late_s, first_s = (statistics.median(turn[i] for turn in turns) for i in (0, 1))
    assert late_s <= 1.2 * first_s

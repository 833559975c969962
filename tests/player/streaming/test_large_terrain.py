"""Terrain several times larger than the limit of device memory: its patches share buffers, come and go."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.made.hills import hills_scene
from tests.pictures import load
from tests.player.conftest import Counted
from tests.player.sanitized import BUILDS, play_sanitized

Player = Callable[..., "subprocess.CompletedProcess[str]"]
pytestmark = pytest.mark.deep
LIMIT_MB = 69  # from 68 MB on blocks share buffers under a limit
AMPLE_MB = 10_000
FRAMES = 120
SIZE = ("--size", "160x90")


@pytest.fixture(scope="module")
def hills(tmp_path_factory: pytest.TempPathFactory, paradize: Player) -> Path:
    folder = tmp_path_factory.mktemp("hills")
    scene = hills_scene(folder / "scene", 2049, 0.12)
    baked = paradize("bake", scene, "-o", folder / "baked", "-j", 1)
    assert baked.returncode == 0, baked.stderr
    return folder / "baked"


def report(result: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    assert result.returncode == 0, result.stderr
    out: dict[str, Any] = json.loads(result.stdout)
    return out


def test_pictures_under_a_limit_are_those_of_ample_memory_while_blocks_come_and_go(
    hills: Path, player: Player, tmp_path: Path
) -> None:
    """Where all that is needed is resident, byte for byte. Without any limit finer mips than a view asks for
    are loaded too, which changes pixels by a code or three."""
    flight = (hills, *SIZE, "--frames", FRAMES, "--json", "--debug", "--screenshot")
    limited = report(player(*flight, tmp_path / "limited.png", "--vram", LIMIT_MB))
    ample = report(player(*flight, tmp_path / "ample.png", "--vram", AMPLE_MB))
    assert limited["total_bytes"] > 2e6 * LIMIT_MB
    assert limited["streaming"]["evictions"] > 30 and ample["streaming"]["evictions"] == 0
    assert limited["streaming"]["peak_bytes"] <= 1e6 * LIMIT_MB
    errors = [[error for _, error, *_ in run["streaming"]["frames"]] for run in (limited, ample)]
    complete = [frame for frame, both in enumerate(zip(*errors, strict=True)) if both == (0.0, 0.0)]
    assert len(complete) > FRAMES // 2
    for frame in complete:
        name = f"_{frame:04d}.png"
        assert np.array_equal(load(tmp_path / f"limited{name}"), load(tmp_path / f"ample{name}")), frame


def test_what_a_flight_sees_has_no_error_although_more_lies_near_it_than_fits(
    hills: Path, player: Player
) -> None:
    run = report(player(hills, *SIZE, "--frames", 60, "--json", "--vram", 56))
    assert [error for _, error, *_ in run["streaming"]["frames"]][22:] == [0.0] * 38


@pytest.mark.parametrize("vram_mb", [LIMIT_MB, AMPLE_MB])
def test_frames_allocate_nothing_while_blocks_of_shared_buffers_come_and_go(
    vram_mb: int, hills: Path, counted: Counted, player: Player
) -> None:
    """Under the limit blocks are evicted and moved; with ample memory more and more buffers are made."""
    flight = (hills, *SIZE, "--vram", vram_mb, "--frames")
    assert counted(*flight, FRAMES // 2)[1] == counted(*flight, 30)[1]
    counts = [report(player(*flight, n, "--json"))["streaming"] for n in (30, FRAMES // 2)]
    change = "evictions" if vram_mb == LIMIT_MB else "uploads"
    assert counts[1][change] > counts[0][change] + 20


@pytest.mark.parametrize("build", BUILDS)
def test_sanitizers_find_nothing_while_blocks_come_and_go(build: str, hills: Path) -> None:
    options = (*SIZE, "--frames", FRAMES // 2, "--vram", LIMIT_MB)
    assert play_sanitized(build, hills, *options)["streaming"]["evictions"] > 0

"""Files that a slow disk holds: a headless frame waits for what it shows, a window goes on drawing."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.pictures import load
from tests.places import ROOT
from tests.player.app.test_window import PLAYER, on_a_display
from tests.player.boxes import row_of_boxes
from tests.player.synthetic import texture
from tests.sweeps import sweep

Player = Callable[..., "subprocess.CompletedProcess[str]"]
Slow = Callable[[int, int], dict[str, str]]
EDGE = 1024
FRAMES = 6
LITTLE = ["--ram", 1, "--vram", 8]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two boxes: one is seen from the first frame on."""
    random = np.random.default_rng(8)
    maps = []
    for _ in range(2):
        pixels = random.integers(0, 255, (EDGE, EDGE, 4), dtype=np.uint8)
        pixels[..., 3] = 255
        maps.append(texture("RGBA8_SRGB", pixels))
    return row_of_boxes(tmp_path_factory.mktemp("slow") / "scene", maps, spacing_m=30.0, seconds=6.0)


@pytest.fixture(scope="module")
def slow(tmp_path_factory: pytest.TempPathFactory, scene: Path) -> Slow:
    """The environment in which so many reads of the seen box's map take so many milliseconds more each."""
    compiler = shutil.which("g++") or shutil.which("c++")
    assert compiler, "no C++ compiler"
    library = tmp_path_factory.mktemp("slow") / "slow.so"
    source = ROOT / "tests/player/preload/slow.cpp"
    subprocess.run([compiler, "-std=c++17", "-shared", "-fPIC", "-O1", source, "-o", library], check=True)
    file = {"LD_PRELOAD": str(library), "PARADIZE_SLOW_FILE": str(scene / "color0.ktx2")}
    return lambda reads, ms: file | {"PARADIZE_SLOW_READS": str(reads), "PARADIZE_SLOW_MS": str(ms)}


@pytest.mark.parametrize("limits", sweep([[], LITTLE], test=[LITTLE]))
def test_a_slow_disk_changes_no_picture_of_a_headless_run(
    player: Player, scene: Path, slow: Slow, tmp_path: Path, limits: list[object]
) -> None:
    flight = (scene, "--size", "64x36", "--frames", FRAMES, "--debug", *limits, "--screenshot")
    assert player(*flight, tmp_path / "quick.png").returncode == 0
    result = player(*flight, tmp_path / "slow.png", env=slow(1000, 40))
    assert result.returncode == 0, result.stderr
    for frame in range(FRAMES):
        quick, late = (load(tmp_path / f"{name}_{frame:04d}.png") for name in ("quick", "slow"))
        assert np.array_equal(quick, late), frame


@pytest.mark.skipif(shutil.which("xvfb-run") is None, reason="no xvfb-run: `make setup-test` brings it")
def test_a_window_draws_while_a_slow_disk_is_read(scene: Path, slow: Slow) -> None:
    """All frames are over before one read of the map is; the run then waits for the file's check."""
    arguments = (PLAYER, scene, "--size", "64x36", "--frames", FRAMES, "--json")
    result = on_a_display(*arguments, **slow(1, 8000))
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    frames = report["streaming"]["frames"]
    assert len(frames) == FRAMES
    assert frames[-1][1] > 1.0  # the map is still missing
    assert report["total_bytes"] - frames[-1][3] >= EDGE * EDGE * 4  # all of it

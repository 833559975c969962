"""The whole flight, played twice without a display: the same pictures, and memory that does not grow."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import RENDER_ENVIRONMENT
from tests.places import ROOT
from tests.player.sanitized import BUILDS, play_sanitized
from tests.player.streaming.test_streaming import report, six_boxes
from tests.processes import started
from tests.sweeps import sweep

Player = Callable[..., "subprocess.CompletedProcess[str]"]


def hashes(folder: Path) -> dict[str, str]:
    """SHA-256 of each picture of a folder, by file name."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


def resident_bytes(process: int) -> int | None:
    """Memory of a process now; None if it has ended."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return None
    return next(
        (1024 * int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS")), None
    )


@pytest.mark.parametrize("vram_mb", sweep([None, 4], test=[4]))
def test_a_flight_twice_gives_the_same_pictures_while_it_streams(
    vram_mb: int | None, player: Player, tmp_path: Path
) -> None:
    scene = six_boxes(tmp_path / "scene")
    limit = () if vram_mb is None else ("--vram", vram_mb)
    pictures = []
    for turn in ("first", "second"):
        folder = tmp_path / turn
        folder.mkdir()
        options = ("--size", "48x27", "--frames", 75, "--screenshot", folder / "frame.png", "--json")
        result = report(player(scene, *options, *limit))
        assert (result["streaming"]["evictions"] > 0) == bool(limit)
        pictures.append(hashes(folder))
    assert pictures[0] == pictures[1]
    assert len(set(pictures[0].values())) > 3  # data arrive, and boxes pass


def faster(scene: Path, folder: Path, times: float) -> Path:
    """The same scene with a flight, days and lamps that take 1/`times` as long."""
    shutil.copytree(scene, folder)
    manifest: dict[str, Any] = json.loads((folder / "scene.json").read_text())
    flight = manifest["flight"]
    flight["duration_s"] /= times
    flight["time_table"] = [[s / times, u, speed * times] for s, u, speed in flight["time_table"]]
    for key in manifest["daytime"]["keys"]:
        key["at_s"] /= times
    for timed in (*manifest["lights"], *manifest["sounds"]):
        for name in timed.get("hours") or ():
            timed["hours"][name] /= times
    manifest["poster_s"] /= times
    (folder / "scene.json").write_text(json.dumps(manifest))
    return folder


@pytest.mark.deep
def test_the_island_s_flight_twice_gives_the_same_pictures_with_flat_memory(
    island: Path, tmp_path: Path
) -> None:
    """A flight eight times as fast, so that the whole of it takes 900 frames. Its second round shows the
    same moments as the first and needs no more memory: some moments, as those at night, need more than
    others, so halves of one round are not compared."""
    scene = faster(island, tmp_path / "scene", 8.0)
    loop = 900
    runs = []
    with ExitStack() as stack:
        for turn, frames in (("first", 2 * loop + 1), ("second", loop)):
            folder = tmp_path / turn
            folder.mkdir()
            command = [ROOT / "build/bin/paradize-player", scene, "--headless", "--size", "96x54"]
            command += ["--frames", frames, "--screenshot", folder / "frame.png"]
            process = stack.enter_context(started(command, env={**os.environ, **RENDER_ENVIRONMENT}))
            runs.append((folder, process))
        samples: list[tuple[int, int]] = []  # of the first run: pictures so far, bytes
        while any(process.poll() is None for _, process in runs):
            memory = resident_bytes(runs[0][1].pid)
            if memory is not None:
                samples.append((sum(1 for _ in runs[0][0].iterdir()), memory))
            time.sleep(0.1)
    assert all(process.returncode == 0 for _, process in runs)
    first, second = (hashes(folder) for folder, _ in runs)
    assert len(first) == 2 * loop + 1 and len(second) == loop
    assert len(set(second.values())) > loop - 20
    assert {name: first[name] for name in second} == second
    early, late = (
        max(memory for frames, memory in samples if begin < frames <= begin + loop) for begin in (0, loop)
    )
    print(f"resident: {early / 1e6:.1f} MB in the first round, {late / 1e6:.1f} MB in the second")
    assert late <= 1.02 * early


@pytest.mark.deep
@pytest.mark.parametrize("build", BUILDS)
def test_sanitizers_find_nothing_in_a_flight_that_streams_under_a_limit(
    build: str, island: Path, tmp_path: Path
) -> None:
    """From the start, and from a second of the night."""
    scene = faster(island, tmp_path / "scene", 16.0)
    for second in (0.0, 12.5):
        options = ("--size", "96x54", "--vram", 24, "--frames", 45, "--time", second)
        assert play_sanitized(build, scene, *options)["streaming"]["evictions"] > 0

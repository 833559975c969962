"""The whole flight, played twice without a display: the same pictures, and memory that does not grow."""

from __future__ import annotations

import hashlib
import os
import subprocess
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.conftest import RENDER_ENVIRONMENT
from tests.places import ROOT
from tests.player.test_streaming import report, six_boxes
from tests.processes import started

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


@pytest.mark.parametrize("limit", [(), ("--vram", 4)], ids=["unlimited", "evicting"])
def test_a_flight_twice_gives_the_same_pictures_while_it_streams(
    limit: tuple[object, ...], player: Player, tmp_path: Path
) -> None:
    scene = six_boxes(tmp_path / "scene")
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


@pytest.mark.deep
def test_the_island_s_flight_twice_gives_the_same_pictures_with_flat_memory(
    island: Path, tmp_path: Path
) -> None:
    """All 7,200 frames and the first of the next round."""
    runs = []
    with ExitStack() as stack:
        for turn in ("first", "second"):
            folder = tmp_path / turn
            folder.mkdir()
            command = [ROOT / "build/bin/paradize-player", island, "--headless", "--size", "96x54"]
            command += ["--frames", 7201, "--screenshot", folder / "frame.png"]
            process = stack.enter_context(started(command, env={**os.environ, **RENDER_ENVIRONMENT}))
            runs.append((folder, process, list[tuple[int, int]]()))
        while any(process.poll() is None for _, process, _ in runs):
            for folder, process, samples in runs:
                memory = resident_bytes(process.pid)
                if memory is not None:
                    samples.append((sum(1 for _ in folder.iterdir()), memory))
            time.sleep(1.0)
    assert all(process.returncode == 0 for _, process, _ in runs)
    first, second = (hashes(folder) for folder, _, _ in runs)
    assert len(first) == 7201 and len(set(first.values())) > 7000
    assert first == second
    for _, _, samples in runs:
        early = max(memory for frames, memory in samples if 600 <= frames < 3600)
        late = max(memory for frames, memory in samples if frames >= 3600)
        print(f"resident: {early / 1e6:.1f} MB in the first half, {late / 1e6:.1f} MB in the second")
        assert late <= 1.02 * early

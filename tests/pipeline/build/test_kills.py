"""Killed at any moment, also in publishing, a bake leaves the old or the new scene; the next mends it."""

from __future__ import annotations

import random
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from tests.pipeline.build.changing_scenes import Changing, cove, few_of_a_gallery, put, whole_gallery
from tests.processes import started


def state_of(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(out.iterdir())}


def bake_beside(scene: Path, out: Path, *options: str) -> AbstractContextManager[subprocess.Popen[bytes]]:
    command = [sys.executable, "-m", "paradize.cli.main", "bake", str(scene), "-o", str(out), *options]
    return started(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def seconds_of(scene: Path, out: Path, *options: str) -> float:
    start = time.monotonic()
    with bake_beside(scene, out, *options) as process:
        assert process.wait() == 0
    return time.monotonic() - start


def wait_for_publishing(process: subprocess.Popen[bytes], out: Path) -> None:
    """Returns as soon as the folder's files are others than they were, or the process is done."""
    before = set(out.iterdir())
    while process.poll() is None and set(out.iterdir()) == before:
        pass


@pytest.mark.deep
@pytest.mark.parametrize(
    ("make", "kills"),
    [(cove, 12), (cove, 200), (few_of_a_gallery, 6), (whole_gallery, 200)],
)
def test_killed_at_random_moments_it_always_ends_in_the_same_bytes(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    make: Callable[[Path], Changing],
    kills: int,
) -> None:
    """With one worker and two in turns; a third of the time all is baked anew, a third the store is warm, a
    third the kill falls within 20 ms of the first file published. What each kill leaves is what the next bake
    begins with."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("PARADIZE_REPORT", "")
    scene, sources = make(tmp_path / "scene")
    out = tmp_path / "out"
    states = []
    for files in sources:
        put(scene.parent, files)
        assert not bake(scene, out, BuildOptions(jobs=2)).errors
        states.append(state_of(out))
    assert states[0] != states[1]
    cold_s = seconds_of(scene, out, "-j", "2", "--force")
    put(scene.parent, sources[0])
    warm_s = seconds_of(scene, out, "-j", "2")
    assert state_of(out) == states[0]
    dice = random.Random(6)
    killed = torn = 0
    for i in range(kills):
        put(scene.parent, sources[(i + 1) % 2])
        way = i // 2 % 3
        before = state_of(out).keys()
        options = ["-j", str(1 + i // 6 % 2), *(["--force"] if way == 0 else [])]
        with bake_beside(scene, out, *options) as process:
            if way == 2:
                wait_for_publishing(process, out)
            try:
                process.wait(timeout=dice.uniform(0.0, (cold_s, warm_s, 0.02)[way]))
            except subprocess.TimeoutExpired:
                process.kill()
                killed += process.wait() < 0
        left = state_of(out)
        whole = [state for state in states if left["scene.json"] == state["scene.json"]]
        assert len(whole) == 1 and whole[0].items() <= left.items(), f"kill {i}"
        torn += left.keys() not in (before, whole[0].keys())
    print(f"{killed} of {kills} killed, {torn} amid publishing; {cold_s:.2f}, {warm_s:.2f} s a bake")
    assert killed > kills // 4 and (torn or kills < 12)
    for files, state in zip(sources, states, strict=True):
        put(scene.parent, files)
        assert not bake(scene, out, BuildOptions(jobs=2)).errors
        assert state_of(out) == state
    shutil.rmtree(out)
    assert (
        not bake(scene, out, BuildOptions(jobs=1)).errors and state_of(out) == states[1]
    )  # the store is sound, too

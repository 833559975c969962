"""Killed at any moment, also in publishing, a bake leaves the old or the new scene; the next mends it."""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from paradize.bake import bake
from paradize.bake_tasks import How
from tests.pipeline.scenes import make_cove


def state_of(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(out.iterdir())}


@pytest.mark.parametrize("kills", [10, pytest.param(200, marks=pytest.mark.deep)])
def test_killed_at_random_moments_it_always_ends_in_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kills: int
) -> None:
    """With one worker and two in turns; half of the time the store is warm: kills meet publishing.
    What each kill leaves is what the next bake begins with."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene, out = make_cove(tmp_path / "scene"), tmp_path / "out"
    sand, wood = ((scene.parent / name).read_bytes() for name in ("sand.png", "wood.png"))
    states, seconds = [], 0.0
    for picture in (sand, wood):
        (scene.parent / "sand.png").write_bytes(picture)
        start = time.monotonic()
        assert not bake(scene, out, How(jobs=2)).errors
        seconds = seconds or time.monotonic() - start
        states.append(state_of(out))
    assert states[0] != states[1]
    dice = random.Random(6)
    killed = 0
    for i in range(kills):
        (scene.parent / "sand.png").write_bytes((sand, wood)[i % 2])
        options = ["-j", str(1 + i // 4 % 2), *(["--force"] if i % 4 < 2 else [])]
        span = seconds + 0.4 if i % 4 < 2 else 0.8
        command = [sys.executable, "-m", "paradize.cli", "bake", str(scene), "-o", str(out), *options]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            process.wait(timeout=dice.uniform(0.0, span))
        except subprocess.TimeoutExpired:
            process.kill()
            killed += process.wait() < 0
        left = state_of(out)
        whole = [state for state in states if left["scene.json"] == state["scene.json"]]
        assert len(whole) == 1 and whole[0].items() <= left.items(), f"kill {i}"
    assert killed > kills // 4
    for picture, state in zip((sand, wood), states, strict=True):
        (scene.parent / "sand.png").write_bytes(picture)
        assert not bake(scene, out, How(jobs=2)).errors
        assert state_of(out) == state
    shutil.rmtree(out)
    assert not bake(scene, out, How(jobs=1)).errors and state_of(out) == states[1]  # the store is sound, too


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_is_one_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene, out = make_cove(tmp_path / "scene"), tmp_path / "out"
    out.mkdir(mode=0o500)
    report = bake(scene, out, How(jobs=2))
    assert len(report.errors) == 1 and "cannot be written: Permission denied" in str(report.errors[0])
    out.chmod(0o700)
    assert not bake(scene, out, How(jobs=2)).errors

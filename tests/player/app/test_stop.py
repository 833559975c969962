"""Signals that stop the player."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import RENDER_ENVIRONMENT
from tests.pictures import load
from tests.places import ROOT
from tests.player.synthetic import write_scene
from tests.processes import started

ENDLESS = 1_000_000  # frames


def stopped(
    folder: Path, out: Path, *options: object, by: signal.Signals, began: Callable[[], bool], shell: str = ""
) -> int:
    """The return code of a player that gets a signal as soon as it has begun to write."""
    command = [ROOT / "build/bin/paradize-player", folder, "--headless", "--frames", ENDLESS, *options]
    if shell:
        command = ["sh", "-c", f'{shell}; exec "$0" "$@"', *command]
    with started(
        command, cwd=out, env={**os.environ, **RENDER_ENVIRONMENT}, stderr=subprocess.PIPE
    ) as player:
        deadline = time.monotonic() + 300
        while not began():
            assert player.poll() is None and time.monotonic() < deadline
            time.sleep(0.01)
        player.send_signal(by)
        return int(player.wait(120))


@pytest.fixture
def out(tmp_path: Path) -> Path:
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


@pytest.mark.parametrize("by", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_while_sound_is_written_leaves_no_file(
    tmp_path: Path, out: Path, by: signal.Signals
) -> None:
    folder = write_scene(tmp_path / "scene")
    code = stopped(folder, out, "--audio", "flight.wav", by=by, began=lambda: any(out.iterdir()))
    assert code == -by
    assert list(out.iterdir()) == []


def test_a_signal_between_frames_leaves_whole_pictures(tmp_path: Path, out: Path) -> None:
    folder = write_scene(tmp_path / "scene")
    options = ("--size", "64x36", "--screenshot", "f.png")
    code = stopped(folder, out, *options, by=signal.SIGINT, began=lambda: (out / "f_0002.png").exists())
    assert code == -signal.SIGINT
    names = sorted(path.name for path in out.iterdir())
    assert names == [f"f_{i:04}.png" for i in range(len(names))] and len(names) >= 3
    assert all(load(out / name).shape == (36, 64, 3) for name in names)


def test_a_signal_that_the_player_was_started_to_ignore_does_not_stop_it(tmp_path: Path, out: Path) -> None:
    """As `nohup` and a script's background do."""
    folder = write_scene(tmp_path / "scene", bare=True)
    options = ("--size", "64x36", "--screenshot", "f.png", "--frames", 60)
    began = (out / "f_0002.png").exists
    assert stopped(folder, out, *options, by=signal.SIGHUP, began=began, shell="trap '' HUP") == 0
    assert len(list(out.iterdir())) == 60

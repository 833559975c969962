"""The tests' own processes: none outlives its test, and none inherits that signals are ignored."""

from __future__ import annotations

import os
import re
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.places import ROOT
from tests.processes import started
from tests.sweeps import sweep

INNER = """
import os, signal, subprocess
from tests.processes import started

def test_interrupt():
    with started(["sleep", "600"]) as process:
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == -signal.SIGINT

def test_hang():
    with started(["bash", "-c", "sleep 600 & echo $!; wait"], stdout=subprocess.PIPE, text=True) as process:
        os.write(int(os.environ["SLEEPER_PIPE"]), process.stdout.readline().encode())
        signal.pause()
"""


def inner(folder: Path, *words: str) -> list[str]:
    """The command that runs tests of their own, as pytest runs ours."""
    (folder / "test_inner.py").write_text(INNER)
    options = ["-p", "tests.conftest", "--rootdir", str(folder), *words]
    return [sys.executable, "-m", "pytest", *options, str(folder)]


@pytest.mark.parametrize("ignored", sweep(["INT", "INT HUP"], test=["INT HUP"]))
def test_where_signals_are_ignored_a_test_can_still_send_them(tmp_path: Path, ignored: str) -> None:
    """`nohup make test &` in a script: what a process ignores, what it starts ignores too."""
    shell = ["bash", "-c", f'trap "" {ignored}; exec "$@"', "bash"]
    command = [*shell, *inner(tmp_path, "-k", "interrupt")]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stdout + result.stderr


SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.mark.parametrize("number", sweep(SIGNALS, test=[signal.SIGTERM]))
def test_a_run_that_is_ended_leaves_no_process(tmp_path: Path, number: int) -> None:
    """Neither those that its tests started, nor what those started."""
    ours, theirs = os.pipe()
    environment = {**os.environ, "SLEEPER_PIPE": str(theirs)}
    command = inner(tmp_path, "-s", "-k", "hang")
    with started(command, cwd=ROOT, env=environment, pass_fds=[theirs], stdout=subprocess.DEVNULL) as run:
        os.close(theirs)
        sleeper = os.pidfd_open(int(os.read(ours, 100)))
        os.close(ours)
        run.send_signal(number)
        assert run.wait(60) != 0
        ended, _, _ = select.select([sleeper], [], [], 60.0)
        os.close(sleeper)
        assert ended


def test_tests_start_what_runs_beside_them_in_one_way() -> None:
    """`started` ends them; press.py and the bench are programs of their own."""
    bench = ROOT / "tests/bench"
    paths = [path for path in (ROOT / "tests").rglob("*.py") if bench not in path.parents]
    starting = {str(path.relative_to(ROOT)) for path in paths if re.search(r"Popen\(", path.read_text())}
    assert starting == {"tests/processes.py", "tests/player/press.py"}

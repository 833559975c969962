"""The suites of C++ tests, as CMake's presets built them: of the kernels and of the player.

`make test` compiles them and runs them here, beside the other tests. `make deep` also runs those that are
built with sanitizers (`make cpp-sanitized`).
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.places import CPP_CASES, ROOT
from tests.sweeps import sweep

SUITES = [("test", "kernels"), ("test", "player")]
SANITIZED = [("threads", "player"), ("sanitize", "kernels"), ("sanitize", "player")]
Counts = tuple[int, ...]
COUNTS = re.compile(r"test cases: +(\d+) \| +(\d+) passed \| +(\d+) failed \| +(\d+) skipped")


def run_suite(folder: Path, preset: str, suite: str) -> tuple[Counts, subprocess.CompletedProcess[str]]:
    """Runs a suite that was built in `folder`: how many cases ran, passed, failed and were skipped, and how
    ctest ended."""
    command = [ROOT / "build/venv/bin/ctest", "--preset", preset, "-R", f"^{suite}$", "-V"]
    ran = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    counts = COUNTS.search(ran.stdout)
    assert counts and int(counts[1]), f"no case ran:\n{ran.stdout[-20_000:]}{ran.stderr}"
    return tuple(map(int, counts.groups())), ran


@pytest.mark.parametrize(("preset", "suite"), sweep(SUITES + SANITIZED, test=SUITES))
def test_every_case_passes(preset: str, suite: str, record_property: Callable[[str, object], None]) -> None:
    counts, ran = run_suite(ROOT, preset, suite)
    record_property(CPP_CASES, counts)
    assert ran.returncode == 0, ran.stdout[-20_000:]


def listing(folder: Path, line: str) -> Path:
    """A folder with the presets, and a build whose list of tests is this line of CTest."""
    (folder / "CMakePresets.json").symlink_to(ROOT / "CMakePresets.json")
    (folder / "build/player").mkdir(parents=True)
    (folder / "build/player/CTestTestfile.cmake").write_text(line)
    return folder


@pytest.mark.parametrize(
    "suite",
    ["others true", "player true", 'player echo "[doctest] test cases: 0 | 0 passed | 0 failed | 0 skipped"'],
)
def test_a_suite_that_is_not_there_or_holds_no_case_is_a_failure(tmp_path: Path, suite: str) -> None:
    with pytest.raises(AssertionError, match="no case ran"):
        run_suite(listing(tmp_path, f"add_test({suite})"), "test", "player")


@pytest.mark.parametrize("code", [0, 1])
def test_a_suite_passes_as_its_program_says(tmp_path: Path, code: int) -> None:
    (tmp_path / "suite").write_text(
        f"echo '[doctest] test cases: 3 | 2 passed | 1 failed | 0 skipped'; exit {code}"
    )
    counts, ran = run_suite(listing(tmp_path, f'add_test(player sh "{tmp_path}/suite")'), "test", "player")
    assert counts == (3, 2, 1, 0)
    assert (ran.returncode == 0) == (code == 0)

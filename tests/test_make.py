"""`make test` on a fresh clone runs the C++ tests, and its last lines say what ran and what did not."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.conftest import pytest_terminal_summary
from tests.sweeps import sweep

ROOT = Path(__file__).resolve().parent.parent
SUITES = {"kernels", "player"}


@cache
def recipe(*targets: str) -> list[str]:
    """The commands of some targets and of all that they need, as if nothing were built."""
    said = subprocess.run(["make", "-nB", *targets], cwd=ROOT, capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    return said.stdout.splitlines()


def registered(folder: Path) -> tuple[int, set[str]]:
    """ctest's exit code and the names of the C++ tests that `make test` would run in a clone."""
    command = [ROOT / "build/venv/bin/ctest", "--preset", "test", "--show-only=json-v1"]
    said = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    listed = json.loads(said.stdout)["tests"] if said.stdout.startswith("{") else []
    return said.returncode, {test["name"] for test in listed}


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """The sources with a build/ of their own that holds the virtual environment only."""
    for name in ("CMakeLists.txt", "CMakePresets.json", "pipeline", "player", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "build").mkdir()
    (tmp_path / "build/venv").symlink_to(ROOT / "build/venv")
    return tmp_path


def configure(clone: Path, command: str, *, doctest: bool) -> subprocess.CompletedProcess[str]:
    """Runs a command of the Makefile that configures, on a machine with or without doctest."""
    machine = clone / "machine.cmake"
    machine.write_text("" if doctest else "set(CMAKE_DISABLE_FIND_PACKAGE_doctest ON)\n")
    environment = os.environ | {"CMAKE_TOOLCHAIN_FILE": str(machine)}
    return subprocess.run(
        ["bash", "-c", command], cwd=clone, env=environment, capture_output=True, text=True, timeout=300
    )


def test_make_test_after_make_run_names_the_missing_doctest_and_with_it_runs_every_cpp_suite(
    clone: Path,
) -> None:
    """`make run` configures the player before `make test` installs doctest."""
    first = [line for line in recipe("run") if "cmake --preset" in line]
    assert len(first) == 1
    result = configure(clone, first[0], doctest=False)
    assert result.returncode == 0, result.stdout + result.stderr
    lines = [line for line in recipe("test") if "cmake --preset" in line]
    without = [configure(clone, line, doctest=False) for line in lines]
    stopped = [result for result in without if result.returncode]
    assert stopped and "doctest" in stopped[0].stdout + stopped[0].stderr
    for line in lines:
        result = configure(clone, line, doctest=True)
        assert result.returncode == 0, result.stdout + result.stderr
    assert registered(clone) == (0, SUITES)


@pytest.mark.parametrize("target", sweep(["test", "deep"], test=["test"]))
def test_no_cpp_test_found_is_a_failure(clone: Path, target: str) -> None:
    """On a build that was configured and holds no test."""
    commands = [line for line in recipe(target) if "bin/ctest " in line]
    assert commands
    for preset, folder in (("test", "player"), ("sanitize", "sanitize"), ("threads", "threads")):
        (clone / "build" / folder).mkdir()
        (clone / "build" / folder / "CTestTestfile.cmake").write_text("")
        for line in commands:
            if f" {preset} " in line or f"build/{folder}" in line:
                result = subprocess.run(["bash", "-c", line], cwd=clone, capture_output=True, text=True)
                assert result.returncode != 0 and "No tests were found" in result.stdout + result.stderr


def closing_lines(folder: Path, log: str, *more: str) -> subprocess.CompletedProcess[str]:
    """Runs three small tests, of which two are skipped, by the words of `make test`, after a given ctest."""
    (folder / "pyproject.toml").symlink_to(ROOT / "pyproject.toml")
    (folder / "tests").mkdir()
    (folder / "tests/conftest.py").symlink_to(ROOT / "tests/conftest.py")
    (folder / "tests/test_three.py").write_text(
        "import pytest\n"
        "def test_a(): pass\n"
        "def test_b(): pytest.skip('no moon')\n"
        "@pytest.mark.skipif(True, reason='no moon')\n"
        "def test_c(): pass\n"
    )
    (folder / "build").mkdir()
    (folder / "build/ctest.log").write_text(log)
    line = next(line for line in recipe("test") if "-m pytest" in line)
    options = shlex.split(line.split("-m pytest")[1])
    return subprocess.run(
        [sys.executable, "-m", "pytest", *options, *more],
        cwd=folder, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
    )  # fmt: skip


def test_the_last_lines_count_cpp_cases_and_skips_by_reason(tmp_path: Path) -> None:
    result = closing_lines(
        tmp_path,
        "1: [doctest] test cases:      80 |      78 passed | 1 failed | 1 skipped\n"
        "2: [doctest] test cases:     120 |     120 passed | 0 failed | 0 skipped\n",
        "-n1",
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert "slowest 10 durations" in result.stdout
    cpp, skips, closing = result.stdout.splitlines()[-3:]
    assert cpp == "2 C++ suites, 200 cases: 198 passed, 1 failed, 1 skipped"
    assert skips == "2 skipped: no moon"
    assert "1 passed, 2 skipped" in closing


NO_CASES = ["No tests were found!!!", "test cases: 0 | 0 passed | 0 failed | 0 skipped"]


@pytest.mark.parametrize("text", NO_CASES)
def test_a_log_without_cpp_cases_is_an_error(tmp_path: Path, text: str) -> None:
    (tmp_path / "log").write_text(text)
    config: Any = SimpleNamespace(getoption={"--ctest": tmp_path / "log"}.get)
    with pytest.raises(pytest.UsageError, match=r"no C\+\+ suite ran"):
        pytest_terminal_summary(config, config)


@pytest.mark.deep
@pytest.mark.parametrize("text", NO_CASES)
def test_a_run_without_cpp_cases_is_a_failure(tmp_path: Path, text: str) -> None:
    result = closing_lines(tmp_path, text, "-n0")
    assert result.returncode != 0 and "no C++ suite ran" in result.stdout + result.stderr

"""`make test` on a fresh clone runs the C++ tests, and its last lines say what ran and what did not."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

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


def test_the_last_lines_count_cpp_cases_and_skips_by_reason(tmp_path: Path) -> None:
    """Of five small tests, run by the words of `make test`: two tell C++ cases, two are skipped."""
    (tmp_path / "pyproject.toml").symlink_to(ROOT / "pyproject.toml")
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests/conftest.py").symlink_to(ROOT / "tests/conftest.py")
    (tmp_path / "tests/test_five.py").write_text(
        "import pytest\n"
        "def test_a(): pass\n"
        "def test_b(): pytest.skip('no moon')\n"
        "@pytest.mark.skipif(True, reason='no moon')\n"
        "def test_c(): pass\n"
        "def test_d(record_property): record_property('cpp_cases', (120, 120, 0, 0))\n"
        "def test_e(record_property): record_property('cpp_cases', (80, 78, 1, 1)); assert False\n"
    )
    line = next(line for line in recipe("test") if "-m pytest" in line)
    result = subprocess.run(
        [sys.executable, "-m", "pytest", *shlex.split(line.split("-m pytest")[1]), "-n1"],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
    )  # fmt: skip
    assert result.returncode == 1, result.stdout + result.stderr
    assert "slowest 10 durations" in result.stdout
    assert "\n2 C++ suites, 200 cases: 198 passed, 1 failed, 1 skipped\n2 skipped: no moon\n" in result.stdout
    assert "1 failed, 2 passed, 2 skipped" in result.stdout.splitlines()[-1]

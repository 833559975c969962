"""Shared by the tests of the player."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable

import pytest

from tests.places import ROOT

Player = Callable[..., "subprocess.CompletedProcess[str]"]
Counted = Callable[..., tuple["subprocess.CompletedProcess[str]", int]]


@pytest.fixture(scope="session")
def counted(player: Player, tmp_path_factory: pytest.TempPathFactory) -> Counted:
    """Runs the player, and counts what its own code allocates: counted(DIR, "--frames", 3). Of runs that
    differ in their frames the longest comes first."""
    compiler = shutil.which("g++") or shutil.which("c++")
    assert compiler, "no C++ compiler"
    folder = tmp_path_factory.mktemp("count")
    library, out = folder / "count_new.so", folder / "count"
    source = ROOT / "tests/player/preload/count_new.cpp"
    # Since C++20 <atomic> holds so much that it compiles three times as long.
    subprocess.run([compiler, "-std=c++17", "-shared", "-fPIC", "-O1", source, "-o", library], check=True)
    environment = {
        "LD_PRELOAD": str(library),
        "PARADIZE_COUNT_FILE": str(out),
        "PARADIZE_CHECKED": "",  # files that were written long enough ago go into a record, which allocates
    }
    settled: set[tuple[object, ...]] = set()

    def once(*arguments: object) -> tuple[subprocess.CompletedProcess[str], int]:
        result = player(*arguments, env=environment)
        assert result.returncode == 0, result.stderr
        return result, int(out.read_text())

    def run(*arguments: object) -> tuple[subprocess.CompletedProcess[str], int]:
        result, count = once(*arguments)
        # Mesa allocates through templates that the linker merges with ours: more where it compiles a shader,
        # the same number in every run that finds all of them in its cache.
        kind = tuple(
            a for before, a in zip(("", *arguments), arguments, strict=False) if before != "--frames"
        )
        for _ in range(0 if kind in settled else 10):
            before, (result, count) = count, once(*arguments)
            if count == before:
                break
        settled.add(kind)
        return result, count

    return run

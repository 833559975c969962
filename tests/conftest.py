"""Shared by all tests: paths, and the island, baked once."""

from __future__ import annotations

import gc
import json
import os
import shutil
import subprocess
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from tests.places import CORPUS, CPP_CASES, ROOT
from tests.processes import take_signals

# Tests bake much, beside each other: sheets are drawn and workers run side by side where one asks for it.
os.environ.setdefault("PARADIZE_REPORT", "")
os.environ.setdefault("PARADIZE_JOBS", "1")

# Tests and the bench render as CI does: no display, no sound card, no newer OpenGL than the player asks for.
SOFTWARE_RENDERING = {
    "MESA_GL_VERSION_OVERRIDE": "3.3",
    "MESA_GLSL_VERSION_OVERRIDE": "330",
    "ALSOFT_DRIVERS": "null",
    "GALLIVM_PERF": "nopt",  # shaders compile in half the time; the pictures are the same
    "PARADIZE_CHECKED": "",  # each start checks all files
}
# Tests start the player hundreds of times. For narrower vectors shaders compile in two thirds of the time,
# with the same pictures. Their own cache: from another one Mesa takes code of wider vectors, and crashes.
RENDER_ENVIRONMENT = SOFTWARE_RENDERING | {
    "LP_NATIVE_VECTOR_WIDTH": "128",
    "MESA_SHADER_CACHE_DIR": str(ROOT / "build/test_shaders"),
    "PARADIZE_CHECKED": str(ROOT / "build/test_checked"),
    # A start takes 60,000 pages of memory. In large ones (malloc asks for them) an eighth of its time goes.
    "GLIBC_TUNABLES": "glibc.malloc.hugetlb=1",
}


# Hypothesis tries the same cases each time, so that `make test` judges a change and not its luck. `make deep`
# asks for `new_cases`: what fails there is written down as an @example.
settings.register_profile("same_cases", derandomize=True)
settings.register_profile("new_cases", print_blob=True, derandomize=False)  # also where CI is set
settings.load_profile("same_cases")


def pytest_configure(config: pytest.Config) -> None:
    take_signals()
    gc.disable()


def pytest_collection_finish(session: pytest.Session) -> None:
    """Collected tests live to the end, so the garbage collector looks at them once, not again and again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)  # by default it looks at what is new after each 700 objects
    gc.enable()


def pytest_unconfigure(config: pytest.Config) -> None:
    gc.unfreeze()


@pytest.hookimpl(trylast=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Above pytest's closing line: the C++ tests, as doctest counts them, and why tests were skipped."""
    calls = [r for kept in terminalreporter.stats.values() for r in kept if getattr(r, "when", "") == "call"]
    counts = [value for call in calls for key, value in call.user_properties if key == CPP_CASES]
    if counts:
        count, passed, failed, skipped = map(sum, zip(*counts, strict=True))
        terminalreporter.write_line(
            f"{len(counts)} C++ suites, {count} cases: {passed} passed, {failed} failed, {skipped} skipped"
        )
    reasons = Counter(report.longrepr[2] for report in terminalreporter.stats.get("skipped", ()))
    for reason, count in reasons.most_common():
        terminalreporter.write_line(f"{count} {reason.replace('Skipped:', 'skipped:')}")


@pytest.fixture(scope="session")
def root() -> Path:
    """The project's folder."""
    return ROOT


@pytest.fixture(scope="session")
def corpus() -> Path:
    """Files that nobody here wrote: $PARADIZE_CORPUS, by default ../shared/corpus. The only way to them."""
    if not CORPUS.is_dir():
        pytest.skip(f"no corpus at {CORPUS}: set PARADIZE_CORPUS to run this test")
    return CORPUS


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files that the tests make themselves, in folders as the corpus has them."""
    from tests.made import make_sources  # here: it loads numpy and OpenImageIO, which pytest itself does not

    return make_sources(tmp_path_factory.mktemp("sources") / "made")


@pytest.fixture(params=["made", "corpus"])
def sources(request: pytest.FixtureRequest) -> Path:
    """A folder of source files: a test that takes it runs on those made here, and on the corpus."""
    return request.getfixturevalue(request.param)


@pytest.fixture
def source(request: pytest.FixtureRequest) -> Callable[[str], Path]:
    """The path of a file or folder by name: source("made/textures/photo.png"), source("corpus/sky")."""

    def find(name: str) -> Path:
        where, _, path = name.partition("/")
        return request.getfixturevalue(where) / path

    return find


@pytest.fixture(scope="session")
def paradize() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs the `paradize` command: paradize("mesh", "a.obj", "-o", "a.glb")."""

    def run(*arguments: object, timeout: float = 300, **kwargs: Any) -> subprocess.CompletedProcess[str]:
        command = [str(ROOT / "build/venv/bin/paradize"), *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=timeout, **kwargs)

    return run


@pytest.fixture(scope="session")
def player() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs `paradize-player`, without a display: player(DIR, "--time", 3, "--screenshot", "a.png")."""

    def run(
        *arguments: object, timeout: float = 300, env: dict[str, str] | None = None
    ) -> subprocess.CompletedProcess[str]:
        command = [str(ROOT / "build/bin/paradize-player"), "--headless", *map(str, arguments)]
        environment = {**os.environ, **RENDER_ENVIRONMENT, **(env or {})}
        return subprocess.run(command, capture_output=True, text=True, timeout=timeout, env=environment)

    return run


@pytest.fixture(scope="session")
def island(paradize: Callable[..., subprocess.CompletedProcess[str]]) -> Path:
    """The island, baked into build/assets/island (a no-op where it is up to date)."""
    folder = ROOT / "build/assets/island"
    result = paradize("bake", ROOT / "raw_assets/island.toml", "-o", folder, "--json")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["failed"] == 0
    return folder


@pytest.fixture(scope="session")
def node() -> Callable[[str, list[object]], Any]:
    """Runs a script of tests/e2e under node with the npm peers of package.json; returns its JSON."""
    modules = ROOT / "build/node/node_modules"
    if shutil.which("node") is None or not modules.is_dir():
        pytest.skip("no node or no build/node/node_modules: `make setup-test` brings them")

    def run(script: str, arguments: list[object]) -> Any:
        command = ["node", str(ROOT / "tests/e2e" / script), *map(str, arguments)]
        environment = {**os.environ, "PARADIZE_NODE_MODULES": str(modules)}
        result = subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)
        assert result.returncode == 0, result.stderr
        return json.loads(result.stdout)

    return run

"""The house stays as the design page draws it."""

from __future__ import annotations

import ast
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "pipeline/paradize"

GROUND = {"data", "errors", "kernels"}
LAYERS = {
    # room: what it may import (besides itself and the ground)
    "cli": {
        "tradeoff",
        "check",
        "explain",
        "export",
        "report",
        "new",
        "watch",
        "bake",
        "scene",
        "budget",
        "engine",
    },
    "tradeoff": {
        "bake",
        "require",
        "readers",
        "stages",
        "formats",
        "metrics",
        "scene",
        "budget",
        "flight",
        "engine",
    },
    "watch": {"bake", "engine"},
    "check": {"bake", "formats", "metrics", "scene", "budget", "schema", "flight"},
    "explain": {"bake", "require", "scene", "budget", "schema", "formats"},
    "export": {"bake", "report", "formats", "metrics", "engine", "flight"},
    "new": {"readers", "formats", "engine"},
    "report": {"bake", "engine", "formats", "metrics", "scene", "budget"},
    "bake": {
        "require",
        "engine",
        "readers",
        "stages",
        "formats",
        "metrics",
        "scene",
        "budget",
        "schema",
        "flight",
    },
    "require": {"scene", "flight"},
    "flight": {"scene"},
    "scene": {"schema", "budget"},
    "budget": {"schema"},
    "schema": set(),
    "stages": set(),
    "readers": set(),
    "formats": set(),
    "metrics": set(),
    "engine": set(),
    "data": set(),
    "errors": set(),
    "kernels": set(),
}


def whose(name: str) -> str:
    """bake_mesh.py, bake_maps.py ... are rooms of bake, one per kind of product; cli_options.py is of cli,
    new_sources.py of new, tradeoff_curve.py of tradeoff."""
    first = name.partition("_")[0]
    return first if first in ("bake", "cli", "explain", "export", "new", "tradeoff") else name


def room_of(path: Path) -> str:
    return whose(path.relative_to(PACKAGE).parts[0].removesuffix(".py"))


def imported_rooms(path: Path) -> set[str]:
    rooms = set()
    for node in ast.walk(ast.parse(path.read_text())):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide the direction"
            names = [node.module or ""]
            if node.module == "paradize":
                names = [f"paradize.{alias.name}" for alias in node.names]
        for name in names:
            parts = name.split(".")
            if parts[0] == "paradize" and len(parts) > 1:
                rooms.add(whose(parts[1]))
    return rooms - {"__version__"}


def test_python_imports_run_one_way() -> None:
    wrong = []
    for path in sorted(PACKAGE.rglob("*.py")):
        room = room_of(path)
        if room == "__init__":
            continue
        allowed = LAYERS[room] | {room} | (GROUND if room not in GROUND else {"errors"})
        wrong += [f"{path.relative_to(ROOT)} imports {r}" for r in sorted(imported_rooms(path) - allowed)]
    assert not wrong


def test_every_room_has_a_layer_and_every_layer_a_room() -> None:
    assert {room_of(path) for path in PACKAGE.rglob("*.py")} - {"__init__"} == set(LAYERS)


def test_every_topic_of_kernels_is_built_and_tested_without_python() -> None:
    kernels = PACKAGE / "kernels"
    bound = {path.stem.split("_")[1] for path in kernels.glob("bind_*.cpp")}
    topics = re.search(r"foreach\(topic IN ITEMS ([a-z0-9 ]+)\)", (kernels / "CMakeLists.txt").read_text())
    assert topics is not None
    assert set(topics[1].split()) == bound
    tested = {path.stem.removeprefix("test_") for path in (ROOT / "tests/kernels").glob("test_*.cpp")}
    assert bound - tested == {"reference"}  # what others are held to: held to numpy in tests/pipeline


def test_metrics_never_use_a_kernel_of_a_stage() -> None:
    wrong = []
    for path in sorted((PACKAGE / "metrics").rglob("*.py")):
        for found in re.findall(r"paradize\.kernels(?: import |\.)(\w+)", path.read_text()):
            if not found.startswith("reference"):
                wrong.append(f"{path.relative_to(ROOT)} imports kernels.{found}")
    assert not wrong


def test_player_includes_run_one_way() -> None:
    forbidden = {"assets": ("gl/", "passes/"), "gl": ("assets/", "passes/")}
    wrong = []
    for room, banned in forbidden.items():
        for path in sorted((ROOT / "player" / room).glob("*.[ch]pp")):
            for include in re.findall(r'#include "([^"]+)"', path.read_text()):
                if include.startswith(banned):
                    wrong.append(f"{path.relative_to(ROOT)} includes {include}")
    assert not wrong


@pytest.mark.parametrize(
    "readme",
    sorted(
        name
        for name in (str(path.relative_to(ROOT)) for path in ROOT.rglob("*.md"))
        if not re.match(r"(.*/)?(build|\.[^/]+)/", name)
    ),
)
def test_every_path_that_a_readme_names_exists(readme: str) -> None:
    path = ROOT / readme
    missing = []
    for name in set(re.findall(r"`([A-Za-z0-9_./-]+/[A-Za-z0-9_.-]*)`", path.read_text())):
        if name.startswith(("build/", "/", "../")) or "//" in name:
            continue
        if not any((base / name).exists() for base in (ROOT, path.parent, PACKAGE)):
            missing.append(name)
    assert not missing


def test_the_readme_names_every_make_target() -> None:
    targets = re.findall(r"^([a-z]+):.*## ", (ROOT / "Makefile").read_text(), re.M)
    readme = (ROOT / "README.md").read_text()
    assert targets
    assert [t for t in targets if t != "help" and f"make {t}" not in readme] == []


def test_locks_name_no_host_and_carry_hashes() -> None:
    for lock in sorted((ROOT / "setup").glob("python-*.txt")):
        text = lock.read_text()
        assert "://" not in text, lock
        assert "--index" not in text, lock
        assert "--find-links" not in text, lock
        pins = len(re.findall(r"^[a-z0-9-]+==", text, re.M | re.I))
        assert pins > 0
        assert pins == len(re.findall(r"==[^\n]+\\\n +--hash=sha256:", text)), lock
    package_lock = (ROOT / "tests/e2e/package-lock.json").read_text()
    assert "resolved" not in package_lock
    assert "integrity" in package_lock


def test_tests_reach_the_corpus_through_its_fixture_alone() -> None:
    """Which skips where there is none. The bench has files of its own beside it."""
    ways = re.compile(r"\bCORPUS\b|PARADIZE_CORPUS|shared\W+corpus")
    own = {ROOT / "tests" / name for name in ("conftest.py", "places.py", "test_house.py")}
    files = [path for path in (ROOT / "tests").rglob("*") if path.suffix in (".py", ".cpp", ".hpp", ".mjs")]
    wrong = {path for path in files if path.parent.name != "bench" and ways.search(path.read_text())}
    assert wrong - own == set()


def tracked_files() -> list[Path]:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    return [ROOT / name for name in listed.stdout.decode().split("\0") if name]


def test_sources_fit_in_25_megabytes() -> None:
    total = sum(p.stat().st_size for p in tracked_files() if p.is_relative_to(ROOT / "raw_assets"))
    assert 0 < total <= 25_000_000

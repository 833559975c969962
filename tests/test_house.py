"""The house stays as the design page draws it."""

from __future__ import annotations

import ast
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "pipeline/paradize"

GROUND = {"data", "documents", "errors", "files", "kernels", "kinds"}
LAYERS = {
    "__main__": {"cli"},
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
    "documents": {"files"},
    "files": set(),
    "kernels": set(),
    "kinds": {"documents", "files"},
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
    assert bound - tested == {"reference", "openmesh"}  # held to numpy and to our own count in tests/pipeline


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


# What reads files, by the last name of a call, and where a file may be read beside files.py: what no person
# and no build put there.
READING = {
    "open", "open_code", "fdopen", "read_bytes", "read_text", "fromfile", "memmap", "load", "loadtxt",
    "genfromtxt", "open_memmap", "file_digest", "copy", "copy2", "copyfile", "copytree", "ImageBuf",
    "SoundFile", "resolve", "mmap",
}  # fmt: skip
FREE = {
    "files.py": "it is the way",
    "cli.py": "the null device",
    "engine/limits.py": "what the kernel says of memory",
    "engine/loader.py": "our own modules",
    "engine/code.py": "our own modules",
    "engine/cluster_far.py": "our own modules",
    "kernels/digest.py": "our own sources, as they are built",
}


def reads_a_file(call: ast.Call) -> bool:
    """Whether a call may open a file for reading by a name that it is given."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    if name not in READING:
        return False
    owner = ast.unparse(call.func.value) if isinstance(call.func, ast.Attribute) else ""
    given = [ast.unparse(argument) for argument in call.args]
    if name == "open" and owner == "Image":
        return given != ["stream"]  # an open file
    if name == "open" and owner == "oiio.ImageInput":
        return given[:1] != ["name"]  # of name_for_library
    if name == "open" and (owner == "target" or given[-1:] in (["'wb'"], ["'xb'"], ["'w'"])):
        return False  # for writing
    if name == "open" and owner == "os":
        return given != ["folder", "os.O_RDONLY"] and "os.devnull" not in given
    if name == "SoundFile":
        return not given[0].startswith("io.BytesIO")
    return bool(given) or name not in ("copy", "load")  # of an array, of an unpickler


def test_files_are_opened_for_reading_in_one_place() -> None:
    """A pipe, a device or a file without end is met there, once for all."""
    wrong = []
    for path in sorted(PACKAGE.rglob("*.py")):
        name = str(path.relative_to(PACKAGE))
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and name not in FREE and reads_a_file(node):
                wrong.append(f"{name}, line {node.lineno}: {ast.unparse(node)[:80]}")
    assert not wrong, "open it with paradize.files"


@pytest.mark.parametrize(
    "text",
    [
        "open(path)", "path.open('rb')", "path.open()", "io.open(path)", "os.open(path, os.O_RDONLY)",
        "path.read_bytes()", "Path(a).read_text()", "np.fromfile(path)", "np.memmap(path)", "np.load(path)",
        "shutil.copyfile(a, b)", "hashlib.file_digest(f, 'x')", "Image.open(path)", "oiio.ImageBuf(path)",
        "oiio.ImageInput.open(str(path))", "soundfile.SoundFile(path)", "tomllib.load(f)", "json.load(f)",
        "mmap.mmap(n, 0)", "path.resolve()",
    ],
)  # fmt: skip
def test_the_test_of_open_sees_each_way_to_read_a_file(text: str) -> None:
    call = ast.parse(text, mode="eval").body
    assert isinstance(call, ast.Call) and reads_a_file(call)


ROUND_TRIPS = {"bake_inputs.py", "bake_footprint.py", "documents.py"}  # what the same process wrote as JSON


def test_json_and_toml_of_others_are_parsed_in_one_place() -> None:
    """Their bounds stand there: documents.py."""
    wrong = []
    for path in sorted(PACKAGE.rglob("*.py")):
        name = str(path.relative_to(PACKAGE))
        for node in ast.walk(ast.parse(path.read_text())):
            called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
            if (
                called in ("json.loads", "json.load", "tomllib.loads", "tomllib.load")
                and name not in ROUND_TRIPS
            ):
                wrong.append(f"{name}: {called}")
    assert not wrong, "parse it with paradize.documents"

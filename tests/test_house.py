"""The house stays as the design page draws it."""

from __future__ import annotations

import ast
import re
import subprocess
from collections import Counter
from fnmatch import fnmatch
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "pipeline/paradize"
BENCH = ROOT / "tests/bench"

# The floors of the house, the highest first: a room imports from lower floors alone, and rooms of one floor
# never import one another. A metric that called a stage would judge itself.
FLOORS = (
    {"__main__"},
    {"cli"},
    {"api"},
    {"tradeoff", "checks", "report", "explain", "export", "watch", "new"},
    {"build"},
    {"bakers"},
    {"visibility", "preview"},
    {"cluster"},
    {"stages", "readers", "formats", "metrics", "store", "jobs"},
    {"scene"},
    {"kinds"},
    {"documents", "kind_table"},
    {"files", "spelling"},
    {"kernels", "data", "map_table", "artifact", "material", "placement"},
    {"errors", "tiers", "angles", "vectors", "player_limits"},
)
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
# Rooms that know neither a scene nor its settings.
STRANGERS = {"stages", "readers", "formats", "metrics", "store", "jobs"}
MODULES = {
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(PACKAGE.rglob("*.py"))
}


def room_of(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


Trees = dict[str, list[ast.AST]]
# The nodes that these tests look at: a fifth of all.
KINDS = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.Import, ast.ImportFrom, ast.Assign, ast.Call)


@pytest.fixture(scope="module")
def trees() -> Trees:
    """The nodes of KINDS of every module of the package, the module first, for all tests of this file."""
    nodes = {module: ast.walk(ast.parse(path.read_text())) for module, path in MODULES.items()}
    return {module: [node for node in found if isinstance(node, KINDS)] for module, found in nodes.items()}


def imports_of(trees: Trees, module: str) -> set[str]:
    """The modules of the package that a module imports, also where only types or one function need them."""
    found = set()
    for node in trees[module]:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: relative imports hide the direction"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in MODULES else str(node.module) for name in names}
    return (found & MODULES.keys()) - {module}  # a package imports its native module


def test_every_room_has_its_floor() -> None:
    assert {room_of(module) for module in MODULES} - {""} == FLOOR.keys()


def test_rooms_import_from_lower_floors_alone(trees: Trees) -> None:
    wrong = []
    for module in MODULES:
        room = room_of(module)
        for name in imports_of(trees, module):
            other = room_of(name)
            strange = room in STRANGERS and other == "scene"
            if room and other and other != room and (FLOOR[other] <= FLOOR[room] or strange):
                wrong.append(f"{module} imports {name}")
    assert not wrong


def doors_of(trees: Trees) -> dict[str, set[str]]:
    """The modules and names in `__all__` of each room's `__init__`: what other rooms may use of it."""
    doors = {}
    for module, nodes in trees.items():
        for node in nodes:
            if (
                module.count(".") == 1
                and MODULES[module].name == "__init__.py"
                and isinstance(node, ast.Assign)
                and ast.unparse(node.targets[0]) == "__all__"
            ):
                doors[room_of(module)] = set(ast.literal_eval(node.value))
    return doors


def test_rooms_are_entered_through_their_doors_alone(trees: Trees) -> None:
    """A room's `__all__` names what other rooms import from it: no less, no more."""
    used: dict[str, set[str]] = {room: set() for room in doors_of(trees)}
    for module, nodes in trees.items():
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("paradize."):
                room, *inner = str(node.module).split(".")[1:]
                if room in used and room != room_of(module):
                    used[room] |= {inner[0]} if inner else {alias.name for alias in node.names}
    assert len(used) > 15
    assert used == doors_of(trees)


def test_check_judges_with_eyes_of_its_own(trees: Trees) -> None:
    """It shares kernels, readers of files and metrics with what made a file, nothing else."""
    rules = [module for module in MODULES if room_of(module) == "checks"]
    found = {(module, name) for module in rules for name in imports_of(trees, module)}
    assert found
    assert not {pair for pair in found if room_of(pair[1]) in ("build", "bakers", "stages")}


def test_no_modules_import_one_another_in_a_circle(trees: Trees) -> None:
    graph = {module: imports_of(trees, module) for module in MODULES}
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as circle:
        pytest.fail(" -> ".join(circle.args[1]))


def names_of(tree: ast.Module) -> set[str]:
    """The names that a module defines or imports at its top level, or below an `if` there."""
    names = set()
    for statement in tree.body:
        if isinstance(statement, ast.FunctionDef | ast.ClassDef):
            names.add(statement.name)
            continue
        for node in ast.walk(statement):
            if isinstance(node, ast.alias):
                names.add(node.asname or node.name)
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                names.add(node.id)
    return names


def is_there(trees: Trees, name: str) -> bool:
    """Whether a dotted name that begins with a room leads to a module, or to what one holds."""
    parts = ["paradize", *name.split(".")]
    for count in range(len(parts), 1, -1):
        module = ".".join(parts[:count])
        if module in MODULES:
            tree = trees[module][0]
            return count == len(parts) or (isinstance(tree, ast.Module) and parts[count] in names_of(tree))
    return False


def test_docstrings_name_what_exists(trees: Trees) -> None:
    """Dotted names that begin with a room: `scene.settings.Flight`, not `scene.Flight`."""
    missing, count = [], 0
    for module in MODULES:
        for node in trees[module]:
            if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                continue
            for name in re.findall(r"(?<![\w./])[a-z_]+(?:\.\w+)+(?![\w/])", ast.get_docstring(node) or ""):
                is_file = name.endswith((".html", ".json", ".py", ".toml"))
                if name.partition(".")[0] in FLOOR and not is_file:
                    count += 1
                    if not is_there(trees, name):
                        missing.append(f"{module}: {name}")
    assert count > 0
    assert not missing


def test_the_tiers_are_named_in_one_place() -> None:
    files = [path for path in PACKAGE.rglob("*.py") if '("fast", "balanced", "exact")' in path.read_text()]
    assert files == [PACKAGE / "tiers.py"]


def test_every_room_says_what_is_inside() -> None:
    doors = {path.parent / "__init__.py" for path in MODULES.values()}
    assert not [door for door in doors if not ast.get_docstring(ast.parse(door.read_text()))]


def test_files_stand_in_folders_not_behind_prefixes() -> None:
    """Five files of a folder whose names begin with the same word belong into a folder of that name."""
    stems = set()
    for root in ("pipeline", "player", "shaders", "raw_assets", "tests"):
        for path in (ROOT / root).rglob("*.*"):
            if path.suffix in (".py", ".cpp", ".hpp", ".glsl", ".vert", ".frag", ".mjs"):
                stems.add((path.parent.relative_to(ROOT), path.stem.removeprefix("test_")))
    firsts = Counter((folder, stem.partition("_")[0]) for folder, stem in stems if "_" in stem.strip("_"))
    assert [f"{folder}/{word}_*" for (folder, word), count in firsts.items() if count >= 5] == []


def test_the_pipeline_readme_draws_the_floors() -> None:
    """Its table of rooms has each room once, in the order of FLOORS, and one number for a floor."""
    readme = (ROOT / "pipeline/README.md").read_text()
    rows = re.findall(r"^\| (\d+) \| (.*?) \|", readme, re.M)
    drawn = [(int(floor), room) for floor, rooms in rows for room in re.findall(r"`paradize/(\w+)", rooms)]
    assert drawn == sorted(drawn, key=lambda pair: pair[0])
    floors = [{room for floor, room in drawn if floor == number} for number in range(1, len(FLOORS))]
    assert floors == [*FLOORS[1:]]  # __main__ starts the first
    assert len(drawn) == sum(map(len, floors))


def test_every_topic_of_kernels_is_built_and_tested_without_python() -> None:
    kernels = PACKAGE / "kernels"
    bound = {path.parent.name for path in kernels.glob("*/bind.cpp")}
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


# The same of the player, below main.cpp: readers of files and OpenGL's objects know nothing of one another.
PLAYER_FLOORS = ({"app"}, {"render"}, {"passes"}, {"streaming"}, {"scene"}, {"assets", "gl"}, {"player"})


def test_player_includes_run_one_way() -> None:
    floor = {room: height for height, rooms in enumerate(PLAYER_FLOORS) for room in rooms}
    player = ROOT / "player"
    files = [path for path in sorted(player.rglob("*.[ch]pp")) if path != player / "main.cpp"]
    rooms = {path: path.relative_to(ROOT).parent.parts[:2][-1] for path in files}
    assert set(rooms.values()) == floor.keys()
    wrong = []
    for path, room in rooms.items():
        for include in re.findall(r'^ *# *include "([^"]+)"', path.read_text(), re.MULTILINE):
            assert player / include in rooms, f"{path}: {include} is named from player/"
            other = rooms[player / include]
            if other != room and floor[other] <= floor[room]:
                wrong.append(f"{path.relative_to(ROOT)} includes {include}")
    assert not wrong


# The outputs of `make` and the programs in build/ at the root. The room of that name is another folder.
GENERATED = {"sheets", "assets", "bench", "bin", "flight", "golden", "report", "sanitize", "setup", "store"}
GENERATED |= {"threads", "venv", "wheel"}


@pytest.mark.parametrize(
    "readme",
    sorted(
        name
        for name in (str(path.relative_to(ROOT)) for path in ROOT.rglob("*.md"))
        if not re.match(r"build/|(.*/)?(\.[^/]+|node_modules)/", name)
    ),
)
def test_every_path_that_a_readme_names_exists(readme: str) -> None:
    """It starts at the folder of the README or at the root; a plain name lies in or below that folder."""
    path = ROOT / readme
    text = path.read_text()
    linked = set(re.findall(r"\]\(([^():]+)\)", text))
    missing = [name for name in linked if not (path.parent / name.partition("#")[0]).exists()]
    for name in set(re.findall(r"`([A-Za-z0-9_./-]+/[A-Za-z0-9_.-]*)`", text)):
        first, _, rest = name.partition("/")
        if (first == "build" and rest.partition("/")[0] in GENERATED) or not first or "//" in name:
            continue
        if not any((base / name).exists() for base in (ROOT, path.parent)):
            missing.append(name)
    for name in set(re.findall(r"`([A-Za-z0-9_]+\.(?:py|cpp|hpp|sh|mjs|frag|vert|glsl|yml|md))`", text)):
        if not any(path.parent.rglob(name)):
            missing.append(name)
    for name in set(re.findall(r"python -m (tests\.[a-z0-9_.]+)", text)):
        if not (ROOT / name.replace(".", "/")).with_suffix(".py").is_file():
            missing.append(name)
    assert not missing


def test_the_readme_names_every_make_target() -> None:
    targets = re.findall(r"^([a-z]+):.*## ", (ROOT / "Makefile").read_text(), re.M)
    readme = (ROOT / "README.md").read_text()
    assert targets
    assert [t for t in targets if t != "help" and f"make {t}" not in readme] == []


def test_locks_name_no_host_and_carry_hashes() -> None:
    locks = sorted(set((ROOT / "setup").glob("*.txt")) - {ROOT / "setup/debian.txt"})
    assert len(locks) >= 6
    for lock in locks:
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


def test_a_deep_test_names_no_cases_of_make_test() -> None:
    """`sweep`, `sample` and deep cases would say of it what is not so."""
    # Found by their lines: to parse all tests takes 40 times as long.
    decorated = re.compile(r"^((?:@.*\n(?:[ )\]}#].*\n)*)+)def (\w+)", re.M)
    texts = [path.read_text() for path in (ROOT / "tests").rglob("test_*.py")]
    found = [pair for text in texts for pair in decorated.findall(text)]
    deep = [(test, marks) for marks, test in found if re.search(r"^@pytest\.mark\.deep\b", marks, re.M)]
    assert len(deep) > 100
    others = re.compile(r"\b(?:sweep|sample)\(|marks=pytest\.mark\.deep")
    assert [test for test, marks in deep if others.search(marks)] == []


def test_no_folder_of_tests_is_left_out_of_a_run(pytestconfig: pytest.Config) -> None:
    """By default pytest enters no folder named `build`."""
    unread = pytestconfig.getini("norecursedirs")
    folders = {path.parent.name for path in (ROOT / "tests").rglob("test_*.py")}
    assert [name for name in sorted(folders) if any(fnmatch(name, pattern) for pattern in unread)] == []


def test_tests_reach_the_corpus_through_its_fixture_alone() -> None:
    """Which skips where there is none. The bench has files of its own beside it."""
    ways = re.compile(r"\bCORPUS\b|PARADIZE_CORPUS|shared\W+corpus")
    own = {ROOT / "tests" / name for name in ("conftest.py", "places.py", "test_house.py")}
    files = [path for path in (ROOT / "tests").rglob("*") if path.suffix in (".py", ".cpp", ".hpp", ".mjs")]
    wrong = {path for path in files if BENCH not in path.parents and ways.search(path.read_text())}
    assert wrong - own == set()


def tracked_files() -> list[Path]:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    return [ROOT / name for name in listed.stdout.decode().split("\0") if name]


def test_comments_and_docstrings_name_files_that_exist() -> None:
    """A path in the code is the end of the path of a file here: `scene/flight.py`, `lib/frame.glsl`."""
    files = [path.relative_to(ROOT) for path in tracked_files()]
    ends = {"/".join(path.parts[first:]) for path in files for first in range(len(path.parts))}
    placeholders = {"topic/file.hpp", "lib/name.glsl", "lib/x.glsl"}
    suffixes = r"py|cpp|hpp|glsl|frag|vert|md|mjs"
    missing, count = [], 0
    for path in files:
        if path.parts[0] in ("pipeline", "player", "shaders", "raw_assets") and path.suffix[
            1:
        ] in suffixes.split("|"):
            text = (ROOT / path).read_text()
            for name in (
                set(re.findall(rf"(?<![\w./<])((?:\w+/)+\w+\.(?:{suffixes}))\b", text)) - placeholders
            ):
                count += 1
                if name.removeprefix("paradize/") not in ends:
                    missing.append(f"{path}: {name}")
    assert count > 100
    assert not missing


def test_docstrings_and_comments_name_the_thing_without_riddles() -> None:
    """As "The errors of each level" does, not "What was measured of each level"."""
    riddle = re.compile(r'(?:^\s*(?://+|#)|""") ?What ', re.M)
    assert riddle.search("/// What lies here.") and riddle.search('"""' + "What it does.")
    leaning = re.compile(r'"""(?:The same|Of|Those)\b')  # says nothing without the function before it
    assert leaning.search('"""' + "The same for pairs.")
    code = {".py", ".pyi", ".cpp", ".hpp", ".glsl", ".vert", ".frag"}
    files = [path for path in tracked_files() if path.suffix in code]
    assert len(files) > 1000
    assert [str(path) for path in files if riddle.search(path.read_text())] == []
    modules = [path for path in files if path.suffix == ".py" and not path.is_relative_to(ROOT / "tests")]
    assert [str(path) for path in modules if leaning.search(path.read_text())] == []


def test_sources_fit_in_25_megabytes() -> None:
    total = sum(p.stat().st_size for p in tracked_files() if p.is_relative_to(ROOT / "raw_assets"))
    assert 0 < total <= 25_000_000


# Calls that read files, by their last name, and where a file may be read beside files.py: what no person
# and no build put there.
READING = {
    "open", "open_code", "fdopen", "read_bytes", "read_text", "fromfile", "memmap", "load", "loadtxt",
    "genfromtxt", "open_memmap", "file_digest", "copy", "copy2", "copyfile", "copytree", "ImageBuf",
    "SoundFile", "resolve", "mmap",
}  # fmt: skip
FREE = {
    "files.py": "it is the way",
    "cli/main.py": "the null device",
    "jobs/limits.py": "what the kernel says of memory",
    "jobs/loader.py": "our own modules",
    "jobs/code.py": "our own modules",
    "cluster/dask_worker.py": "our own modules",
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


def test_files_are_opened_for_reading_in_one_place(trees: Trees) -> None:
    """A pipe, a device or a file without end is met there, once for all."""
    wrong = []
    for module, path in MODULES.items():
        name = str(path.relative_to(PACKAGE))
        for node in trees[module]:
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


ROUND_TRIPS = {
    "build/job_inputs.py",
    "visibility/texel_footprint.py",
    "documents.py",
}  # what the same process wrote as JSON


def test_what_reaches_artifacts_has_no_matrix_products_of_numpy() -> None:
    """Their sums are in another order on another processor: vectors.py has one."""
    rooms = ("readers", "stages", "formats", "bakers", "build")
    threshold = "readers/mtl/bump.py"  # a correlation that is only compared with one
    product = re.compile(r"[\w\])] @ |\.T @|np\.(dot|matmul|einsum|inner)\(")
    wrong = [
        f"{name}: {line.strip()}"
        for path in MODULES.values()
        if (name := str(path.relative_to(PACKAGE))).startswith(rooms) and name != threshold
        for line in path.read_text().splitlines()
        if product.search(line)
    ]
    assert not wrong


def test_json_and_toml_of_others_are_parsed_in_one_place(trees: Trees) -> None:
    """Their bounds stand there: documents.py."""
    wrong = []
    for module, path in MODULES.items():
        name = str(path.relative_to(PACKAGE))
        for node in trees[module]:
            if not isinstance(node, ast.Call) or getattr(node.func, "attr", "") not in ("load", "loads"):
                continue
            called = ast.unparse(node.func)
            if called.startswith(("json.", "tomllib.")) and name not in ROUND_TRIPS:
                wrong.append(f"{name}: {called}")
    assert not wrong, "parse it with paradize.documents"

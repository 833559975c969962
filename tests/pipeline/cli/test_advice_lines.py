"""The advice in messages of commands and rules works: it is taken out of the message and followed.

The last test finds literal advice (a key, a value, an option, a command, a variable) that no test follows.
"""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from paradize.checks.rules import RULES
from paradize.errors import SceneError
from paradize.scene.settings.instance_table import read_instances
from tests.pipeline.cli.test_advice import faults_of
from tests.pipeline.cli.test_wrong_inputs import run
from tests.pipeline.scenes import ball, make_cove, write_image
from tests.places import ROOT
from tests.sweeps import sweep

PACKAGE = ROOT / "pipeline/paradize"


# --- commands: a line that is refused, and the line as advised ----------------------------------------


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]) -> Path:
    """Of all lines: it knows the cove."""
    return cove_store(tmp_path_factory.mktemp("store") / "own")


@pytest.fixture
def here(tmp_path: Path, store: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The cove's sources, in the working folder."""
    monkeypatch.setenv("PARADIZE_STORE", str(store))
    monkeypatch.setenv("PARADIZE_REPORT", "")
    monkeypatch.chdir(make_cove(tmp_path / "here").parent)
    Path("bare.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    Path("wide.obj").write_text(re.sub(r"(?m)^vt (\S+) 1.0*$", r"vt \1 2000000.5", ball()))
    Path("void.asc").write_text("ncols 2\nnrows 2\nNODATA_value 5\n5 5\n5 5\n")
    heights = np.linspace(0, 1, 81, dtype=np.float32).reshape(9, 9, 1)
    write_image(Path("grey.png"), (heights * 65535).astype(np.uint16))
    write_image(Path("wide.png"), np.zeros((1024, 352, 3), np.uint8))
    write_image(Path("pale.png"), (heights * 255).astype(np.uint8))
    return tmp_path / "here"


def words_without(line: str, *options: str) -> str:
    """A command line without options and their values."""
    for option in options:
        line = re.sub(rf" {option}(?: (?!-)\S+)*", "", line)
    return line


def first_option(message: str) -> str:
    return re.findall(r"(--[a-z-]+)", message.rpartition(";")[2])[0]


LINES: dict[str, tuple[str, str, Callable[[str, str], str]]] = {
    "no data in a colour map": (
        "maps wood.png -o m --nodata 3",
        "leave --nodata out",
        lambda line, said: words_without(line, first_option(said)),
    ),
    "no data in a grey picture": (
        "maps pale.png -o m --nodata 3",
        "add --from height",
        lambda line, said: f"{line} {re.findall('add (--from height)', said)[0]}",
    ),
    "a heightmap that is one hole": (
        "terrain void.asc -o a.glb --size 9 9",
        "nodata none keeps them (--nodata none)",
        lambda line, said: f"{line} {re.findall('[(](--nodata none)', said)[0]}",
    ),
    "codes without metres": (
        "terrain grey.png -o a.glb --size 9 9",
        "say how high white stands above black: --height H",
        lambda line, said: f"{line} {first_option(said)} 3",
    ),
    "digits in a grey picture": (
        "terrain grey.png -o a.glb --size 9 9 --height 3 --encoding terrarium",
        'or the encoding "grey"',
        lambda line, said: line.replace("terrarium", re.findall(r'encoding "(\w+)"', said)[0]),
    ),
    "a relative store": (
        "bake cove.toml -o b --store file://store",
        "write file:///folder",
        lambda line, said: line.replace("file://store", f"file://{Path.cwd()}/store"),
    ),
    # what is wrong: a line, what its message's mend holds, and the line as the message advises it
    "a sheet of PNG": (
        "maps wood.png -o m --format png --report r",
        "leave out --format png or --report",
        lambda line, said: words_without(line, first_option(said)),
    ),
    "a layout that a model lacks": (
        "maps wood.png -o m --uv bare.obj",
        "leave out --uv",
        lambda line, said: words_without(line, first_option(said)),
    ),
    "a layout of many tiles": (
        "maps wood.png -o m --uv wide.obj",
        "leave out --uv",
        lambda line, said: words_without(line, first_option(said)),
    ),
    "a group that is not there": (
        "maps wood.png -o m --uv post.obj --gloss-groups brass",
        "there are",
        lambda line, said: line.replace("brass", re.findall(r"there are '(\w+)'", said)[0]),
    ),
    "a size of a model": (
        "measure post.obj -o m --size 1 1 --runs 1",
        "leave out --from, --size, --height, --max-error and --encoding",
        lambda line, said: words_without(line, *re.findall(r"--[a-z-]+", said.rpartition(";")[2])),
    ),
    "a size of a colour map": (
        "measure wood.png -o m --size 1 1 --runs 1",
        "leave out --size, --height, --max-error and --encoding",
        lambda line, said: words_without(line, *re.findall(r"--[a-z-]+", said.rpartition("leave out")[2])),
    ),
    "an amount of memory": (
        "PARADIZE_MEMORY=lots bake cove.toml -o b",
        "write bytes (4G, 500Mi) or a share",
        lambda line, said: line.replace("lots", re.findall(r"\((\d+%)\)", said)[0]),
    ),
    "a time": (
        "PARADIZE_TIMEOUT=0 bake cove.toml -o b",
        "write a number of seconds, such as 3600",
        lambda line, said: line.replace("=0", "=60"),
    ),
    "a number of threads": (
        "PARADIZE_THREADS=many maps wood.png -o m",
        "write a number of threads, such as 2",
        lambda line, said: line.replace("many", said[-1]),
    ),
    "a number of jobs": (
        "PARADIZE_JOBS=many bake cove.toml -o b",
        "write a number of worker processes, such as 2",
        lambda line, said: line.replace("many", said[-1]),
    ),
    "a store that cannot be": (
        "PARADIZE_STORE=wood.png bake cove.toml -o b",
        "set PARADIZE_STORE to a folder that can",
        lambda line, said: line.replace("wood.png", "a-store"),
    ),
    "a picture beyond the limits": (
        "PARADIZE_MAX_SIDE=8 maps wood.png -o m",
        "raise PARADIZE_MAX_SIDE and PARADIZE_MAX_TEXELS",
        lambda line, said: line.replace("=8", "=64"),
    ),
    "a picture of too many bytes": (
        "PARADIZE_MAX_MB=1 maps wide.png -o m",
        "raise PARADIZE_MAX_MB",
        lambda line, said: line.replace("=1 ", "=2 "),
    ),
    "nothing to compare": (
        "check made --against gone",
        "name the folder of an earlier bake after --against",
        lambda line, said: line.replace("gone", "made"),
    ),
    "nothing that can be compared": (
        "check wood.png --against made",
        "leave --against out",
        lambda line, said: words_without(line, first_option(said)),
    ),
    "a name nearly right": (
        "mesh pots.obj -o a.glb --lods 1",
        "did you mean",
        lambda line, said: line.replace("pots.obj", re.findall(r"mean (\S+)\?", said)[0]),
    ),
}


def run_line(line: str, patch: pytest.MonkeyPatch) -> tuple[int, str]:
    """Exit code and all that a line says; NAME=value words first set the environment."""
    words = shlex.split(line)
    while "=" in words[0]:
        patch.setenv(*words.pop(0).split("=", 1))
    code, out, err = run(*words)
    return code, out + err


# The advice of the others is followed in `make deep`.
QUICK = [
    "no data in a colour map", "a relative store", "a group that is not there", "a number of jobs",
    "a name nearly right",
]  # fmt: skip


@pytest.mark.parametrize("name", sweep(LINES, test=QUICK))
def test_a_line_works_as_its_refusal_advises(here: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    line, says, follow = LINES[name]
    if "made" in line:
        assert run("bake", "cove.toml", "-o", "made")[0] == 0
    code, said = run_line(line, monkeypatch)
    assert code == 1 and says in said, said
    message = next(result for result in said.splitlines() if says in result)
    again = follow(line, message)
    assert again != line
    code, said = run_line(again, monkeypatch)
    assert code == 0, (message, again, said)


# --- rules of check: what their mends say to write in the scene ---------------------------------------


@pytest.mark.parametrize("rule", [code for code, rule in RULES.items() if "write" in rule.mend])
def test_a_scene_takes_what_a_rule_says_to_write(tmp_path: Path, rule: str) -> None:
    scene = make_cove(tmp_path)
    text = scene.read_text()
    written = re.findall(r'write (\w+ = "\w+") under (?:its )?(\[+\w+\]+)', RULES[rule].mend)
    assert len(written) == 1, RULES[rule].mend
    line, table = written[0]
    scene.write_text(
        text.replace(f"{table}\n", f"{table}\n{line}\n", 1) if table in text else f"{text}{table}\n{line}\n"
    )
    assert faults_of(scene) == [] and line in scene.read_text()


# --- the guard: no advice that is tried nowhere --------------------------------------------------------

LITERAL = re.compile(r"`|--\w|\w = |\[|\{ |\"|PARADIZE_|\bwrite |did you mean|allowed:|known:")


@pytest.mark.parametrize(
    "table, says, mended",
    [
        ("x,y,z\n", "write one for each instance below the header", "x,y,z\n1,2,3\n"),
        ("x,y,z\n1,2\n", "write one for each of x, y, z", "x,y,z\n1,2,3\n"),
    ],
)
def test_a_table_of_instances_is_read_as_its_refusal_advises(
    table: str, says: str, mended: str, tmp_path: Path
) -> None:
    file = tmp_path / "copies.csv"
    file.write_text(table)
    with pytest.raises(SceneError, match=re.escape(says)):
        read_instances(file)
    file.write_text(mended)
    assert len(read_instances(file)) == 1


def test_a_scene_takes_what_a_cutoff_without_a_mask_is_advised(tmp_path: Path) -> None:
    scene = make_cove(tmp_path)
    lines = ['alpha_mode = "blend"', "alpha_cutoff = 0.5"]
    table = "\n".join(["[object.material.leaf]", *lines, "", "[[object.instance]]"])
    scene.write_text(scene.read_text().replace("[[object.instance]]", table, 1))
    (fault,) = faults_of(scene)
    assert "leave it out" in fault.mend
    text = scene.read_text()
    scene.write_text(text.replace(lines[1], ""))
    assert faults_of(scene) == []
    (written,) = re.findall(r'or write (\w+ = "\w+")', fault.mend)
    scene.write_text(text.replace(lines[0], written))
    assert faults_of(scene) == []


DARK_AT = "[[daytime]]\nsun = { intensity = 0.0 }\nat_s = "  # a key without sunlight

# a line of a scene's table, what its mend holds, and the line as the message advises it
TABLES = [
    ("[sound]\n", "on_s = 1.0", "write both or none", "on_s = 1.0\noff_s = 2.0"),
    ("[sound]\n", "on_s = 1.0\noff_s = 1.0", "write different seconds, or none", "on_s = 1.0\noff_s = 2.0"),
    ("[sound]\n", "line = [[0, 0, 0]]", "write 2 to 256 points [x, y, z]", "line = [[0, 0, 0], [1, 0, 0]]"),
    (
        '[[light]]\nname = "lamp"\n', "", "write position = [x, y, z], or the name of an object",
        "position = [0, 1, 0]",
    ),
    (
        "[[daytime]]\nat_s = 1.0\n", "", "write two or more, or leave it out",
        "[[daytime]]\nat_s = 4.0",
    ),
    (
        '[clouds]\npicture = "sand.png"\n', "", "write two or more keys, or leave it out",
        "[[daytime]]\nat_s = 1.0\n[[daytime]]\nat_s = 4.0",
    ),
    (
        "[[daytime]]\nat_s = 1.0\n", f"{DARK_AT}2.0\n{DARK_AT}4.0\nmoon = {{ intensity = 0.3 }}",
        "set sun.intensity or moon.intensity to 0, or write a key between in which both are 0",
        f"{DARK_AT}2.0\n{DARK_AT}4.0\nmoon = {{ intensity = 0.3 }}\n{DARK_AT}6.0",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("table", "line", "says", "mended"), TABLES, ids=[says for _, _, says, _ in TABLES])
def test_a_scene_takes_what_the_refusal_of_a_table_advises(
    tmp_path: Path, table: str, line: str, says: str, mended: str
) -> None:
    scene = make_cove(tmp_path)
    text = scene.read_text() if table in scene.read_text() else f"{scene.read_text()}\n{table}"
    scene.write_text(text.replace(table, f"{table}{line}\n"))
    (fault,) = faults_of(scene)
    assert says in str(fault.mend)
    scene.write_text(text.replace(table, f"{table}{mended}\n"))
    assert faults_of(scene) == []


COVERED = [  # of messages that are followed above, in test_advice.py and in test_wrong_inputs.py
    r"(\{\}|\d)* ?numbers, .*|allowed: .*|\{\}, or \{\}|write one or more of .*|did you mean .*|known: .*",
    r"write the smaller numbers? first|write it as .*|write a rule's code.*|write \{ soft.*",
    r"write true or false|write some words|write each once|write 1 to 40 of.*|write strings in brackets.*",
    r"write \[.*|write \{\}, and its keys below|write a path relative.*|write \{\} files\{\}",
    r"write a number or three, .*|write one for each instance below the header|write one for each of \{\}",
    r"write lod_(errors|size_px) with .*|write one target .*|the scene has no \[.*|must .*",
    *(".*" + re.escape(says) + ".*" for _, says, _ in LINES.values()),
    r"`paradize .*|.*; `paradize new DIR` .*|write \{\}|write \{\}:///folder",
    r"write a number of \{\}, such as 2",
    r"leave it out, or write alpha_mode = \"mask\"|write \{\} to \{\} points .*",
    *(re.escape(says) for _, _, says, _ in TABLES),
]
_CHARTS = "weld the mesh (--weld), so that triangles share edges, or paint its own layout"
ELSEWHERE = {  # where it is followed; or why it is not
    "allow more: `ulimit -n 1024`": "needs a machine without open files to spare",
    "allow more (`ulimit -a`), or work with fewer: `-j 1`": "needs a machine without memory",
    "bake with --force": "tests/pipeline/build/test_verify.py",
    "start some with `dask worker`": "needs a cluster",
    "start it with `dask scheduler`, or mend the address: tcp://HOST:PORT": "needs a cluster",
    "install it as of setup/python-test.txt, or with pip install 'paradize[cluster]'": "needs the network",
    "let this user write there, or set PARADIZE_STORE to another folder": "root may write anywhere",
    "write paradize.{}(..., budget={})": "tests/pipeline/test_api.py",
    'of a panorama write faces = ["panorama.exr"]': "tests/pipeline/bakers/test_panorama.py",
    "{}; else write the six faces of a cube map": "tests/pipeline/bakers/test_panorama.py",
    "cut these out, and write them as six files": "tests/pipeline/bakers/test_face_order.py",
    "write {} in [sun], or turn the picture": "tests/pipeline/checks/test_skies.py",
    "write 0 or more": "of a Python function; the command line refuses first",
    _CHARTS: "needs more charts than a square holds",
}


def templates(node: ast.expr | None, names: dict[str, list[ast.expr]]) -> list[str]:
    """The texts that an expression may be, {} for what is filled in."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value]
    if isinstance(node, ast.JoinedStr):
        return ["".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)]  # type: ignore[misc]
    if isinstance(node, ast.IfExp):
        return [*templates(node.body, names), *templates(node.orelse, names)]
    if isinstance(node, ast.BoolOp):
        return [text for part in node.values for text in templates(part, names)]
    if isinstance(node, ast.Name):
        return [text for found in names.get(node.id, []) for text in templates(found, {})]
    return []


def advice_of(path: Path) -> Iterator[str]:
    """Every text that a module gives as a mend."""
    text = path.read_text()
    if "mend" not in text and ".add(" not in text:
        return
    tree = ast.parse(text)
    scopes = [tree, *(node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))]
    for scope in scopes:
        names: dict[str, list[ast.expr]] = {}
        nodes = list(ast.walk(scope))
        for node in nodes:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                names.setdefault(node.targets[0].id, []).append(node.value)
        for node in nodes:
            if isinstance(node, ast.Call):
                given = [word.value for word in node.keywords if word.arg == "mend"]
                if isinstance(node.func, ast.Attribute) and node.func.attr == "add" and len(node.args) == 3:
                    given.append(node.args[2])
                for mend in given:
                    if not isinstance(mend, ast.Name) or scope is not tree or mend.id.startswith("_"):
                        yield from templates(mend, names)


def test_every_literal_advice_is_tried() -> None:
    found = {text for path in PACKAGE.rglob("*.py") for text in advice_of(path) if LITERAL.search(text)}
    covered = re.compile("|".join(f"(?:{pattern})" for pattern in COVERED), re.S)
    untried = sorted(text for text in found if text not in ELSEWHERE and not covered.fullmatch(text))
    assert not untried, "follow them in this module"
    assert sorted(set(ELSEWHERE) - found) == [], "no module says so any more"

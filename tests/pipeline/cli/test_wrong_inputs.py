"""Every command, given every kind of file: it takes it, or says in one message what the file is and what to
do, and what it says to do works."""

from __future__ import annotations

import io
import re
import shlex
import shutil
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np
import pytest

from paradize.cli.main import main
from paradize.cli.output import MOST_LINE
from paradize.errors import MAX_MEND, MAX_PART, BakeError, GroupedError
from tests.pipeline.readers.gltf.made import SQUARE, shown
from tests.pipeline.readers.gltf.made import square as made_square
from tests.pipeline.scenes import make_cove
from tests.sweeps import sweep

MODELS = {"post.obj", "post.glb", "model.gltf"}
SIZE = ("--size", "9", "9", "--height", "1")
# Of each command: its words for an input, and what it takes. Text may become a scene while it is watched.
COMMANDS: dict[str, tuple[Callable[[str], list[str]], set[str]]] = {
    "bake": (lambda file: ["bake", file, "-o", "out"], {"cove.toml"}),
    "watch": (lambda file: ["watch", file], {"cove.toml", "notes.txt"}),
    "explain": (lambda file: ["explain", file], {"cove.toml"}),
    "mesh": (lambda file: ["mesh", file, "-o", "out.glb"], MODELS),
    "new": (lambda file: ["new", "out", "--from", file], MODELS),
    "uv": (lambda file: ["maps", "wood.png", "-o", "out", "--uv", file], MODELS),
    "maps": (lambda file: ["maps", file, "-o", "out"], {"wood.png", "grey.png", "N00E000.hgt"}),
    "terrain": (lambda file: ["terrain", file, "-o", "out.glb", *SIZE], {"grey.png", "N00E000.hgt"}),
    "measure": (
        lambda file: ["measure", file, "-o", "out"],
        {"cove.toml", *MODELS, "wood.png", "grey.png", "N00E000.hgt"},
    ),
    "check": (
        lambda file: ["check", file],
        {"baked", "baked/scene.json", "post.glb", "wood.ktx2", "wood.png", "grey.png", "cove.toml"},
    ),
    "export": (lambda file: ["export", file, "-o", "out.glb"], {"baked", "baked/scene.json"}),
}
FILES = [
    "cove.toml", "post.obj", "post.mtl", "wood.png", "grey.png", "wood.ktx2", "post.glb", "baked",
    "baked/scene.json", "folder", "empty", "missing", "sea.ogg", "notes.txt", "N00E000.hgt", "model.gltf",
    "some.bin",
]  # fmt: skip


def run(*words: str) -> tuple[int, str, str]:
    """Exit code, standard output, standard error."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main(words)
    return code, out.getvalue(), err.getvalue()


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]) -> Path:
    """A folder with a file of each kind."""
    folder = tmp_path_factory.mktemp("kinds")
    patch = pytest.MonkeyPatch()
    patch.setenv("PARADIZE_STORE", str(cove_store(tmp_path_factory.mktemp("store") / "own")))
    patch.chdir(folder)
    make_cove(folder)
    assert run("bake", "cove.toml", "-o", "baked")[0] == 0
    assert run("mesh", "post.obj", "-o", "post.glb")[0] == 0
    assert run("maps", "wood.png", "-o", "m", "--only", "height")[0] == 0
    (folder / "m/wood_height.ktx2").rename(folder / "wood.ktx2")
    (folder / "grey.png").write_bytes((folder / "height.png").read_bytes())
    (folder / "folder").mkdir()
    (folder / "empty").touch()
    (folder / "notes.txt").write_text("A few words, and no more.\n")
    (folder / "some.bin").write_bytes(bytes(range(256)) * 9)
    square, primitive = made_square(TEXCOORD_0=SQUARE[:, :2])
    shown(primitive, square).gltf(folder / "model.gltf")
    (np.arange(81).reshape(9, 9)).astype(">i2").tofile(folder / "N00E000.hgt")
    patch.undo()
    return folder


@pytest.fixture
def at(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder: copies of all of them, and nothing else."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("PARADIZE_REPORT", "")
    folder = tmp_path / "here"
    shutil.copytree(made, folder)
    monkeypatch.chdir(folder)
    return folder


def advised(message: str) -> list[list[str]]:
    """The commands that a message names."""
    return [shlex.split(found)[1:] for found in re.findall(r"`(paradize [^`]*)`", message)]


# Advice that was followed: all of these tests begin with the same files.
FOLLOWED: set[tuple[str, ...]] = set()
WRONG = [(command, file) for command, (_, takes) in COMMANDS.items() for file in FILES if file not in takes]


# Each command, and most files, with a twelfth of the others.
@pytest.mark.parametrize(("command", "file"), sweep(WRONG, test=WRONG[4::12]))
def test_a_wrong_kind_of_input_is_one_message_whose_advice_works(at: Path, command: str, file: str) -> None:
    code, out, err = run(*COMMANDS[command][0](file))
    result = out if command == "check" else err
    assert code == 1, (code, out, err)
    # On a busy machine work takes so long that its progress is told.
    lines = [line for line in result.splitlines() if "warning" not in line and " so far: " not in line]
    message = lines[0]
    assert file in message and len(message) < 500 and message.isprintable()
    assert len([line for line in lines if not line.startswith("1 error, ")]) == 1, result
    assert not any((at / name).exists() for name in ("out", "out.glb"))
    assert ";" in message, "a mend"
    for words in advised(message):
        filled = tuple({"DIR": "made", "SCENE.toml": "cove.toml"}.get(word, word) for word in words)
        if filled not in FOLLOWED:
            code, out, err = run(*filled)
            assert code == 0, (message, filled, out, err)
            FOLLOWED.add(filled)


MISNAMED = [
    ["mesh", "post.obj", "-o", "a.gltf"],
    ["mesh", "post.obj", "-o", "a"],
    ["terrain", "grey.png", "-o", "a.gltf", *SIZE],
    ["terrain", "grey.png", "-o", "a.png", *SIZE],
    ["export", "baked", "-o", "a.gltf"],
    ["maps", "wood.png", "-o", "a.ktx2"],
    ["maps", "wood.png", "-o", "a.png", "--format", "png"],
    ["measure", "wood.png", "-o", "a.html"],
    ["bake", "cove.toml", "-o", "a.glb"],
]


@pytest.mark.parametrize(
    "words",
    sweep(MISNAMED, test=[words for words in MISNAMED if words[0] in ("export", "bake")]),
)
def test_a_name_of_another_format_is_refused_and_the_one_advised_taken(at: Path, words: list[str]) -> None:
    before = set(at.iterdir())
    code, _, err = run(*words)
    assert code == 1 and len(err.splitlines()) == 1, err
    assert set(at.iterdir()) <= before | {at / "build"}
    advice = re.search(r"write `-o ([^`]+)`", err)
    assert advice is not None, err
    if words[0] != "measure":
        assert (
            run(*[advice[1] if word.startswith("a") and word == words[3] else word for word in words])[0] == 0
        )
    assert Path(advice[1]).suffix in (".glb", "")


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (["maps", "wood.png", "-o", "a.tif"], "-o a"),
        (["maps", "wood.png", "-o", "out", "--report", "a.gif"], "--report a"),
        (["measure", "wood.png", "-o", "a.exr"], "-o a"),
        (["new", "a.obj"], "paradize new a"),
    ],
)
def test_no_command_makes_a_folder_under_the_name_of_a_file(at: Path, words: list[str], advice: str) -> None:
    before = set(at.iterdir())
    code, _, err = run(*words)
    assert code == 1 and len(err.splitlines()) == 1, err
    assert "looks like the name of a file; the output is a folder" in err and f"write `{advice}`" in err
    assert set(at.iterdir()) == before


def test_what_fills_a_message_is_cut_in_the_middle() -> None:
    junk = "".join(map(chr, range(1, 40))) * 200
    error = BakeError(junk, file="a.obj", place=junk, mend=junk)
    assert len(str(error)) < 2 * MAX_PART + MAX_MEND + 20 and str(error).isprintable()
    assert len(str(GroupedError([error, error]))) < 2 * len(str(error)) + 2
    code, out, err = run("mesh", "missing.obj", "-o", "out.glb", "--tier", junk)
    assert code == 2 and out == ""
    assert all(len(line) <= MOST_LINE and line.isprintable() for line in err.splitlines())


def test_a_picture_that_an_object_names_as_its_mesh_is_told_as_such(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = make_cove(tmp_path)
    scene.write_text(scene.read_text().replace('mesh = "post.obj"', 'mesh = "wood.png"'))
    code, _, err = run("bake", str(scene), "-o", str(tmp_path / "out"))
    assert code == 1 and "is a PNG picture, not an OBJ, glTF, PLY or STL model" in err and len(err) < 2000

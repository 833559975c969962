"""Common to every command: a light start, and --json."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from paradize.artifact import Artifact
from paradize.build.provenance import BakeReport
from paradize.cli.bake import MANY, show_bake
from paradize.cli.main import COMMANDS, EXAMPLES, main, parser
from tests.pipeline.scenes import make_cove, tone
from tests.pipeline.shapes import CORNER_OBJ
from tests.places import ROOT
from tests.sweeps import sweep

# All of this package that a bake with nothing to do loads.
# Slow to load, or not for that. A bake with nothing to do may take 8 times python's own start.
HEAVY = {"multiprocessing", "numpy", "secrets", "socket", "subprocess", "tqdm"}
MOST = 150
SCRIPT = """
import sys
before = set(sys.modules)
from paradize.cli.main import main
assert main(sys.argv[1:]) == 0
import json
print(json.dumps(sorted(set(sys.modules) - before)))
"""
# Of each command, words that it must refuse, without --json.
REFUSED: dict[str, list[str]] = {
    "bake": ["gone.toml"],
    "mesh": ["gone.obj", "-o", "out.glb"],
    "maps": ["gone.png", "-o", "out"],
    "terrain": ["gone.png", "-o", "out.glb", "--size", "1", "1", "--height", "1"],
    "explain": ["gone.toml"],
    "check": ["--format", "gone"],
    "measure": ["gone.png", "-o", "out"],
    "watch": ["gone.toml"],
    "export": ["gone", "-o", "out.glb"],
    "new": ["full"],
    "clean": ["--older-than", "gone"],
    "completion": ["gone"],
}


@pytest.mark.parametrize("changed", sweep([False, True], test=[False]))
def test_a_bake_with_nothing_to_do_loads_few_modules(
    changed: bool, tmp_path: Path, cove_store: Callable[[Path], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = make_cove(tmp_path / "scene")
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    environment = {**os.environ, "PARADIZE_REPORT": ""}
    words = ["bake", str(scene), "-o", str(tmp_path / "out"), "-j", "2"]

    def loaded() -> set[str]:
        call = [sys.executable, "-I", "-c", SCRIPT, *words]
        output = subprocess.run(call, capture_output=True, text=True, check=True, env=environment).stdout
        return set(json.loads(output.splitlines()[-1]))

    assert main(words) == 0
    if changed:
        (scene.parent / "sea.ogg").write_bytes(tone(220.0))
        assert loaded() & HEAVY  # it bakes
    else:
        again = loaded()
        assert not again & HEAVY and len(again) <= MOST


def test_a_command_that_bakes_one_file_leaves_all_but_the_report_to_its_worker(tmp_path: Path) -> None:
    (tmp_path / "nook.obj").write_text(CORNER_OBJ)
    call = [sys.executable, "-I", "-c", SCRIPT, "mesh", "nook.obj", "-o", "nook.glb"]
    output = subprocess.run(call, capture_output=True, text=True, check=True, cwd=tmp_path).stdout
    loaded = set(json.loads(output.splitlines()[-1]))
    assert "paradize.build.single_file" in loaded  # which the worker loads too
    heavy = {
        "numpy",
        "paradize.api",
        "paradize.bakers",
        "paradize.build.bake",
        "paradize.checks",
        "paradize.tradeoff",
    }
    assert not loaded & heavy


def test_of_many_artifacts_the_table_tells_those_that_are_not_as_they_were(tmp_path: Path) -> None:
    rows = [Artifact(f"thing_{i}", status="reused", bytes=1) for i in range(MANY + 1)]
    rows[3], rows[5] = replace(rows[3], status="baked"), replace(rows[5], over=["too coarse"])
    result = io.StringIO()
    show_bake(BakeReport(tmp_path, rows), result)
    assert "thing_3 " in result.getvalue() and "thing_5 " in result.getvalue()
    assert "thing_4 " not in result.getvalue() and f"{MANY - 1} artifacts did not change" in result.getvalue()
    few = io.StringIO()
    show_bake(BakeReport(tmp_path, rows[:MANY]), few)
    assert "thing_4 " in few.getvalue()


def test_the_help_of_every_command_has_an_example_that_parses() -> None:
    assert EXAMPLES.keys() == COMMANDS.keys()
    for command, example in EXAMPLES.items():
        assert parser(command).parse_args(example.split()).command == command


def test_every_command_has_words_that_it_refuses() -> None:
    assert REFUSED.keys() == COMMANDS.keys()


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("words", ["refused", "wrong"])
def test_every_command_refuses_with_one_json_object(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: str,
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    (tmp_path / "full").mkdir()
    (tmp_path / "full/file").touch()
    given = REFUSED[command] if words == "refused" else ["--no-such-option"]
    code = main([command, *given, "--json"])
    out, err = capsys.readouterr()
    report: dict[str, Any] = json.loads(out)
    assert code == (2 if words == "wrong" else code) and code in (1, 2)
    assert report["error"] and all(isinstance(text, str) and text for text in report["error"])
    if words == "refused":
        assert any(word in err for word in ("gone", "full"))


def json_of(capsys: pytest.CaptureFixture[str]) -> Callable[..., dict[str, Any]]:
    """Runs a command with --json; its object."""

    def call(*words: object) -> dict[str, Any]:
        assert main([*map(str, words), "--json"]) == 0
        found: dict[str, Any] = json.loads(capsys.readouterr().out)
        return found

    return call


def documented(command: str) -> set[str]:
    """The keys that the page of the commands names for a command."""
    page = (ROOT / "pipeline/paradize/cli/README.md").read_text().partition("## JSON")[2]
    (row,) = re.findall(rf"^\| `{command}` \| (.*) \|$", page, re.M)
    return set(re.findall(r"`(\w+)`", row))


def test_what_ends_well_is_one_json_object_too_whose_keys_the_page_names(
    tmp_path: Path,
    cove_store: Callable[[Path], Path],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    monkeypatch.setenv("PARADIZE_REPORT", "")
    run = json_of(capsys)

    def call(command: str, *words: object) -> dict[str, Any]:
        found = run(command, *words)
        assert found.keys() <= documented(command), command
        return found

    assert "scene" in call("new", "mine")
    scene = make_cove(tmp_path / "scene")
    assert "artifacts" in call("bake", scene, "-o", "out")
    assert call("explain", scene, "-o", "out")
    assert call("check", "out")["errors"] == 0
    assert call("export", "out", "-o", "all.glb")
    (lod,) = call("mesh", "scene/post.obj", "-o", "post.glb", "--lods", 1)["lods"]
    assert lod["draw"].keys() <= documented("mesh") | {"acmr_before", "atvr_before"}
    assert call("maps", "scene/wood.png", "-o", "maps", "--only", "height")["maps"][
        "height"
    ].keys() <= documented("maps")
    assert call("terrain", "scene/height.png", "-o", "ground.glb", "--size", 9, 9, "--height", 1)["triangles"]
    assert "dropped" in call("clean", "--older-than", "1d")
    assert call("completion", "zsh")["shell"] == "zsh"

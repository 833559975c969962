"""No name from a broken or hostile file can control the terminal."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT
from tests.player.synthetic import write_scene

Player = Callable[..., "subprocess.CompletedProcess[str]"]
# Clears the screen, sets the window's title, reverses text, starts a new line.
EVIL = "\x1b[2J\x1b]0;owned\x07\x9b31m\u202eexe\nparadize-player: all is well\r\x7f"
Edit = Callable[[dict[str, Any]], None]


def harmless(text: str) -> None:
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", text), ascii(text)
    assert text.count("\nparadize-player: ") == 0
    assert "\\x1B[2J" in text


def edits() -> dict[str, Edit]:
    def in_box(key: str, value: Any) -> Edit:
        return lambda tree: tree["objects"][0].update({key: value})

    def unknown_key(tree: dict[str, Any]) -> None:
        tree[EVIL] = 1

    def artifact(tree: dict[str, Any]) -> None:
        tree["artifacts"][EVIL] = {"kind": EVIL, "file": "x"}

    def file(tree: dict[str, Any]) -> None:
        tree["artifacts"]["box_color"]["file"] = EVIL.replace("\n", "")

    def streaming(tree: dict[str, Any]) -> None:
        tree["streaming"] = [EVIL]

    def object_name(tree: dict[str, Any]) -> None:
        tree["objects"][0] |= {"name": EVIL, "lods": []}

    return {
        "an unknown key": unknown_key,
        "an artifact's name": artifact,
        "a file": file,
        "a reference": in_box("mesh", EVIL),
        "streaming": streaming,
        "an object's name": object_name,
        "format": lambda tree: tree.update({"format": EVIL}),
    }


@pytest.mark.parametrize("what", sorted(edits()))
def test_a_name_in_scene_json_reaches_the_terminal_escaped(player: Player, tmp_path: Path, what: str) -> None:
    scene = write_scene(tmp_path / "scene", bare=True)
    tree = json.loads((scene / "scene.json").read_text())
    edits()[what](tree)
    (scene / "scene.json").write_text(json.dumps(tree))
    result = player(scene, "--size", "16x16")
    assert result.returncode == 1
    harmless(result.stderr)


def test_what_is_wrong_in_scene_json_is_one_bounded_message_that_ends_with_what_to_do(
    player: Player, tmp_path: Path
) -> None:
    scene = write_scene(tmp_path / "scene", bare=True)
    text = (scene / "scene.json").read_text()

    def said(changed: str) -> str:
        (scene / "scene.json").write_text(changed)
        result = player(scene, "--size", "16x16")
        assert result.returncode == 1 and result.stderr.count("\n") == 1
        place, _, mend = result.stderr.removeprefix("paradize-player: ").partition("; bake the scene ")
        assert mend.startswith(("again: paradize bake SCENE.toml", "with the same version"))
        return place.removeprefix(f"{scene}/scene.json: ")

    def edited(**changes: Any) -> str:
        return json.dumps(json.loads(text) | changes)

    assert said("[1]") == "must hold one JSON object, holds array"
    assert said(text[: len(text) // 2]).startswith("is not valid JSON: ")
    assert said(text.replace('"exposure"', '"exposure": 2, "exposure"', 1)) == (
        'key "exposure" appears twice in one object'
    )
    assert said(edited(exposure="1.0")) == "exposure: must be a number, is string"
    assert said(edited(exposure=1e300)) == "exposure: is 1e+300, must lie in [1e-06, 1000000]"
    assert said(edited(viewport=[96.5, 54])) == "viewport[0]: is 96.5, must be a whole number"
    assert said(edited(viewport=[96])) == "viewport: must be an array of 2 entries, is 1 entries"
    assert said(edited(flight=None)) == "flight: must be an object, is null"
    for letter in ("k", "\x1b", "\u202e", "\u4e2d"):
        long = said(edited(**{letter * 100_000: 1}))
        assert (
            7000 < len(long.encode()) < 8050
            and " ... " in long
            and long.endswith("is unknown to this player")
        )


def test_names_of_folders_and_options_reach_the_terminal_escaped(player: Player, tmp_path: Path) -> None:
    result = player(tmp_path / EVIL)
    assert result.returncode == 1
    harmless(result.stderr)
    result = player(tmp_path, "--disable", EVIL)
    assert result.returncode == 2
    harmless(result.stderr)


def test_all_messages_go_through_one_function() -> None:
    for path in sorted((ROOT / "player").rglob("*.[ch]pp")):
        if path.name != "messages.cpp":
            text = path.read_text()
            assert not re.search(r"\b(stderr|stdout|cerr|cout|perror|v?printf)\b", text), path

"""The page of a scene's fields: made from the settings, and its examples are a scene."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path
from typing import Any

import pytest

from paradize.scene.reference import EXAMPLES, PAGE, fields_page
from paradize.scene.settings import Scene, load_scene

FILES = ("px", "nx", "py", "ny", "pz", "nz")


def test_the_page_is_what_the_settings_say() -> None:
    assert PAGE.read_text() == fields_page(), "python -m paradize.scene.reference writes it"


def test_a_table_without_an_example_is_named_with_the_mend(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(EXAMPLES, "light_shafts")
    with pytest.raises(LookupError, match="'light_shafts' has no example; add one to EXAMPLES"):
        fields_page()


def test_every_field_has_a_meaning() -> None:
    def unexplained(of: Any) -> list[str]:
        own = [
            f"{of.__name__}.{item.name}" for item in dataclasses.fields(of) if not item.metadata["meaning"]
        ]
        inner = [item.metadata["of"] for item in dataclasses.fields(of) if item.metadata["of"]]
        return own + [name for one in inner for name in unexplained(one)]

    assert unexplained(Scene) == []


def test_the_examples_of_the_page_are_one_scene(tmp_path: Path) -> None:
    text = "\n\n".join(EXAMPLES.values())
    names = [*(f"{face}.exr" for face in FILES), "ground.png", "sand.png", "waves.png", "palm.obj", "sea.ogg"]
    names += ["clouds.png", "shore.ogg", "morning.ogg", "night.ogg"]
    for name in names:
        (tmp_path / name).write_bytes(b"looked for, not read")
    path = tmp_path / "scene.toml"
    path.write_text(text)
    scene = load_scene(path)
    assert (
        scene.objects[0].materials["leaf"].two_sided
        and scene.terrain
        and scene.terrain.sand_relief.contrast == 1.5
    )
    assert set(tomllib.loads(text)) == {key.partition(".")[0] for key in EXAMPLES}

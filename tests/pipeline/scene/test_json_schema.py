"""The JSON Schema of a scene file says what the reader of scenes says, field by field."""

from __future__ import annotations

import dataclasses
import json
import tomllib
from collections.abc import Callable, Iterator
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

import fastjsonschema
import pytest

from paradize.new.scene import new_scene
from paradize.scene.json_schema import scene_schema
from paradize.scene.reference import EXAMPLES, SCHEMA, schema_text
from paradize.scene.schema import Faults
from paradize.scene.settings import Scene
from tests.places import ROOT
from tests.sweeps import sweep


def is_valid(schema: dict[str, Any], value: object) -> bool:
    try:
        fastjsonschema.compile(schema)(value)
    except fastjsonschema.JsonSchemaValueException:
        return False
    return True


def as_json(value: Any) -> Any:
    """A TOML value as validators see it: days are texts."""
    if isinstance(value, dict):
        return {key: as_json(item) for key, item in value.items()}
    if isinstance(value, list):
        return [as_json(item) for item in value]
    return value.isoformat() if isinstance(value, date) else value


def leaves(of: type, path: str = "") -> Iterator[tuple[str, Any]]:
    """Every field that holds no table, by its path."""
    for item in dataclasses.fields(of):  # type: ignore[arg-type]
        key = path + (item.metadata["key"] or item.name)
        if item.metadata["of"] is None:
            yield key, item
        else:
            yield from leaves(item.metadata["of"], f"{key}.")


LEAVES = dict(leaves(Scene))
WORDS = [choice for item in LEAVES.values() for choice in item.metadata["json"].get("enum", [])]
VALUES: list[object] = [
    True, 0, 1, 3, -1, 0.5, 1e-9, 1e30, -1e30, 10**400, "", "a word", "palm_2", "PZ104", "2P",
    [], ["x"], [0.1, 0.2], [1, 2], [2, 1], [0.1, 0.2, 0.3], [0.0] * 6, ["camera"], ["camera", "camera"],
    {}, {"PZ104": "off"}, {"PZ104": "x"}, {"normal_p99_deg": 3.0}, {"normal_p99_deg": -3.0},
    {"normal_p99_deg": {"soft": 1.0, "hard": 2.0}}, {"normal_p99_deg": {"medium": 1.0}}, {"no_metric": 1.0},
    *WORDS,
]  # fmt: skip
# Rules that a schema cannot state: that files exist, that numbers rise, that a day is not text.
ONLY_THE_READER = (
    "looked for in",
    "there is no file",
    "lies outside",
    "the smaller number",
    "without quotes",
)


def edges(schema: dict[str, Any]) -> list[object]:
    """Numbers at the limits of a schema and just beyond them; lists of these and of one number too many."""
    found: list[object] = [edge for part in schema.get("anyOf", ()) for edge in edges(part)]
    if "maximum" in schema:
        low, high = schema["minimum"], schema["maximum"]
        step = 1 if schema["type"] == "integer" else 1e-6 * (high - low)
        found += [low - step, low, high, high + step]
    for edge in edges(schema["items"]) if "items" in schema else []:
        found += [[edge] * count for count in (schema.get("minItems", 1), schema.get("maxItems", 1) + 1)]
    return found


@cache
def compiled_schema(text: str) -> Callable[[object], object]:
    """Many fields have the same one, and to compile takes most of a test's time."""
    made: Callable[[object], object] = fastjsonschema.compile(json.loads(text))
    return made


# Each third, and one of each kind of rule.
QUICK = [*LEAVES][::3]
QUICK += {field.metadata["rule"].__qualname__: place for place, field in LEAVES.items()}.values()


@pytest.mark.parametrize("place", sweep(LEAVES, test=QUICK))
def test_schema_and_reader_agree_about_every_field(place: str, tmp_path: Path) -> None:
    facts = LEAVES[place].metadata
    compiled = compiled_schema(json.dumps(facts["json"], sort_keys=True))
    for value in [*VALUES, *edges(facts["json"])]:
        faults = Faults(tmp_path / "scene.toml")
        facts["rule"](value, place, faults)
        try:
            compiled(value)
            valid = True
        except fastjsonschema.JsonSchemaValueException:
            valid = False
        said = " ".join(str(error) for error in faults.errors)
        if valid and faults.errors:
            assert any(words in said for words in ONLY_THE_READER), (value, said)
        assert valid or faults.errors, value


def test_the_schema_file_is_what_the_settings_say() -> None:
    assert SCHEMA.read_text() == schema_text(), "python -m paradize.scene.reference writes it"


@pytest.mark.deep
def test_scenes_that_bake_are_valid(tmp_path: Path) -> None:
    schema = scene_schema()
    made = new_scene(tmp_path / "made").scene
    texts = [(ROOT / "raw_assets/island.toml").read_text(), "\n\n".join(EXAMPLES.values()), made.read_text()]
    for text in texts:
        tree = as_json(tomllib.loads(text))
        fastjsonschema.compile(schema)(tree)
        tree["scene"]["nmae"] = "x"
        assert not is_valid(schema, tree), "an unknown key passes"
        del tree["scene"]
        assert not is_valid(schema, tree), "a missing table passes"


def test_a_new_scene_names_its_schema_for_editors(tmp_path: Path) -> None:
    made = new_scene(tmp_path / "made")
    line = made.scene.read_text().splitlines()[0]
    assert line == "#:schema scene.schema.json"
    assert (made.scene.parent / "scene.schema.json").read_text() == schema_text()

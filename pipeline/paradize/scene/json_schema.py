"""The fields of a scene as JSON Schema (draft 7), with which editors complete and check a scene file.

    python -m paradize.scene.reference

writes scene.schema.json beside FIELDS.md. It does not know what concerns several fields, nor whether files
exist.
"""

from __future__ import annotations

import dataclasses
from dataclasses import MISSING
from typing import Any

from paradize.scene.settings import Scene


def scene_schema() -> dict[str, Any]:
    """The schema of a scene file."""
    head = {"$schema": "http://json-schema.org/draft-07/schema#", "title": "A scene of Paradize"}
    return head | _table(Scene)


def _table(of: type) -> dict[str, Any]:
    fields = {item.metadata["key"] or item.name: item for item in dataclasses.fields(of)}
    missing = [
        key for key, item in fields.items() if item.default is MISSING and item.default_factory is MISSING
    ]
    others = {key: fields[key].metadata["instead"] for key in missing if fields[key].metadata["instead"]}
    needed = [key for key in missing if key not in others]
    return {
        "type": "object",
        "properties": {key: _field(item) for key, item in fields.items()},
        **({"required": needed} if needed else {}),
        **({"allOf": [_either(*pair) for pair in others.items()]} if others else {}),
        "additionalProperties": False,
    }


def _either(one: str, other: str) -> dict[str, Any]:
    return {"anyOf": [{"required": [one]}, {"required": [other]}]}


def _field(item: Any) -> dict[str, Any]:
    facts = item.metadata
    unit = f", {facts['unit']}" if facts["unit"] else ""
    schema: dict[str, Any] = {"description": f"{facts['meaning']}{unit}", **facts["json"]}
    if item.default is not MISSING and item.default not in (None, ()):
        schema["default"] = list(item.default) if isinstance(item.default, tuple) else item.default
    if facts["of"] is None:
        return schema
    own = _table(facts["of"])
    if facts["lone"]:
        return {"description": schema.pop("description"), "anyOf": [schema | {"items": own}, own]}
    return schema | {"array": {"items": own}, "object": {"additionalProperties": own}}.get(
        schema.get("type", ""), own
    )

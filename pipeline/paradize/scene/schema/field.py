"""The field of a table: a rule that checks its value and adds its faults to those of the file."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import field
from pathlib import Path
from typing import Any

from paradize.errors import GroupedError, ParadizeError, SceneError
from paradize.files import resolved

MOST_FAULTS = 100  # reported for one file


class Faults:
    """Collects the faults of one file. `file` is named in each; sources are looked for beside it."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.folder = resolved(file.parent)
        self.errors: list[ParadizeError] = []
        self.tables: list[tuple[str, type[Any]]] = []  # key path, of: those being read, the outermost first

    def add(self, place: str, what: str, mend: str | None = None) -> None:
        """Adds a fault. Raises GroupedError once there are MOST_FAULTS."""
        self.errors.append(SceneError(what, file=self.file, place=place, mend=mend))
        if len(self.errors) == MOST_FAULTS:
            more = SceneError(f"more than {MOST_FAULTS} faults: the rest is not looked at", file=self.file)
            raise GroupedError([*self.errors, more])

    def raise_if_any(self) -> None:
        """Raises SceneError for one fault, GroupedError for more."""
        if len(self.errors) == 1:
            raise self.errors[0]
        if self.errors:
            raise GroupedError(self.errors)


def header(place: str) -> str:
    """Returns a key path as a TOML header writes it: object[0].instance becomes object.instance."""
    return re.sub(r"\[\d+\]", "", place)


Rule = Callable[[object, str, Faults], Any]  # value, key path, faults -> the checked value (None on a fault)


def declare(
    rule: Rule,
    default: Any,
    allowed: str,
    *,
    json: dict[str, Any],
    meaning: str,
    unit: str = "",
    key: str | None = None,
    of: type | None = None,
    instead: str | None = None,
    lone: bool = False,
    formerly: str | None = None,
) -> Any:
    """Returns a field of a dataclass. allowed, meaning, unit: for FIELDS.md. json: the same limits as JSON
    Schema; of a table what is around the schema of its own. of: the dataclass of a table. instead: the key of
    another field that may stand in place of this one, which is then empty. lone: one table may stand for an
    array of one. formerly: its key in older scenes, which is refused with the new one."""
    metadata = {"rule": rule, "unit": unit, "key": key, "allowed": allowed, "meaning": meaning}
    metadata |= {"json": json, "of": of, "instead": instead, "lone": lone, "formerly": formerly}
    if isinstance(default, type) or callable(default):
        return field(default_factory=default, metadata=metadata)
    return field(default=default, metadata=metadata)


def show(value: object) -> str:
    """Returns a value as a message shows it, at most 60 characters."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def nearest(key: str, known: Any) -> str:
    """Returns a mend for an unknown name, the nearest of the known ones; empty where none is near."""
    import difflib

    near = difflib.get_close_matches(key, list(known), n=1)
    return f"did you mean {near[0]}?" if near else ""


def suggestion(key: str, known: Any) -> str:
    """Returns a mend for an unknown name: the nearest of the known ones, else all of them."""
    return nearest(key, known) or f"known: {', '.join(sorted(known))}"

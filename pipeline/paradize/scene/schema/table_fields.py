"""Fields that hold tables, and the reader of a table."""

from __future__ import annotations

import dataclasses
from dataclasses import MISSING
from typing import Any, TypeVar

from paradize.scene.schema.field import Faults, declare, header, nearest, show

T = TypeVar("T")
_EACH_NAME = "a table for each name"


def table(of: type[T], default: Any = MISSING, *, key: str | None = None, meaning: str = "") -> Any:
    """A table that is itself a dataclass of rules. key: its name in the file where that differs."""

    def rule(value: object, place: str, faults: Faults) -> T | None:
        return read_table(of, value, place, faults)

    return declare(rule, default, "a table", json={}, meaning=meaning, key=key, of=of)


def tables(
    of: type[T],
    *,
    least: int = 0,
    most: int = 10_000,
    key: str | None = None,
    instead: str | None = None,
    lone: bool = False,
    meaning: str = "",
) -> Any:
    """An array of tables, `least` to `most` of them. instead: the key of another field that may stand in
    place of all of them. lone: a single table may stand for an array of one."""

    def rule(value: object, place: str, faults: Faults) -> tuple[T, ...] | None:
        if lone and isinstance(value, dict):
            table = read_table(of, value, place, faults)
            return () if table is None else (table,)
        if not isinstance(value, list):
            faults.add(place, f"is {show(value)}, not an array of tables", f"write [[{header(place)}]]")
            return None
        if not least <= len(value) <= most:
            faults.add(place, f"has {len(value)} entries", f"allowed: {least} to {most}")
            return None
        items = [read_table(of, item, f"{place}[{i}]", faults) for i, item in enumerate(value)]
        return tuple(item for item in items if item is not None)

    kind = f"{least} or more tables" if least else "tables"
    json = {"type": "array", "minItems": least, "maxItems": most}
    default = MISSING if least else tuple
    return declare(
        rule, default, kind, json=json, meaning=meaning, key=key, of=of, instead=instead, lone=lone
    )


def named_tables(of: type[T], *, key: str, meaning: str) -> Any:
    """A table of tables by name, such as materials."""

    def rule(value: object, place: str, faults: Faults) -> dict[str, T]:
        if not isinstance(value, dict):
            mend = f"write [{header(place)}.NAME] for each name"
            faults.add(place, f"is {show(value)}, not a table of tables", mend)
            return {}
        read = {name: read_table(of, item, f"{place}.{name}", faults) for name, item in value.items()}
        return {name: item for name, item in read.items() if item is not None}

    return declare(rule, dict, _EACH_NAME, json={"type": "object"}, meaning=meaning, key=key, of=of)


def _known(of: type[Any]) -> dict[str, Any]:
    """The fields of a table by their keys in the file."""
    return {item.metadata["key"] or item.name: item for item in dataclasses.fields(of)}


def _written(item: Any, name: str, place: str) -> str:
    """The header of a table, a field of the table at `place`, as TOML writes it."""
    allowed = item.metadata["allowed"]
    inside = f"{header(place)}." if place else ""
    table = f"[{inside}{name}{'.NAME' if allowed == _EACH_NAME else ''}]"
    return f"[{table}]" if allowed.endswith("tables") else table


def _tables_below(key: str, of: type[Any], place: str) -> str:
    """A mend for a key that belongs to tables in this one; empty where none has it, or more than three."""
    named = [
        _written(item, name, place)
        for name, item in _known(of).items()
        if item.metadata["of"] and key in _known(item.metadata["of"])
    ]
    return f"it is a key of {', '.join(named)}" if 0 < len(named) <= 3 else ""


def _table_around(key: str, faults: Faults) -> str:
    """A mend for a key that belongs to a table around the one that is read; empty where none has it. TOML
    gives a key to the last header above it."""
    for place, of in reversed(faults.tables[:-1]):
        if (item := _known(of).get(key)) is None:
            continue
        if item.metadata["of"]:
            return f"write {_written(item, key, place)}, and its keys below"
        named = f"[[{header(place)}]]" if place.endswith("]") else f"[{header(place)}]"
        return f"it is a key of {named}; write it right below that line"
    return ""


def _unknown(key: str, known: dict[str, Any], faults: Faults) -> str:
    """A mend for a key that the table that is read, the last of faults.tables, does not have."""
    place, of = faults.tables[-1]
    now = [name for name, item in known.items() if item.metadata["formerly"] == key]
    if now:
        return f"its name is {now[0]} now"
    mend = _tables_below(key, of, place) or _table_around(key, faults) or nearest(key, known)
    beside = (_tables_below(key, around, place) for place, around in reversed(faults.tables[:-1]))
    return mend or next(filter(None, beside), f"known: {', '.join(sorted(known))}")


def read_table(of: type[T], value: object, place: str, faults: Faults) -> T | None:
    """Reads one table into the dataclass `of`. Returns None if it added a fault."""
    if not isinstance(value, dict):
        named = f"[[{header(place)}]]" if place.endswith("]") else f"[{header(place)}]"
        faults.add(place, f"is {show(value)}, not a table", f"write {named}, and its keys below")
        return None
    before = len(faults.errors)
    known = _known(of)
    read: dict[str, Any] = {}
    dotted = f"{place}." if place else ""
    faults.tables.append((place, of))
    for key in value:
        if key not in known:
            faults.add(f"{dotted}{key}", "is not a key of this table", _unknown(key, known, faults))
    for key, item in known.items():
        if key in value:
            read[item.name] = item.metadata["rule"](value[key], f"{dotted}{key}", faults)
        elif item.metadata["instead"] in value:
            read[item.name] = ()
        elif item.default is MISSING and item.default_factory is MISSING:
            meaning = item.metadata["meaning"]
            named = _written(item, key, place) if item.metadata["of"] else "it"
            faults.add(f"{dotted}{key}", "is missing", f"write {named}" + (f": {meaning}" if meaning else ""))
    faults.tables.pop()
    return of(**read) if len(faults.errors) == before else None

"""Fields that hold words: choices, names, texts, days and codes of rules."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import MISSING
from datetime import date, datetime
from typing import Any

from paradize.scene.schema.field import Faults, declare, header, show, suggestion


def flag(default: Any = MISSING, *, meaning: str = "") -> Any:
    """true or false."""

    def rule(value: object, place: str, faults: Faults) -> bool | None:
        if not isinstance(value, bool):
            faults.add(place, f"is {show(value)}", "write true or false")
            return None
        return value

    return declare(rule, default, "true, false", json={"type": "boolean"}, meaning=meaning)


def choice(default: Any = MISSING, *, among: tuple[str, ...], pair: str = "", meaning: str = "") -> Any:
    """One of a few words; or two of them, if `pair` says what they stand for."""
    allowed = ", ".join(among) + (f"; or two of them, {pair}" if pair else "")

    def rule(value: object, place: str, faults: Faults) -> str | tuple[str, ...] | None:
        if pair and isinstance(value, list) and len(value) == 2 and all(item in among for item in value):
            return tuple(value)
        if value not in among:
            faults.add(place, f"is {show(value)}", f"allowed: {allowed}")
            return None
        return str(value)

    json: dict[str, Any] = {"enum": list(among)}
    if pair:
        json = {"anyOf": [json, {"type": "array", "items": json, "minItems": 2, "maxItems": 2}]}
    return declare(rule, default, allowed, json=json, meaning=meaning)


def choices(default: Any = MISSING, *, among: tuple[str, ...], meaning: str = "") -> Any:
    """One or more of a few words, none twice."""

    def rule(value: object, place: str, faults: Faults) -> tuple[str, ...] | None:
        allowed = f"write one or more of {', '.join(among)}"
        if not isinstance(value, list) or not value or any(item not in among for item in value):
            faults.add(place, f"is {show(value)}", allowed)
            return None
        if len(set(value)) != len(value):
            faults.add(place, f"is {show(value)}", "write each once")
            return None
        return tuple(value)

    json = {"type": "array", "items": {"enum": list(among)}, "minItems": 1, "uniqueItems": True}
    return declare(rule, default, f"some of {', '.join(among)}", json=json, meaning=meaning)


_NAME = "abcdefghijklmnopqrstuvwxyz0123456789_"


def identifier(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A name that is also used in file names: 1 to 40 of a-z, 0-9 and _, a letter first."""

    def rule(value: object, place: str, faults: Faults) -> str | None:
        good = isinstance(value, str) and 1 <= len(value) <= 40 and all(c in _NAME for c in value)
        if not good or not str(value)[0].isalpha():
            faults.add(place, f"is {show(value)}", "write 1 to 40 of a-z, 0-9 and _, a letter first")
            return None
        return str(value)

    json = {"type": "string", "pattern": "^[a-z][a-z0-9_]{0,39}$"}
    return declare(rule, default, "1 to 40 of a-z, 0-9 and _, a letter first", json=json, meaning=meaning)


def text(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A string that is not blank."""

    def rule(value: object, place: str, faults: Faults) -> str | None:
        if not isinstance(value, str) or not value.strip():
            faults.add(place, f"is {show(value)}", "write some words")
            return None
        return value

    json = {"type": "string", "pattern": "\\S"}
    return declare(rule, default, "text", json=json, meaning=meaning)


def texts(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A list of strings."""

    def rule(value: object, place: str, faults: Faults) -> tuple[str, ...] | None:
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            faults.add(
                place,
                f"is {show(value)}, not a list of strings",
                'write strings in brackets, as ["one", "two"]',
            )
            return None
        return tuple(value)

    json = {"type": "array", "items": {"type": "string"}}
    return declare(rule, default, "list of texts", json=json, meaning=meaning)


def one_of(default: Any = MISSING, *, known: Collection[str], meaning: str = "") -> Any:
    """One of many names."""

    def rule(value: object, place: str, faults: Faults) -> str | None:
        if not isinstance(value, str) or value not in known:
            faults.add(place, f"is {show(value)}", suggestion(str(value), known))
            return None
        return value

    return declare(rule, default, "a metric", json={"enum": sorted(known)}, meaning=meaning)


def day(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A date, as TOML writes it: 2026-12-31."""

    def rule(value: object, place: str, faults: Faults) -> date | None:
        if isinstance(value, datetime) or not isinstance(value, date):
            faults.add(place, f"is {show(value)}, not a day", "write it as 2026-12-31, without quotes")
            return None
        return value

    json = {"type": "string", "format": "date"}  # how validators of TOML see a day
    return declare(rule, default, "a day, as 2026-12-31", json=json, meaning=meaning)


_CODE = re.compile(r"PZ[0-9]{3}")


def code(default: Any = MISSING, *, meaning: str = "") -> Any:
    """The code of a rule of `paradize check`."""

    def rule(value: object, place: str, faults: Faults) -> str | None:
        if not isinstance(value, str) or not _CODE.fullmatch(value):
            faults.add(place, f"is {show(value)}", "write a rule's code, as PZ401")
            return None
        return value

    json = {"type": "string", "pattern": f"^{_CODE.pattern}$"}
    return declare(rule, default, "a code, as PZ401", json=json, meaning=meaning)


def words(among: tuple[str, ...], *, meaning: str = "") -> Any:
    """A table of rule code = one of a few words."""

    def rule(value: object, place: str, faults: Faults) -> dict[str, str]:
        if not isinstance(value, dict):
            mend = f'write [{header(place)}], and below it lines as PZ104 = "off"'
            faults.add(place, f"is {show(value)}, not a table of code = word", mend)
            return {}
        for key, item in value.items():
            if not _CODE.fullmatch(key):
                faults.add(f"{place}.{key}", "is not a code of a rule", "write a rule's code, as PZ104")
            elif item not in among:
                faults.add(f"{place}.{key}", f"is {show(item)}", f"allowed: {', '.join(among)}")
        return value

    rules = {f"^{_CODE.pattern}$": {"enum": list(among)}}
    json = {"type": "object", "patternProperties": rules, "additionalProperties": False}
    return declare(rule, dict, f"code = {', '.join(among)}", json=json, meaning=meaning)

"""Reads a table of TOML into a frozen dataclass: one rule per field, all faults reported at once.

A field is declared with its default, unit and allowed range (`number(0.5, low=0, high=1)`); a field without a
default is required. `read_table` checks types, ranges, unknown keys and files. It collects every fault as a
SceneError with the key path, the value, the limit and the mend.
"""

from __future__ import annotations

import dataclasses
import itertools
import os
import re
from collections.abc import Callable, Collection
from dataclasses import MISSING, dataclass, field
from datetime import date, datetime
from pathlib import Path
from typing import Any, TypeVar

from paradize.errors import GroupedError, ParadizeError, SceneError
from paradize.files import is_there, missing_reason, resolved

T = TypeVar("T")
FARTHEST = 1e9  # metres; limit of a coordinate. float64 has steps of 1e-7 there


MOST_FAULTS = 100  # reported for one file


class Faults:
    """Collects the faults of one file. `file` is named in each; sources are looked for beside it."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.folder = resolved(file.parent)
        self.errors: list[ParadizeError] = []

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


def _field(
    rule: Rule,
    default: Any,
    allowed: str,
    *,
    meaning: str = "",
    unit: str = "",
    key: str | None = None,
    of: type | None = None,
) -> Any:
    """Returns a field of a dataclass. allowed, meaning, unit: for FIELDS.md. of: the dataclass of a table."""
    metadata = {"rule": rule, "unit": unit, "key": key, "allowed": allowed, "meaning": meaning, "of": of}
    if isinstance(default, type) or callable(default):
        return field(default_factory=default, metadata=metadata)
    return field(default=default, metadata=metadata)


def _show(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _real(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        return float("inf")


def _limits(low: float, high: float, unit: str) -> str:
    """Returns the allowed range as text. low, high: whole numbers for a field of whole numbers."""
    return f"allowed: {_range(low, high)}{' ' + unit if unit else ''}"


def _range(low: float, high: float) -> str:
    shown = [str(limit) if isinstance(limit, int) else f"{limit:g}" for limit in (low, high)]
    return f"{shown[0]} to {shown[1]}"


def number(default: Any = MISSING, *, low: float, high: float, unit: str = "", meaning: str = "") -> Any:
    """A finite number in [low, high]."""

    def rule(value: object, place: str, faults: Faults) -> float | None:
        real = _real(value)
        if real is None:
            faults.add(place, f"is {_show(value)}, not a number", _limits(low, high, unit))
            return None
        if not low <= real <= high:  # also refuses NaN
            faults.add(place, f"is {_show(value)}, out of range", _limits(low, high, unit))
            return None
        return real

    return _field(rule, default, _range(low, high), meaning=meaning, unit=unit)


def number_or(words: tuple[str, ...], *, low: float, high: float, meaning: str = "") -> Any:
    """A finite number in [low, high], or one of a few words, the first by default."""

    def rule(value: object, place: str, faults: Faults) -> float | str | None:
        real = _real(value)
        if (real is None and value not in words) or not low <= (real or 0.0) <= high:
            faults.add(place, f"is {_show(value)}", f"{_limits(low, high, '')}, or {', '.join(words)}")
            return None
        return str(value) if real is None else real

    return _field(rule, words[0], f"{_range(low, high)}, or {', '.join(words)}", meaning=meaning)


def whole(default: Any = MISSING, *, low: int, high: int, unit: str = "", meaning: str = "") -> Any:
    """A whole number in [low, high]."""

    def rule(value: object, place: str, faults: Faults) -> int | None:
        if isinstance(value, bool) or not isinstance(value, int):
            faults.add(place, f"is {_show(value)}, not a whole number", _limits(low, high, unit))
            return None
        if not low <= value <= high:
            faults.add(place, f"is {value}, out of range", _limits(low, high, unit))
            return None
        return value

    return _field(rule, default, f"whole, {_range(low, high)}", meaning=meaning, unit=unit)


def vector(
    default: Any = MISSING,
    *,
    size: int,
    low: float,
    high: float,
    unit: str = "",
    rising: bool = False,
    integers: bool = False,
    meaning: str = "",
) -> Any:
    """`size` finite numbers in [low, high]. rising: none is smaller than the one before it."""

    def rule(value: object, place: str, faults: Faults) -> tuple[float, ...] | None:
        limits = f"{size} {'whole ' if integers else ''}numbers, {_limits(low, high, unit)}"
        if not isinstance(value, list) or len(value) != size:
            faults.add(place, f"is {_show(value)}, not {size} numbers", limits)
            return None
        reals = []
        for i, item in enumerate(value):
            real = _real(item)
            if real is None or not low <= real <= high or (integers and not isinstance(item, int)):
                faults.add(f"{place}[{i}]", f"is {_show(item)}", limits)
                return None
            reals.append(int(real) if integers else real)
        if rising and any(b < a for a, b in itertools.pairwise(reals)):
            faults.add(place, f"is {_show(value)}", "write the smaller number first")
            return None
        return tuple(reals)

    kind = f"{size} {'whole ' if integers else ''}numbers, {_range(low, high)}{', rising' if rising else ''}"
    return _field(rule, default, kind, meaning=meaning, unit=unit)


def numbers(default: Any = MISSING, *, low: float, high: float, unit: str = "", meaning: str = "") -> Any:
    """Any count of finite numbers in [low, high], none smaller than the one before it."""

    def rule(value: object, place: str, faults: Faults) -> tuple[float, ...] | None:
        limits = f"numbers, {_limits(low, high, unit)}"
        if not isinstance(value, list):
            faults.add(place, f"is {_show(value)}, not a list of numbers", limits)
            return None
        reals = [_real(item) for item in value]
        for i, real in enumerate(reals):
            if real is None or not low <= real <= high:
                faults.add(f"{place}[{i}]", f"is {_show(value[i])}", limits)
                return None
        found = tuple(real for real in reals if real is not None)
        if any(b < a for a, b in itertools.pairwise(found)):
            faults.add(place, f"is {_show(value)}", "write the smaller numbers first")
            return None
        return found

    return _field(rule, default, f"rising numbers, {_range(low, high)}", meaning=meaning, unit=unit)


def flag(default: Any = MISSING, *, meaning: str = "") -> Any:
    """true or false."""

    def rule(value: object, place: str, faults: Faults) -> bool | None:
        if not isinstance(value, bool):
            faults.add(place, f"is {_show(value)}", "write true or false")
            return None
        return value

    return _field(rule, default, "true, false", meaning=meaning)


def point(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A point: x, y and z in metres, each at most FARTHEST from 0."""
    return vector(default, size=3, low=-FARTHEST, high=FARTHEST, unit="m", meaning=meaning)


def choice(default: Any = MISSING, *, among: tuple[str, ...], meaning: str = "") -> Any:
    """One of a few words."""

    def rule(value: object, place: str, faults: Faults) -> str | None:
        if value not in among:
            faults.add(place, f"is {_show(value)}", f"allowed: {', '.join(among)}")
            return None
        return str(value)

    return _field(rule, default, ", ".join(among), meaning=meaning)


def choices(default: Any = MISSING, *, among: tuple[str, ...], meaning: str = "") -> Any:
    """One or more of a few words, none twice."""

    def rule(value: object, place: str, faults: Faults) -> tuple[str, ...] | None:
        allowed = f"write one or more of {', '.join(among)}"
        if not isinstance(value, list) or not value or any(item not in among for item in value):
            faults.add(place, f"is {_show(value)}", allowed)
            return None
        if len(set(value)) != len(value):
            faults.add(place, f"is {_show(value)}", "write each once")
            return None
        return tuple(value)

    return _field(rule, default, f"some of {', '.join(among)}", meaning=meaning)


_NAME = "abcdefghijklmnopqrstuvwxyz0123456789_"


def identifier(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A name that is also used in file names: 1 to 40 of a-z, 0-9 and _, a letter first."""

    def rule(value: object, place: str, faults: Faults) -> str | None:
        good = isinstance(value, str) and 1 <= len(value) <= 40 and all(c in _NAME for c in value)
        if not good or not str(value)[0].isalpha():
            faults.add(place, f"is {_show(value)}", "write 1 to 40 of a-z, 0-9 and _, a letter first")
            return None
        return str(value)

    return _field(rule, default, "1 to 40 of a-z, 0-9 and _, a letter first", meaning=meaning)


def text(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A string that is not blank."""

    def rule(value: object, place: str, faults: Faults) -> str | None:
        if not isinstance(value, str) or not value.strip():
            faults.add(place, f"is {_show(value)}", "write some words")
            return None
        return value

    return _field(rule, default, "text", meaning=meaning)


def one_of(default: Any = MISSING, *, known: Collection[str], meaning: str = "") -> Any:
    """One of many names."""

    def rule(value: object, place: str, faults: Faults) -> str | None:
        if not isinstance(value, str) or value not in known:
            faults.add(place, f"is {_show(value)}", _nearest(str(value), known))
            return None
        return value

    return _field(rule, default, "a metric", meaning=meaning)


def day(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A date, as TOML writes it: 2026-12-31."""

    def rule(value: object, place: str, faults: Faults) -> date | None:
        if isinstance(value, datetime) or not isinstance(value, date):
            faults.add(place, f"is {_show(value)}, not a day", "write it as 2026-12-31, without quotes")
            return None
        return value

    return _field(rule, default, "a day, as 2026-12-31", meaning=meaning)


_CODE = re.compile(r"PZ[0-9]{3}")


def code(default: Any = MISSING, *, meaning: str = "") -> Any:
    """The code of a rule of `paradize check`."""

    def rule(value: object, place: str, faults: Faults) -> str | None:
        if not isinstance(value, str) or not _CODE.fullmatch(value):
            faults.add(place, f"is {_show(value)}", "write a rule's code, as PZ401")
            return None
        return value

    return _field(rule, default, "a code, as PZ401", meaning=meaning)


def words(among: tuple[str, ...], *, meaning: str = "") -> Any:
    """A table of rule code = one of a few words."""

    def rule(value: object, place: str, faults: Faults) -> dict[str, str]:
        if not isinstance(value, dict):
            mend = f'write [{header(place)}], and below it lines as PZ104 = "off"'
            faults.add(place, f"is {_show(value)}, not a table of code = word", mend)
            return {}
        for key, item in value.items():
            if not _CODE.fullmatch(key):
                faults.add(f"{place}.{key}", "is no code of a rule", "write a rule's code, as PZ104")
            elif item not in among:
                faults.add(f"{place}.{key}", f"is {_show(item)}", f"allowed: {', '.join(among)}")
        return value

    return _field(rule, dict, f"code = {', '.join(among)}", meaning=meaning)


def texts(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A list of strings."""

    def rule(value: object, place: str, faults: Faults) -> tuple[str, ...] | None:
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            faults.add(
                place,
                f"is {_show(value)}, not a list of strings",
                'write strings in brackets, as ["one", "two"]',
            )
            return None
        return tuple(value)

    return _field(rule, default, "list of texts", meaning=meaning)


def _source(value: object, place: str, faults: Faults) -> Path | None:
    if not isinstance(value, str) or not value or "\0" in value:
        faults.add(place, f"is {_show(value)}, not a file", "write a path relative to the scene's folder")
        return None
    try:
        named = faults.folder / value
        path = resolved(named)
        inside = path.is_relative_to(faults.folder)
        there = inside and is_there(path)
    except OSError as error:
        faults.add(place, f"{_show(value)} cannot be read: {error.strerror or error}")
        return None
    if not inside:
        faults.add(place, f"{_show(value)} lies outside the scene's folder", f"move it into {faults.folder}")
        return None
    if not there:
        link = missing_reason(named)
        what = f"{_show(value)} {link}" if link else f"there is no file {_show(value)}"
        faults.add(place, what, f"looked for in {faults.folder}")
        return None
    # A link keeps its own name, so that a bake notices when its target changes.
    return path if os.path.normpath(named) == str(path) else named


def source(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A file, relative to the scene's folder and inside it."""
    return _field(_source, default, "a file", meaning=meaning)


def sources(default: Any = MISSING, *, size: int, meaning: str = "") -> Any:
    """`size` files, each relative to the scene's folder and inside it."""

    def rule(value: object, place: str, faults: Faults) -> tuple[Path, ...] | None:
        if not isinstance(value, list) or len(value) != size:
            faults.add(place, f"is {_show(value)}", f"write {size} files")
            return None
        paths = [_source(item, f"{place}[{i}]", faults) for i, item in enumerate(value)]
        return None if None in paths else tuple(path for path in paths if path is not None)

    return _field(rule, default, f"{size} files", meaning=meaning)


def table(of: type[T], default: Any = MISSING, *, key: str | None = None, meaning: str = "") -> Any:
    """A table that is itself a dataclass of rules. key: its name in the file where that differs."""

    def rule(value: object, place: str, faults: Faults) -> T | None:
        return read_table(of, value, place, faults)

    return _field(rule, default, "a table", meaning=meaning, key=key, of=of)


def tables(
    of: type[T], *, least: int = 0, most: int = 10_000, key: str | None = None, meaning: str = ""
) -> Any:
    """An array of tables, `least` to `most` of them."""

    def rule(value: object, place: str, faults: Faults) -> tuple[T, ...] | None:
        if not isinstance(value, list):
            faults.add(place, f"is {_show(value)}, not an array of tables", f"write [[{header(place)}]]")
            return None
        if not least <= len(value) <= most:
            faults.add(place, f"has {len(value)} entries", f"allowed: {least} to {most}")
            return None
        items = [read_table(of, item, f"{place}[{i}]", faults) for i, item in enumerate(value)]
        return tuple(item for item in items if item is not None)

    kind = f"{least} or more tables" if least else "tables"
    return _field(rule, MISSING if least else tuple, kind, meaning=meaning, key=key, of=of)


def named_tables(of: type[T], *, key: str | None = None, meaning: str = "") -> Any:
    """A table of tables by name, such as materials."""

    def rule(value: object, place: str, faults: Faults) -> dict[str, T]:
        if not isinstance(value, dict):
            mend = f"write [{header(place)}.NAME] for each name"
            faults.add(place, f"is {_show(value)}, not a table of tables", mend)
            return {}
        read = {name: read_table(of, item, f"{place}.{name}", faults) for name, item in value.items()}
        return {name: item for name, item in read.items() if item is not None}

    return _field(rule, dict, "a table for each name", meaning=meaning, key=key, of=of)


@dataclass(frozen=True)
class Limit:
    """A metric that a budget may limit: its unit, whether less is better, the largest sensible value, and
    its meaning."""

    unit: str
    less_is_better: bool
    high: float
    meaning: str


@dataclass(frozen=True)
class Limits:
    """hard, soft: worst allowed value by metric. Beyond hard is an error, beyond soft a warning."""

    hard: dict[str, float] = field(default_factory=dict)
    soft: dict[str, float] = field(default_factory=dict)

    @property
    def aim(self) -> dict[str, float]:
        """The limits by which `auto` chooses a tier: the soft limit where there is one, else the hard one."""
        return self.hard | self.soft


def limits(known: dict[str, Limit], *, meaning: str = "") -> Any:
    """A table of metric = limit or metric = { soft = limit, hard = limit }, for known metrics."""

    def rule(value: object, place: str, faults: Faults) -> Limits:
        if not isinstance(value, dict):
            mend = f"write [{header(place)}], and below it lines as {next(iter(known))} = 1.0"
            faults.add(place, f"is {_show(value)}, not a table of metric = limit", mend)
            return Limits()
        read = Limits()
        for key, item in value.items():
            if key not in known:
                faults.add(f"{place}.{key}", "is no metric", _nearest(key, known))
                continue
            parts = item if isinstance(item, dict) else {"hard": item}
            for part, limit in parts.items():
                where = f"{place}.{key}.{part}" if parts is item else f"{place}.{key}"
                real = _real(limit)
                if part not in ("hard", "soft"):
                    faults.add(where, "is not a key of a limit", "write { soft = limit, hard = limit }")
                elif real is None or not 0 <= real <= known[key].high:
                    faults.add(where, f"is {_show(limit)}", _limits(0, known[key].high, known[key].unit))
                else:
                    getattr(read, part)[key] = real
            soft, hard = read.soft.get(key), read.hard.get(key)
            less = known[key].less_is_better
            if soft is not None and hard is not None and (soft > hard if less else soft < hard):
                mend = f"must be at {'most' if less else 'least'} the hard limit, {hard:g}"
                faults.add(f"{place}.{key}.soft", f"is {soft:g}", mend)
        return read

    return _field(rule, Limits, "metric = limit, or { soft = limit, hard = limit }", meaning=meaning)


def _nearest(key: str, known: Any) -> str:
    import difflib

    near = difflib.get_close_matches(key, list(known), n=1)
    return f"did you mean {near[0]}?" if near else f"known: {', '.join(sorted(known))}"


def read_table(of: type[T], value: object, place: str, faults: Faults) -> T | None:
    """Reads one table into the dataclass `of`. Returns None if it added a fault."""
    if not isinstance(value, dict):
        named = f"[[{header(place)}]]" if place.endswith("]") else f"[{header(place)}]"
        faults.add(place, f"is {_show(value)}, not a table", f"write {named}, and its keys below")
        return None
    before = len(faults.errors)
    known = {item.metadata["key"] or item.name: item for item in dataclasses.fields(of)}  # type: ignore[arg-type]
    read: dict[str, Any] = {}
    dotted = f"{place}." if place else ""
    for key in value:
        if key not in known:
            faults.add(f"{dotted}{key}", "is not a key of this table", _nearest(key, known))
    for key, item in known.items():
        if key in value:
            read[item.name] = item.metadata["rule"](value[key], f"{dotted}{key}", faults)
        elif item.default is MISSING and item.default_factory is MISSING:
            meaning = item.metadata["meaning"]
            faults.add(
                f"{dotted}{key}", "is missing", "it has no default" + (f": {meaning}" if meaning else "")
            )
    return of(**read) if len(faults.errors) == before else None

"""Checks for the members of scene.json, combined in schema.py. Each knows the key path for its
message."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import date
from typing import Any

Check = Callable[[Any, str], None]  # takes a value and its key path; raises Wrong


class Wrong(Exception):  # noqa: N818 (internal)
    def __init__(self, place: str, what: str) -> None:
        super().__init__(what)
        self.place = place


def number(low: float = -1e30, high: float = 1e30) -> Check:
    def check(value: Any, place: str) -> None:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise Wrong(place, f"is {value!r:.60}, not a number in {low:g} to {high:g}")

    return check


def whole(low: int, high: int) -> Check:
    def check(value: Any, place: str) -> None:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise Wrong(place, f"is {value!r:.60}, not a whole number in {low} to {high}")

    return check


def text(value: Any, place: str) -> None:
    if not isinstance(value, str) or not value:
        raise Wrong(place, f"is {value!r:.60}, not a name")


def day(value: Any, place: str) -> None:
    try:
        date.fromisoformat(value)
    except (TypeError, ValueError):
        raise Wrong(place, f"is {value!r:.60}, not a day as 2026-12-31") from None


def file_name(value: Any, place: str) -> None:
    text(value, place)
    if "/" in value or "\\" in value or value.startswith("."):
        raise Wrong(place, f"is {value!r:.60}, not a file name in the manifest's own folder")


def file_stem(value: Any, place: str) -> None:
    """ASCII letters and digits, or nothing: a part of a file name."""
    if not isinstance(value, str) or len(value) > 40 or not (value + "a").isalnum() or not value.isascii():
        raise Wrong(place, f"is {value!r:.60}, not letters and digits")


def sha256(value: Any, place: str) -> None:
    if not isinstance(value, str) or len(value) != 64 or set(value) - set("0123456789abcdef"):
        raise Wrong(place, f"is {value!r:.80}, not a SHA-256")


def flag(value: Any, place: str) -> None:
    if not isinstance(value, bool):
        raise Wrong(place, f"is {value!r:.60}, not true or false")


def one_of(*known: str) -> Check:
    def check(value: Any, place: str) -> None:
        if value not in known:
            raise Wrong(place, f"is {value!r:.60}, not one of {', '.join(known)}")

    return check


def list_of(item: Check, *, size: int | None = None, min_size: int = 0, max_size: int | None = None) -> Check:
    def check(value: Any, place: str) -> None:
        if not isinstance(value, list) or len(value) < min_size or (size is not None and len(value) != size):
            expected = f"{size}" if size is not None else f"at least {min_size}"
            raise Wrong(place, f"is not a list of {expected}")
        if max_size is not None and len(value) > max_size:
            raise Wrong(place, f"has {len(value)} entries, limit {max_size}")
        for i, part in enumerate(value):
            item(part, f"{place}[{i}]")

    return check


def map_of(item: Check) -> Check:
    def check(value: Any, place: str) -> None:
        if not isinstance(value, dict):
            raise Wrong(place, "is not an object")
        for key, part in value.items():
            item(part, f"{place}.{key}")

    return check


def table(optional: Mapping[str, Check] | None = None, /, **keys: Check) -> Check:
    """Exactly these keys, and any of the `optional` ones."""
    spare = optional or {}

    def check(value: Any, place: str) -> None:
        if not isinstance(value, dict):
            raise Wrong(place, "is not an object")
        dotted = f"{place}." if place else ""
        for key in value:
            if key not in keys and key not in spare:
                raise Wrong(f"{dotted}{key}", "is not a known key")
        for key, item in keys.items():
            if key not in value:
                raise Wrong(f"{dotted}{key}", "is missing")
            item(value[key], f"{dotted}{key}")
        for key in spare.keys() & value.keys():
            spare[key](value[key], f"{dotted}{key}")

    return check


def or_null(item: Check) -> Check:
    def check(value: Any, place: str) -> None:
        if value is not None:
            item(value, place)

    return check

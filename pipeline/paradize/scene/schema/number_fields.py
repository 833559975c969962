"""Fields that hold numbers: their types and allowed ranges."""

from __future__ import annotations

import itertools
from dataclasses import MISSING
from typing import Any

from paradize.scene.schema.field import Faults, declare, show

FAR = 1e6  # metres; limit of lengths in a scene
FARTHEST = 1e9  # metres; limit of a coordinate. float64 has steps of 1e-7 there


def real_number(value: object) -> float | None:
    """Returns a value of TOML as a float, infinite where it is too large; None where it is not a number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        return float("inf")


def allowed_range(low: float, high: float, unit: str) -> str:
    """Returns the allowed range as text. low, high: whole numbers for a field of whole numbers."""
    return f"allowed: {_range(low, high)}{' ' + unit if unit else ''}"


def _range(low: float, high: float) -> str:
    shown = [str(limit) if isinstance(limit, int) else f"{limit:g}" for limit in (low, high)]
    return f"{shown[0]} to {shown[1]}"


def _json(kind: str, low: float, high: float) -> dict[str, Any]:
    return {"type": kind, "minimum": low, "maximum": high}


def number(
    default: Any = MISSING,
    *,
    low: float,
    high: float,
    unit: str = "",
    meaning: str = "",
    formerly: str | None = None,
) -> Any:
    """A finite number in [low, high]."""

    def rule(value: object, place: str, faults: Faults) -> float | None:
        real = real_number(value)
        if real is None:
            faults.add(place, f"is {show(value)}, not a number", allowed_range(low, high, unit))
            return None
        if not low <= real <= high:  # also refuses NaN
            faults.add(place, f"is {show(value)}, out of range", allowed_range(low, high, unit))
            return None
        return real

    json = _json("number", low, high)
    return declare(rule, default, _range(low, high), json=json, meaning=meaning, unit=unit, formerly=formerly)


def number_or(words: tuple[str, ...], *, low: float, high: float, meaning: str) -> Any:
    """A finite number in [low, high], or one of a few words, the first by default."""

    def rule(value: object, place: str, faults: Faults) -> float | str | None:
        real = real_number(value)
        if (real is None and value not in words) or not low <= (real or 0.0) <= high:
            faults.add(place, f"is {show(value)}", f"{allowed_range(low, high, '')}, or {', '.join(words)}")
            return None
        return str(value) if real is None else real

    json = {"anyOf": [_json("number", low, high), {"enum": list(words)}]}
    return declare(rule, words[0], f"{_range(low, high)}, or {', '.join(words)}", json=json, meaning=meaning)


def scale(default: Any = MISSING, *, low: float, high: float, meaning: str = "") -> Any:
    """A factor, or three along x, y and z, each in [low, high]; or negative in [-high, -low]: mirrored."""
    mend = f"write a number or three, {_range(low, high)}; negative: mirrored"

    def rule(value: object, place: str, faults: Faults) -> float | tuple[float, ...] | None:
        listed = isinstance(value, list)
        reals = [real_number(item) for item in value] if isinstance(value, list) else [real_number(value)]
        found = [real for real in reals if real is not None and low <= abs(real) <= high]
        if len(found) != (3 if listed else 1) or len(reals) != len(found):
            faults.add(place, f"is {show(value)}", mend)
            return None
        return tuple(found) if listed else found[0]

    factor = {"anyOf": [_json("number", low, high), _json("number", -high, -low)]}
    json = {"anyOf": [*factor["anyOf"], {"type": "array", "items": factor, "minItems": 3, "maxItems": 3}]}
    allowed = f"{_range(low, high)}, or negative; or three such numbers"
    return declare(rule, default, allowed, json=json, meaning=meaning)


def whole(default: Any = MISSING, *, low: int, high: int, unit: str = "", meaning: str = "") -> Any:
    """A whole number in [low, high]."""

    def rule(value: object, place: str, faults: Faults) -> int | None:
        if isinstance(value, bool) or not isinstance(value, int):
            faults.add(place, f"is {show(value)}, not a whole number", allowed_range(low, high, unit))
            return None
        if not low <= value <= high:
            faults.add(place, f"is {value}, out of range", allowed_range(low, high, unit))
            return None
        return value

    json = _json("integer", low, high)
    return declare(rule, default, f"whole, {_range(low, high)}", json=json, meaning=meaning, unit=unit)


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
        limits = f"{size} {'whole ' if integers else ''}numbers, {allowed_range(low, high, unit)}"
        if not isinstance(value, list) or len(value) != size:
            faults.add(place, f"is {show(value)}, not {size} numbers", limits)
            return None
        reals = []
        for i, item in enumerate(value):
            real = real_number(item)
            if real is None or not low <= real <= high or (integers and not isinstance(item, int)):
                faults.add(f"{place}[{i}]", f"is {show(item)}", limits)
                return None
            reals.append(int(real) if integers else real)
        if rising and any(b < a for a, b in itertools.pairwise(reals)):
            faults.add(place, f"is {show(value)}", "write the smaller number first")
            return None
        return tuple(reals)

    kind = f"{size} {'whole ' if integers else ''}numbers, {_range(low, high)}{', rising' if rising else ''}"
    items = _json("integer" if integers else "number", low, high)
    json = {"type": "array", "items": items, "minItems": size, "maxItems": size}
    return declare(rule, default, kind, json=json, meaning=meaning, unit=unit)


def numbers(default: Any = MISSING, *, low: float, high: float, unit: str = "", meaning: str = "") -> Any:
    """Any count of finite numbers in [low, high], none smaller than the one before it."""

    def rule(value: object, place: str, faults: Faults) -> tuple[float, ...] | None:
        limits = f"numbers, {allowed_range(low, high, unit)}"
        if not isinstance(value, list):
            faults.add(place, f"is {show(value)}, not a list of numbers", limits)
            return None
        reals = [real_number(item) for item in value]
        for i, real in enumerate(reals):
            if real is None or not low <= real <= high:
                faults.add(f"{place}[{i}]", f"is {show(value[i])}", limits)
                return None
        found = tuple(real for real in reals if real is not None)
        if any(b < a for a, b in itertools.pairwise(found)):
            faults.add(place, f"is {show(value)}", "write the smaller numbers first")
            return None
        return found

    json = {"type": "array", "items": _json("number", low, high)}
    return declare(
        rule, default, f"rising numbers, {_range(low, high)}", json=json, meaning=meaning, unit=unit
    )


def points(default: Any = MISSING, *, least: int, most: int, meaning: str = "") -> Any:
    """`least` to `most` points, each x, y and z in metres, at most FARTHEST from 0."""
    limits = f"write {least} to {most} points [x, y, z], each {_range(-FARTHEST, FARTHEST)} m"

    def rule(value: object, place: str, faults: Faults) -> tuple[tuple[float, ...], ...] | None:
        if not isinstance(value, list) or not least <= len(value) <= most:
            what = f"has {len(value)} points" if isinstance(value, list) else f"is {show(value)}"
            faults.add(place, what, limits)
            return None
        found = []
        for i, item in enumerate(value):
            reals = [real_number(part) for part in item] if isinstance(item, list) else []
            if len(reals) != 3 or not all(real is not None and abs(real) <= FARTHEST for real in reals):
                faults.add(f"{place}[{i}]", f"is {show(item)}", limits)
                return None
            found.append(tuple(real for real in reals if real is not None))
        return tuple(found)

    point = {"type": "array", "items": _json("number", -FARTHEST, FARTHEST), "minItems": 3, "maxItems": 3}
    json = {"type": "array", "items": point, "minItems": least, "maxItems": most}
    return declare(rule, default, f"{least} to {most} points", json=json, meaning=meaning, unit="m")


def point(default: Any = MISSING, *, meaning: str = "") -> Any:
    """A point: x, y and z in metres, each at most FARTHEST from 0."""
    return vector(default, size=3, low=-FARTHEST, high=FARTHEST, unit="m", meaning=meaning)

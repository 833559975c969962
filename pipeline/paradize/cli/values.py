"""Converters of option values for argparse. Each raises argparse.ArgumentTypeError with the value and what is
allowed."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from datetime import date


_Number = TypeVar("_Number", int, float)


def path(text: str) -> Path:
    """An option that names a file or a folder. A shell leaves nothing of a variable that is not set."""
    if not text:
        raise argparse.ArgumentTypeError("is empty; write a name, or . for the current folder")
    return Path(text)


def plain(text: str) -> str:
    """The text. Raises ValueError for forms of a number that only Python accepts, as 1_0."""
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    return text


def number(low: float, high: float) -> Callable[[str], float]:
    """An option that is a finite number in [low, high]."""
    return _within(float, "number", low, high, f"{low:g} to {high:g}")


def whole(low: int, high: int) -> Callable[[str], int]:
    """An option that is a whole number in [low, high]."""
    return _within(int, "whole number", low, high, f"{low} to {high}")


def _within(
    parse: Callable[[str], _Number], what: str, low: _Number, high: _Number, allowed: str
) -> Callable[[str], _Number]:
    def read(text: str) -> _Number:
        try:
            value = parse(plain(text))
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a {what}; allowed: {allowed}") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is out of range; allowed: {allowed}")
        return value

    return read


def percent(text: str) -> float:
    """An option that is a share in percent: above 0, up to 100."""
    value = number(0.0, 100.0)(text.removesuffix("%"))
    if value == 0.0:
        raise argparse.ArgumentTypeError("0 % is too small; allowed: above 0, up to 100")
    return value


def day(text: str) -> date:
    """An option that is a day: 2026-12-31."""
    from datetime import date

    try:
        return date.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a day; write it as 2026-12-31") from None


def rising(low: float, high: float) -> Callable[[str], tuple[float, ...]]:
    """An option that is rising numbers in [low, high], separated by commas."""
    read_one = number(low, high)

    def read(text: str) -> tuple[float, ...]:
        values = tuple(read_one(part) for part in text.split(","))
        if list(values) != sorted(values):
            raise argparse.ArgumentTypeError(f"{text} is not rising; write the smaller numbers first")
        return values

    return read


def _scaled(text: str, scales: dict[str, float], unit: str, otherwise: str) -> float:
    """A number with one of the units in `scales`; without a unit it is in `otherwise`."""
    digits = text.rstrip("".join(scales) + "i")
    name = text[len(digits) :] or otherwise
    try:
        value = float(plain(digits)) * scales[name]
    except (ValueError, KeyError):
        raise argparse.ArgumentTypeError(f"{text!r} is not a {unit}; units: {', '.join(scales)}") from None
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a {unit}: it must be at least 0, and finite")
    return value


def age(text: str) -> float:
    """An option that is a time, in seconds: 90s, 10m, 12h, 30d; a number alone is days."""
    return _scaled(text, {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}, "time", "d")


def size(text: str) -> int:
    """An option that is a number of bytes: 500M (a million each), 2G, 1Ki (1024), or a number alone."""
    scales = {"B": 1.0}
    for i, letter in enumerate("KMGT"):
        scales |= {letter: 1000.0 ** (i + 1), f"{letter}i": 1024.0 ** (i + 1)}
    return int(_scaled(text, scales, "size", "B"))

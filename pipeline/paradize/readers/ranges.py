"""Numbers of materials that lie outside the range that their format allows: the nearest in it is taken, and a
warning says so."""

from __future__ import annotations

from math import inf


def within(values: tuple[float, ...], low: float, high: float) -> tuple[float, ...]:
    """The values, those below `low` or above `high` replaced by these."""
    return tuple(min(max(value, low), high) for value in values)


def beyond(values: tuple[float, ...], low: float, high: float, taken: tuple[float, ...]) -> str:
    """Says that values are out of range, and what is taken instead."""
    allowed = f"{low:g} or more" if high == inf else f"{low:g} to {high:g}"
    return f"{_words(values)}, expected {allowed}; read as {_words(taken)}: correct it in the model"


def _words(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:g}" for value in values)

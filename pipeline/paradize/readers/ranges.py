"""Numbers of materials that lie outside the range that their format allows: the nearest in it is taken, and a
warning says so."""

from __future__ import annotations

from math import inf

_ROUNDING = 5e-6  # of shares that went through float32 or six digits of text


def within(values: tuple[float, ...], low: float, high: float) -> tuple[float, ...]:
    """The values, those below `low` or above `high` replaced by these."""
    return tuple(min(max(value, low), high) for value in values)


def strays(values: tuple[float, ...], taken: tuple[float, ...]) -> bool:
    """Whether values differ from those that are taken by more than exporters round: 1.0000001 is 1."""
    return any(abs(value - near) > _ROUNDING for value, near in zip(values, taken, strict=True))


def beyond(values: tuple[float, ...], low: float, high: float, taken: tuple[float, ...]) -> str:
    """Says that values are out of range, and what is taken instead."""
    allowed = f"{low:g} or more" if high == inf else f"{low:g} to {high:g}"
    return f"{_words(values)}, expected {allowed}; read as {_words(taken)}: correct it in the model"


def _words(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:g}" for value in values)

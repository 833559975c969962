"""The form of a bound: a value, its unit, its terms, and what is not bounded."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

SIX = 1.0 + 1e-5  # numbers of scene.json have six digits


def bound(
    value: float | None, unit: str, what: str, terms: list[dict[str, Any]], unbounded: Sequence[str] = ()
) -> dict[str, Any]:
    """A bound as bounds_of returns it. An infinite value becomes None."""
    finite = value if value is not None and math.isfinite(value) else None
    return {"value": finite, "unit": unit, "what": what, "terms": terms, "open": list(unbounded)}

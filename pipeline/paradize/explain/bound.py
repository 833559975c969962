"""A bound as `paradize explain` tells it: a value, its unit, its terms, and what is not bounded."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

SIX = 1.0 + 1e-5  # numbers of scene.json have six digits


def bound(
    value: float | None, unit: str, what: str, terms: list[dict[str, Any]], unbounded: Sequence[str] = ()
) -> dict[str, Any]:
    """As bounds_of tells one; a value that is infinite is none."""
    told = value if value is not None and math.isfinite(value) else None
    return {"value": told, "unit": unit, "what": what, "terms": terms, "open": list(unbounded)}

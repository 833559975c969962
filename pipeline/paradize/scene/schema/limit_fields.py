"""The field of a budget: a limit for each metric."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from paradize.scene.schema.field import Faults, declare, header, show, suggestion
from paradize.scene.schema.number_fields import allowed_range, real_number


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
            faults.add(place, f"is {show(value)}, not a table of metric = limit", mend)
            return Limits()
        read = Limits()
        for key, item in value.items():
            if key not in known:
                faults.add(f"{place}.{key}", "is no metric of a budget", suggestion(key, known))
                continue
            parts = item if isinstance(item, dict) else {"hard": item}
            for part, limit in parts.items():
                where = f"{place}.{key}.{part}" if parts is item else f"{place}.{key}"
                real = real_number(limit)
                if part not in ("hard", "soft"):
                    faults.add(where, "is not a key of a limit", "write { soft = limit, hard = limit }")
                elif real is None or not 0 <= real <= known[key].high:
                    faults.add(where, f"is {show(limit)}", allowed_range(0, known[key].high, known[key].unit))
                else:
                    getattr(read, part)[key] = real
            soft, hard = read.soft.get(key), read.hard.get(key)
            less = known[key].less_is_better
            if soft is not None and hard is not None and (soft > hard if less else soft < hard):
                mend = f"must be at {'most' if less else 'least'} the hard limit, {hard:g}"
                faults.add(f"{place}.{key}.soft", f"is {soft:g}", mend)
        return read

    allowed = "metric = limit, or { soft = limit, hard = limit }"
    return declare(rule, Limits, allowed, json=_json(known), meaning=meaning)


def _json(known: dict[str, Limit]) -> dict[str, Any]:
    metrics = {}
    for name, limit_of_metric in known.items():
        limit = {"type": "number", "minimum": 0, "maximum": limit_of_metric.high}
        parts = dict.fromkeys(("soft", "hard"), limit)
        both = {"type": "object", "properties": parts, "additionalProperties": False}
        unit = f", {limit_of_metric.unit}" if limit_of_metric.unit else ""
        metrics[name] = {"description": f"{limit_of_metric.meaning}{unit}", "anyOf": [limit, both]}
    return {"type": "object", "properties": metrics, "additionalProperties": False}

"""What a person reads beside a curve: the trade in a sentence, where measurement disagrees with the declared
order of the tiers, and which tier to take. All of it follows from the figures of a group.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from paradize.tradeoff_curve import (
    Group,
    Point,
    apart,
    cheapest,
    inside,
    knee,
    loss,
    main_front,
    mark,
    series_of,
)

_SAME_BYTES = 0.05  # sizes nearer to each other than this share count as equal
_SAME_ERROR = 0.02  # so do errors
_WORSE = 0.05  # a tier that errs more than the one before by this share breaks its promise


def judge(group: Group) -> list[str]:
    """Fills in what follows from the points of a group: front, sentence, advice. Returns warnings: where time
    or error disagree with the declared order."""
    mark(group["points"], group["less_is_better"])
    group["sentence"] = sentence(group)
    group["advice"] = advice(group)
    return disagreements(group)


def value_text(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}".rstrip()


def seconds_text(seconds: float) -> str:
    """As a person says it: 3.2 s, 41 ms, 7 us."""
    if seconds >= 1.0:
        return f"{seconds:.3g} s"
    return f"{seconds * 1e3:.3g} ms" if seconds >= 1e-3 else f"{seconds * 1e6:.3g} us"


def _times(ratio: float) -> str:
    return f"{_two(ratio)} x"


def _two(value: float) -> str:
    """Two digits, without an exponent where the number is large."""
    return f"{value:.2g}" if value < 100.0 else f"{float(f'{value:.2g}'):.0f}"


def _time_words(before: Point, after: Point) -> str:
    old, new = before["seconds"], after["seconds"]
    name = before["tier"]
    if not apart(old, new) or old["median"] <= 0.0:
        return f"takes about as long as {name}"
    ratio = new["median"] / old["median"]
    verb = "costs" if ratio >= 1.0 else "takes"
    return f"{verb} {_times(ratio)} the time of {name}"


def _error_words(before: Point, after: Point, group: Group) -> str:
    old, new = (loss(point["error"]["value"], group["less_is_better"]) for point in (before, after))
    figures = " to ".join(f"{point['error']['value']:.3g}" for point in (before, after))
    figures = f" ({figures} {group['unit']})"
    if old == new or abs(new - old) < _SAME_ERROR * max(old, new):
        return "errs as much"
    if new == 0.0:
        return f"leaves no error{figures}"
    if old == 0.0:
        return f"errs where {before['tier']} did not{figures}"
    ratio = new / old
    if 0.45 <= ratio <= 0.55:
        return f"halves the error{figures}"
    if ratio < 1e-3:
        return f"leaves next to no error{figures}"
    if ratio < 0.1:
        return f"divides the error by {_two(1.0 / ratio)}{figures}"
    if ratio < 1.0:
        return f"takes {100.0 * (1.0 - ratio):.0f} % off the error{figures}"
    more = f"by {100.0 * (ratio - 1.0):.0f} % more" if ratio < 1.3 else f"{_times(ratio)} as much"
    return f"errs {more}{figures}"


def _size_words(before: Point, after: Point) -> str:
    old, new = before["bytes"], after["bytes"]
    if not old or not new or abs(new - old) <= _SAME_BYTES * old:
        return ""
    return f" at {_times(new / old)} the bytes"


def compared(before: Point, after: Point, group: Group) -> str:
    """balanced costs 3 x the time of fast and halves the error (1.2 to 0.6 degrees) at 2 x the bytes."""
    return (
        f"{after['tier']} {_time_words(before, after)} and {_error_words(before, after, group)}"
        f"{_size_words(before, after)}"
    )


def declared_points(group: Group) -> list[Point]:
    """The points whose order is a promise, in that order; all where nothing is declared."""
    points = {point["tier"]: point for point in group["points"]}
    return [points[tier] for tier in group.get("declared", []) if tier in points] or group["points"]


def sentence(group: Group) -> str:
    """The trade between neighbouring tiers, in words."""
    points = declared_points(group)
    if len(group["points"]) == 1:
        (only,) = group["points"]
        took, value = seconds_text(only["seconds"]["median"]), only["error"]["value"]
        return f"There is one tier: it takes {took}; {group['metric']} is {value_text(value, group['unit'])}."
    text = "; ".join(compared(before, after, group) for before, after in pairwise(points))
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def disagreements(group: Group) -> list[str]:
    """Where a tier is quicker than the one it is declared to be slower than, beyond the spread of both, or
    errs more. One that writes fewer bytes may err more, one that writes more may be quicker."""
    found: list[str] = []
    points = declared_points(group)
    if not group.get("declared"):
        return found
    for before, after in pairwise(points):
        same = series_of(before) == series_of(after)
        smaller = same or (after["bytes"] or 0) <= (before["bytes"] or 0)
        larger = same or not smaller
        a, b = before["seconds"], after["seconds"]
        if smaller and apart(a, b) and b["median"] < a["median"]:
            found.append(
                f"{group['name']}: {after['tier']} is declared slower than {before['tier']}, but takes "
                f"{seconds_text(b['median'])} against {seconds_text(a['median'])}"
            )
        old, new = (loss(point["error"]["value"], group["less_is_better"]) for point in (before, after))
        if larger and new > old * (1.0 + _WORSE):
            figures = [value_text(point["error"]["value"], group["unit"]) for point in (after, before)]
            found.append(
                f"{group['name']}: {after['tier']} is declared nearer than {before['tier']}, but its "
                f"{group['metric']} is {figures[0]} against {figures[1]}"
            )
    return found


def advice(group: Group) -> dict[str, Any] | None:
    """Which tier to take, and why: {"tier", "why", "text"}. "budget": the cheapest that keeps it (tier None
    where none does). Without one "flat": the quickest of tiers that err alike; else "knee": where the front
    bends; None where it does not."""
    points, budget, less = group["points"], group["budget"], group["less_is_better"]
    if budget is None:
        front = main_front(points, less)
        if len(front) > 1 and front[0].loss <= front[-1].loss * (1.0 + _WORSE):
            tier = front[0].point["tier"]
            return {"tier": tier, "why": "flat", "text": f"Tiers err alike: the quickest, {tier}, will do."}
        at = knee(points, less)
        if at is None:
            return None
        return {
            "tier": at["tier"],
            "why": "knee",
            "text": f"No budget binds: the curve bends at {at['tier']}.",
        }
    limit = value_text(budget, group["unit"])
    best = cheapest(points, budget, less)
    if best is None:
        near = min(points, key=lambda point: loss(point["error"]["value"], less))
        value = value_text(near["error"]["value"], group["unit"])
        text = f"No tier keeps the budget of {limit}: the nearest, {near['tier']}, has {value}"
        text += ", and is beyond that of another metric." if near.get("passes") is False else "."
        return {"tier": None, "why": "budget", "text": text}
    if len(points) == 1:
        return {"tier": best["tier"], "why": "budget", "text": f"It keeps the budget of {limit}."}
    text = f"{best['tier']} is the cheapest inside the budget of {limit}{_in_use_words(points, best, group)}."
    return {"tier": best["tier"], "why": "budget", "text": text[:1].upper() + text[1:]}


def _in_use_words(points: Sequence[Point], best: Point, group: Group) -> str:
    used = next((point for point in points if point["in_use"]), None)
    if used is None:
        return ""
    if used is best:
        return ", and in use"
    if not inside(used["error"]["value"], group["budget"] or 0.0, group["less_is_better"]):
        return f"; {used['tier']}, in use, exceeds it"
    saved = used["seconds"]["median"] - best["seconds"]["median"]
    if saved > 0.0 and apart(used["seconds"], best["seconds"]):
        return f"; it saves {seconds_text(saved)} against {used['tier']}, in use"
    return f"; {used['tier']} is in use"

"""The sentences beside a curve: what each tier costs, where the measurement disagrees with the declared order
of the tiers, and which tier to take. Every comparison of two tiers comes from `compare`, so that no two
sentences contradict each other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from paradize.tradeoff.curve import (
    Group,
    Point,
    apart,
    cheapest,
    dominates,
    inside,
    knee,
    loss,
    main_front,
    mark,
    series_of,
)

_SAME_BYTES = 0.05  # sizes that differ by less than this share count as equal
_SAME_ERROR = 0.02  # and errors that differ by less than this share


def conclude(group: Group) -> list[str]:
    """Adds to a group what follows from its points: the front, the sentence and the advice. Returns warnings
    if time or error disagree with the declared order."""
    mark(group["points"], group["less_is_better"])
    for point in group["points"]:
        if point["dominated"]:
            point["instead"] = instead(point, group)
    group["sentence"] = sentence(group)
    group["advice"] = advice(group)
    return disagreements(group)


def value_text(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}".rstrip()


def seconds_text(seconds: float) -> str:
    """Seconds with a fitting unit: 3.2 s, 41 ms, 7 us."""
    if seconds >= 1.0:
        return f"{seconds:.3g} s"
    return f"{seconds * 1e3:.3g} ms" if seconds >= 1e-3 else f"{seconds * 1e6:.3g} us"


def _times(ratio: float) -> str:
    return f"{_two(ratio)} x"


def _two(value: float) -> str:
    """Two digits, without an exponent for large numbers."""
    return f"{value:.2g}" if value < 100.0 else f"{float(f'{value:.2g}'):.0f}"


class Compared(NamedTuple):
    """Two tiers of one series. time, error: 1 if `after` takes longer or has more error, -1 if less, 0 if the
    difference is chance: times that are not apart (curve.py), errors within _SAME_ERROR."""

    before: Point
    after: Point
    time: int
    error: int


def compare(before: Point, after: Point, group: Group) -> Compared:
    """Raises ValueError for tiers of different series: they differ in bytes, and only a budget can weigh
    bytes against error."""
    if series_of(before) != series_of(after):
        raise ValueError(f"{before['tier']} and {after['tier']} are of different series")
    a, b = before["seconds"], after["seconds"]
    time = 0
    if apart(a, b) and a["median"] > 0.0:
        time = 1 if b["median"] > a["median"] else -1
    old, new = (loss(point["error"]["value"], group["less_is_better"]) for point in (before, after))
    alike = old == new or abs(new - old) < _SAME_ERROR * max(old, new)
    return Compared(before, after, time, 0 if alike else 1 if new > old else -1)


def chains(group: Group) -> list[list[Point]]:
    """The points by series, in the group's order. Only points of one chain are compared."""
    series: dict[str, list[Point]] = {}
    for point in group["points"]:
        series.setdefault(series_of(point), []).append(point)
    return list(series.values())


def _neighbours(group: Group) -> list[Compared]:
    return [compare(a, b, group) for chain in chains(group) for a, b in pairwise(chain)]


def _time_words(pair: Compared) -> str:
    name = pair.before["tier"]
    if pair.time == 0:
        return f"takes about as long as {name}"
    ratio = pair.after["seconds"]["median"] / pair.before["seconds"]["median"]
    if 0.5 < ratio < 2.0:
        share = f"{100.0 * abs(ratio - 1.0):.2g} %"
        return f"takes {share} {'longer' if ratio > 1.0 else 'less time'} than {name}"
    return f"{'costs' if pair.time > 0 else 'takes'} {_times(ratio)} the time of {name}"


def _error_words(pair: Compared, group: Group) -> str:
    before, after = pair.before, pair.after
    old, new = (loss(point["error"]["value"], group["less_is_better"]) for point in (before, after))
    figures = " to ".join(f"{point['error']['value']:.3g}" for point in (before, after))
    figures = f" ({figures} {group['unit']})"
    if pair.error == 0:
        return "has the same error"
    if new == 0.0:
        return f"leaves no error{figures}"
    if old == 0.0:
        return f"has an error where {before['tier']} has none{figures}"
    ratio = new / old
    if 0.45 <= ratio <= 0.55:
        return f"halves the error{figures}"
    if ratio < 1e-3:
        return f"leaves next to no error{figures}"
    if ratio < 0.1:
        return f"divides the error by {_two(1.0 / ratio)}{figures}"
    if ratio < 1.0:
        return f"has {100.0 * (1.0 - ratio):.0f} % less error{figures}"
    more = f"{100.0 * (ratio - 1.0):.0f} % more error" if ratio < 1.3 else f"{_times(ratio)} the error"
    return f"has {more}{figures}"


def _size_words(before: Point, after: Point) -> str:
    old, new = before["bytes"], after["bytes"]
    if not old or not new or abs(new - old) <= _SAME_BYTES * old:
        return ""
    return f" at {_times(new / old)} the bytes"


def compared(before: Point, after: Point, group: Group) -> str:
    """balanced costs 3 x the time of fast and halves the error (1.2 to 0.6 degrees) at 2 x the bytes."""
    pair = compare(before, after, group)
    words = f"{after['tier']} {_time_words(pair)} and {_error_words(pair, group)}"
    return words + _size_words(before, after)


def _alone(point: Point, group: Group) -> str:
    size = f" and {point['bytes']} bytes" if point["bytes"] else ""
    took, value = seconds_text(point["seconds"]["median"]), value_text(point["error"]["value"], group["unit"])
    return f"{point['tier']} takes {took}{size}; {group['metric']} is {value}"


def sentence(group: Group) -> str:
    """Compares neighbouring tiers of one series; gives the figures of a series with one tier."""
    if len(group["points"]) == 1:
        (only,) = group["points"]
        took, value = seconds_text(only["seconds"]["median"]), only["error"]["value"]
        return f"There is one tier: it takes {took}; {group['metric']} is {value_text(value, group['unit'])}."
    sentences = []
    for chain in chains(group):
        pairs = [compared(before, after, group) for before, after in pairwise(chain)]
        text = "; ".join(pairs or [_alone(chain[0], group)])
        sentences.append(f"{text[:1].upper()}{text[1:]}.")
    return " ".join(sentences)


def disagreements(group: Group) -> list[str]:
    """A warning for each tier that is quicker than the one declared quicker, or has more error than the one
    declared less exact."""
    warnings: list[str] = []
    for pair in _neighbours(group) if group.get("declared") else ():
        before, after = pair.before, pair.after
        if pair.time < 0:
            took = [seconds_text(point["seconds"]["median"]) for point in (after, before)]
            warnings.append(
                f"{group['name']}: {after['tier']} is declared slower than {before['tier']}, but takes "
                f"{took[0]} against {took[1]}"
            )
        if pair.error > 0:
            figures = [value_text(point["error"]["value"], group["unit"]) for point in (after, before)]
            warnings.append(
                f"{group['name']}: {after['tier']} is declared more exact than {before['tier']}, but its "
                f"{group['metric']} is {figures[0]} against {figures[1]}"
            )
    return warnings


def instead(point: Point, group: Group) -> str:
    """Names the tier to take instead of a dominated one, and why."""
    best, why = _better(point, group)
    return f"take {best['tier']}: it is {why}"


def _better(point: Point, group: Group) -> tuple[Point, str]:
    """The best tier that dominates a tier, and what makes it better."""
    less = group["less_is_better"]
    better = [other for other in group["points"] if dominates(other, point, less)]
    best = min(better, key=lambda other: (other["dominated"], other["seconds"]["median"]))
    quicker = (
        apart(best["seconds"], point["seconds"]) and best["seconds"]["median"] < point["seconds"]["median"]
    )
    exacter = loss(best["error"]["value"], less) < loss(point["error"]["value"], less)
    smaller = series_of(best) != series_of(point) and (best["bytes"] or 0) < (point["bytes"] or 0)
    gains = [
        word for word, true in (("quicker", quicker), ("smaller", smaller), ("more exact", exacter)) if true
    ]
    if not (quicker and exacter):
        gains.append("no slower" if exacter else "no worse")
    return best, f"{', '.join(gains[:-1])} and {gains[-1]}"


def advice(group: Group) -> dict[str, Any] | None:
    """Which tier to take, and why: {"tier", "why", "text"}.

    "budget": the cheapest inside it (tier None if none is). Without a budget, of the series with most points
    on the front: "flat", the quickest if all its tiers have the same error; else "knee", where the front
    bends; else "dominated", a better tier than the one in use. None if there is nothing to say."""
    points, budget, less = group["points"], group["budget"], group["less_is_better"]
    if budget is None:
        return _flat(group) or _knee(group) or _dominated(group)
    limit = value_text(budget, group["unit"])
    best = cheapest(points, budget, less)
    if best is None:
        near = min(points, key=lambda point: loss(point["error"]["value"], less))
        value = value_text(near["error"]["value"], group["unit"])
        text = f"No tier is inside the budget of {limit}: the nearest, {near['tier']}, has {value}"
        text += ", and is beyond the budget of another metric." if near.get("passes") is False else "."
        return {"tier": None, "why": "budget", "text": text}
    if len(points) == 1:
        return {"tier": best["tier"], "why": "budget", "text": f"It is inside the budget of {limit}."}
    text = f"{best['tier']} is the cheapest inside the budget of {limit}{_in_use_words(points, best, group)}."
    return {"tier": best["tier"], "why": "budget", "text": text[:1].upper() + text[1:]}


def _flat(group: Group) -> dict[str, Any] | None:
    """The first of the quickest tiers, of a series whose tiers all have the same error."""
    front = main_front(group["points"], group["less_is_better"])
    chain = next((chain for chain in chains(group) if front and front[0].point in chain), [])
    pairs = [compare(a, b, group) for a in chain for b in chain]
    if len(chain) < 2 or any(pair.error for pair in pairs):
        return None
    best = next(a for a in chain if not any(pair.before is a and pair.time < 0 for pair in pairs))
    names = ", ".join(point["tier"] for point in chain[:-1]) + f" and {chain[-1]['tier']}"
    text = f"{names} have the same error: take {best['tier']}, none of them is quicker."
    return {"tier": best["tier"], "why": "flat", "text": text[:1].upper() + text[1:]}


def _knee(group: Group) -> dict[str, Any] | None:
    """Where the front bends, among the points that differ from the one before by more than chance."""
    less = group["less_is_better"]
    kept: list[Point] = []
    for place in main_front(group["points"], less):
        pair = compare(kept[-1], place.point, group) if kept else None
        if pair is None or (pair.time > 0 and pair.error < 0):
            kept.append(place.point)
    at = knee(kept, less)
    if at is None:
        return None
    return {
        "tier": at["tier"],
        "why": "knee",
        "text": f"No budget limits it: the curve bends at {at['tier']}.",
    }


def _dominated(group: Group) -> dict[str, Any] | None:
    """A tier that dominates the one in use."""
    used = next((point for point in group["points"] if point["in_use"] and point["dominated"]), None)
    if used is None:
        return None
    best, why = _better(used, group)
    text = f"{used['tier']}, in use, is dominated: take {best['tier']}, it is {why}."
    return {"tier": best["tier"], "why": "dominated", "text": text[:1].upper() + text[1:]}


def _in_use_words(points: Sequence[Point], best: Point, group: Group) -> str:
    used = next((point for point in points if point["in_use"]), None)
    if used is None:
        return ""
    if used is best:
        return ", and in use"
    if not inside(used["error"]["value"], group["budget"] or 0.0, group["less_is_better"]):
        return f"; {used['tier']}, in use, exceeds it"
    if used.get("passes") is False:
        return f"; {used['tier']}, in use, exceeds the budget of another metric"
    if series_of(used) == series_of(best) and compare(best, used, group).time > 0:
        saved = used["seconds"]["median"] - best["seconds"]["median"]
        return f"; it saves {seconds_text(saved)} against {used['tier']}, in use"
    return f"; {used['tier']} is in use"

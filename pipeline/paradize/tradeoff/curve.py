"""Which tiers are dominated, which form the Pareto front, where its knee is, and which is the cheapest inside
a budget. Pure functions of the points of a group, in the form of tradeoff.json."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import quantiles
from typing import Any, NamedTuple, NotRequired, TypedDict

from paradize.tradeoff.timing import LEAST_RUNS

LOSSLESS_DB = 120.0  # from here on a picture counts as without error: metrics report at most this


class Seconds(TypedDict):
    """Median and quartiles of a number of runs."""

    median: float
    low: float
    high: float
    runs: int


class Point(TypedDict):
    """A measured tier. series: points of one series count as equal in bytes (one texture format, one mesh); a
    point without one is a series of its own. error: "value" is the group's metric; mean, p99, max ... belong
    to it. loss: the value as an error (see loss). bytes: of what is written; None: nothing. passes: False if
    another metric of the tier is beyond its budget. beside: errors of other kinds, by metric, the same for
    all points of a group; less is better. instead: what to take if the tier is dominated."""

    tier: str
    seconds: Seconds
    error: dict[str, float]
    bytes: int | None
    in_use: bool
    dominated: bool
    on_front: bool
    loss: NotRequired[float]
    series: NotRequired[str]
    beside: NotRequired[dict[str, float]]
    passes: NotRequired[bool]
    note: NotRequired[str]
    instead: NotRequired[str]


class Group(TypedDict):
    """The tiers of one stage on one artifact, in their declared order, from cheap to exact. kind: "bake" or
    "frame". time: what was timed. declared: tiers whose order is a promise: each is slower and more exact
    than the one before. budget: the scene's; None without one."""

    name: str
    stage: str
    kind: str
    artifact: str
    metric: str
    unit: str
    less_is_better: bool
    time: str
    points: list[Point]
    budget: float | None
    sentence: str
    declared: NotRequired[list[str]]
    note: NotRequired[str]
    advice: NotRequired[dict[str, Any] | None]


def spread(seconds: Sequence[float]) -> Seconds:
    """Median and quartiles (by linear interpolation) of at least one run."""
    if len(seconds) == 1:
        low = median = high = seconds[0]
    else:
        low, median, high = quantiles(seconds, n=4, method="inclusive")
    return {"median": median, "low": low, "high": high, "runs": len(seconds)}


def loss(value: float, less_is_better: bool) -> float:
    """The value of a metric as an error, 0 or more: itself, or of decibels the RMS error as a share of the
    peak, 10^(-dB / 20); 0 where nothing is lost."""
    if less_is_better:
        return value
    return 0.0 if value >= LOSSLESS_DB else 10.0 ** (-value / 20.0)


def inside(value: float, budget: float, less_is_better: bool) -> bool:
    """Whether a value keeps a budget."""
    return value <= budget if less_is_better else value >= budget


def series_of(point: Point) -> str:
    """The series of a point. Only points of one series are compared: their bytes count as equal."""
    return point.get("series", point["tier"] if point["bytes"] else "")


def dominates(a: Point, b: Point, less_is_better: bool) -> bool:
    """Whether a is at least as good as b in time, error and (in another series) bytes and all errors beside,
    and better in one of them. Times within each other's quartiles are equal."""
    first = a["seconds"]["median"] if apart(a["seconds"], b["seconds"]) else b["seconds"]["median"]
    costs = []
    for point, seconds in ((a, first), (b, b["seconds"]["median"])):
        more: tuple[float, ...] = ()
        if series_of(a) != series_of(b):
            beside = point.get("beside", {})
            more = (point["bytes"] or 0, *(beside[metric] for metric in sorted(beside)))
        costs.append((seconds, loss(point["error"]["value"], less_is_better), *more))
    return costs[0] != costs[1] and all(p <= q for p, q in zip(*costs, strict=True))


def mark(points: Sequence[Point], less_is_better: bool) -> None:
    """Sets `loss`, `dominated` and `on_front` of every point."""
    for point in points:
        point["loss"] = loss(point["error"]["value"], less_is_better)
        point["dominated"] = any(dominates(other, point, less_is_better) for other in points)
        point["on_front"] = not point["dominated"]


class FrontPoint(NamedTuple):
    """A point of a front: its median seconds and its error, both above 0."""

    seconds: float
    loss: float
    point: Point


def main_front(points: Sequence[Point], less_is_better: bool) -> list[FrontPoint]:
    """The Pareto front of the series with most points on it, the quickest first. Points without error are
    left out: they have no place on a logarithmic axis."""
    fronts: dict[str, list[FrontPoint]] = {}
    for point in points:
        place = FrontPoint(point["seconds"]["median"], loss(point["error"]["value"], less_is_better), point)
        if point["on_front"] and place.loss > 0.0 and place.seconds > 0.0:
            fronts.setdefault(series_of(point), []).append(place)
    longest = max(fronts.values(), key=len, default=[])
    return sorted(longest, key=lambda place: place[:2])


def knee(points: Sequence[Point], less_is_better: bool) -> Point | None:
    """The point of the main front that is farthest below the chord between its ends, on logarithmic axes of
    time and error; None if no point is below it.

    Source: V. Satopaa, J. Albrecht, D. Irwin and B. Raghavan, "Finding a Kneedle in a Haystack", 2011.
    """
    front = [(math.log(place.seconds), math.log(place.loss)) for place in main_front(points, less_is_better)]
    if len(front) < 3:
        return None
    (t0, e0), (t1, e1) = front[0], front[-1]
    # Twice the areas of triangles over the chord, whose length is common to all.
    below = [(t - t0) * (e1 - e0) - (e - e0) * (t1 - t0) for t, e in front]
    best = max(range(len(front)), key=below.__getitem__)
    return main_front(points, less_is_better)[best].point if below[best] > 0.0 else None


def cheapest(points: Sequence[Point], budget: float, less_is_better: bool) -> Point | None:
    """The quickest point inside the budget, of the series with the fewest bytes; None if no point is inside.

    Bytes count first: they cost at every load and every frame, the time of a bake only once.
    """
    sizes: dict[str, int] = {}
    for point in points:
        size = point["bytes"] or 0
        sizes[series_of(point)] = min(sizes.get(series_of(point), size), size)
    passing = [
        point
        for point in points
        if inside(point["error"]["value"], budget, less_is_better) and point.get("passes", True)
    ]
    return min(passing, key=lambda point: (sizes[series_of(point)], point["seconds"]["median"]), default=None)


def apart(a: Seconds, b: Seconds) -> bool:
    """Whether the quartiles of two times do not overlap. One or two runs have no quartiles: then whether one
    time is more than twice the other."""
    slack = 1.0 if min(a["runs"], b["runs"]) >= LEAST_RUNS else 2.0
    return slack * a["high"] < b["low"] or slack * b["high"] < a["low"]

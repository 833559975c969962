"""A group of tradeoff.json -> one SVG: time across, error up, both logarithmic; lower left is better.

The area of a circle follows the bytes; the bar through it spans the quartiles of the time. Dominated tiers
are grey, a line joins the front of each series, the tier in use has a ring, a budget is a line. Colours are
CSS classes, because the page may be dark."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

WIDTH, HEIGHT = 420.0, 300.0
LEFT, RIGHT, TOP, BOTTOM = 62.0, 22.0, 16.0, 46.0
LANE = 26.0  # height of the strip for points without error, which a logarithmic axis cannot show
_LARGEST, _SMALLEST = 13.0, 4.5  # radii
_DECADES = 5.0  # range of errors on the axis; smaller errors count as none
_LETTER = 6.1  # width of a letter of a label
COLORS = 5


@dataclass(frozen=True)
class Axis:
    """A logarithmic axis: `low` to `high` (both above 0) map to `start` to `end` of the picture."""

    low: float
    high: float
    start: float
    end: float

    def at(self, value: float) -> float:
        share = math.log(value / self.low) / math.log(self.high / self.low)
        return self.start + share * (self.end - self.start)

    def ticks(self) -> list[float]:
        """Values with a grid line: powers of ten; if those are few, also twice and five times such."""
        first, last = math.floor(math.log10(self.low)), math.ceil(math.log10(self.high))
        wide = math.log10(self.high / self.low) > 1.6
        steps = (1.0,) if wide else (1.0, 2.0, 5.0)
        values = [step * 10.0**power for power in range(first, last + 1) for step in steps]
        inside = [value for value in values if self.low <= value <= self.high]
        most = 5
        return inside[:: max(1, -(-len(inside) // most))]


def axis_over(values: Sequence[float], start: float, end: float, margin: float = 1.6) -> Axis:
    """An axis over the values (above 0), wider by a factor `margin` on both sides, at least a factor of
    ten."""
    low, high = min(values) / margin, max(values) * margin
    if high < 10.0 * low:
        middle = math.sqrt(low * high)
        low, high = middle / math.sqrt(10.0), middle * math.sqrt(10.0)
    return Axis(low, high, start, end)


def seconds_label(seconds: float) -> str:
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if seconds >= scale * 0.9999:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def number_label(value: float) -> str:
    if value == 0.0:
        return "0"
    return (
        f"{value:.3g}"
        if 1e-3 <= abs(value) < 1e5
        else f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e")
    )


def curve(group: Mapping[str, Any]) -> str:
    """The SVG of a group; nothing where one tier makes no curve."""
    return plot(group) if len(group["points"]) > 1 else ""


def plot(group: Mapping[str, Any]) -> str:
    """The SVG of a group with at least one point. For screen readers it is one image, because its texts stand
    beside it too."""
    points = group["points"]
    known = [point["loss"] for point in points if point["loss"] > 0.0]
    budget = _budget_loss(group)
    floor = (max([*known, budget or 0.0]) or 1.0) * 10.0**-_DECADES
    shown = [value for value in [*known, *([budget] if budget else [])] if value >= floor] or [1.0]
    lane = any(point["loss"] < floor for point in points)
    x = axis_over(
        [point["seconds"][key] for point in points for key in ("low", "high")],
        LEFT,
        WIDTH - RIGHT,
        margin=1.4,
    )
    y = axis_over(shown, HEIGHT - BOTTOM - (LANE if lane else 0.0), TOP)
    at = [
        (
            x.at(p["seconds"]["median"]),
            y.at(p["loss"]) if p["loss"] >= floor else HEIGHT - BOTTOM - LANE / 2.0,
        )
        for p in points
    ]
    words = _budget_box(group, budget, y, at)
    parts = [_grid(group, x, y, lane), _budget_line(group, budget, y, words)]
    parts += _fronts(points, at)
    series = series_colors(points)
    for point, (px, py) in zip(points, at, strict=True):
        parts.append(_marker(group, point, px=px, py=py, x=x, radius=_radius(point, points), series=series))
    parts.append(_labels(points, at, [_radius(point, points) for point in points], words))
    label = escape(f"{group['name']}: {group['metric']} against time. {group['sentence']}", quote=True)
    return (
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{label}">'
        + "".join(parts)
        + "</svg>"
    )


def series_colors(points: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """The colour number of each series, in the order of the points; one colour if each point is a series of
    its own."""
    names = list(dict.fromkeys(point.get("series", point["tier"]) for point in points))
    if len(names) == len(points):
        return dict.fromkeys(names, 0)
    return {name: at % COLORS for at, name in enumerate(names)}


def _budget_loss(group: Mapping[str, Any]) -> float | None:
    if group["budget"] is None or group["budget"] <= 0.0:
        return None
    value = float(group["budget"])
    return value if group["less_is_better"] else float(10.0 ** (-value / 20.0))


def _radius(point: Mapping[str, Any], points: Sequence[Mapping[str, Any]]) -> float:
    most = max((other["bytes"] or 0 for other in points), default=0)
    if not most or not point["bytes"]:
        return 6.0
    return max(_SMALLEST, _LARGEST * math.sqrt(point["bytes"] / most))


def _text(x: float, y: float, text: str, anchor: str = "middle", kind: str = "tick") -> str:
    return f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'


def _box(kind: str, bottom: float) -> str:
    """From the top of the field down to `bottom`."""
    wide, high = WIDTH - LEFT - RIGHT, bottom - TOP
    return f'<rect class="{kind}" x="{LEFT:g}" y="{TOP:g}" width="{wide:g}" height="{high:.1f}"/>'


def _grid(group: Mapping[str, Any], x: Axis, y: Axis, lane: bool) -> str:
    bottom = HEIGHT - BOTTOM
    parts = [_box("field", bottom)]
    for value in x.ticks():
        px = x.at(value)
        parts.append(f'<path class="grid" d="M{px:.1f} {TOP:g}V{bottom:g}"/>')
        parts.append(_text(px, bottom + 15.0, seconds_label(value)))
    for value, text in _error_ticks(group, y):
        py = y.at(value)
        parts.append(f'<path class="grid" d="M{LEFT:g} {py:.1f}H{WIDTH - RIGHT:g}"/>')
        parts.append(_text(LEFT - 6.0, py + 4.0, text, "end"))
    if lane:
        py = bottom - LANE + 6.0
        parts.append(f'<path class="break" d="M{LEFT:g} {py:.1f}H{WIDTH - RIGHT:g}"/>')
        parts.append(_text(LEFT - 6.0, bottom - 5.0, "none", "end"))
    frame = "time of a frame" if group["kind"] == "frame" else "time of a bake, one core"
    parts.append(_text((LEFT + WIDTH - RIGHT) / 2.0, HEIGHT - 8.0, frame, kind="axis"))
    middle = (TOP + bottom) / 2.0
    unit = escape(group["unit"] or group["metric"])
    parts.append(
        f'<text class="axis" x="13" y="{middle:.1f}" text-anchor="middle" '
        f'transform="rotate(-90 13 {middle:.1f})">{unit}</text>'
    )
    return "".join(parts)


def _error_ticks(group: Mapping[str, Any], y: Axis) -> list[tuple[float, str]]:
    """Errors with a grid line, and their labels; a metric in dB has ticks in dB."""
    if group["less_is_better"]:
        return [(value, number_label(value)) for value in y.ticks()]
    best, worst = -20.0 * math.log10(y.low), -20.0 * math.log10(y.high)
    step = next(step for step in (5, 10, 20, 40, 1000) if (best - worst) / step <= 6)
    first = math.ceil(worst / step) * step
    return [(10.0 ** (-db / 20.0), f"{db:g}") for db in range(int(first), int(best) + 1, step)]


def _budget_line(
    group: Mapping[str, Any],
    budget: float | None,
    y: Axis,
    words: Sequence[tuple[float, float, float, float]],
) -> str:
    if budget is None or not words:
        return ""
    py = y.at(budget)
    ((_, _, right, bottom),) = words
    return (
        _box("beyond", py)
        + f'<path class="budget" d="M{LEFT:g} {py:.1f}H{WIDTH - RIGHT:g}"/>'
        + _text(right, bottom - 3.0, f"budget {group['budget']:g}", "end", "limit")
    )


def _budget_box(
    group: Mapping[str, Any], budget: float | None, y: Axis, at: Sequence[tuple[float, float]]
) -> list[tuple[float, float, float, float]]:
    """The box of the budget's label: at the end or the beginning of its line, above or below it, where it
    covers the circles at `at` least; empty without a line."""
    if budget is None or not y.low <= budget <= y.high:
        return []
    py = y.at(budget)
    wide = _LETTER * len(f"budget {group['budget']:g}")
    boxes = []
    for right in (WIDTH - RIGHT - 4.0, LEFT + 4.0 + wide):
        for bottom in (py - 2.0, py + 16.0):
            box = (right - wide, bottom - 13.0, right, bottom)
            taken = sum(_common(box, (px - 9.0, p - 9.0, px + 9.0, p + 9.0)) for px, p in at)
            boxes.append((taken + (1e3 if box[1] < TOP - 2.0 else 0.0), box))
    return [min(boxes, key=lambda taken_box: taken_box[0])[1]]


def _fronts(points: Sequence[Mapping[str, Any]], at: Sequence[tuple[float, float]]) -> list[str]:
    """A line through the front of each series."""
    series = series_colors(points)
    alone = len(set(series.values())) == 1
    lines: dict[str, list[tuple[float, float]]] = {}
    for point, place in zip(points, at, strict=True):
        if point["on_front"]:
            name = "" if alone else point.get("series", point["tier"])
            lines.setdefault(name, []).append(place)
    paths = []
    for name, line in lines.items():
        path = "L".join(f"{px:.1f} {py:.1f}" for px, py in sorted(line))
        paths.append(f'<path class="front c{series.get(name, 0)}" d="M{path}"/>')
    return paths


def _marker(
    group: Mapping[str, Any],
    point: Mapping[str, Any],
    px: float,
    py: float,
    x: Axis,
    radius: float,
    series: Mapping[str, int],
) -> str:
    kind = "dominated" if point["dominated"] else f"c{series[point.get('series', point['tier'])]}"
    seconds = point["seconds"]
    low, high = x.at(seconds["low"]), x.at(seconds["high"])
    title = (
        f"{point['tier']}: {seconds_label(seconds['median'])} ({seconds_label(seconds['low'])} to "
        f"{seconds_label(seconds['high'])}, {seconds['runs']} runs), "
        f"{number_label(point['error']['value'])} {group['unit']}"
    )
    ring = f'<circle class="ring" r="{radius + 4.0:.1f}"/>' if point["in_use"] else ""
    return (
        f'<path class="spread {kind}" d="M{low:.1f} {py:.1f}H{high:.1f}M{low:.1f} {py - 4:.1f}v8M{high:.1f} '
        f'{py - 4:.1f}v8"/><g transform="translate({px:.1f} {py:.1f})">'
        f'<circle class="dot {kind}" r="{radius:.1f}"><title>{escape(title)}</title></circle>{ring}</g>'
    )


def _labels(
    points: Sequence[Mapping[str, Any]],
    at: Sequence[tuple[float, float]],
    radii: Sequence[float],
    taken: Sequence[tuple[float, float, float, float]],
) -> str:
    """The names of the tiers beside their circles, each where it covers least."""
    taken = [*taken, *((px - r, py - r, px + r, py + r) for (px, py), r in zip(at, radii, strict=True))]
    parts = []
    order = sorted(range(len(points)), key=lambda k: not points[k]["in_use"])
    for k in order:
        (px, py), r, name = at[k], radii[k], points[k]["tier"]
        wide = len(name) * _LETTER + 2.0
        gap = r + (7.0 if points[k]["in_use"] else 4.0)
        places = []
        for dx, dy, anchor in (
            (0.0, -gap - 1.0, "middle"), (0.0, gap + 10.0, "middle"), (gap, 4.0, "start"), (-gap, 4.0, "end"),
            (gap, -9.0, "start"), (gap, 17.0, "start"), (-gap, -9.0, "end"), (-gap, 17.0, "end"),
            (0.0, -gap - 14.0, "middle"), (0.0, gap + 23.0, "middle"),
        ):  # fmt: skip
            left = px + dx - {"start": 0.0, "middle": wide / 2.0, "end": wide}[anchor]
            box = (left, py + dy - 10.0, left + wide, py + dy + 3.0)
            outside = max(0.0, LEFT - box[0]) + max(0.0, box[2] - WIDTH + 2.0) + max(0.0, TOP - box[1])
            outside += max(0.0, box[3] - (HEIGHT - BOTTOM))
            places.append((outside * 20.0 + sum(_common(box, other) for other in taken), dx, dy, anchor, box))
        _, dx, dy, anchor, box = min(places, key=lambda choice: choice[0])
        taken.append(box)
        kind = "name used" if points[k]["in_use"] else "name"
        parts.append(
            _text(px + dx, py + dy, name, anchor, kind + (" grey" if points[k]["dominated"] else ""))
        )
    return "".join(parts)


def _common(a: Sequence[float], b: Sequence[float]) -> float:
    """The area that two boxes share."""
    wide, high = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    return wide * high if wide > 0.0 and high > 0.0 else 0.0

"""Draws the trade of time against error beside the peers: build/bench/chart.svg, which README.md shows.

Rows that bear a Trade are kept in build/bench/trades.json, so that topics may be measured one by one.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from html import escape
from itertools import pairwise
from pathlib import Path

from row import Row

FOLDER = Path(__file__).parents[2] / "build/bench"
WIDTH, HEIGHT, TOP, LEFT, GAP = 290, 290, 62, 66, 74  # of a panel, pixels
INK, PALE, OURS, PEER, LESS = "#24292f", "#d8dee4", "#0969da", "#bc4c00", "#6e7781"
TEXT = 'font-family="Helvetica, Arial, sans-serif"'
Point = tuple[str, str, float, float]  # kind (ours, peer, less), name, time and error as multiples of our own


def keep(rows: Iterable[Row]) -> dict[str, dict[str, list[Point]]]:
    """The points by panel: those measured before, and those of these rows instead where there are any."""
    fresh: dict[str, dict[str, list[float | str]]] = {}
    for row in rows:
        if row.trade is None:
            continue
        panel = fresh.setdefault(row.trade.panel, {})
        for kind, name, ms, error in (
            ("ours", row.trade.ours, row.ours_ms, row.trade.ours_error),
            ("less" if row.trade.less else "peer", row.trade.peer, row.peer_ms, row.trade.peer_error),
        ):
            panel.setdefault(name, [kind, ms / row.trade.share, error])
    file = FOLDER / "trades.json"
    known = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    known |= fresh
    FOLDER.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(known, indent=1), encoding="utf-8")
    return {panel: points(found) for panel, found in sorted(known.items())}


def points(found: dict[str, list[float | str]]) -> list[Point]:
    """As multiples of our quickest point."""
    ours = min((entry for entry in found.values() if entry[0] == "ours"), key=lambda entry: entry[1])
    return [(kind, name, ms / ours[1], error / ours[2]) for name, (kind, ms, error) in found.items()]


def draw(rows: Iterable[Row]) -> Path | None:
    """Writes the chart; None where no row belongs to it."""
    panels = keep(rows)
    if not panels:
        return None
    parts = []
    for at, (title, found) in enumerate(panels.items()):
        parts += panel(LEFT + at * (WIDTH + GAP), title, found)
    wide, high = LEFT + len(panels) * (WIDTH + GAP) - GAP + 14, TOP + HEIGHT + 74
    parts += legend(LEFT, high - 14)
    frame = f'<rect width="{wide}" height="{high}" rx="8" fill="#ffffff" stroke="{PALE}"/>'
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {high}" width="{wide}" height="{high}">'
    )
    file = FOLDER / "chart.svg"
    file.write_text("\n".join([head, frame, *parts, "</svg>"]) + "\n", encoding="utf-8")
    return file


def panel(left: float, title: str, found: list[Point]) -> list[str]:
    spans = [span([point[axis] for point in found]) for axis in (2, 3)]

    def place(point: Point) -> tuple[float, float]:
        shares = [
            (math.log(value) - math.log(low)) / (math.log(high) - math.log(low))
            for value, (low, high) in zip(point[2:], spans, strict=True)
        ]
        return left + shares[0] * WIDTH, TOP + (1 - shares[1]) * HEIGHT

    first, _, second = title.partition(": ")
    parts = [
        label(left, TOP - 34, first, size=15, weight="bold"),
        label(left, TOP - 16, second, size=11),
        f'<rect x="{left}" y="{TOP}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="{INK}"/>',
        label(left + WIDTH / 2, TOP + HEIGHT + 34, "time, of our fastest tier", anchor="middle"),
        f'<g transform="translate({left - 50} {TOP + HEIGHT / 2}) rotate(-90)">'
        + label(0, 0, "error, of our fastest tier", anchor="middle")
        + "</g>",
    ]
    for axis, (low, high) in enumerate(spans):
        for value in ticks(low, high):
            x, y = place(("", "", value, spans[1][0]) if axis == 0 else ("", "", spans[0][0], value))
            to = f'x2="{x}" y2="{TOP}"' if axis == 0 else f'x2="{left + WIDTH}" y2="{y}"'
            parts.append(f'<line x1="{x:.1f}" y1="{y:.1f}" {to} stroke="{PALE}"/>')
            text = f"{value:g} x"
            parts.append(
                label(x, y + 16, text, anchor="middle")
                if axis == 0
                else label(x - 4, y + 4, text, anchor="end")
            )
    own = [place(point) for point in sorted(found, key=lambda point: point[2]) if point[0] == "ours"]
    for (x, y), (u, v) in pairwise(own):
        parts.append(
            f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{u:.1f}" y2="{v:.1f}" stroke="{OURS}" stroke-width="2"/>'
        )
    taken = [box(*place(point), -6, 12) for point in found]
    for (x, y), (u, v) in pairwise(own):
        taken += [box(x + (u - x) * k / 20, y + (v - y) * k / 20, -1, 2, 2) for k in range(21)]
    for kind, name, *values in found:
        x, y = place((kind, name, values[0], values[1]))
        color = {"ours": OURS, "peer": PEER, "less": LESS}[kind]
        parts.append(mark(kind, x, y))
        parts.append(beside(name, x, y, color, taken, left))
    return parts


def span(values: list[float]) -> tuple[float, float]:
    """The axis: a little beyond the values, a factor of two at least."""
    low, high = min(values), max(values)
    more = max((high / low) ** 0.14, math.sqrt(2 / (high / low)) if high < 2 * low else 1.0, 1.06)
    return low / more, high * more


def ticks(low: float, high: float) -> list[float]:
    """Round numbers of the axis, at most six."""
    for steps in ((1, 1.2, 1.4, 1.6, 1.8, 2, 2.5, 3, 4, 5, 6, 8), (1, 1.5, 2, 3, 4, 6), (1, 2, 5), (1,)):
        found = [step * 10.0**power for power in range(-4, 6) for step in steps]
        found = [round(value, 6) for value in found if low <= value <= high]
        if len(found) <= 6:
            return found
    return found


def mark(kind: str, x: float, y: float) -> str:
    if kind == "ours":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5.5" fill="{OURS}"/>'
    color, fill = (PEER, PEER) if kind == "peer" else (LESS, "#ffffff")
    side = f'x="{x - 4.5:.1f}" y="{y - 4.5:.1f}" width="9" height="9"'
    return f'<rect {side} fill="{fill}" stroke="{color}" stroke-width="1.6"/>'


def box(x: float, y: float, start: float, width: float, half: float = 6) -> tuple[float, float, float, float]:
    return x + start, y - half, x + start + width, y + half


def beside(
    name: str, x: float, y: float, color: str, taken: list[tuple[float, float, float, float]], left: float
) -> str:
    """The name where it covers nothing: right of the point, left of it, or some lines above or below."""
    wide = 6.1 * len(name)
    for down in (0, 13, -13, 26, -26, 39, -39):
        for anchor, start in (("start", 9.0), ("end", -9.0 - wide), ("middle", -wide / 2)):
            if anchor == "middle" and down == 0:
                continue
            low, top, high, bottom = one = box(x, y + down, start, wide)
            inside = left + 2 <= low and high <= left + WIDTH - 2 and top > TOP and bottom < TOP + HEIGHT
            if inside and not any(low < b[2] and b[0] < high and top < b[3] and b[1] < bottom for b in taken):
                taken.append(one)
                at = x + {"start": 9, "end": -9, "middle": 0}[anchor]
                return label(at, y + down + 4, name, anchor=anchor, color=color)
    raise SystemExit(f"chart: no room for {name!r}")


def label(
    x: float, y: float, text: str, *, size: int = 11, anchor: str = "start", color: str = INK,
    weight: str = "normal",
) -> str:  # fmt: skip
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" {TEXT} font-size="{size}" font-weight="{weight}" '
        f'text-anchor="{anchor}" fill="{color}">{escape(text)}</text>'
    )


def legend(x: float, y: float) -> list[str]:
    parts = []
    for kind, text in (
        ("ours", "Paradize, by tier"),
        ("peer", "others, the same work"),
        ("less", "others, positions alone: no texture coordinates, no seams"),
    ):
        parts += [mark(kind, x + 6, y - 4), label(x + 18, y, text)]
        x += 52 + 5.6 * len(text)
    parts.append(label(x, y, "Down and to the left is better. Both axes are logarithmic."))
    return parts

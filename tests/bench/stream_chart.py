"""Draws the curve of screen error against seconds since start."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tests.places import ROOT

CHART = ROOT / "build/bench/stream.svg"
Curve = list[tuple[float, float]]  # seconds since the start, largest error on screen


def draw(curves: dict[str, Curve]) -> None:
    """Error on screen, from 1 to 10,000 on a logarithmic scale, against the first ten seconds."""
    wide, high, left, top = 560, 300, 60, 40
    colors = {"needs": "#0969da", "file": "#bc4c00"}
    names = {"needs": "what the picture needs most first", "file": "order of scene.json"}
    text = 'font-family="Helvetica, Arial, sans-serif" font-size="12" fill="#24292f"'
    last = min(10.0, max(points[-1][0] for points in curves.values()))

    def at(second: float, error: float) -> tuple[float, float]:
        return (
            left + wide * min(second / last, 1.0),
            top + high * (1 - np.log10(np.clip(error, 1.0, 1e4)) / 4),
        )

    parts = [f'<rect width="{left + wide + 20}" height="{top + high + 50}" rx="8" fill="#ffffff"/>']
    for power in range(5):
        y = at(0.0, 10.0**power)[1]
        parts.append(f'<path d="M{left} {y:.1f}h{wide}" stroke="#d8dee4"/>')
        parts.append(f'<text x="{left - 8}" y="{y + 4:.1f}" {text} text-anchor="end">{10**power}</text>')
    for second in range(int(last) + 1):
        parts.append(f'<text x="{at(second, 1)[0]:.1f}" y="{top + high + 18}" {text}>{second}</text>')
    for line, (order, points) in enumerate(curves.items()):
        path = ""
        for (a, error), (b, _) in pairwise([*points, (last, points[-1][1])]):
            if a <= last:
                path += f"{'L' if path else 'M'}{at(a, error)[0]:.1f} {at(a, error)[1]:.1f}"
                path += f"L{at(b, error)[0]:.1f} {at(b, error)[1]:.1f}"
        parts.append(f'<path d="{path}" fill="none" stroke="{colors[order]}" stroke-width="2"/>')
        parts.append(
            f'<rect x="{left + 250}" y="{top + 6 + 18 * line}" width="12" height="3" fill="{colors[order]}"/>'
        )
        parts.append(f'<text x="{left + 268}" y="{top + 12 + 18 * line}" {text}>{names[order]}</text>')
    parts.append(
        f'<text x="{left}" y="22" {text}>largest error on screen, multiple of the accepted one</text>'
    )
    parts.append(f'<text x="{left + wide - 110}" y="{top + high + 38}" {text}>seconds since start</text>')
    CHART.parent.mkdir(parents=True, exist_ok=True)
    CHART.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + wide + 20}" height="{top + high + 50}">'
        + "\n".join(parts) + "</svg>\n",
        encoding="utf-8",
    )  # fmt: skip

"""tradeoff.json -> one self-contained page: no script, no network, light and dark, wide and narrow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from paradize.report.tradeoff.plot import curve, number_label, seconds_label, series_colors
from paradize.report.tradeoff.style import STYLE

Group = Mapping[str, Any]
_FRAMES = (
    "Frames are timed on all cores. Their error is the difference from the player’s own reference: the mean "
    "of many frames of a lossless bake."
)
_DOT = '<circle class="dot c0" cx="{}" cy="8" r="{}"/>'


def tradeoff_page(tradeoff: Mapping[str, Any]) -> str:
    """The page of a tradeoff.json."""
    groups = tradeoff["groups"]
    title = f"{Path(tradeoff['source']).stem}: speed against accuracy"
    stages: dict[str, list[Group]] = {}
    for group in groups:
        stages.setdefault(group["stage"], []).append(group)
    parts = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<link rel="icon" href="data:,">',
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body><main>",
        f"<h1>{escape(title)}</h1>",
        _intro(tradeoff),
        _overview(groups),
        _attribution(tradeoff.get("attribution") or []),
        _warnings(tradeoff["warnings"]),
        "<h2>Every stage</h2>",
        _legend(),
    ]
    cards = [_card(group) for members in stages.values() for group in members]
    parts.append(f'<div class="cards">{"".join(cards)}</div>')
    parts.append("</main></body></html>\n")
    return "".join(parts)


def _anchor(text: str) -> str:
    return "".join(letter if letter.isalnum() else "-" for letter in text)


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _intro(tradeoff: Mapping[str, Any]) -> str:
    groups = tradeoff["groups"]
    tiers = sum(len(group["points"]) for group in groups)
    runs = sum(point["seconds"]["runs"] for group in groups for point in group["points"])
    drawn = any(group["kind"] == "frame" for group in groups)
    frames = f" {_FRAMES}" if drawn else ""
    return (
        f'<p class="lead"><code>{escape(tradeoff["source"])}</code>: {_count(len(groups), "comparison")}, '
        f"{_count(tiers, 'tier')}, {_count(runs, 'run')} on {_count(tradeoff['threads'], 'core')}, "
        f"{tradeoff['seconds']:g} s in all. All tiers are measured against the same reference."
        f"{frames}</p>"
    )


def _used(group: Group) -> Mapping[str, Any] | None:
    return next((point for point in group["points"] if point["in_use"]), None)


def _verdict(group: Group) -> tuple[str, str]:
    """The class and the words of a group's verdict: what to do."""
    used, advice, budget = _used(group), group.get("advice"), group["budget"]
    if used is None:
        return "plain", "not in use"
    if budget is not None:
        value = used["error"]["value"]
        over = value > budget if group["less_is_better"] else value < budget
        if over:
            to = advice["tier"] if advice and advice["tier"] else None
            return "bad", f"over budget: take {to}" if to else "over budget: no tier is inside"
    if len(group["points"]) == 1:
        return "plain", "one tier only"
    if advice and advice["tier"] and advice["tier"] != used["tier"]:
        return "hint", f"take {advice['tier']}" if advice["why"] != "knee" else f"bends at {advice['tier']}"
    return "good", "keep it" if budget is None else "keep it: inside budget"


def _overview(groups: Sequence[Group]) -> str:
    rows = []
    for group in groups:
        used = _used(group)
        kind, words = _verdict(group)
        value = limit = took = "–"
        if used:
            value = f"{number_label(used['error']['value'])} {escape(group['unit'])}"
            took = seconds_label(used["seconds"]["median"])
        if group["budget"] is not None:
            limit = f"{'≤' if group['less_is_better'] else '≥'} {group['budget']:g}"
        rows.append(
            f'<tr><td><a href="#{_anchor(group["name"])}">{escape(group["name"])}</a></td>'
            f'<td><span class="tag {kind}">{escape(words)}</span></td>'
            f"<td>{escape(used['tier']) if used else '–'}</td><td>{value}</td><td>{limit}</td>"
            f'<td class="n">{took}</td></tr>'
        )
    head = "".join(
        f"<th>{text}</th>" for text in ("stage", "what to do", "tier in use", "error", "budget", "time")
    )
    return (
        '<h2>At a glance</h2><div class="wide"><table class="glance"><thead><tr>'
        f"{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _attribution(bars: Sequence[Mapping[str, Any]]) -> str:
    """Bars of how much the final picture changes when one stage alone is exact."""
    if not bars:
        return ""
    most = max((bar["flip_mean"] for bar in bars), default=0.0) or 1.0
    rows = []
    for bar in sorted(bars, key=lambda bar: -bar["flip_mean"]):
        share = 100.0 * bar["flip_mean"] / most
        rows.append(
            f'<tr><th scope="row">{escape(bar["stage"])}</th>'
            f'<td class="bar"><span style="width:{share:.1f}%"></span></td>'
            + "".join(
                f'<td class="n">{number_label(bar[f"flip_{part}"])}</td>' for part in ("mean", "p99", "max")
            )
            + "</tr>"
        )
    return (
        "<h2>Which stage causes the error of the frame</h2><p>Each stage in turn was baked exact. How much "
        "the picture then changes (FLIP, 0 to 1) is what its tier in use costs the eye.</p>"
        '<div class="wide"><table class="bars"><thead><tr><th>stage</th><th></th><th>mean</th><th>99 %</th>'
        f"<th>largest</th></tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _warnings(warnings: Sequence[str]) -> str:
    if not warnings:
        return ""
    items = "".join(f"<li>{escape(text)}</li>" for text in warnings)
    return f'<h2>What to know of this measurement</h2><ul class="warnings">{items}</ul>'


def _legend() -> str:
    signs = (
        (34, _DOT.format(8, 3.5) + _DOT.format(24, 7), "area: bytes"),
        (22, '<path class="spread c0" d="M3 8H19M3 4v8M19 4v8"/>', "quartiles of the time"),
        (22, _DOT.format(11, 3.5) + '<circle class="ring" cx="11" cy="8" r="7"/>', "in use"),
        (
            16,
            '<circle class="dot dominated" cx="8" cy="8" r="5"/>',
            "dominated: another tier is better and no worse, take that one",
        ),
        (26, '<path class="budget" d="M1 8H25"/>', "budget"),
    )
    keys = " · ".join(f'<svg viewBox="0 0 {wide} 16">{drawn}</svg> {text}' for wide, drawn, text in signs)
    return f'<p class="legend">In every picture lower left is better: quick and exact. {keys}</p>'


def _card(group: Group) -> str:
    points = group["points"]
    colors = series_colors(points)
    keys = ""
    if len(set(colors.values())) > 1:
        shown = "".join(
            f'<span class="key"><i class="k{color}"></i>{escape(name.partition("_")[0])}</span>'
            for name, color in colors.items()
        )
        keys = f'<p class="keys">{shown}</p>'
    advice = group.get("advice")
    advised = f'<p class="advice">{escape(advice["text"])}</p>' if advice else ""
    better = "".join(
        f'<p class="note">{escape(point["tier"])} is dominated: {escape(point["instead"])}.</p>'
        for point in points
        if point.get("instead") and not point["in_use"]
    )
    note = f'<p class="note">{escape(group["note"])}</p>' if group.get("note") else ""
    return (
        f'<section class="card" id="{_anchor(group["name"])}"><p class="stage">{escape(group["stage"])}</p>'
        f'<h3>{escape(group["name"])}</h3><p class="metric">{escape(group["metric"])}</p>'
        f"<p>{escape(group['sentence'])}</p>{advised}"
        f"{curve(group)}{keys}{better}{note}{_details(group)}</section>"
    )


def _details(group: Group) -> str:
    """The table of all figures of a group."""
    points = group["points"]
    roles = [
        role for role in ("mean", "rms", "p99", "max") if any(role in point["error"] for point in points)
    ]
    notes = any(point.get("note") for point in points)
    head = ["tier", "median", "quartiles", "runs", group["unit"] or "value", *roles, "bytes"]
    head += ["result"] if notes else []
    rows = []
    for point in points:
        seconds = point["seconds"]
        cells = [
            seconds_label(seconds["median"]),
            f"{seconds_label(seconds['low'])} to {seconds_label(seconds['high'])}",
            str(seconds["runs"]),
            number_label(point["error"]["value"]),
            *(number_label(point["error"][role]) if role in point["error"] else "–" for role in roles),
            f"{point['bytes']:,}".replace(",", " ") if point["bytes"] else "–",
        ]
        result = f"<td>{escape(point.get('note', ''))}</td>" if notes else ""
        kind = ' class="used"' if point["in_use"] else ""
        rows.append(
            f'<tr{kind}><th scope="row">{escape(point["tier"])}</th>'
            + "".join(f'<td class="n">{escape(cell)}</td>' for cell in cells)
            + f"{result}</tr>"
        )
    return (
        '<details><summary>All figures</summary><div class="wide"><table><thead><tr>'
        + "".join(f"<th>{escape(text)}</th>" for text in head)
        + f"</tr></thead><tbody>{''.join(rows)}</tbody></table></div></details>"
    )

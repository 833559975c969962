"""The report of a bake: one self-contained page, no script, no network, light and dark, wide and narrow.

Pictures, levels side by side, errors beside their budgets, bytes and time of every artifact, what was not
baked and why, and, where they were measured, the curves of the tiers.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from PIL import Image

from paradize.files import open_file, read_file
from paradize.report.tradeoff.plot import number_label, plot, seconds_label
from paradize.report.tradeoff.style import STYLE
from paradize.scene.budget import METRICS, is_beyond
from paradize.store.atomic import write_whole

_WIDE = 1100  # pixels of a sheet as the page holds it
_QUALITY = 82
_MORE = """
.sheet{margin:0 0 1rem;padding:0;overflow:hidden}
.sheet img{width:100%;height:auto;display:block}
.meter{position:relative;height:.5rem;min-width:7rem;border-radius:99px;background:var(--grid);overflow:hidden}
.meter i{position:absolute;inset:0 auto 0 0;border-radius:99px;background:var(--good)}
.meter.soft i{background:var(--hint)}
.meter.over i{background:var(--bad)}
.facts{display:flex;flex-wrap:wrap;gap:.6rem 2rem;margin:1rem 0;padding:0;list-style:none}
.facts b{display:block;font-size:1.5rem;line-height:1.2}
.facts span{color:var(--soft);font-size:.84rem}
td.why{white-space:normal;min-width:16rem;color:var(--soft)}
"""


def scene_page(
    scene: Mapping[str, Any],
    rows: Sequence[Mapping[str, Any]],
    explained: Mapping[str, Any],
    sheets: Sequence[Path],
    *,
    seconds: float,
    warnings: Sequence[str],
    trade: Mapping[str, Any] | None = None,
) -> str:
    """The page of a baked scene. scene: its scene.json; rows: as `bake --json` tells them; explained: what
    `explain` says: "saved_bytes" (by what was left out, or None) and "artifacts", each a "name" and "why",
    lines; sheets: PNGs to show; trade: a tradeoff.json."""
    title = f"{scene['name']}: what was baked"
    parts = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<link rel="icon" href="data:,">',
        f"<title>{escape(title)}</title><style>{STYLE}{_MORE}</style></head><body><main>",
        f"<h1>{escape(title)}</h1>",
        _facts(scene, rows, explained["saved_bytes"] or {}, seconds),
        _warnings(warnings),
        "<h2>Errors against budgets</h2>",
        _errors(scene, rows),
        "<h2>Bytes and time</h2>",
        _costs(rows),
        "<h2>What it looks like</h2>",
        "".join(map(_sheet, sheets)),
        "<h2>Who asked, and what was not baked</h2>",
        _reasons(explained["artifacts"]),
        _curves(trade),
        "</main></body></html>\n",
    ]
    return "".join(parts)


def _size(count: float) -> str:
    return f"{count / 1e6:.3g} MB" if count >= 1e6 else f"{count / 1e3:.3g} kB"


def _facts(
    scene: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], saved: Mapping[str, int], seconds: float
) -> str:
    over = sum(len(row["over"]) for row in rows)
    total = sum(row["bytes"] for row in rows)
    over += any(total / 1e6 > part.get("folder_mb", float("inf")) for part in scene["budget"].values())
    baked = sum(row["status"] == "baked" for row in rows)
    facts = [
        (str(len(rows)), "artifacts"),
        (_size(total), "on disk, all mips and levels"),
        (_size(sum(saved.values())), "saved by not baking what nothing asks for"),
        (f"{baked} of {len(rows)}", f"baked anew, in {seconds_label(seconds)}"),
        (str(over) if over else "none", "errors beyond their budget"),
    ]
    told = "".join(f"<li><b>{escape(value)}</b><span>{escape(what)}</span></li>" for value, what in facts)
    return f'<ul class="facts">{told}</ul>'


def _warnings(warnings: Sequence[str]) -> str:
    told = "".join(f"<li>{escape(text)}</li>" for text in warnings)
    return f'<h2>Warnings</h2><ul class="warnings">{told}</ul>' if told else ""


def _errors(scene: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> str:
    """A line for each error that has a limit, those beyond it first; then those without by artifact."""
    hard, soft = scene["budget"]["hard"], scene["budget"]["soft"]
    told, free = [], []
    entries = [(row["name"], row["tier"], row["errors"]) for row in rows]
    entries.append(("flight", "", scene["flight"]["errors"]))
    if "folder_mb" in hard | soft:
        entries.append(("scene", "", {"folder_mb": sum(row["bytes"] for row in rows) / 1e6}))
    for name, tier, errors in entries:
        rest = []
        for metric, value in errors.items():
            limit = hard.get(metric, soft.get(metric))
            if limit is None or metric not in METRICS:
                rest.append(f"{metric} {number_label(value)}")
                continue
            known = METRICS[metric]
            kind = "over" if is_beyond(metric, value, limit) else ""
            if not kind and metric in soft and is_beyond(metric, value, soft[metric]):
                kind = "soft"
            sign = "≤" if known.less_is_better else "≥"
            row = (
                f"<tr><th>{escape(name)}</th><td>{escape(tier or '–')}</td><td>{escape(metric)}</td>"
                f'<td class="n">{number_label(value)} {escape(known.unit)}</td>'
                f'<td class="n">{sign} {limit:g}</td>'
                f"<td>{_meter(value, limit, known.less_is_better, kind)}</td></tr>"
            )
            told.append((("over", "soft", "").index(kind), row))
        if rest:
            free.append(f"<tr><th>{escape(name)}</th><td class='why'>{escape(', '.join(rest))}</td></tr>")
    head = "".join(f"<th>{text}</th>" for text in ("artifact", "tier", "metric", "error", "budget", "of it"))
    lines = [row for _, row in sorted(told, key=lambda entry: entry[0])]
    table = _table(head, lines) if told else '<p class="lead">The scene limits no error.</p>'
    more = _table("", free)
    return f"{table}<details><summary>errors that nothing limits</summary>{more}</details>" if free else table


def _table(head: str, lines: Sequence[str], kind: str = "") -> str:
    top = f"<thead><tr>{head}</tr></thead>" if head else ""
    return f'<div class="wide"><table class="{kind}">{top}<tbody>{"".join(lines)}</tbody></table></div>'


def _meter(value: float, limit: float, less_is_better: bool, kind: str) -> str:
    """How much of a limit is used; decibels by the error that they stand for."""
    if less_is_better:
        share = value / limit if limit > 0.0 else float(value > 0.0)
    else:
        share = 10.0 ** min((limit - value) / 20.0, 1.0)
    return f'<div class="meter {kind}"><i style="width:{100.0 * min(max(share, 0.0), 1.0):.1f}%"></i></div>'


def _costs(rows: Sequence[Mapping[str, Any]]) -> str:
    most = max((row["bytes"] for row in rows), default=0) or 1
    lines = []
    for row in sorted(rows, key=lambda row: -row["bytes"]):
        took = seconds_label(row["seconds"]) if row["status"] == "baked" else row["status"]
        lines.append(
            f"<tr><th>{escape(row['name'])}</th><td>{escape(row['format'] or '–')}</td>"
            f'<td class="n">{_size(row["bytes"])}</td><td class="bar"><span style="width:'
            f'{100.0 * row["bytes"] / most:.1f}%"></span></td><td class="n">{escape(took)}</td></tr>'
        )
    head = "".join(f"<th>{text}</th>" for text in ("artifact", "format", "bytes", "", "time"))
    return _table(head, lines, "bars")


def _sheet(path: Path) -> str:
    """A picture, made smaller, in the page itself."""
    data = base64.b64encode(_small(path)).decode()
    picture = f'<img alt="{escape(path.stem)}" src="data:image/jpeg;base64,{data}">'
    return f'<figure class="card sheet">{picture}</figure>'


def _small(path: Path) -> bytes:
    """A PNG as a JPEG of at most _WIDE pixels across; kept beside it until it is drawn anew."""
    kept = path.with_suffix(".jpg")
    if kept.is_file() and kept.stat().st_mtime_ns >= path.stat().st_mtime_ns:
        return read_file(kept)
    with open_file(path) as stream, Image.open(stream) as picture:
        rgb = picture.convert("RGB")
    if rgb.width > _WIDE:
        rgb = rgb.resize((_WIDE, round(rgb.height * _WIDE / rgb.width)), Image.Resampling.LANCZOS)
    out = io.BytesIO()
    rgb.save(out, "JPEG", quality=_QUALITY)
    write_whole(kept, out.getvalue(), durable=False)
    return out.getvalue()


def _reasons(explained: Sequence[Mapping[str, Any]]) -> str:
    lines = [
        f"<tr><th>{escape(told['name'])}</th>"
        f"<td class='why'>{'<br>'.join(map(escape, told['why']))}</td></tr>"
        for told in explained
    ]
    return _table("", lines)


def _curves(trade: Mapping[str, Any] | None) -> str:
    if trade is None:
        return (
            '<h2>Speed against accuracy</h2><p class="lead">Not measured: <code>paradize measure SCENE.toml '
            "-o DIR</code> with this page's folder as DIR puts the curves into the next bake's page.</p>"
        )
    cards = [
        f'<section class="card"><p class="stage">{escape(group["stage"])}</p><h3>{escape(group["name"])}</h3>'
        f"<p>{escape(group['sentence'])}</p>{plot(group)}</section>"
        for group in trade["groups"]
        if group["points"]
    ]
    return f'<h2>Speed against accuracy</h2><div class="cards">{"".join(cards)}</div>'

"""The report of a bake: one self-contained page, no script, no network, light and dark, wide and narrow.

In order: the scene's picture, every error with its meaning and verdict, bytes and time of every artifact, the
contact sheets, what was not baked and why, and the curves of the tiers if they were measured.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from PIL import Image

from paradize.errors import merged
from paradize.files import bytes_text, open_file, read_file
from paradize.report.poster import Poster
from paradize.report.tradeoff.plot import curve, number_label, seconds_label
from paradize.report.tradeoff.style import STYLE
from paradize.report.verdict import Verdict, verdict_of
from paradize.scene.budget import meaning_of, unit_of
from paradize.store.atomic import write_report

_WIDE = 1100  # pixels, of a sheet on the page
_QUALITY = 82  # of JPEG
_STYLE = """
.sheet{margin:0 0 1rem;padding:0;overflow:hidden}
.sheet img{width:100%;height:auto;display:block}
.poster img{max-height:36rem;object-fit:cover}
.meter{position:relative;height:.4rem;margin-top:.3rem;max-width:16rem;border-radius:99px;background:var(--grid);
  overflow:hidden}
.meter i{position:absolute;inset:0 auto 0 0;border-radius:99px;background:var(--good)}
.meter.hint i{background:var(--hint)}
.meter.bad i{background:var(--bad)}
.errors td,.errors th{vertical-align:top}
.errors td.what,.errors td.verdict{white-space:normal}
.errors code,.errors small{color:var(--soft);font-size:.8rem}
.errors td.verdict .tag{margin-right:.5em}
@media (max-width:44rem){
  .errors thead{display:none}
  .errors tr{display:block;padding:.6rem 0;border-bottom:1px solid var(--line)}
  .errors td,.errors th{display:block;border:0;padding:.08rem 0}
  .errors th{font-weight:700}
  .errors th br{display:none}
  .errors th small{margin-left:.6em;font-weight:400}
}
.facts{display:flex;flex-wrap:wrap;gap:.6rem 2rem;margin:1rem 0;padding:0;list-style:none}
.facts b{display:block;font-size:1.5rem;line-height:1.2}
.facts span{color:var(--soft);font-size:.84rem}
td.why{white-space:normal;min-width:16rem;color:var(--soft)}
"""


def scene_page(
    scene: Mapping[str, Any],
    rows: Sequence[Mapping[str, Any]],
    explained: Mapping[str, Any],
    poster: Poster,
    sheets: Sequence[Path],
    *,
    seconds: float,
    warnings: Sequence[str],
    tradeoff: Mapping[str, Any] | None = None,
) -> str:
    """The page of a baked scene. scene: its scene.json; rows: as in `bake --json`; explained: from `explain`,
    "saved_bytes" (by what was left out, or None) and "artifacts", each a "name" and "why", lines; poster: the
    scene's picture; sheets: PNGs to show; tradeoff: a tradeoff.json."""
    title = f"{scene['name']}: what was baked"
    parts = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<link rel="icon" href="data:,">',
        f"<title>{escape(title)}</title><style>{STYLE}{_STYLE}</style></head><body><main>",
        f"<h1>{escape(title)}</h1>",
        _poster(poster, str(scene["name"])),
        _facts(scene, rows, explained["saved_bytes"] or {}, seconds),
        _warnings(warnings),
        "<h2>How exact it is</h2>",
        _errors(scene, rows),
        "<h2>Bytes and time</h2>",
        _costs(rows),
        "<h2>Contact sheets</h2>",
        "".join(map(_sheet, sheets)),
        "<h2>Why each artifact exists, and what was not baked</h2>",
        _reasons(explained["artifacts"]),
        _curves(tradeoff),
        "</main></body></html>\n",
    ]
    return "".join(parts)


def _poster(poster: Poster, name: str) -> str:
    if poster.picture is None:
        return f'<p class="lead">{escape(poster.missing)}</p>' if poster.missing else ""
    data = base64.b64encode(poster.picture).decode()
    picture = f'<img alt="{escape(name)} at its poster second" src="data:image/jpeg;base64,{data}">'
    return f'<figure class="card sheet poster">{picture}</figure>'


def _facts(
    scene: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], saved: Mapping[str, int], seconds: float
) -> str:
    over = sum(len(row["over"]) for row in rows)
    total = sum(row["bytes"] for row in rows)
    over += any(total / 1e6 > part.get("folder_mb", float("inf")) for part in scene["budget"].values())
    baked = sum(row["status"] == "baked" for row in rows)
    facts = [
        (str(len(rows)), "artifacts"),
        (bytes_text(total), "on disk, all mips and levels"),
        (bytes_text(sum(saved.values())), "not baked: no view draws it, or no pass reads it"),
        (f"{baked} of {len(rows)}", f"baked this time, in {seconds_label(seconds)}"),
    ]
    if any(scene["budget"].values()):
        facts.append((str(over) if over else "none", "errors beyond their budget"))
    items = "".join(f"<li><b>{escape(value)}</b><span>{escape(what)}</span></li>" for value, what in facts)
    return f'<ul class="facts">{items}</ul>'


def _warnings(warnings: Sequence[str]) -> str:
    items = "".join(f"<li>{escape(text)}</li>" for text in merged(warnings))
    return f'<h2>Warnings</h2><ul class="warnings">{items}</ul>' if items else ""


_KINDS = {"bad": "beyond", "hint": "may show", "good": "good", "plain": "–"}  # in the order of the table


def _errors(scene: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> str:
    """A row for each error with a budget, those beyond it first; the others, by artifact, under a summary."""
    limits = scene["budget"]["hard"] | scene["budget"]["soft"]
    entries = [(row["name"], row["tier"], row["errors"]) for row in rows]
    entries.append(("flight", "", scene["flight"]["errors"]))
    if "folder_mb" in limits:
        entries.append(("scene", "", {"folder_mb": sum(row["bytes"] for row in rows) / 1e6}))
    limited: list[tuple[int, float, str]] = []
    others: list[str] = []
    for name, tier, errors in entries:
        for metric, value in errors.items():
            verdict = verdict_of(metric, value, scene)
            row = _error_row(name, tier, metric, value, verdict)
            if verdict.share is None:
                others.append(row)
            else:
                limited.append((list(_KINDS).index(verdict.kind), -verdict.share, row))
    head = "".join(f"<th>{text}</th>" for text in ("artifact", "error", "what it measures", "is it good?"))
    lead = "Each error against the budget of the scene, the worst first."
    lines = [row for _, _, row in sorted(limited, key=lambda entry: entry[:2])]
    shown = _table(head, lines, "errors") if lines else ""
    lead = lead if lines else "The scene has no [budget]: no error is limited."
    rest = "Without a budget, an error is compared with what the eye sees, by rules of thumb."
    more = f'<p class="lead">{rest}</p>{_table(head, others, "errors")}'
    details = f"<details><summary>{len(others)} errors without a budget</summary>{more}</details>"
    return f'<p class="lead">{escape(lead)}</p>{shown}{details if others else ""}'


def _error_row(name: str, tier: str, metric: str, value: float, verdict: Verdict) -> str:
    meter = ""
    if verdict.share is not None:
        meter = f'<div class="meter {verdict.kind}"><i style="width:{100.0 * verdict.share:.1f}%"></i></div>'
    meaning = meaning_of(metric)
    words = f"{number_label(value)} {unit_of(metric)}".strip()
    return (
        f"<tr><th>{escape(name)}{f'<br><small>tier {escape(tier)}</small>' if tier else ''}</th>"
        f'<td class="n">{escape(words)}</td>'
        f'<td class="what">{escape(meaning)}{"<br>" if meaning else ""}<code>{escape(metric)}</code></td>'
        f'<td class="verdict"><span class="tag {verdict.kind}">{_KINDS[verdict.kind]}</span>'
        f"<small>{escape(verdict.words)}</small>{meter}</td></tr>"
    )


def _table(head: str, lines: Sequence[str], kind: str = "") -> str:
    top = f"<thead><tr>{head}</tr></thead>" if head else ""
    return f'<div class="wide"><table class="{kind}">{top}<tbody>{"".join(lines)}</tbody></table></div>'


def _costs(rows: Sequence[Mapping[str, Any]]) -> str:
    most = max((row["bytes"] for row in rows), default=0) or 1
    lines = []
    for row in sorted(rows, key=lambda row: -row["bytes"]):
        took = seconds_label(row["seconds"]) if row["status"] == "baked" else row["status"]
        lines.append(
            f"<tr><th>{escape(row['name'])}</th><td>{escape(row['format'] or '–')}</td>"
            f'<td class="n">{bytes_text(row["bytes"])}</td><td class="bar"><span style="width:'
            f'{100.0 * row["bytes"] / most:.1f}%"></span></td><td class="n">{escape(took)}</td></tr>'
        )
    head = "".join(f"<th>{text}</th>" for text in ("artifact", "format", "bytes", "", "time"))
    return _table(head, lines, "bars")


def _sheet(path: Path) -> str:
    """A picture, reduced, embedded in the page."""
    data = base64.b64encode(_small(path)).decode()
    picture = f'<img alt="{escape(path.stem)}" src="data:image/jpeg;base64,{data}">'
    return f'<figure class="card sheet">{picture}</figure>'


def _small(path: Path) -> bytes:
    """A PNG as a JPEG at most _WIDE pixels wide, kept beside it until the PNG changes."""
    small = path.with_suffix(".jpg")
    if small.is_file() and small.stat().st_mtime_ns >= path.stat().st_mtime_ns:
        return read_file(small)
    with open_file(path) as stream, Image.open(stream) as picture:
        rgb = picture.convert("RGB")
    if rgb.width > _WIDE:
        rgb = rgb.resize((_WIDE, round(rgb.height * _WIDE / rgb.width)), Image.Resampling.LANCZOS)
    out = io.BytesIO()
    rgb.save(out, "JPEG", quality=_QUALITY)
    write_report(small, out.getvalue())
    return out.getvalue()


def _reasons(explained: Sequence[Mapping[str, Any]]) -> str:
    lines = [
        f"<tr><th>{escape(facts['name'])}</th>"
        f"<td class='why'>{'<br>'.join(map(escape, facts['why']))}</td></tr>"
        for facts in explained
    ]
    return _table("", lines)


def _curves(tradeoff: Mapping[str, Any] | None) -> str:
    if tradeoff is None:
        return (
            '<h2>Speed against accuracy</h2><p class="lead">Not measured yet. Run <code>paradize measure '
            "SCENE.toml -o DIR</code> with the folder of this page as DIR: the page of the next bake then "
            "shows the curves.</p>"
        )
    cards = [
        f'<section class="card"><p class="stage">{escape(group["stage"])}</p><h3>{escape(group["name"])}</h3>'
        f"<p>{escape(group['sentence'])}</p>{curve(group)}</section>"
        for group in tradeoff["groups"]
        if group["points"]
    ]
    return f'<h2>Speed against accuracy</h2><div class="cards">{"".join(cards)}</div>'

"""Applies the [check] and [[waiver]] tables of a scene to its findings."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import date
from difflib import get_close_matches
from itertools import chain
from typing import Any

from paradize.checks.rules import RULES, Finding


def apply_scene(
    findings: Iterable[Finding],
    settings: dict[str, Any],
    file: str,
    today: date,
    artifacts: Collection[str] = (),
) -> Iterator[Finding]:
    """The findings with the severities and waivers of the scene. settings: `check` of scene.json; file:
    scene.json; artifacts: the names that a waiver may mean. A waiver holds up to and including its day; after
    it the finding says that the waiver ended. A waiver without a finding is a finding itself."""
    severities, waivers = settings["severity"], settings["waivers"]
    used: set[int] = set()
    for finding in findings:
        matching = [k for k, waiver in enumerate(waivers) if _matches(waiver, finding)]
        used.update(matching)
        waived = _waived(finding, [waivers[k] for k in matching], today)
        yield from with_severities([waived], severities)
    unused = {k: waiver for k, waiver in enumerate(waivers) if k not in used and waiver["rule"] in RULES}
    unknown = without_rule(severities, [waiver["rule"] for waiver in waivers], file)
    yield from with_severities(chain(_without_finding(unused, artifacts, file), unknown), severities)


def with_severities(findings: Iterable[Finding], severities: dict[str, str]) -> Iterator[Finding]:
    """The findings with the severities that a scene gives their rules, without those that are off."""
    for finding in findings:
        override = severities.get(finding.code, "")
        if override != "off":
            yield replace(finding, override=override)


def _without_finding(
    waivers: dict[int, dict[str, Any]], artifacts: Collection[str], file: str
) -> Iterator[Finding]:
    for k, waiver in waivers.items():
        near = get_close_matches(waiver["artifact"] or "", artifacts, 1)
        meant = near and waiver["artifact"] not in artifacts
        mend = f"did you mean {near[0]}? Mend it in the scene, and bake again" if meant else ""
        what = f"no finding matches {_described(waiver)}"
        yield Finding("PZ407", file, what, f"waiver[{k}]", mend=mend)


def without_rule(severities: Iterable[str], waived: Sequence[str], file: str) -> Iterator[Finding]:
    """The codes under [check], and those of the waivers, that name no rule."""
    named = [(f"waiver[{k}]", code) for k, code in enumerate(waived)]
    for place, code in [*named, *((f"check.{code}", code) for code in severities)]:
        if code not in RULES:
            yield Finding("PZ407", file, f"there is no rule {code}", place)


def _matches(waiver: dict[str, Any], finding: Finding) -> bool:
    return bool(
        waiver["rule"] == finding.code
        and waiver["artifact"] in (None, finding.artifact)
        and waiver["metric"] in (None, finding.metric)
    )


def _waived(finding: Finding, waivers: list[dict[str, Any]], today: date) -> Finding:
    """The finding under the waiver that holds longest."""
    if not waivers:
        return finding
    longest = max(waivers, key=lambda waiver: str(waiver["until"]))
    if today <= date.fromisoformat(longest["until"]):
        return replace(finding, waived=f"waived until {longest['until']}: {longest['reason']}")
    return replace(
        finding, what=f"{finding.what}; its waiver ended on {longest['until']} ({longest['reason']})"
    )


def _described(waiver: dict[str, Any]) -> str:
    names = (("artifact", " of "), ("metric", " by "))
    return str(waiver["rule"]) + "".join(f"{word}{waiver[key]}" for key, word in names if waiver[key])

"""What a scene says of findings: the severity of a rule, and which findings are waived up to which day."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from datetime import date
from typing import Any

from paradize.check.rules import RULES, Finding


def judged(findings: Iterable[Finding], told: dict[str, Any], file: str, today: date) -> Iterator[Finding]:
    """The findings as the scene has them. told: the manifest's `check`; file: the manifest's own. A waiver
    holds up to and with its day; then the finding says that it ended. What meets no finding is one."""
    used: set[int] = set()
    met: set[str] = set()
    for finding in findings:
        met.add(finding.code)
        override = told["severity"].get(finding.code, "")
        if override == "off":
            used |= {k for k, waiver in enumerate(told["waivers"]) if _meets(waiver, finding)}
            continue
        known = [k for k, waiver in enumerate(told["waivers"]) if _meets(waiver, finding)]
        used.update(known)
        yield replace(_waived(finding, [told["waivers"][k] for k in known], today), override=override)
    for k, waiver in enumerate(told["waivers"]):
        if k not in used:
            what = f"no finding is {_asked(waiver)}"
            if waiver["rule"] not in RULES:
                what = f"there is no rule {waiver['rule']}"
            yield Finding("PZ407", file, what, f"waiver[{k}]")
    for code in told["severity"]:
        if code not in RULES:
            yield Finding("PZ407", file, f"there is no rule {code}", f"check.{code}")


def _meets(waiver: dict[str, Any], finding: Finding) -> bool:
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


def _asked(waiver: dict[str, Any]) -> str:
    names = (("artifact", " of "), ("metric", " by "))
    return str(waiver["rule"]) + "".join(f"{word}{waiver[key]}" for key, word in names if waiver[key])

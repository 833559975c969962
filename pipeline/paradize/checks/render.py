"""Findings as text, JSON, JUnit (for CI pages) and SARIF 2.1.0 (OASIS, 2020; for code-review pages)."""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote
from xml.sax.saxutils import escape, quoteattr

from paradize import __version__
from paradize.checks.rules import RULES, Finding
from paradize.documents import json_text
from paradize.errors import one_line


def render(
    findings: Sequence[Finding],
    form: str,
    artifacts: int = 0,
    scenes: Mapping[str, int | None] | None = None,
    without_budget: Sequence[str] = (),
) -> str:
    """form: "text", "json", "junit" or "sarif". artifacts: how many files were looked at; scenes: how many
    files the scenes name whose settings were looked at; None: they have faults; without_budget: the
    scene.json files whose scene limits no error. A text says all three."""
    if form == "text":
        return _text(findings, artifacts, scenes or {}, without_budget)
    return {"json": _json, "junit": _junit, "sarif": _sarif}[form](findings)


def _counts(findings: Sequence[Finding]) -> tuple[int, int, int]:
    """The numbers of errors, of warnings, and of waived findings."""
    errors = sum(finding.fails for finding in findings)
    waived = sum(bool(finding.waived) for finding in findings)
    return errors, len(findings) - errors - waived, waived


def _text(
    findings: Sequence[Finding],
    artifacts: int,
    scenes: Mapping[str, int | None],
    without_budget: Sequence[str],
) -> str:
    errors, warnings, waived = _counts(findings)
    found = [_counted(errors, "error"), _counted(warnings, "warning")] if findings else ["no finding"]
    found += [f"{waived} waived"] if waived else []
    looked = [] if scenes and not artifacts else [_counted(artifacts, "artifact")]
    looked += [f"the settings of {_counted(len(scenes), 'scene')}"] if scenes else []
    summary = f"{' and '.join(looked)} checked: {', '.join(found)}"
    notes = [
        f"{path}: its settings are valid and the files that it names ({count}) are there; `paradize bake` "
        "reads what they hold"
        for path, count in scenes.items()
        if count is not None
    ]
    notes += [
        f"{path}: the scene sets no [budget], so errors are recorded and none is judged"
        for path in without_budget
    ]
    shared = {key for key, count in Counter(map(_advice, findings)).items() if count > 1 and key[1]}
    lines = [finding.line(mend=_advice(finding) not in shared) for finding in findings]
    mends = [
        f"{code}: {mend}" for code, mend in dict.fromkeys(map(_advice, findings)) if (code, mend) in shared
    ]
    return "\n".join([*map(one_line, (*lines, *mends, *notes)), summary])


def _counted(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"


def _advice(finding: Finding) -> tuple[str, str]:
    """The rule and what to do; a text says it once for all findings that share it."""
    return finding.code, "" if finding.waived else finding.mend or RULES[finding.code].mend


def _json(findings: Sequence[Finding]) -> str:
    errors, warnings, waived = _counts(findings)
    rows = [
        {
            "code": finding.code,
            "severity": finding.severity,
            "title": finding.title,
            "file": finding.file,
            "place": finding.place,
            "what": finding.what,
            "count": finding.count,
            "mend": finding.mend or RULES[finding.code].mend,
            "artifact": finding.artifact or None,
            "metric": finding.metric or None,
            "waived": finding.waived or None,
        }
        for finding in findings
    ]
    return json_text({"findings": rows, "errors": errors, "warnings": warnings, "waived": waived})


def _junit(findings: Sequence[Finding]) -> str:
    """One test case per rule: a failure if an error was found, skipped if all its errors are waived."""
    cases = []
    failures = skipped = 0
    for code, rule in RULES.items():
        matching = [finding for finding in findings if finding.code == code]
        body = escape("\n".join(one_line(str(finding)) for finding in matching))
        name = f'<testcase classname="paradize.checks" name={quoteattr(f"{code} {rule.title}")}'
        if any(finding.fails for finding in matching):
            failures += 1
            cases.append(f"{name}><failure message={quoteattr(rule.title)}>{body}</failure></testcase>")
        elif any(finding.waived for finding in matching):
            skipped += 1
            cases.append(f"{name}><skipped message={quoteattr(one_line(str(matching[0])))}/></testcase>")
        elif matching:
            cases.append(f"{name}><system-out>{body}</system-out></testcase>")
        else:
            cases.append(f"{name}/>")
    counts = f'tests="{len(cases)}" failures="{failures}" errors="0" skipped="{skipped}"'
    head = f'<testsuite name="paradize check" {counts}>'
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', head, *cases, "</testsuite>"])


def _fingerprint(finding: Finding) -> str:
    """The fingerprint by which a page recognizes a finding: its rule and place, without its numbers."""
    name = re.sub(r"-[0-9a-f]{8}(?=\.)", "", finding.file)  # artifacts carry their hash
    what = "" if finding.artifact else finding.what
    words = (finding.code, name, finding.artifact, finding.metric, finding.place, what)
    return hashlib.sha256("\0".join(words).encode("utf-8", "surrogatepass")).hexdigest()[:32]


def _suppressed(finding: Finding) -> dict[str, Any]:
    if not finding.waived:
        return {}
    return {"suppressions": [{"kind": "external", "justification": finding.waived}]}


def _sarif(findings: Sequence[Finding]) -> str:
    rules = [
        {
            "id": code,
            "name": re.sub(r"[\W_]+", "", rule.title.title()),
            "shortDescription": {"text": rule.title},
            "fullDescription": {"text": rule.cause},
            "help": {"text": rule.mend or rule.cause},
            "defaultConfiguration": {"level": rule.severity},
        }
        for code, rule in RULES.items()
    ]
    numbers = {code: k for k, code in enumerate(RULES)}
    results: list[dict[str, Any]] = [
        {
            "ruleId": finding.code,
            "ruleIndex": numbers[finding.code],
            "level": finding.severity,
            "message": {"text": str(finding)},
            "occurrenceCount": finding.count,
            "partialFingerprints": {"finding/v1": _fingerprint(finding)},
            "locations": [
                {
                    "physicalLocation": {"artifactLocation": {"uri": quote(finding.file.replace("\\", "/"))}},
                    "logicalLocations": [{"fullyQualifiedName": finding.place or finding.file}],
                }
            ],
        }
        | _suppressed(finding)
        for finding in findings
    ]
    tool = {"driver": {"name": "paradize check", "semanticVersion": __version__, "rules": rules}}
    tree = {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{"tool": tool, "results": results}],
    }
    return json.dumps(tree, indent=1)

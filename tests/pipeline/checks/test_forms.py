"""Other tools can read what `check` prints; its rules are documented; its workflow runs what there is.

`python -m tests.pipeline.checks.test_forms` writes the table of RULES.md; `make fix` runs it.
"""

from __future__ import annotations

import importlib
import json
import re
import shlex
from typing import Any

import junitparser

from paradize.checks import Finding, render
from paradize.checks.rules import RULES
from paradize.cli.main import parser
from tests.places import ROOT

ROOM = ROOT / "pipeline/paradize/checks"
PAGE = ROOM / "RULES.md"
LEVELS = ("none", "note", "warning", "error")
FOUND = [
    Finding(
        "PZ401", "out/a & b/scene.json", "color_psnr_db is 30 dB, budget 36", "artifacts.post_color level 0"
    ),
    Finding("PZ401", "out/scene.json", "worse", "x", waived="waived until 2999-01-01: <soon>"),
    Finding("PZ104", "out/sky-00000000.ktx2", "is not named by scene.json", count=3),
    Finding("PZ104", "out/sand-00000001.ktx2", "is not named by scene.json", override="error"),
]


def rules_table() -> str:
    """The rules as Markdown."""
    lines = [
        "| code | severity | what is wrong | why it matters | what to do |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [f"| {code} | {r.severity} | {r.title} | {r.cause} | {r.mend} |" for code, r in RULES.items()]
    return "\n".join(lines)


def rules_page() -> str:
    """The text of RULES.md, with the table of the rules as they are."""
    before, _, rest = PAGE.read_text().partition("| code |")
    _, _, after = rest.partition("\n\n")
    return f"{before}{rules_table()}\n\n{after}"


def suite_of(findings: list[Finding]) -> Any:
    (suite,) = junitparser.JUnitXml.fromstring(render(findings, "junit").encode())
    return suite


def test_every_rule_is_documented_with_cause_and_mend() -> None:
    assert all(rule.cause and rule.mend and rule.severity in ("error", "warning") for rule in RULES.values())
    assert list(RULES) == sorted(RULES), "in the order of their codes"
    assert PAGE.read_text() == rules_page(), "`make fix` writes it"


def test_a_text_says_a_mend_once_for_all_findings_that_share_it() -> None:
    mend = RULES["PZ421"].mend
    found = [
        Finding("PZ421", "scene.json", f"{metric} is 2 where it was 1", "artifacts.post") for metric in "ab"
    ]
    alone = render(found[:1], "text").splitlines()
    assert alone[0].endswith(mend) and len(alone) == 2
    first, second, last, _ = render(found, "text").splitlines()
    assert last == f"PZ421: {mend}" and mend not in first + second
    assert first == "scene.json: artifacts.post: error PZ421: a is 2 where it was 1"


def test_junit_is_read_by_a_parser_of_its_own() -> None:
    suite = suite_of(FOUND)
    cases = {case.name.split()[0]: case for case in suite}
    assert set(cases) == set(RULES)
    assert (suite.tests, suite.failures, suite.errors, suite.skipped) == (len(RULES), 2, 0, 0)
    (failure,) = cases["PZ401"].result
    assert isinstance(failure, junitparser.Failure) and "artifacts.post_color level 0" in failure.text
    assert "a & b" in failure.text and isinstance(cases["PZ104"].result[0], junitparser.Failure)
    assert all(not case.result for code, case in cases.items() if code not in ("PZ401", "PZ104"))
    waived = suite_of(FOUND[1:2])
    (case,) = [case for case in waived if case.result]
    assert isinstance(case.result[0], junitparser.Skipped) and "<soon>" in case.result[0].message
    assert (waived.failures, waived.skipped) == (0, 1)


def test_sarif_holds_what_its_schema_requires() -> None:
    """SARIF 2.1.0 (OASIS, 2020): the required properties and the enumerations that results use."""
    tree = json.loads(render(FOUND, "sarif"))
    assert tree["version"] == "2.1.0" and tree["$schema"].startswith("https://")
    (run,) = tree["runs"]  # 3.13.4
    driver = run["tool"]["driver"]  # 3.18.2, 3.19.8: a driver has a name
    assert driver["name"] and re.fullmatch(r"\d+(\.\d+){1,3}.*", driver["semanticVersion"])
    ids = [rule["id"] for rule in driver["rules"]]  # 3.49.3; unique in the array
    assert ids == list(RULES) and len(set(ids)) == len(ids)
    for rule in driver["rules"]:
        assert rule["shortDescription"]["text"] and rule["fullDescription"]["text"] and rule["help"]["text"]
        assert rule["defaultConfiguration"]["level"] in LEVELS  # 3.50.3
        assert rule["name"].isalnum(), "3.49.7: an identifier that a person understands"
    assert len(run["results"]) == len(FOUND)
    for finding, result in zip(FOUND, run["results"], strict=True):
        assert result["message"]["text"] and result["level"] in LEVELS  # 3.27.10, 3.27.11
        assert ids[result["ruleIndex"]] == result["ruleId"] == finding.code  # 3.27.6
        assert result["occurrenceCount"] == finding.count >= 1  # 3.27.14
        for location in result["locations"]:
            uri = location["physicalLocation"]["artifactLocation"]["uri"]
            assert re.fullmatch(r"[A-Za-z0-9._~/%:@!$&'()*+,;=-]+", uri), "3.10: a valid URI reference"
            assert location["logicalLocations"][0]["fullyQualifiedName"]
        suppressed = result.get("suppressions", [])  # 3.27.23, 3.35
        assert [entry["kind"] for entry in suppressed] == (["external"] if finding.waived else [])
        assert result["partialFingerprints"], "3.27.17: so that a page knows a finding again"
    prints = [tuple(result["partialFingerprints"].values()) for result in run["results"]]
    assert len(set(prints)) == len(prints)


def workflow() -> Any:
    return importlib.import_module("yaml").safe_load((ROOM / "github-actions.yml").read_text())


def test_the_workflow_is_one_and_calls_commands_that_there_are() -> None:
    tree = workflow()
    steps = tree["jobs"]["check"]["steps"]
    assert all("uses" in step or "run" in step for step in steps)
    said = "\n".join(step.get("run", "") for step in steps)
    calls = re.findall(
        r"paradize (bake|check) ([^>|\n]*)", said.replace("$against", "--against build/before")
    )
    assert {name for name, _ in calls} == {"bake", "check"}
    for name, rest in calls:
        parser(name).parse_args([name, *shlex.split(rest)])
    names = set(re.findall(r"\benv\.(\w+)", json.dumps(tree)))
    assert names <= set(tree["env"]), "what steps ask of env is set"


def test_the_workflow_sets_up_only_what_its_cache_does_not_hold() -> None:
    """Keyed by all that the kept folder is made of: what `make setup` reads, and the package itself."""
    steps = workflow()["jobs"]["check"]["steps"]
    (kept,) = [step for step in steps if step.get("id") == "setup"]
    (made,) = [step for step in steps if "make" in step.get("run", "")]
    assert kept["uses"].startswith("actions/cache@") and steps.index(kept) < steps.index(made)
    assert made["if"] == "steps.setup.outputs.cache-hit != 'true'"
    assert "restore-keys" not in kept["with"], "what other sources made is not taken"
    home = "build/paradize/"
    assert kept["with"]["path"] == f"{home}build/venv"
    assert any(f"$PWD/{kept['with']['path']}/bin" in step.get("run", "") for step in steps)
    hashed = [name.removeprefix(home) for name in re.findall(r"'([^']+)'", kept["with"]["key"])]
    assert {"Makefile", "CMakeLists.txt", "pyproject.toml", "setup/**", "pipeline/**"} == set(hashed)
    assert all((ROOT / name.removesuffix("/**")).exists() for name in hashed)
    (target,) = re.findall(r"make -C \S+ (\w+)", made["run"])
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)


if __name__ == "__main__":
    PAGE.write_text(rules_page())

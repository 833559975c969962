"""`paradize check` and `paradize explain`: they look and tell, and change nothing."""

from __future__ import annotations

import argparse

from paradize.cli_output import show, show_json


def run_check(arguments: argparse.Namespace) -> int:
    """The exit code."""
    from datetime import date

    from paradize.check import Look, check_paths, render

    today = arguments.today or date.today()
    look = Look(arguments.against, arguments.worse_by / 100.0, today)
    findings = check_paths(arguments.paths, look)
    show(render(findings, "json" if arguments.json else arguments.fmt))
    return 1 if any(finding.fails for finding in findings) else 0


def run_explain(arguments: argparse.Namespace) -> int:
    """The exit code."""
    from paradize.explain import explain
    from paradize.explain_words import render

    explanation = explain(arguments.scene, arguments.artifact, arguments.out)
    if arguments.json:
        show_json(explanation.as_json())
    else:
        show(render(explanation, details=arguments.artifact is not None))
    return 0

"""`paradize check`: rules over baked scenes, meshes and textures."""

from __future__ import annotations

import argparse
from pathlib import Path

from paradize.cli.options import add_json
from paradize.cli.output import show
from paradize.cli.values import day, percent


def add(sub: argparse.ArgumentParser) -> None:
    """What `paradize check` takes."""
    sub.add_argument("paths", type=Path, nargs="+", metavar="PATH")
    sub.add_argument("--format", dest="fmt", choices=("text", "json", "junit", "sarif"), default="text")
    sub.add_argument(
        "--against", type=Path, metavar="DIR", help="an earlier bake: fail where an artifact got worse"
    )
    sub.add_argument(
        "--worse-by", type=percent, default=5.0, metavar="P", help="by more than this, in percent (5)"
    )
    sub.add_argument("--today", type=day, help=argparse.SUPPRESS)
    add_json(sub, "the same as --format json")


def run(arguments: argparse.Namespace) -> int:
    """The exit code."""
    from datetime import date

    from paradize.check import CheckOptions, check_paths, render

    today = arguments.today or date.today()
    look = CheckOptions(arguments.against, arguments.worse_by / 100.0, today)
    findings = check_paths(arguments.paths, look)
    show(render(findings, "json" if arguments.json else arguments.fmt))
    return 1 if any(finding.fails for finding in findings) else 0

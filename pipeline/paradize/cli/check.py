"""`paradize check`: checks baked scenes, meshes and textures by rules, and the settings of scenes."""

from __future__ import annotations

import argparse

from paradize.cli.options import add_json
from paradize.cli.output import show
from paradize.cli.values import day, path, percent


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize check`."""
    sub.add_argument(
        "paths",
        type=path,
        nargs="+",
        metavar="PATH",
        help="a baked folder, scene.json, GLB, KTX2 or PNG; or a scene's TOML (its settings alone)",
    )
    sub.add_argument(
        "--format",
        dest="fmt",
        choices=("text", "json", "junit", "sarif"),
        default="text",
        help="form of the findings (text); junit and sarif for CI",
    )
    sub.add_argument(
        "--against", type=path, metavar="DIR", help="an earlier bake: fail if an artifact got worse"
    )
    sub.add_argument(
        "--worse-by",
        type=percent,
        default=5.0,
        metavar="P",
        help="with --against: by more than P percent (5)",
    )
    sub.add_argument("--today", type=day, help=argparse.SUPPRESS)
    add_json(sub, "the same as --format json")


def run(arguments: argparse.Namespace) -> int:
    """Checks; returns the exit code."""
    from datetime import date

    from paradize.checks import CheckOptions, check_paths, render
    from paradize.cli.progress import progress

    today = arguments.today or date.today()
    with progress() as shown:
        options = CheckOptions(arguments.against, arguments.worse_by / 100.0, today, shown.step)
        findings = check_paths(arguments.paths, options)
    form = "json" if arguments.json else arguments.fmt
    show(render(findings, form, len(options.checked), options.scenes, options.without_budget))
    return 1 if any(finding.fails for finding in findings) else 0

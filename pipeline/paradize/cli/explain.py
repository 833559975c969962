"""`paradize explain`: why each artifact of a scene exists, and what limits it: a line for each, or all."""

from __future__ import annotations

import argparse

from paradize.cli.options import add_json, add_scene
from paradize.cli.output import show, show_json
from paradize.cli.values import path
from paradize.errors import one_line


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize explain`."""
    add_scene(sub)
    sub.add_argument(
        "artifact", nargs="?", metavar="ARTIFACT", help="only this one, in detail (default: all)"
    )
    sub.add_argument(
        "-o", "--out", type=path, metavar="DIR", help="the baked folder (default: build/assets/<scene name>)"
    )
    sub.add_argument("--details", action="store_true", help="all artifacts in detail, not a line for each")
    add_json(sub)


def run(arguments: argparse.Namespace) -> int:
    """Runs the command; returns the exit code."""
    from paradize.cli.table import table
    from paradize.explain.facts import explain
    from paradize.explain.words import OVERVIEW, overview, render, sums, unread

    explanation = explain(arguments.scene, arguments.artifact, arguments.out)
    if arguments.json:
        show_json(explanation.as_json())
    elif arguments.details or arguments.artifact is not None:
        show(render(explanation))
    else:
        show(table(overview(explanation), OVERVIEW))
        show("\n".join([*unread(explanation), *sums(explanation)]))
        show(one_line(f"more: paradize explain {arguments.scene} ARTIFACT, or --details"))
    return 0

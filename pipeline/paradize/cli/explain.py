"""`paradize explain`: why each artifact of a scene exists, and what limits it."""

from __future__ import annotations

import argparse
from pathlib import Path

from paradize.cli.options import add_json, add_scene
from paradize.cli.output import show, show_json


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize explain`."""
    add_scene(sub)
    sub.add_argument(
        "artifact", nargs="?", metavar="ARTIFACT", help="only this one, in detail (default: all)"
    )
    sub.add_argument(
        "-o", "--out", type=Path, metavar="DIR", help="the baked folder (default: build/assets/<scene name>)"
    )
    add_json(sub)


def run(arguments: argparse.Namespace) -> int:
    """Runs the command; returns the exit code."""
    from paradize.explain.facts import explain
    from paradize.explain.words import render

    explanation = explain(arguments.scene, arguments.artifact, arguments.out)
    if arguments.json:
        show_json(explanation.as_json())
    else:
        show(render(explanation, details=arguments.artifact is not None))
    return 0

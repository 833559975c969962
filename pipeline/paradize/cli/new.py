"""`paradize new`: a small scene to start from."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from paradize.cli.options import add_json
from paradize.cli.output import say, show, show_json
from paradize.errors import one_line


def add(sub: argparse.ArgumentParser) -> None:
    """What `paradize new` takes."""
    sub.add_argument("folder", type=Path, metavar="DIR", help="a new folder for the scene")
    sub.add_argument("--from", dest="model", type=Path, metavar="IN.obj", help="the model (default: a vase)")
    add_json(sub)


def run(arguments: argparse.Namespace) -> int:
    """Makes a scene; says how to bake and play it."""
    from paradize.new.scene import new_scene

    made = new_scene(arguments.folder, arguments.model)
    for note in made.notes:
        say(f"paradize: warning: {note}")
    if arguments.json:
        show_json({"scene": str(made.scene), "files": made.files, "warnings": made.notes})
        return 0
    show(one_line(f"{len(made.files)} files in {made.scene.parent}"))
    baked = f"{made.scene.parent.name}-baked"
    to = shlex.quote(f"./{baked}" if baked.startswith("-") else baked)
    show(one_line(f"bake it:  paradize bake {shlex.quote(str(made.scene))} -o {to}"))
    show(one_line(f"play it:  paradize-player {to}"))
    return 0

"""`paradize new`: writes a small scene to start from."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from pathlib import Path
from shutil import which

from paradize.cli.options import add_json
from paradize.cli.output import show, show_json, warn
from paradize.cli.values import path
from paradize.errors import one_line
from paradize.files import resolved
from paradize.new.templates import TEMPLATES


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize new`."""
    sub.add_argument("folder", type=path, metavar="DIR", help="a new folder for the scene")
    what = sub.add_mutually_exclusive_group()
    what.add_argument(
        "--from",
        dest="model",
        type=path,
        metavar="IN.obj|glb|gltf|ply|stl",
        help="the model (default: a vase)",
    )
    what.add_argument(
        "--template",
        choices=TEMPLATES,
        help="a sky alone, a small island in the sea, or the island at night with lanterns",
    )
    add_json(sub)


def run(arguments: argparse.Namespace) -> int:
    """Makes a scene; prints the commands that bake it and show it."""
    from paradize.kinds import require_folder
    from paradize.new.scene import new_scene

    if not os.path.lexists(arguments.folder):  # else it says itself what stands there
        require_folder(arguments.folder, "paradize new")
    if arguments.template:
        from paradize.new.template import new_from_template

        made = new_from_template(arguments.folder, arguments.template)
    else:
        made = new_scene(arguments.folder, arguments.model)
    warn(made.notes)
    if arguments.json:
        stands = {"position": made.position, "scale": made.scale}
        found = {"files": made.files, "taken": made.taken, "warnings": made.notes}
        show_json({"scene": str(made.scene)} | stands | found)
        return 0
    show(one_line(f"{len(made.files)} files in {made.scene.parent}"))
    for text in made.taken:
        show(one_line(text))
    show(one_line(f"bake it:  {shlex.join([*_paradize(), 'bake', str(made.scene)])}"))
    player = _player()
    if player is not None:
        screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        how = [] if screen else ["--headless", "--screenshot", f"{made.name}.png"]
        show(one_line(f"show it:  {shlex.join([player, f'build/assets/{made.name}', *how])}"))
    return 0


def _paradize() -> list[str]:
    """The command that starts this program here."""
    if which("paradize"):
        return ["paradize"]
    program = Path(sys.argv[0])
    return [str(resolved(program))] if os.access(program, os.X_OK) else [sys.executable, "-m", "paradize"]


def _player() -> str | None:
    """The command that starts the player here; None if it is not built."""
    from paradize.preview.player import PLAYER, find_player

    found = PLAYER if which(PLAYER) else find_player()
    return None if found is None else str(found)

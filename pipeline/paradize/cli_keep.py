"""`paradize new` and `paradize clean`: what begins a scene, and what keeps the store small."""

from __future__ import annotations

import argparse
import shlex
import time

from paradize.cli_output import say, show, show_json
from paradize.errors import one_line


def run_new(arguments: argparse.Namespace) -> int:
    """Makes a scene; says how to bake and play it."""
    from paradize.new import new_scene

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


def run_clean(arguments: argparse.Namespace) -> int:
    """Takes from the store what is of no use, too old or too much."""
    from paradize.engine.clean import clean
    from paradize.engine.store import Store, default_root

    store = Store(default_root())
    done = clean(store, now_s=time.time(), older_than_s=arguments.older_than, to_bytes=arguments.to_size)
    told = {"store": str(store.root), "dropped": done.dropped}
    told |= {"freed_bytes": done.freed_bytes, "kept_bytes": done.kept_bytes}
    if arguments.json:
        show_json(told)
    else:
        kept = f"{done.kept_bytes} bytes stay in {store.root}"
        show(one_line(f"{done.dropped} entries dropped, {done.freed_bytes} bytes freed, {kept}"))
    return 0

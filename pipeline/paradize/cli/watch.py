"""`paradize watch`: bakes again whatever is saved, until it is interrupted."""

from __future__ import annotations

import argparse
import json
import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING

from paradize.cli.options import add_common, add_elsewhere, add_scene
from paradize.cli.output import complain, say, show
from paradize.errors import one_line

if TYPE_CHECKING:
    from paradize.watch.loop import Told


def add(sub: argparse.ArgumentParser) -> None:
    """What `paradize watch` takes."""
    add_scene(sub)
    sub.add_argument("-o", "--out", type=Path, metavar="DIR", help="default: build/assets/<scene name>")
    add_elsewhere(sub)
    add_common(sub, "worker processes", None)
    sub.epilog = "With --json every bake prints one line of JSON. Ctrl-C ends the watch: exit 0."


def run(arguments: argparse.Namespace) -> int:
    """0: an interrupt is how a watch ends."""
    from paradize.watch.loop import Watch

    told = _as_json if arguments.json else _as_text
    from paradize.kinds import SCENE, require

    require(SCENE, arguments.scene)
    watch = Watch(
        arguments.scene,
        arguments.out,
        arguments.jobs or 0,
        arguments.tier,
        told,
        arguments.cluster,
        arguments.store,
    )
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN  # started by nohup, or behind a script
    ends = f"`kill {os.getpid()}`" if ignored else "Ctrl-C"
    say(f"paradize: watching {arguments.scene} and what it names; {ends} ends it")
    try:
        watch.run()
    except KeyboardInterrupt:
        return 0
    finally:
        watch.stop()
    return 0


def _as_json(told: Told) -> None:
    """One line for each bake (JSON Lines)."""
    errors = list(dict.fromkeys(str(error) for error in told.baked.errors))
    line = told.baked.report or {}
    line |= {"error": errors} if errors else {}
    line |= {"changed": [str(path) for path in told.changed], "restarted": told.restarted}
    show(json.dumps(line, allow_nan=False))
    if errors:
        complain(told.baked.errors)


def _as_text(told: Told) -> None:
    report = told.baked.report
    why = ", ".join(path.name for path in told.changed) + (" new code" if told.restarted else "")
    if told.baked.errors:
        complain(told.baked.errors)
        say("paradize: the scene stays as it was baked last; waiting for the next save")
        return
    assert report is not None
    for warning in report["warnings"]:
        say(f"paradize: warning: {warning}")
    made = [row["name"] for row in report["artifacts"] if row["status"] == "baked"]
    what = f"{report['baked']} baked{' (' + ', '.join(made) + ')' if made else ''}, {report['reused']} reused"
    show(one_line(f"{why.strip() or 'start'}: {what} in {report['seconds']:.2f} s, in {told.baked.out}"))

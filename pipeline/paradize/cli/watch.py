"""`paradize watch`: bakes again after every save, until it is interrupted."""

from __future__ import annotations

import argparse
import json
import os
import signal
from typing import TYPE_CHECKING

from paradize.cli.options import add_common, add_elsewhere, add_scene
from paradize.cli.output import complain, say, show, warn
from paradize.cli.progress import Progress
from paradize.cli.values import path
from paradize.errors import one_line

if TYPE_CHECKING:
    from paradize.jobs.progress import Step
    from paradize.watch.loop import WatchEvent


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize watch`."""
    add_scene(sub)
    sub.add_argument("-o", "--out", type=path, metavar="DIR", help="default: build/assets/<scene name>")
    add_elsewhere(sub)
    add_common(sub, "worker processes (default: $PARADIZE_JOBS, else cores)", None)
    sub.epilog = f"{sub.epilog}. With --json every bake prints one line of JSON. Ctrl-C ends it: exit 0."


def run(arguments: argparse.Namespace) -> int:
    """Watches until it is interrupted. Returns 0: an interrupt is how a watch ends."""
    from paradize.kinds import SCENE, require
    from paradize.watch.loop import Watch

    require(SCENE, arguments.scene)
    shown = BakeProgress()
    watch = Watch(
        scene=arguments.scene,
        out=arguments.out,
        jobs=arguments.jobs or 0,
        tier=arguments.tier,
        on_bake=show_line if arguments.json else TextReport(),
        cluster=arguments.cluster,
        store=arguments.store,
        on_start=shown.start,
        on_step=shown.step,
        on_end=shown.end,
    )
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN  # started by nohup, or by a script with &
    ends = f"`kill {os.getpid()}`" if ignored else "Ctrl-C"
    say(f"paradize: watching {arguments.scene} and the files that it names; {ends} ends it")
    try:
        watch.run()
    except KeyboardInterrupt:
        return 0
    finally:
        shown.end()
        watch.stop()
    return 0


class BakeProgress:
    """Shows how a bake gets on, from its start to its end; each bake anew."""

    def __init__(self) -> None:
        self.shown: Progress | None = None

    def start(self) -> None:
        self.shown = Progress()
        self.shown.step("bake", 0, 1)

    def step(self, step: Step) -> None:
        shown = self.shown  # another thread may end it meanwhile
        if shown:
            shown.step("bake", step.done, step.total)
            shown.reached("bake", step.name)

    def end(self) -> None:
        if self.shown:
            self.shown.close()
        self.shown = None


def show_line(event: WatchEvent) -> None:
    """Prints a bake as one line of JSON (JSON Lines)."""
    errors = list(dict.fromkeys(str(error) for error in event.baked.errors))
    line = event.baked.report or {}
    line |= {"error": errors} if errors else {}
    line |= {"changed": [str(path) for path in event.changed], "restarted": event.restarted}
    show(json.dumps(line, allow_nan=False))
    if errors:
        complain(event.baked.errors)


class TextReport:
    """Prints each bake as a line of text. A warning of the bake before is only counted, not printed again."""

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def __call__(self, event: WatchEvent) -> None:
        if event.baked.errors:
            complain(event.baked.errors)
            say("paradize: the last good bake stays in place; waiting for the next save")
            return
        report = event.baked.report
        assert report is not None
        new = [text for text in report["warnings"] if text not in self.warnings]
        known = len(set(report["warnings"])) - len(set(new))
        self.warnings = report["warnings"]
        warn(new)
        cause = ", ".join(path.name for path in event.changed) + (" new code" if event.restarted else "")
        names = [row["name"] for row in report["artifacts"] if row["status"] == "baked"]
        baked = f"{report['baked']} baked{' (' + ', '.join(names) + ')' if names else ''}"
        what = f"{baked}, {report['reused']} reused in {report['seconds']:.2f} s, in {event.baked.out}"
        again = f"; {known} {'warning' if known == 1 else 'warnings'} as before" if known else ""
        show(one_line(f"{cause.strip() or 'start'}: {what}{again}"))

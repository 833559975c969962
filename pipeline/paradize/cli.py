"""The command line: parse, call, print, exit code; nothing else.

Exit 0: done; 1: a bake, a check or a scene failed, or an input was refused; 2: wrong usage. With --json one
JSON object goes to standard output, also on failure, wrong usage and interruption ({"error": [...]}), and
everything else to standard error.
"""

from __future__ import annotations

import argparse
import importlib
import io
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from paradize.cli_options import (
    add_maps_options,
    add_mesh_options,
    add_terrain_options,
    age,
    percent,
    size,
    whole,
)
from paradize.cli_output import OutputLost, complain, say, show, show_json
from paradize.errors import BakeError, GroupedError, ParadizeError, one_line

TIERS = ("fast", "balanced", "exact")
INTERRUPTED = 130  # as shells tell it: 128 + SIGINT


class _WrongUsage(Exception):  # noqa: N818 (never leaves this module)
    """What argparse finds wrong."""


class _Parser(argparse.ArgumentParser):
    """Takes no abbreviated options, and leaves it to `main` to tell what is wrong."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings, allow_abbrev=False)

    def error(self, message: str) -> NoReturn:
        raise _WrongUsage(f"{self.format_usage()}{self.prog}: error: {one_line(message)}")


def parser() -> argparse.ArgumentParser:
    """The whole command line, as DESIGN's contract has it."""
    top = _Parser(
        prog="paradize",
        description="Bakes OBJ models, colour maps and heightmaps into measured, engine-ready assets.",
    )
    top.add_argument("--version", action="store_true", help="print the version and exit")
    commands = top.add_subparsers(dest="command", metavar="COMMAND")

    def command(name: str, call: str, text: str) -> argparse.ArgumentParser:
        """call: the module and the function that runs it; only what a command needs is imported."""
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(call=call)
        return sub

    def common(sub: argparse.ArgumentParser, jobs: str = "threads at most") -> None:
        sub.add_argument("-j", "--jobs", type=whole(1, 4096), metavar="N", help=f"{jobs} (default: cores)")
        sub.add_argument("--tier", choices=TIERS, default="balanced", help="speed against accuracy")
        sub.add_argument("--json", action="store_true", help="print one JSON object on standard output")

    sub = command("bake", "cli_bake:run_bake", "Bake a scene: everything that it requires, once.")
    sub.add_argument("scene", type=Path, metavar="SCENE.toml")
    sub.add_argument("-o", "--out", type=Path, metavar="DIR", help="default: build/assets/<scene name>")
    sub.add_argument("--force", action="store_true", help="bake everything anew; read nothing from the store")
    sub.add_argument(
        "--verify", type=percent, metavar="P", help="derive P %% of the artifacts again and compare bytes"
    )
    common(sub, "worker processes")

    for name, add_options, text in (
        ("mesh", add_mesh_options, "Bake an OBJ into a GLB with tangent frames and levels of detail."),
        ("maps", add_maps_options, "Bake a colour or height map into normal, height, gloss and du/dv maps."),
        ("terrain", add_terrain_options, "Bake a heightmap into a GLB under a bound on its vertical error."),
    ):
        sub = command(name, f"cli_solo:run_{name}", text)
        add_options(sub)
        common(sub)

    sub = command(
        "explain", "cli_look:run_explain", "Say why each artifact of a scene exists, and what limits it."
    )
    sub.add_argument("scene", type=Path, metavar="SCENE.toml")
    sub.add_argument("artifact", nargs="?", metavar="ARTIFACT", help="this one in detail (default: all)")
    sub.add_argument("-o", "--out", type=Path, metavar="DIR", help="where it was baked")
    sub.add_argument("--json", action="store_true", help="print one JSON object on standard output")

    sub = command(
        "check", "cli_look:run_check", "Check baked scenes (folders or scene.json), GLB, KTX2 and PNG files."
    )
    sub.add_argument("paths", type=Path, nargs="+", metavar="PATH")
    sub.add_argument("--format", dest="fmt", choices=("text", "json", "junit", "sarif"), default="text")
    sub.add_argument("--json", action="store_true", help="the same as --format json")

    sub = command("new", "cli_keep:run_new", "Make a small scene to start from, with a model of yours in it.")
    sub.add_argument("folder", type=Path, metavar="DIR", help="a new folder for the scene")
    sub.add_argument("--from", dest="model", type=Path, metavar="IN.obj", help="the model (default: a vase)")
    sub.add_argument("--json", action="store_true", help="print one JSON object on standard output")

    sub = command("clean", "cli_keep:run_clean", "Take from the store what is of no use, old or too much.")
    sub.add_argument("--older-than", type=age, metavar="D", help="not used that long: 30d, 12h, 10m, 90s")
    sub.add_argument("--to-size", type=size, metavar="B", help="keep at most that: 500M, 2G, 1Gi, bytes")
    sub.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    return top


def _terminated(number: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


def _open_streams() -> None:
    """Gives a process that was started without standard streams the null device for each, before a file of
    ours takes their numbers; names that are no text are printed escaped."""
    for stream in range(3):
        try:
            os.fstat(stream)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number: this one
            os.set_inheritable(stream, True)
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 (open as long as the process runs)
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: PTH123, SIM115
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def _run(words: Sequence[str]) -> int:
    """Parses and runs one command; tells its errors; returns the exit code."""
    as_json = "--json" in words
    top = parser()
    try:
        arguments = top.parse_args(words)
        if arguments.version:
            from paradize import __version__

            show(f"paradize {__version__}")
            return 0
        if arguments.command is None:
            raise _WrongUsage(f"{top.format_help()}\nparadize: error: a command is missing")
        module, _, name = arguments.call.partition(":")
        code: int = getattr(importlib.import_module(f"paradize.{module}"), name)(arguments)
        return code
    except _WrongUsage as wrong:
        if as_json:
            show_json({"error": [str(wrong).splitlines()[-1]]})
        say(*str(wrong).splitlines())
        return 2
    except KeyboardInterrupt:
        what = "interrupted; nothing half-written stays"
        if as_json:
            show_json({"error": [what]})
        say(f"paradize: {what}")
        return INTERRUPTED
    except OutputLost:
        raise
    except ParadizeError as error:
        errors: Sequence[ParadizeError] = error.errors if isinstance(error, GroupedError) else [error]
    except Exception as unknown:
        errors = [BakeError(f"unforeseen {type(unknown).__name__}: {unknown}", mend="please report it")]
    complain(errors)
    if as_json:
        show_json({"error": [str(error) for error in errors]})
    return 1


def main(words: Sequence[str] | None = None) -> int:
    """Runs one command; returns its exit code."""
    _open_streams()
    signal.signal(signal.SIGTERM, _terminated)
    try:
        return _run(sys.argv[1:] if words is None else words)
    except OutputLost as lost:
        if str(lost):
            say(f"paradize: error: standard output cannot be written: {lost}")
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is still held goes nowhere
        return 1


if __name__ == "__main__":
    sys.exit(main())

"""`paradize completion`: prints a script by which a shell completes commands, options and files."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

from paradize.cli.options import add_json
from paradize.cli.output import show, show_json
from paradize.cli.values import path

PICTURES = (
    "asc",
    "avif",
    "bmp",
    "dds",
    "exr",
    "hdr",
    "hgt",
    "jpg",
    "jpeg",
    "png",
    "qoi",
    "r16",
    "r32",
    "raw",
    "tga",
    "tif",
    "tiff",
    "webp",
)  # the files that IN.png stands for


SHELLS = ("bash", "zsh", "fish")


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize completion`."""
    sub.add_argument("shell", choices=SHELLS, help="the shell to print for")
    add_json(sub)


def run(arguments: argparse.Namespace) -> int:
    """Prints the script for one shell."""
    script = completion(arguments.shell)
    if arguments.json:
        show_json({"shell": arguments.shell, "script": script})
    else:
        show(script)
    return 0


def completion(shell: str) -> str:
    """The script for `shell`, one of SHELLS, with all commands and options."""
    import shtab

    from paradize.cli.main import parser

    top = parser()
    for action in actions_of(top):
        if action.type is path:
            action.complete = _files(str(action.metavar or ""))  # type: ignore[attr-defined]
    script: str = shtab.complete(top, shell)
    return script


def actions_of(top: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Every argument of a parser and of its commands."""
    for action in top._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for sub in action.choices.values():
                yield from actions_of(sub)


def _files(metavar: str) -> Any:
    """The completions of file names for shtab: folders for DIR, for IN.obj|glb files with these suffixes,
    else any file."""
    import shtab

    if metavar == "DIR":
        return shtab.DIRECTORY
    _, _, suffix = metavar.partition(".")
    if not suffix:
        return shtab.FILE
    suffixes = PICTURES if metavar == "IN.png" else tuple(suffix.split("|"))
    # At least two patterns, because zsh takes (*.obj) alone as qualifiers.
    return shtab.glob(*(f"*.{case}" for suffix in suffixes for case in (suffix, suffix.upper())))

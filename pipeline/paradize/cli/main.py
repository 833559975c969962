"""The command line: parses, calls a command, prints errors, returns the exit code.

Exit 0: done; 1: a bake, a check or a scene failed, or an input was refused; 2: wrong usage. With --json one
JSON object goes to standard output, also on failure, wrong usage and interruption ({"error": [...]}), and
everything else to standard error.
"""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from functools import partial
from importlib import import_module
from textwrap import wrap
from typing import Any, NoReturn

from paradize.cli.interrupt import EXIT_CODE, WHAT, interrupted, interruptible
from paradize.cli.output import OutputLost, complain, say, show, show_json
from paradize.errors import GroupedError, ParadizeError, bounded, unexpected


class _WrongUsage(Exception):  # noqa: N818 (never leaves this module)
    """An error of the usage, from argparse."""


class _Help(argparse.HelpFormatter):
    """Breaks no path at a hyphen."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        lines = wrap(" ".join(text.split()), width, break_on_hyphens=False, break_long_words=False)
        return "\n".join(indent + line for line in lines)


class _Parser(argparse.ArgumentParser):
    """Accepts no abbreviated options. Errors are printed by `main`, without the usage: it would bury them."""

    def __init__(self, **settings: Any) -> None:
        # argparse makes a formatter for every option, which asks how wide the terminal is: here only for help
        narrow = partial(argparse.HelpFormatter, width=80)
        super().__init__(**settings, allow_abbrev=False, formatter_class=narrow)

    def format_help(self) -> str:
        self.formatter_class = _Help
        return super().format_help()

    def error(self, message: str) -> NoReturn:
        raise _WrongUsage(f"{self.prog}: error: {bounded(message)}{self._advice(message)}")

    def _advice(self, message: str) -> str:
        """Advice on what to write instead: the number of values that an option takes, or a name that is
        near."""
        known = self._option_string_actions
        for sub in (command for action in self._actions for command in _choices(action).values()):
            known = known | sub._option_string_actions  # unknown options are reported by the top parser
        if found := re.match(r"argument (?:.*/)?(-\S+): expected ", message):
            action = known[found[1]]
            values = action.metavar if isinstance(action.metavar, tuple) else (action.metavar or "VALUE",)
            meaning = (action.help or "").replace("%%", "%")
            return f"; give {meaning}: {found[1]} {' '.join(values)}"
        if message.startswith("argument COMMAND: invalid choice: "):
            wrong, names = [message.split("'")[1]], list(COMMANDS)
        else:
            unknown = message.removeprefix("unrecognized arguments: ")
            wrong = [word.partition("=")[0] for word in unknown.split() if word[:1] == "-"]
            wrong, names = wrong if unknown != message else [], list(known)
        near = [name for word in wrong for name in get_close_matches(word, names, 1)]
        return f"; did you mean {', '.join(near)}?" if near else ""


def _choices(action: argparse.Action) -> dict[str, _Parser]:
    return action.choices if isinstance(action, argparse._SubParsersAction) else {}


# The commands and their help. The module paradize.cli.<command> has add(), which declares the options, and
# run(). Only the module of the command that is called is imported.
COMMANDS = {
    "bake": "Bake everything that a scene requires.",
    "mesh": "Bake a model (OBJ, glTF, PLY, STL) into a GLB with tangent frames and levels of detail.",
    "maps": "Bake a colour or height map into normal, height, gloss and du/dv maps.",
    "terrain": "Bake a heightmap into a GLB under a bound on its vertical error.",
    "explain": "Say why each artifact of a scene exists, and what its error does to the picture.",
    "check": "Check baked scenes (folders or scene.json), GLB, KTX2 and PNG files, and settings of scenes.",
    "measure": "Measure time, error and bytes of every tier of every stage.",
    "watch": "Bake a scene, and again whenever one of its files is saved.",
    "export": "Write a baked scene as one GLB with pictures and the flight, for Blender or three.js.",
    "new": "Write a small scene to start from, with your own model in it.",
    "clean": "Delete from the store what is useless, old or too much.",
    "completion": "Print a script by which a shell completes commands, options and files.",
}

EXAMPLES = {
    "bake": "bake scene.toml -o build/assets/scene",
    "mesh": "mesh rock.obj -o rock.glb --lods 3 --tier exact",
    "maps": "maps bark.png -o bark --only normal,gloss --wrap repeat",
    "terrain": "terrain island.png -o island.glb --size 400 400 --height 30",
    "explain": "explain scene.toml palm_color",
    "check": "check build/assets/scene --against build/assets/before",
    "measure": "measure rock.obj -o trade",
    "watch": "watch scene.toml",
    "export": "export build/assets/scene -o scene.glb",
    "new": "new mine --from rock.obj",
    "clean": "clean --older-than 30d --to-size 2G",
    "completion": "completion bash",
}


def parser(only: str | None = None) -> argparse.ArgumentParser:
    """The command line, with all commands, or with one."""
    top = _Parser(
        prog="paradize",
        description="Bakes models (OBJ, glTF, PLY, STL), pictures and heightmaps into measured assets.",
    )
    top.add_argument("--version", action="store_true", help="print the version and exit")
    commands = top.add_subparsers(dest="command", metavar="COMMAND", prog="paradize")
    for name in [only] if only else COMMANDS:
        example = f"Example: paradize {EXAMPLES[name]}"
        sub = commands.add_parser(name, help=COMMANDS[name], description=COMMANDS[name], epilog=example)
        import_module(f"paradize.cli.{name}").add(sub)
    return top


def _open_streams() -> None:
    """Opens the null device for each missing standard stream, before another file takes its number. Names
    that are not valid text are printed escaped."""
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
    """Parses and runs one command, prints its errors, returns the exit code."""
    as_json = "--json" in words
    top = parser(words[0] if words and words[0] in COMMANDS else None)
    try:
        arguments = top.parse_args(words)
        if arguments.version:
            from paradize import __version__

            show(f"paradize {__version__}")
            return 0
        if arguments.command is None:
            say(*top.format_help().splitlines())
            top.error("a command is missing")
        code: int = import_module(f"paradize.cli.{arguments.command}").run(arguments)
        return code
    except _WrongUsage as wrong:
        if as_json:
            show_json({"error": [str(wrong)]})
        command = f" {words[0]}" if words and words[0] in COMMANDS else ""
        say(str(wrong), f"`paradize{command} --help` shows all that it takes")
        return 2
    except OutputLost:
        raise
    except ParadizeError as error:
        errors: Sequence[ParadizeError] = error.errors if isinstance(error, GroupedError) else [error]
    except Exception as unknown:
        errors = [unexpected(unknown)]
    if interrupted():
        raise KeyboardInterrupt
    complain(errors)
    if as_json:
        show_json({"error": [str(error) for error in errors]})
    return 1


def main(words: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit code. words: the command line after `paradize`; None: that of
    this process. An interrupt ends with one line (cli/interrupt.py)."""
    given = sys.argv[1:] if words is None else words
    _open_streams()
    try:
        try:
            return interruptible(lambda: _run(given))
        except BaseException:  # Python and libraries turn some KeyboardInterrupts into other exceptions
            if not interrupted():
                raise
        if "--json" in given:
            show_json({"error": [WHAT]})
        say(f"paradize: {WHAT}")
        return EXIT_CODE
    except OutputLost as lost:
        if str(lost):
            say(f"paradize: error: standard output cannot be written: {lost}")
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # buffered output goes nowhere
        return 1


if __name__ == "__main__":
    sys.exit(main())

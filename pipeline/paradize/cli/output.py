"""What the commands print, and where to."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from paradize.errors import ParadizeError, bounded

MOST_LINE = 8000  # characters: a path of 4096 and every part of a message


class OutputLost(Exception):  # noqa: N818 (never leaves the command line)
    """Standard output takes no more: its reader has gone, or its disk is full."""


def say(*lines: str) -> None:
    """Lines for standard error; where nobody can read it, nothing is lost."""
    with suppress(OSError):
        for line in lines:
            print(bounded(line, MOST_LINE), file=sys.stderr)


def show(text: str, stream: Any = None) -> None:
    """Text for `stream`, standard output by itself. Raises OutputLost where that takes it no longer."""
    try:
        print(text, file=stream or sys.stdout, flush=True)
    except OSError as error:
        if stream is None or stream is sys.stdout:
            raise OutputLost(error.strerror if not isinstance(error, BrokenPipeError) else "") from None


def show_json(tree: Any) -> None:
    show(json.dumps(tree, indent=1, allow_nan=False))


def complain(errors: Sequence[ParadizeError]) -> None:
    """One message for all errors of a run, equal ones once."""
    told = list(dict.fromkeys(str(error) for error in errors))
    head = "error" if len(told) == 1 else f"{len(told)} errors"
    say(f"paradize: {head}:" if len(told) > 1 else f"paradize: {head}: {told[0]}")
    if len(told) > 1:
        say(*(f"  {text}" for text in told))

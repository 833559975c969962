"""Printing: results on standard output, everything else on standard error."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from paradize.documents import json_text
from paradize.errors import ParadizeError, bounded, merged

MOST_LINE = 8000  # characters: a path of 4096 and every part of a message


class OutputLost(Exception):  # noqa: N818 (never leaves the command line)
    """Standard output cannot be written any more: its reader is gone, or its disk is full."""


def say(*lines: str) -> None:
    """Prints lines on standard error. A closed standard error is not an error."""
    with suppress(OSError):
        for line in lines:
            print(bounded(line, MOST_LINE), file=sys.stderr)


def show(text: str, stream: Any = None) -> None:
    """Prints text on `stream` (default: standard output). Raises OutputLost if standard output cannot be
    written."""
    try:
        print(text, file=stream or sys.stdout, flush=True)
    except OSError as error:
        if stream is None or stream is sys.stdout:
            raise OutputLost(error.strerror if not isinstance(error, BrokenPipeError) else "") from None


def show_json(tree: Mapping[str, Any]) -> None:
    show(json_text(tree))


def warn(warnings: Iterable[str]) -> None:
    """A line on standard error for each warning, without repeats."""
    say(*(f"paradize: warning: {text}" for text in merged(warnings)))


def complain(errors: Sequence[ParadizeError]) -> None:
    """One message for all errors of a run, without repeats."""
    messages = list(dict.fromkeys(str(error) for error in errors))
    if len(messages) == 1:
        say(f"paradize: error: {messages[0]}")
    else:
        say(f"paradize: {len(messages)} errors:", *(f"  {text}" for text in messages))

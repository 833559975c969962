"""Catches what libraries such as libpng and libtiff write to standard error."""

from __future__ import annotations

import os
import sys
import threading
from contextlib import contextmanager
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_silence = threading.Lock()
_MOST = 1 << 16  # bytes that are kept of them


@contextmanager
def silenced() -> Iterator[list[str]]:
    """Catches the lines that libraries write to the process's standard error; the list has them at its end.
    One thread at a time."""
    lines: list[str] = []
    with _silence, TemporaryFile() as caught:
        if sys.stderr is not None:
            sys.stderr.flush()
        try:
            saved = os.dup(2)
        except OSError:  # standard error is closed
            yield lines
            return
        try:
            os.dup2(caught.fileno(), 2)
            yield lines
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            caught.seek(0)
            lines += caught.read(_MOST).decode(errors="replace").splitlines()

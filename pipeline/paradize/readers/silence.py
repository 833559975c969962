"""Keeps libraries such as libpng and libtiff from writing to standard error."""

from __future__ import annotations

import os
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import IO

_silence = threading.Lock()


@contextmanager
def silenced(caught: IO[bytes] | None = None) -> Iterator[None]:
    """While it lasts, all that is written to the process's standard error goes into the file `caught`; None:
    nowhere. One thread at a time."""
    with _silence:
        if sys.stderr is not None:
            sys.stderr.flush()
        try:
            saved = os.dup(2)
        except OSError:  # standard error is closed
            yield
            return
        null = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(null if caught is None else caught.fileno(), 2)
            yield
        finally:
            os.dup2(saved, 2)
            os.close(null)
            os.close(saved)

"""Progress of long work: the step that runs now, and how many steps are done of how many.

A worker sends its steps to its parent (worker.py, pool.py). Code that runs in no worker reports to nobody.
"""

from __future__ import annotations

from collections.abc import Callable

OnProgress = Callable[[str, int, int], None]  # the step that runs now, steps done, steps in all

_listener: OnProgress | None = None


def listen(listener: OnProgress | None) -> None:
    """Makes `listener` hear of every step of this process from here on; None: nobody."""
    global _listener
    _listener = listener


def report_progress(step: str, done: int, total: int) -> None:
    """Says that `step` runs now, and that `done` of `total` steps are finished."""
    if _listener is not None:
        _listener(step, done, total)

"""Progress of long work: what a command shows, and how a baker in a worker process says which step runs.

A worker sends its steps to its parent (worker.py, process.py). Code that runs in no worker reports to nobody.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

OnProgress = Callable[[str, int, int], None]  # the step that runs now, steps done, steps in all


@dataclass(frozen=True)
class Step:
    """A worker's message: this step of its job runs now. done, total: steps that are done and steps in all;
    0, 0 where the job does not count them."""

    name: str
    done: int = 0
    total: int = 0


_listener: Callable[[Step], None] | None = None


def listen(listener: Callable[[Step], None]) -> None:
    """Makes `listener` hear of every step of this process from here on."""
    global _listener
    _listener = listener


def report_step(name: str, done: int = 0, total: int = 0) -> None:
    """Says that a step of this process's job begins: "reading", "level 1 of 3". done, total: as in Step."""
    if _listener is not None:
        _listener(Step(name, done, total))

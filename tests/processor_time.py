"""The processor's time of one piece of work beside another's: seconds depend on the machine, a ratio less."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time


def ratio(work: Callable[[], object], other: Callable[[], object], *, turns: int = 3) -> float:
    """How often the time of `other` goes into that of `work`: each is the least of some turns."""
    return _least_s(work, turns) / _least_s(other, turns)


def _least_s(work: Callable[[], object], turns: int) -> float:
    times = []
    for _ in range(turns):
        start = process_time()
        work()
        times.append(process_time() - start)
    return min(times)

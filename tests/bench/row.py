"""A row of the bench table, and how its times are taken."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Row:
    """ours_ms, peer_ms: medians of one run, or amounts of `unit`. limit: the smallest ratio peer / ours that
    we promise, where we promise one. The errors are texts; measuring them is never inside the times."""

    work: str
    ours_ms: float
    peer: str
    peer_ms: float
    ours_error: str
    peer_error: str
    limit: float | None = None
    unit: str = "ms"


def median_ms(work: Callable[[], Any], runs: int) -> float:
    """Median wall time of `runs` calls after one that is not counted."""
    work()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append((time.perf_counter() - start) * 1e3)
    return statistics.median(times)


def pair_ms(
    ours: Callable[[], Any],
    peer: Callable[[], Any],
    runs: int,
    clock: Callable[[], float] = time.perf_counter,
) -> tuple[float, float]:
    """Median times of both by `clock` (wall time unless told), taken in turns, so that a busy moment of the
    machine meets both. time.thread_time, where both work in one thread, counts no other program's time."""
    ours(), peer()
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(runs):
        for work, into in zip((ours, peer), times, strict=True):
            start = clock()
            work()
            into.append((clock() - start) * 1e3)
    return statistics.median(times[0]), statistics.median(times[1])

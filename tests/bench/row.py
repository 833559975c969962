"""A row of the bench table, how its times are taken, and on what."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Trade:
    """Where a row stands in the chart. panel: "title: what was done". ours, peer: names of the two points.
    Their errors in one unit. less: the peer keeps positions alone. share: how much of the
    panel's work the row did."""

    panel: str
    ours: str
    peer: str
    ours_error: float
    peer_error: float
    less: bool = False
    share: float = 1.0


@dataclass(frozen=True)
class Row:
    """ours_ms, peer_ms: medians of one run, or amounts of `unit`. limit: the smallest ratio peer / ours that
    we promise, where we promise one. The errors are texts; measuring them is never inside the times. inside:
    what both times hold. ours_on, peer_on: threads and instruction sets, as `on` says them. trade: of a row
    that the chart shows."""

    work: str
    ours_ms: float
    peer: str
    peer_ms: float
    ours_error: str
    peer_error: str
    limit: float | None = None
    unit: str = "ms"
    _: KW_ONLY
    inside: str
    ours_on: str
    peer_on: str
    trade: Trade | None = None


def cpu_flags() -> set[str]:
    """The CPU's features as Linux names them; none elsewhere."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return set()
    return set(next((line for line in text.splitlines() if line.startswith("flags")), "").split())


def _widest() -> str:
    """The instruction set that our kernels choose at run time (kernels/simd/cpu.hpp)."""
    flags = cpu_flags()
    if {"avx512f", "avx512vl", "avx512dq", "avx512bw"} <= flags:
        return "AVX-512"
    return "AVX2" if "avx2" in flags else BASELINE


BASELINE = "SSE2" if platform.machine() == "x86_64" else platform.machine()
WIDEST = _widest()
CORES = os.cpu_count() or 1


def on(threads: int, instructions: str = WIDEST) -> str:
    return f"{threads} thread{'s' if threads > 1 else ''}, {instructions}"


def machine() -> str:
    """The machine in a line: CPU, cores, system."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "CPU")
    system = f"{platform.platform()}, Python {platform.python_version()}"
    return f"{name}, {CORES} cores, our kernels run {WIDEST}; {system}"


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

"""A tier as it is asked for and as it was found: what the parent and its workers tell each other.

A stage is timed by itself, in a process that does nothing else: not the interpreter's start, not the reading
of the source, not the measuring of the error. Seconds are those of the processor, on one core: what else a
machine does is not counted.
"""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from paradize.jobs.limits import cores
from paradize.kernels.threads import VARIABLE as THREADS

MOST_RUNS, LEAST_RUNS = 10, 3  # without a word from the user: as many as fit into ENOUGH_S
ENOUGH_S = 1.0
_SLOW_S = 0.3  # such a run needs no warm-up: caches and pages are a small part of it
Result = TypeVar("Result")


@dataclass(frozen=True)
class Trial:
    """One tier. call: a module-level function of `arguments` and `runs` that gives a TrialResult. series: as
    of curve.Point. row: what the artifact's row says where this tier is in use ({"tier": ...}); None:
    never, {}: always."""

    tier: str
    call: Callable[..., TrialResult]
    arguments: dict[str, Any]
    series: str | None = None
    row: Mapping[str, str] | None = None


@dataclass(frozen=True)
class TrialGroup:
    """A group to be measured. metrics: the one that a budget names counts, else the first. declared: as of
    curve.Group. units: of metrics that no budget can name."""

    name: str
    stage: str
    artifact: str
    metrics: tuple[str, ...]
    tries: tuple[Trial, ...]
    declared: tuple[str, ...] = ()
    note: str = ""
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class TrialResult:
    """What a worker found of a tier. seconds: one of each run. levels: metric -> value of each level of
    detail; other stages have one. bytes: None where nothing is written."""

    seconds: list[float]
    levels: list[dict[str, float]]
    bytes: int | None = None
    note: str = ""


def timed(work: Callable[[], Result], runs: int | None) -> tuple[list[float], Result]:
    """The seconds of each run of `work`, and what it gave. runs: None for as many as are worth their time. A
    quick one has a run before that does not count. Afterwards native kernels may use all cores again: the
    metrics that follow are in nobody's way."""
    seconds: list[float] = []
    total, warm = 0.0, False
    while True:
        gc.collect()
        start = time.process_time()
        result = work()
        took = time.process_time() - start
        if not warm and took < _SLOW_S:
            warm = True
            continue
        warm = True
        seconds.append(took)
        total += took
        enough = runs or (MOST_RUNS if total < ENOUGH_S else LEAST_RUNS)
        if len(seconds) >= enough:
            os.environ[THREADS] = str(cores())
            return seconds, result

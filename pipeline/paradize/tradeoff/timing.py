"""The trials that a parent sends to its workers, their results, and the timing.

The stage alone is timed: not the start of the interpreter, the reading of the source or the measuring of the
error. Seconds are processor time on one core, so other work of the machine does not count.
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

MOST_RUNS, LEAST_RUNS = 10, 3  # by default: as many as fit into ENOUGH_S
ENOUGH_S = 1.0
_SLOW_S = 0.3  # a run that takes longer needs no warm-up: caches and pages are a small part of it
Result = TypeVar("Result")


@dataclass(frozen=True)
class Trial:
    """One tier to measure. call: a module-level function of `arguments` and `runs` that returns a
    TrialResult. series: as in curve.Point. row: the keys of the artifact's row that mean that this tier is in
    use ({"tier": ...}); None: it never is; {}: it always is."""

    tier: str
    call: Callable[..., TrialResult]
    arguments: dict[str, Any]
    series: str | None = None
    row: Mapping[str, str] | None = None


@dataclass(frozen=True)
class TrialGroup:
    """A group to measure. metrics: the one that has a budget counts, else the first. declared: as in
    curve.Group. units: of metrics that are not in scene/budget.py. beside: metrics of other errors in which a
    library may be worse."""

    name: str
    stage: str
    artifact: str
    metrics: tuple[str, ...]
    trials: tuple[Trial, ...]
    declared: tuple[str, ...] = ()
    note: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    beside: tuple[str, ...] = ()


@dataclass(frozen=True)
class TrialResult:
    """A worker's measurements of a tier. seconds: of each run. levels: metric -> value, for each level of
    detail; other stages have one level. bytes: None if nothing is written. triangles: of each level of
    detail."""

    seconds: list[float]
    levels: list[dict[str, float]]
    bytes: int | None = None
    note: str = ""
    triangles: tuple[int, ...] = ()


def timed(work: Callable[[], Result], runs: int | None) -> tuple[list[float], Result]:
    """Runs `work` several times. Returns the seconds of each run, and the last result.

    runs: None for MOST_RUNS, or fewer if they take long. A quick `work` has a first run that does not count.
    Native kernels use one thread meanwhile, and all cores afterwards, for the metrics."""
    os.environ[THREADS] = "1"
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

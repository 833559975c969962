"""Runs every tier of every stage of a file, and returns time, error and bytes of each as tradeoff.json.

The tiers run one at a time and on one core, so that no timing disturbs another, in a worker process, so
that one that crashes or hangs costs only itself. Errors come from the metrics, which share no code with the
stages. formats/FORMAT.md describes the result.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from paradize.data import rounded
from paradize.errors import BakeError, GroupedError, ParadizeError, SourceError
from paradize.jobs.pool import Job, Outcome, WorkerPool, run_jobs
from paradize.jobs.progress import OnProgress
from paradize.scene.budget import METRICS, worst
from paradize.tradeoff.curve import Group, Point, inside, spread
from paradize.tradeoff.plan import FileOptions, file_groups, file_rows
from paradize.tradeoff.timing import Trial, TrialGroup, TrialResult
from paradize.tradeoff.words import conclude

VERSION = 1
_SAME_COUNT = 1.1  # levels whose triangles differ by less than this factor are compared
_ROLE = re.compile(r"_(mean|p99|rms|max)(?=_|$)")


def measure_file(
    path: Path,
    options: FileOptions,
    *,
    tier: str = "balanced",
    runs: int | None = None,
    on_progress: OnProgress | None = None,
) -> dict[str, Any]:
    """Every tier of every stage of an OBJ, a colour map or a heightmap, as the object of tradeoff.json.

    tier: the tier in use. runs: of each tier; None: up to MOST_RUNS, fewer if one takes long. on_progress
    hears of each tier. Raises SourceError and BakeError, or GroupedError."""
    start = time.monotonic()
    arguments = {"path": path, "options": options}
    planned = plan_in_worker(path.name, file_groups, arguments, path)
    groups, warnings = run_groups(planned, file_rows(planned, tier), {}, runs, on_progress)
    return result(path, groups, warnings, time.monotonic() - start)


def result(source: Path, groups: list[Group], warnings: list[str], seconds: float) -> dict[str, Any]:
    """The object of tradeoff.json."""
    return {
        "version": VERSION,
        "source": str(source),
        "threads": 1,
        "seconds": round(seconds, 1),
        "groups": groups,
        "warnings": warnings,
    }


def plan_in_worker(
    name: str, call: Callable[..., Any], arguments: dict[str, Any], file: Path
) -> list[TrialGroup]:
    """Plans the measurement in a worker process, because reading a broken source may crash."""
    (outcome,) = run_jobs([Job(name, call, arguments, file=file)], 1)
    if outcome.error:
        raise outcome.error
    groups: list[TrialGroup] = outcome.value
    return groups


def run_groups(
    planned: list[TrialGroup],
    rows: Mapping[str, Mapping[str, Any]],
    budget: Mapping[str, float],
    runs: int | None,
    on_progress: OnProgress | None,
) -> tuple[list[Group], list[str]]:
    """Measures the planned groups. Returns the measured groups, and warnings.

    rows: what was baked, by artifact. budget: metric -> limit. A tier that fails is a warning. A source that
    cannot be read raises its SourceError; if every tier fails, their errors are raised."""
    total = sum(len(group.trials) for group in planned)
    done = 0
    groups: list[Group] = []
    warnings: list[str] = []
    errors: list[ParadizeError] = []
    with WorkerPool() as pool:  # starting a process takes longer than most tiers
        for group in planned:
            results: list[tuple[Trial, TrialResult]] = []
            for trial in group.trials:
                if on_progress:
                    on_progress(f"{group.name}: {trial.tier}", done, total)
                outcome = _run(pool, group, trial, runs)
                done += 1
                if isinstance(outcome.error, SourceError):
                    raise outcome.error
                if outcome.error:
                    errors.append(outcome.error)
                    warnings.append(f"{group.name}: {trial.tier} was not measured: {outcome.error}")
                else:
                    results.append((trial, outcome.value))
            if results:
                for at, most in _uneven([result for _, result in results]).items():
                    trial = results[at][0]
                    trial = replace(trial, arguments=trial.arguments | {"most_levels": most})
                    outcome = _run(pool, group, trial, runs)
                    if outcome.error:
                        raise outcome.error
                    results[at] = trial, outcome.value
                measured = _group(group, results, rows.get(group.artifact, {}), budget)
                groups.append(measured)
                warnings += conclude(measured)
    if on_progress:
        on_progress("done", total, total)
    if not groups:
        raise GroupedError(errors) if errors else BakeError("nothing here has a stage to be measured")
    return groups, warnings


def _run(pool: WorkerPool, group: TrialGroup, trial: Trial, runs: int | None) -> Outcome:
    job = Job(f"{group.name}, {trial.tier}", trial.call, trial.arguments | {"runs": runs})
    (outcome,) = run_jobs([job], 1, threads=1, pool=pool)
    return outcome


def _uneven(results: list[TrialResult]) -> dict[int, int]:
    """Which results hold coarser levels of detail than all reach, and how many levels each of these may have
    to be compared: a finer last level would look more exact, one level less quicker and smaller."""
    made = [result.triangles for result in results if len(result.triangles) > 1]
    if not made:
        return {}
    reached = max(triangles[-1] for triangles in made) / _SAME_COUNT
    counts = [max(2, sum(count >= reached for count in result.triangles)) for result in results]
    return {at: most for at, most in enumerate(counts) if most < len(results[at].triangles)}


def _group(
    planned: TrialGroup,
    results: list[tuple[Trial, TrialResult]],
    row: Mapping[str, Any],
    budget: Mapping[str, float],
) -> Group:
    """A group of tradeoff.json, without conclusions."""
    errors = [_worst(result.levels) for _, result in results]
    known = [metric for metric in planned.metrics if all(metric in measured for measured in errors)]
    if not known:
        raise BakeError(f"{planned.name}: none of {', '.join(planned.metrics)} was measured")
    metric = next((name for name in known if name in budget), known[0])
    limit = METRICS.get(metric)
    points: list[Point] = []
    for (trial, result), error in zip(results, errors, strict=True):
        needed = trial.row
        point: Point = {
            "tier": trial.tier,
            "seconds": spread([rounded(seconds) for seconds in result.seconds]),
            "error": parts(metric, error),
            "bytes": result.bytes,
            "in_use": needed is not None and all(row.get(key) == value for key, value in needed.items()),
            "dominated": False,
            "on_front": False,
        }
        if not all(within(name, value, budget) for name, value in error.items()):
            point["passes"] = False
        if planned.beside:
            point["beside"] = {name: rounded(error.get(name, 0.0)) for name in planned.beside}
        if trial.series:
            point["series"] = trial.series
        if result.note:
            point["note"] = result.note
        points.append(point)
    return {
        "name": planned.name,
        "stage": planned.stage,
        "kind": "bake",
        "artifact": planned.artifact,
        "metric": metric,
        "unit": limit.unit if limit else planned.units.get(metric, ""),
        "less_is_better": limit.less_is_better if limit else True,
        "time": "bake",
        "points": points,
        "budget": budget.get(metric),
        "sentence": "",
        "declared": list(planned.declared),
        "note": planned.note,
        "advice": None,
    }


def within(metric: str, value: float, budget: Mapping[str, float]) -> bool:
    """Whether a value is inside the budget of its metric, or has none."""
    return metric not in budget or inside(value, budget[metric], METRICS[metric].less_is_better)


def _worst(levels: list[dict[str, float]]) -> dict[str, float]:
    """The worst error of any level, by metric: the largest, or of dB the smallest."""
    return {
        metric: worst(metric, [level[metric] for level in levels if metric in level])
        for metric in (levels[0] if levels else {})
    }


def parts(metric: str, errors: Mapping[str, float]) -> dict[str, float]:
    """The metric's value as "value", and the mean, p99, rms and max of the same error if they were measured.

    For color_psnr_db: color_max; for normal_p99_deg: normal_mean_deg and normal_max_deg."""
    roles = {"value": rounded(errors[metric])}
    stem = _ROLE.sub("", metric.removesuffix("_psnr_db"))
    for name, value in errors.items():
        role = _ROLE.search(name)
        if role and _ROLE.sub("", name) == stem:
            roles[role[1]] = rounded(value)
    return roles

"""Runs the tiers of every stage on a file or a scene, and says what each costs and what it errs.

Each tier runs in a process of its own, one at a time and on one core, so that no timing disturbs another.
Errors come from the metrics, which share nothing with the stages. The form of the result is told in
formats/FORMAT.md.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from paradize.data import six
from paradize.errors import BakeError, GroupedError, ParadizeError, SourceError
from paradize.jobs.pool import Job, run_jobs
from paradize.measure.curve import Group, Point, inside, spread
from paradize.measure.plan import FileOptions, file_groups, file_rows
from paradize.measure.timing import Trial, TrialGroup, TrialResult
from paradize.measure.words import judge
from paradize.scene.budget import METRICS

VERSION = 1
_ROLE = re.compile(r"_(mean|p99|rms|max)(?=_|$)")
Told = Callable[[str, int, int], None]  # what runs, how many tiers are done, of how many


def measure_file(
    path: Path,
    options: FileOptions,
    *,
    tier: str = "balanced",
    runs: int | None = None,
    told: Told | None = None,
) -> dict[str, Any]:
    """Every tier of every stage of an OBJ, a colour map or a heightmap, as the object of tradeoff.json.

    tier: the one in use. runs: of each tier; None: up to MOST_RUNS, fewer where one takes long. Raises
    SourceError and BakeError, or GroupedError.
    """
    start = time.monotonic()
    arguments = {"path": path, "options": options}
    groups = asked_in_worker(path.name, file_groups, arguments, path)
    made, warnings = run_groups(groups, file_rows(groups, tier), {}, runs, told)
    return result(path, made, warnings, time.monotonic() - start)


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


def asked_in_worker(
    name: str, call: Callable[..., Any], arguments: dict[str, Any], file: Path
) -> list[TrialGroup]:
    """What a planner asks, planned where a broken source can do no harm."""
    (outcome,) = run_jobs([Job(name, call, arguments, file=file)], 1)
    if outcome.error:
        raise outcome.error
    groups: list[TrialGroup] = outcome.value
    return groups


def run_groups(
    groups: list[TrialGroup],
    rows: Mapping[str, Mapping[str, Any]],
    budget: Mapping[str, float],
    runs: int | None,
    told: Told | None,
) -> tuple[list[Group], list[str]]:
    """Measures the groups; the measured ones, and warnings. rows: what was baked, by artifact. budget: metric
    -> the value that tiers are held to. A tier that fails is a warning; a source that cannot be read is an
    error at once, and so are tiers that all fail."""
    total = sum(len(group.tries) for group in groups)
    done, made = 0, []
    warnings: list[str] = []
    errors: list[ParadizeError] = []
    for group in groups:
        found: list[tuple[Trial, TrialResult]] = []
        for attempt in group.tries:
            if told:
                told(f"{group.name}: {attempt.tier}", done, total)
            job = Job(f"{group.name}, {attempt.tier}", attempt.call, attempt.arguments | {"runs": runs})
            (outcome,) = run_jobs([job], 1, threads=1)
            done += 1
            if isinstance(outcome.error, SourceError):
                raise outcome.error
            if outcome.error:
                errors.append(outcome.error)
                warnings.append(f"{group.name}: {attempt.tier} was not measured: {outcome.error}")
            else:
                found.append((attempt, outcome.value))
        if found:
            measured, told_too = _group(group, found, rows.get(group.artifact, {}), budget)
            made.append(measured)
            warnings += told_too + judge(measured)
    if told:
        told("done", total, total)
    if not made:
        raise GroupedError(errors) if errors else BakeError("nothing here has a stage to be measured")
    return made, warnings


def _group(
    asked: TrialGroup,
    found: list[tuple[Trial, TrialResult]],
    row: Mapping[str, Any],
    budget: Mapping[str, float],
) -> tuple[Group, list[str]]:
    """A group of the JSON, not yet judged; and warnings."""
    common = min(len(told.levels) for _, told in found)
    warnings = []
    if len({len(told.levels) for _, told in found}) > 1:
        counts = ", ".join(f"{attempt.tier} {len(told.levels)}" for attempt, told in found)
        warnings.append(
            f"{asked.name}: tiers made different numbers of levels ({counts}); errors are those of {common}"
        )
    errors = [_worst(told.levels[:common]) for _, told in found]
    known = [metric for metric in asked.metrics if all(metric in one for one in errors)]
    if not known:
        raise BakeError(f"{asked.name}: none of {', '.join(asked.metrics)} was measured")
    metric = next((name for name in known if name in budget), known[0])
    limit = METRICS.get(metric)
    points: list[Point] = []
    for (attempt, told), error in zip(found, errors, strict=True):
        wanted = attempt.row
        point: Point = {
            "tier": attempt.tier,
            "seconds": spread([six(seconds) for seconds in told.seconds]),
            "error": parts(metric, error),
            "bytes": told.bytes,
            "in_use": wanted is not None and all(row.get(key) == value for key, value in wanted.items()),
            "dominated": False,
            "on_front": False,
        }
        if not all(within(name, value, budget) for name, value in error.items()):
            point["passes"] = False
        if attempt.series:
            point["series"] = attempt.series
        if told.note:
            point["note"] = told.note
        points.append(point)
    return {
        "name": asked.name,
        "stage": asked.stage,
        "kind": "bake",
        "artifact": asked.artifact,
        "metric": metric,
        "unit": limit.unit if limit else asked.units.get(metric, ""),
        "less_is_better": limit.less_is_better if limit else True,
        "time": "bake",
        "points": points,
        "budget": budget.get(metric),
        "sentence": "",
        "declared": list(asked.declared),
        "note": asked.note,
        "advice": None,
    }, warnings


def within(metric: str, value: float, budget: Mapping[str, float]) -> bool:
    """Whether a value is inside the budget, if there is one for its metric."""
    return metric not in budget or inside(value, budget[metric], METRICS[metric].less_is_better)


def _worst(levels: list[dict[str, float]]) -> dict[str, float]:
    """The largest error of any level, by metric; of metrics of which more is better the smallest."""
    found: dict[str, float] = {}
    for metric in levels[0] if levels else {}:
        values = [level[metric] for level in levels if metric in level]
        found[metric] = min(values) if metric.endswith("_db") else max(values)
    return found


def parts(metric: str, errors: Mapping[str, float]) -> dict[str, float]:
    """The metric's value as "value", and mean, p99, rms and max of the same thing where they were measured.

    color_psnr_db has color_max beside it, normal_p99_deg normal_mean_deg and normal_max_deg."""
    found = {"value": six(errors[metric])}
    stem = _ROLE.sub("", metric.removesuffix("_psnr_db"))
    for name, value in errors.items():
        role = _ROLE.search(name)
        if role and _ROLE.sub("", name) == stem:
            found[role[1]] = six(value)
    return found

"""Compares a bake with an earlier one of the same scene: errors that got worse, artifacts that are new or
gone, files that grew."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from paradize.checks.rules import Finding, isolated
from paradize.documents import SCENE_FILE
from paradize.errors import FormatError
from paradize.files import resolved
from paradize.formats.scene.manifest import read_scene
from paradize.scene.budget import METRICS

WORSE_BY = 0.05
# An error below this is rounding, neither worse nor better. By the end of the metric's name.
_ROUNDING = {"_deg": 1e-3, "_m": 1e-6, "_px": 1e-3, "_s": 1e-6}
_LEAST = 1e-7
_MEND = "name the folder of an earlier bake after --against"


def earlier_scene(against: Path, folder: Path) -> Path:
    """The scene.json of the earlier bake: `against` itself, the one in the folder `against`, or the one in
    its subfolder that is named like `folder`."""
    if against.name == SCENE_FILE:
        return against
    own = against / SCENE_FILE
    return own if os.path.lexists(own) else against / resolved(folder).name / SCENE_FILE


def check_against(manifest: dict[str, Any], path: Path, file: str, worse_by: float) -> Iterator[Finding]:
    """The findings of a manifest, whose own file is `file`, against the scene.json at `path`. worse_by: the
    share by which an error or a file may grow."""
    try:
        earlier = read_scene(path)
    except OSError as error:
        lead = "there is no earlier bake" if isinstance(error, FileNotFoundError) else "cannot be read"
        what = f"{lead}: {error.strerror or error}"
        yield Finding("PZ101", str(path), what, mend=_MEND)
        return
    except FormatError as error:
        yield Finding("PZ102", str(path), error.what, error.place or "", mend=_MEND)
        return
    now, was = _named(manifest), _named(earlier)
    for name, artifact in manifest["artifacts"].items():
        if name not in was:
            yield Finding("PZ422", file, "is new", f"artifacts.{name}", artifact=name)
            continue
        yield from isolated(_grown(was[name], artifact, file, name, worse_by), file)
    for name in earlier["artifacts"]:
        if name not in now:
            yield Finding("PZ422", file, "is gone", f"artifacts.{name}", artifact=name)
    yield from _worse(earlier["flight"]["errors"], manifest["flight"]["errors"], file, "flight", worse_by)


def _named(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """The artifacts by each name for which one stands."""
    return {
        each: artifact
        for name, artifact in manifest["artifacts"].items()
        for each in (name, *artifact["also"])
    }


def _grown(
    was: Mapping[str, Any], now: Mapping[str, Any], file: str, name: str, by: float
) -> Iterator[Finding]:
    yield from _worse(was["errors"], now["errors"], file, name, by)
    yield from _levels(was["levels"], now["levels"], file, name, by)
    before, after = was["bytes"], now["bytes"]
    if after > before * (1.0 + by):
        what = f"{after} bytes, {100.0 * (after / before - 1.0):.1f} % more than {before}"
        yield Finding("PZ423", file, what, f"artifacts.{name}", artifact=name)


def _worse(
    before: Mapping[str, float], after: Mapping[str, float], file: str, name: str, by: float
) -> Iterator[Finding]:
    """The metrics that a budget may limit."""
    for metric in METRICS:
        if metric not in before or metric not in after:
            continue
        share = growth(metric, before[metric], after[metric])
        if share > by:
            what = f"{metric} {_change(before[metric], after[metric], share)}"
            place = name if name == "flight" else f"artifacts.{name}"
            yield Finding("PZ421", file, what, place, artifact=name, metric=metric)


def _levels(
    before: Sequence[Mapping[str, float]],
    after: Sequence[Mapping[str, float]],
    file: str,
    name: str,
    by: float,
) -> Iterator[Finding]:
    """One finding for each metric that grew on coarser levels of an artifact. It describes the level on which
    the metric grew most. Level 0 is left out: its errors are those of the artifact."""
    grown: dict[str, list[tuple[float, int]]] = {}
    for level, (was, now) in enumerate(zip(before, after, strict=False)):
        for metric in sorted(was.keys() & now.keys()) if level else []:
            share = growth(metric, was[metric], now[metric])
            if share > by:
                grown.setdefault(metric, []).append((share, level))
    for metric, levels in grown.items():
        share, level = max(levels)
        what = f"{metric} of level {level} {_change(before[level][metric], after[level][metric], share)}"
        place = f"artifacts.{name} level {level}"
        yield Finding("PZ421", file, what, place, len(levels), artifact=name, metric=metric)


def _change(was: float, now: float, share: float) -> str:
    return f"is {now:g} where it was {was:g}" + (
        "" if share == float("inf") else f", {100.0 * share:.3g} % worse"
    )


def growth(metric: str, was: float, now: float) -> float:
    """The share by which an error grew; of dB the error that they stand for (20 dB less: ten times the
    error). 0 if it did not grow, if both are rounding, and for counts."""
    if "_db" in metric:
        return float(10.0 ** min((was - now) / 20.0, 300.0) - 1.0) if now < was else 0.0
    if metric in ("triangles", "vertices"):
        return 0.0
    least = next((value for end, value in _ROUNDING.items() if metric.endswith(end)), _LEAST)
    if now <= was or now <= least:
        return 0.0
    return now / was - 1.0 if was > 0.0 else float("inf")

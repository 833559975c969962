"""Keeps what each job of the last bake into a folder was made of, and finds what has changed since.

`paradize explain` uses it to name the input that made an artifact stale. Does not import numpy.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from paradize.bakers import registry
from paradize.build.options import BuildOptions
from paradize.build.tasks import SHARED_MODULES, Task, job_settings
from paradize.errors import ParadizeError
from paradize.files import resolved
from paradize.jobs.code import code_of
from paradize.jobs.libraries import library_versions
from paradize.scene.finest_views import scene_views
from paradize.scene.jobs import BakeJob
from paradize.scene.motion import stands
from paradize.scene.settings import Scene
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Store, default_root, key_of

_DETAIL_MODULE = (
    "paradize.build.measurements.required_detail"  # its code decides how much of an artifact is published
)
_LIBRARIES = "libraries"
_MOST_CHANGES = 4  # changes listed for one artifact


def _name(out: Path) -> str:
    return key_of("inputs", str(resolved(out)))[:32]


def views_of_job(scene: Scene, job: BakeJob) -> dict[str, Any]:
    """Returns the settings that decide which levels of a job's artifacts the views need."""
    views = scene_views(scene)
    users = [item for item in scene.objects if item.name in job.objects]
    if users:
        views["views"] = [item.views for item in users]
        views["instance"] = [stand for item in users for stand in stands(item)]
    plain: dict[str, Any] = json.loads(json.dumps(views))
    return plain


def _settings(job: BakeJob, scene: Scene, tier: str | None) -> dict[str, Any]:
    """Returns a job's settings; with the scene's tier, if the command line sets none."""
    settings = job_settings(job, scene, finer_format=True) | ({} if tier is None else {"tier": tier})
    plain: dict[str, Any] = json.loads(json.dumps(settings))
    return plain


def keep_inputs(
    store: Store,
    out: Path,
    scene: Scene,
    tasks: Sequence[Task],
    hash_cache: FileHashCache,
    options: BuildOptions,
) -> None:
    """Stores what the tasks of a finished bake were made of."""
    tier = scene.head.tier if options.tier is None else None
    modules = {task.job.baker: dict(_code(task.job.baker)) for task in tasks}
    store.put_bake(
        _name(out),
        {
            "libraries": list(library_versions()),
            "code": modules,
            "tasks": {
                task.job.name: {
                    "sources": {
                        role: [str(path), hash_cache.sha256(path)] for role, path in task.job.sources.items()
                    },
                    "settings": _settings(task.job, scene, tier),
                    "seen": views_of_job(scene, task.job),
                    "constants": {
                        output.artifact: list(constant)
                        for output in task.outputs
                        if (constant := task.products[output.product].constant) is not None
                    },
                }
                for task in tasks
            },
        },
    )


def inputs_of(out: Path) -> Any | None:
    """Returns what `keep_inputs` stored of the last bake into this folder; None if nothing."""
    return Store(default_root()).get_bake(_name(out))


def constant_of(record: Any | None, job: BakeJob, artifact: str) -> list[float] | None:
    """Returns the values of a map of which the last bake made no file, because all its texels are equal; None
    of others. record: from inputs_of."""
    try:
        values: list[float] | None = record["tasks"][job.name]["constants"].get(artifact)  # type: ignore[index]
    except (LookupError, TypeError, AttributeError):
        return None  # there is no bake, or it is of another version of Paradize
    return values


def stale(record: Any | None, scene: Scene, job: BakeJob) -> list[str] | None:
    """Returns what has changed since a bake, as texts; empty: it is up to date. record: from inputs_of.
    None if the record is missing."""
    if not isinstance(record, dict):
        return None
    try:
        was = record["tasks"].get(job.name)
        if was is None:
            return ["it is new in the scene"]
        changes = list(_sources(was["sources"], job.sources))
        tier = scene.head.tier if "tier" in was["settings"] else None
        settings = _settings(job, scene, tier)
        changes += _shortened([f"setting {text}" for text in _changes(was["settings"], settings)])
        if job.baker not in ("sound", "terrain", "flight"):
            changes += _shortened(list(_changes(was["seen"], views_of_job(scene, job))))
        changes += _shortened(
            [
                f"code of {name} changed"
                for name in _changed_names(record["code"][job.baker], _code(job.baker))
            ]
        )
        return changes + list(_libraries(record["libraries"], library_versions()))
    except (LookupError, TypeError, ValueError, AttributeError):
        return None  # written by another version of Paradize


def _code(baker: str) -> Mapping[str, str]:
    modules = dict(code_of(registry.BAKERS[baker][0], *SHARED_MODULES)) | dict(code_of(_DETAIL_MODULE))
    modules.pop(_LIBRARIES, None)
    return modules


def _changed_names(was: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    for name in sorted(was.keys() | now.keys()):
        if was.get(name) != now.get(name):
            yield name


def _sources(was: Mapping[str, Sequence[str]], now: Mapping[str, Path]) -> Iterator[str]:
    hash_cache = FileHashCache()
    for role in [*now, *(role for role in was if role not in now)]:
        if role not in now:
            yield f"{_relative(Path(was[role][0]))} is not read any more ({role})"
        elif role not in was:
            yield f"{_relative(now[role])} is read now ({role})"
        else:
            try:
                same = hash_cache.sha256(now[role]) == was[role][1]
            except ParadizeError as error:
                yield str(error)
                continue
            if not same:
                moved = str(now[role]) != was[role][0]
                yield f"{_relative(now[role])} " + (f"stands for {was[role][0]}" if moved else "changed")


def _relative(path: Path) -> str:
    """Returns a path relative to the current folder, if it is below it."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)


def _changes(was: Any, now: Any, place: str = "") -> Iterator[str]:
    if isinstance(was, dict) and isinstance(now, dict):
        for key in [*now, *(key for key in was if key not in now)]:
            yield from _changes(was.get(key), now.get(key), f"{place}.{key}" if place else key)
    elif isinstance(was, list) and isinstance(now, list) and len(was) == len(now) and _nested(now):
        for k, (old, new) in enumerate(zip(was, now, strict=True)):
            yield from _changes(old, new, f"{place}[{k}]")
    elif was != now:
        yield f"{place} {_text(was)} -> {_text(now)}"


def _nested(values: list[Any]) -> bool:
    return any(isinstance(value, dict | list) for value in values)


def _text(value: Any) -> str:
    text = "none" if value is None else json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _shortened(texts: list[str]) -> list[str]:
    left = len(texts) - _MOST_CHANGES
    return texts if left <= 1 else [*texts[:_MOST_CHANGES], f"and {left} more like that"]


def _libraries(was: Sequence[str], now: Sequence[str]) -> Iterator[str]:
    old, new = (dict(text.rpartition("-")[::2] for text in texts) for texts in (was, now))
    for name in sorted(old.keys() | new.keys()):
        if old.get(name) != new.get(name):
            yield f"library {name} {old.get(name, 'none')} -> {new.get(name, 'none')}"

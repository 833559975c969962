"""What each task of the last bake into a folder was made of, and what of it has changed since.

Kept beside the store's records, by the folder; `paradize explain` names the input that made an artifact
stale. Knows no numpy.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from paradize.bakers import registry
from paradize.build.options import BuildOptions
from paradize.build.tasks import ASKED, Task, settings_of
from paradize.errors import ParadizeError
from paradize.files import resolved
from paradize.jobs.code import code_of
from paradize.jobs.libraries import library_versions
from paradize.scene.requirements import BakeJob, ground_sight
from paradize.scene.settings import Scene
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Store, default_root, key_of

_SEEN = "paradize.build.required_detail"  # what decides how much of an artifact is published
_LIBRARIES = "libraries"
_MOST = 4  # changes that are told of one artifact, one by one


def _name(out: Path) -> str:
    return key_of("inputs", str(resolved(out)))[:32]


def seen_by(scene: Scene, order: BakeJob) -> dict[str, Any]:
    """What of a scene decides which of an order's levels its views ask for."""
    owner = order.name.rpartition(" ")[0]
    item = next((item for item in scene.objects if item.name == owner), None)
    told = ground_sight(scene)
    if item is not None:
        told["views"] = item.views
        told["instance"] = [[one.position, one.yaw_deg, one.scale] for one in item.instances]
    plain: dict[str, Any] = json.loads(json.dumps(told))
    return plain


def _settings(order: BakeJob, scene: Scene, tier: str | None) -> dict[str, Any]:
    """What a task is told; with the tier that the scene asks for, where no command line does."""
    asked = settings_of(order, scene, grow=True) | ({} if tier is None else {"tier": tier})
    plain: dict[str, Any] = json.loads(json.dumps(asked))
    return plain


def keep_inputs(
    store: Store, out: Path, scene: Scene, tasks: Sequence[Task], memory: FileHashCache, how: BuildOptions
) -> None:
    """Remembers what the tasks of a finished bake were made of."""
    tier = scene.head.tier if how.tier is None else None
    modules = {task.order.maker: dict(_code(task.order.maker)) for task in tasks}
    store.put_bake(
        _name(out),
        {
            "libraries": list(library_versions()),
            "code": modules,
            "tasks": {
                task.order.name: {
                    "sources": {
                        role: [str(path), memory.sha256(path)] for role, path in task.order.sources.items()
                    },
                    "settings": _settings(task.order, scene, tier),
                    "seen": seen_by(scene, task.order),
                }
                for task in tasks
            },
        },
    )


def inputs_of(out: Path) -> Any | None:
    """What `keep_inputs` kept of the last bake into this folder; None where nothing is known of it."""
    return Store(default_root()).get_bake(_name(out))


def stale(record: Any | None, scene: Scene, order: BakeJob) -> list[str] | None:
    """What has changed since a bake, in words; nothing: it is up to date. record: as inputs_of tells. None
    where nothing is known of that bake."""
    if not isinstance(record, dict):
        return None
    try:
        was = record["tasks"].get(order.name)
        if was is None:
            return ["it is new in the scene"]
        found = list(_sources(was["sources"], order.sources))
        tier = scene.head.tier if "tier" in was["settings"] else None
        settings = _settings(order, scene, tier)
        found += _short([f"setting {text}" for text in _changes(was["settings"], settings)])
        if order.maker not in ("sound", "terrain", "flight"):
            found += _short(list(_changes(was["seen"], seen_by(scene, order))))
        found += _short(
            [f"code of {name} changed" for name in _differ(record["code"][order.maker], _code(order.maker))]
        )
        return found + list(_libraries(record["libraries"], library_versions()))
    except (LookupError, TypeError, ValueError, AttributeError):
        return None  # kept by another Paradize


def _code(maker: str) -> Mapping[str, str]:
    modules = dict(code_of(registry.MAKERS[maker][0], *ASKED)) | dict(code_of(_SEEN))
    modules.pop(_LIBRARIES, None)
    return modules


def _differ(was: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    for name in sorted(was.keys() | now.keys()):
        if was.get(name) != now.get(name):
            yield name


def _sources(was: Mapping[str, Sequence[str]], now: Mapping[str, Path]) -> Iterator[str]:
    memory = FileHashCache()
    for role in [*now, *(role for role in was if role not in now)]:
        if role not in now:
            yield f"{_near(Path(was[role][0]))} is not read any more ({role})"
        elif role not in was:
            yield f"{_near(now[role])} is read now ({role})"
        else:
            try:
                same = memory.sha256(now[role]) == was[role][1]
            except ParadizeError as error:
                yield str(error)
                continue
            if not same:
                moved = str(now[role]) != was[role][0]
                yield f"{_near(now[role])} " + (f"stands for {was[role][0]}" if moved else "changed")


def _near(path: Path) -> str:
    """As it is seen from here, where it lies below."""
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


def _short(texts: list[str]) -> list[str]:
    more = len(texts) - _MOST
    return texts if more <= 1 else [*texts[:_MOST], f"and {more} more like that"]


def _libraries(was: Sequence[str], now: Sequence[str]) -> Iterator[str]:
    old, new = (dict(text.rpartition("-")[::2] for text in texts) for texts in (was, now))
    for name in sorted(old.keys() | new.keys()):
        if old.get(name) != new.get(name):
            yield f"library {name} {old.get(name, 'none')} -> {new.get(name, 'none')}"

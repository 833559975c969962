"""Asks workers for what is measured of each object's published bytes: what the gutters of its maps allow, and
what its bumps look like on each level of detail. The answers are kept like any product.

Light: what measures is gutter_limits.py and lod_normal_error.py, in the worker.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paradize.build.artifacts import read_artifact
from paradize.build.entries import BUMPS, GUTTERS, fits
from paradize.build.options import BuildOptions
from paradize.build.work import run_work
from paradize.errors import ParadizeError
from paradize.jobs.code import code_digest, code_of
from paradize.jobs.pool import Job
from paradize.maps import maps_of
from paradize.scene.requirements import ObjectSighting
from paradize.scene.settings import ObjectMaterial, Scene, SceneObject
from paradize.store.local import Store, key_of

_HOLDS = {"gutters": GUTTERS, "bumps": BUMPS}


@dataclass(frozen=True)
class _Measurement:
    """One question about an object: what is asked, the key of its answer, and who finds it out."""

    item: str
    what: str
    key: str
    job: Job


def gutters_of(glb: Path, maps: dict[str, Path], settings: dict[str, Any]) -> dict[str, Any]:
    """In the worker: gutter_limits.measure_gutters."""
    from paradize.build.gutter_limits import measure_gutters

    textures = {key: read_artifact(path) for key, path in maps.items()}
    return measure_gutters(glb=read_artifact(glb), textures=textures, **settings)


def bumps_of(glb: Path, maps: dict[str, Path], settings: dict[str, Any]) -> dict[str, Any]:
    """In the worker: lod_normal_error.measure_bumps."""
    from paradize.build.lod_normal_error import measure_bumps

    texture = read_artifact(maps["normal"])
    return {"levels": measure_bumps(glb=read_artifact(glb), texture=texture, **settings)}


def measure_objects(
    store: Store,
    scene: Scene,
    met: Mapping[str, ObjectSighting],
    materials: Mapping[str, list[str]],
    data: Mapping[str, Path],
    sha256: Mapping[str, str],
    how: BuildOptions,
) -> tuple[dict[str, dict[str, dict[str, Any]]], list[ParadizeError]]:
    """By "gutters" and "bumps", then by the object's name: what measure_gutters returns, for objects with a
    colour map; and {"levels": what measure_bumps returns}, for those with a normal map. And what failed.

    met: how the flight meets each object. materials: the names of its mesh's. data, sha256: by artifact.
    """
    asked: list[_Measurement] = []
    found: dict[str, dict[str, dict[str, Any]]] = {what: {} for what in _HOLDS}
    for item in scene.objects:
        textures = {key: f"{item.name}_{key}" for key in maps_of("object") if f"{item.name}_{key}" in data}
        known = {name: item.materials.get(name, ObjectMaterial()) for name in materials[item.name]}
        parallax = {name: (one.parallax_scale, one.parallax_bias) for name, one in known.items()}
        repeat = item.wrap == "repeat"
        if "color" in textures and repeat:  # maps that tile have no borders to look at
            free = {"limits": dict.fromkeys(sorted(parallax)), "maps": dict.fromkeys(textures)}
            found["gutters"][item.name] = {"repeat": True} | free
        elif "color" in textures:
            settings = {"name": item.name, "parallax": parallax, "bleed": item.bleed, "repeat": repeat}
            settings |= {"pixel_m": met[item.name].pixel_m}
            asked.append(_ask("gutters", gutters_of, item, settings, data, sha256, textures))
        if "normal" in textures:
            settings = {"name": item.name, "repeat": repeat}
            only = {"normal": textures["normal"]}
            asked.append(_ask("bumps", bumps_of, item, settings, data, sha256, only))
    work = []
    if not how.force:
        store.expect(one.key for one in asked)
    for one in asked:
        kept = None if how.force else store.get_product(one.key)
        if fits(kept, _HOLDS[one.what]):
            found[one.what][one.item] = kept
        else:
            work.append(one)
    errors = []
    outcomes = run_work(how, [one.job for one in work])
    for one, outcome in zip(work, outcomes, strict=True):
        if outcome.error:
            errors.append(outcome.error)
            continue
        found[one.what][one.item] = outcome.value
        store.put_product(one.key, outcome.value)
    return found, errors


def _ask(
    what: str,
    call: Callable[..., dict[str, Any]],
    item: SceneObject,
    settings: dict[str, Any],
    data: Mapping[str, Path],
    sha256: Mapping[str, str],
    textures: Mapping[str, str],
) -> _Measurement:
    module = {"gutters": "paradize.build.gutter_limits", "bumps": "paradize.build.lod_normal_error"}[what]
    mesh = f"{item.name}_mesh"
    hashes = {key: sha256[name] for key, name in textures.items()} | {"mesh": sha256[mesh]}
    key = key_of(what, code_digest(module), hashes, settings)
    maps = {key: data[name] for key, name in textures.items()}
    job = Job(
        f"{item.name} {what}",
        call,
        {"glb": data[mesh], "maps": maps, "settings": settings},
        file=item.mesh,
        code=code_of(module),
        files=dict.fromkeys([data[mesh], *maps.values()], True),
    )
    return _Measurement(item.name, what, key, job)

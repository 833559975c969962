"""Measures each object's published files in workers: the limits of its maps' gutters, and the errors of its
levels' normals under the normal map. Results are kept in the store.

gutter_limits.py and lod_normal_error.py measure. They are imported in the worker only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paradize.build.artifacts import read_artifact
from paradize.build.entries import GUTTERS, LOD_NORMAL_ERRORS, fits
from paradize.build.options import BuildOptions
from paradize.build.work import run_build_jobs
from paradize.errors import ParadizeError
from paradize.jobs.code import code_digest, code_of
from paradize.jobs.pool import Job
from paradize.maps import maps_of
from paradize.scene.requirements import ObjectSighting
from paradize.scene.settings import ObjectMaterial, Scene, SceneObject
from paradize.store.local import Store, key_of

_SHAPES = {"gutters": GUTTERS, "lod_normal_error": LOD_NORMAL_ERRORS}


@dataclass(frozen=True)
class _Measurement:
    """A measurement of an object: its kind, its key in the store, and the job that makes it."""

    item: str
    kind: str
    key: str
    job: Job


def gutter_limits_job(glb: Path, maps: dict[str, Path], settings: dict[str, Any]) -> dict[str, Any]:
    """Calls gutter_limits.measure_gutters, in a worker."""
    from paradize.build.gutter_limits import measure_gutters

    textures = {key: read_artifact(path) for key, path in maps.items()}
    return measure_gutters(glb=read_artifact(glb), textures=textures, **settings)


def lod_normal_error_job(glb: Path, maps: dict[str, Path], settings: dict[str, Any]) -> dict[str, Any]:
    """Calls lod_normal_error.measure_lod_normal_error, in a worker."""
    from paradize.build.lod_normal_error import measure_lod_normal_error

    texture = read_artifact(maps["normal"])
    return {"levels": measure_lod_normal_error(glb=read_artifact(glb), texture=texture, **settings)}


def measure_objects(
    store: Store,
    scene: Scene,
    sightings: Mapping[str, ObjectSighting],
    materials: Mapping[str, list[str]],
    data: Mapping[str, Path],
    sha256: Mapping[str, str],
    options: BuildOptions,
) -> tuple[dict[str, dict[str, dict[str, Any]]], list[ParadizeError]]:
    """Measures each object's published files; results are kept in the store.

    sightings, materials: how the flight sees each object and the names of its mesh's materials, by object
    name. data, sha256: by artifact.

    Returns, by "gutters" and "lod_normal_error" and then by object name, what measure_gutters returns of
    objects with a colour map, and {"levels": what measure_lod_normal_error returns} of those with a normal
    map; and the errors of what failed.
    """
    measurements: list[_Measurement] = []
    found: dict[str, dict[str, dict[str, Any]]] = {kind: {} for kind in _SHAPES}
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
            settings |= {"pixel_m": sightings[item.name].pixel_m}
            measurements.append(
                _measurement("gutters", gutter_limits_job, item, settings, data, sha256, textures)
            )
        if "normal" in textures:
            settings = {"name": item.name, "repeat": repeat}
            only = {"normal": textures["normal"]}
            measurements.append(
                _measurement("lod_normal_error", lod_normal_error_job, item, settings, data, sha256, only)
            )
    missing = []
    if not options.force:
        store.expect(one.key for one in measurements)
    for one in measurements:
        stored = None if options.force else store.get_product(one.key)
        if fits(stored, _SHAPES[one.kind]):
            found[one.kind][one.item] = stored
        else:
            missing.append(one)
    errors = []
    outcomes = run_build_jobs(options, [one.job for one in missing])
    for one, outcome in zip(missing, outcomes, strict=True):
        if outcome.error:
            errors.append(outcome.error)
            continue
        found[one.kind][one.item] = outcome.value
        store.put_product(one.key, outcome.value)
    return found, errors


def _measurement(
    kind: str,
    function: Callable[..., dict[str, Any]],
    item: SceneObject,
    settings: dict[str, Any],
    data: Mapping[str, Path],
    sha256: Mapping[str, str],
    textures: Mapping[str, str],
) -> _Measurement:
    module = {
        "gutters": "paradize.build.gutter_limits",
        "lod_normal_error": "paradize.build.lod_normal_error",
    }[kind]
    mesh = f"{item.name}_mesh"
    hashes = {key: sha256[name] for key, name in textures.items()} | {"mesh": sha256[mesh]}
    key = key_of(kind, code_digest(module), hashes, settings)
    maps = {key: data[name] for key, name in textures.items()}
    job = Job(
        f"{item.name} {kind.replace('_', ' ')}",
        function,
        {"glb": data[mesh], "maps": maps, "settings": settings},
        file=item.mesh,
        code=code_of(module),
        files=dict.fromkeys([data[mesh], *maps.values()], True),
    )
    return _Measurement(item.name, kind, key, job)

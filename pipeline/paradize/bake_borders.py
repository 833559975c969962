"""Asks a worker for what the gutters of each object's maps allow; the answers are kept like any product.

Light: what measures is bake_gutter.py, in the worker.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from paradize.engine.code import code_digest, code_of
from paradize.engine.store import Store, key_of
from paradize.engine.workers import Job, run_jobs
from paradize.errors import ParadizeError
from paradize.require import Met
from paradize.scene import ObjectMaterial, Scene

MAPS = ("color", "normal", "height", "gloss")


def measure(**arguments: Any) -> dict[str, Any]:
    """In the worker: bake_gutter.measure_gutters."""
    from paradize.bake_gutter import measure_gutters

    return measure_gutters(**arguments)


def object_gutters(
    store: Store,
    scene: Scene,
    met: Mapping[str, Met],
    materials: Mapping[str, list[str]],
    data: Mapping[str, bytes],
    sha256: Mapping[str, str],
    jobs: int,
    force: bool,
) -> tuple[dict[str, dict[str, Any]], list[ParadizeError]]:
    """What measure_gutters returns, by the object's name, for objects with a colour map; and what failed.

    met: how the flight meets each object. materials: the names of its mesh's. data, sha256: by artifact.
    force: nothing is read from the store.
    """
    found: dict[str, dict[str, Any]] = {}
    work: list[Job] = []
    keys: dict[str, str] = {}
    for item in scene.objects:
        textures = {key: f"{item.name}_{key}" for key in MAPS if f"{item.name}_{key}" in data}
        if "color" not in textures:
            continue
        known = {name: item.materials.get(name, ObjectMaterial()) for name in materials[item.name]}
        settings: dict[str, Any] = {
            "name": item.name,
            "parallax": {
                name: (material.parallax_scale, material.parallax_bias) for name, material in known.items()
            },
            "bleed": item.bleed,
            "repeat": item.wrap == "repeat",
            "pixel_m": met[item.name].pixel_m,
        }
        mesh = f"{item.name}_mesh"
        hashes = {key: sha256[name] for key, name in textures.items()} | {"mesh": sha256[mesh]}
        key = key_of("gutters", code_digest("paradize.bake_gutter"), hashes, settings)
        kept = None if force else store.get_product(key)
        if isinstance(kept, dict) and {"repeat", "limits", "maps"} <= kept.keys():
            found[item.name] = kept
            continue
        keys[item.name] = key
        arguments = settings | {"glb": data[mesh], "textures": {k: data[n] for k, n in textures.items()}}
        code = code_of("paradize.bake_gutter")
        work.append(Job(item.name, measure, arguments, file=item.mesh, code=code))
    errors = []
    for outcome in run_jobs(work, min(jobs, len(work))) if work else []:
        if outcome.error:
            errors.append(outcome.error)
            continue
        found[outcome.name] = outcome.value
        store.put_product(keys[outcome.name], outcome.value)
    return found, errors

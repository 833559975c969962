"""What no view ever asks for is not published: finer mips, finer levels of detail.

Tasks make whole chains, for a mip is a mean of all finer ones, and so that another flight bakes nothing anew;
what a scene's views ask of them (required_detail.py, in a worker) decides what of each is published.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

from paradize.artifact import Artifact
from paradize.bakers.product import flat_errors
from paradize.build.artifacts import read_artifact
from paradize.build.entries import ASKED, FLAT, fits
from paradize.build.options import BuildOptions
from paradize.build.tasks import ZSTD_LEVEL
from paradize.build.work import run_work
from paradize.formats.ktx2.size import ktx2_size
from paradize.formats.scene_fields import Check
from paradize.jobs.code import code_digest, code_of
from paradize.jobs.pool import Job
from paradize.maps import maps_of
from paradize.scene.requirements import finest_scales, finest_shadow_texel_m, ground_sight
from paradize.scene.settings import Scene, SceneObject
from paradize.store.local import Store, key_of

if TYPE_CHECKING:
    from pathlib import Path

    from paradize.build.manifest import MeshFacts

_MODULE, _FLAT = "paradize.build.required_detail", "paradize.build.flat_colors"
_MOST_TILES_BYTES = 64_000_000  # larger terrains keep their textures whole
Asked = dict[str, dict[str, Any]]  # by artifact, as required_detail.measure_required_detail returns it


def asked_of(**arguments: Any) -> Asked:
    """In the worker: required_detail.measure_required_detail."""
    from paradize.build.required_detail import measure_required_detail

    return measure_required_detail(**arguments)


def flat_of(**arguments: Any) -> dict[str, int]:
    """In the worker: flat_colors.measure_flat."""
    from paradize.build.flat_colors import measure_flat

    return measure_flat(**arguments)


def ask(
    store: Store,
    scene: Scene,
    data: Mapping[str, bytes | Path],
    sha256: Mapping[str, str],
    facts: Mapping[str, MeshFacts],
    how: BuildOptions,
) -> Asked:
    """What the views ask of each texture and mesh; every object's is found out alone, and kept like any
    product. data, sha256, facts: by artifact. Raises what a worker raised."""
    work = []
    for arguments, meshes, decides in _parts(scene, data, facts):
        hashes = {name: sha256[name] for name in meshes}
        name = next(iter(arguments["things"]), "the scene")
        job = Job(f"what the flight asks of {name}", asked_of, arguments, code=code_of(_MODULE))
        work.append((key_of("asked", code_digest(_MODULE), hashes, decides), job))
    found: Asked = {}
    for told in _answers(store, work, ASKED, how):
        found |= told
    objects, work = [], []
    for item in scene.objects:
        names = [f"{item.name}_{key}" for key in maps_of("object")]
        names = [name for name in names if "others" in found.get(name, {})]
        if names:
            levels = {name.rpartition("_")[2]: found[name]["others"]["level"] for name in names}
            settings = {"name": item.name, "levels": levels, "repeat": item.wrap == "repeat"}
            mesh = f"{item.name}_mesh"
            hashes = {name: sha256[name] for name in (mesh, *names)}
            held = {name.rpartition("_")[2]: data[name] for name in names}
            arguments = settings | {"glb": data[mesh], "textures": held}
            job = Job(f"what swatches ask of {item.name}", flat_of, arguments, code=code_of(_FLAT))
            work.append((key_of("flat", code_digest(_FLAT), hashes, settings), job))
            objects.append(item.name)
    for name, kept in zip(objects, _answers(store, work, FLAT, how), strict=True):
        for key, level in kept.items():
            found[f"{name}_{key}"] = settled(found[f"{name}_{key}"], level)
    return found


def _answers(
    store: Store, work: Sequence[tuple[str, Job]], shape: Check, how: BuildOptions
) -> list[dict[str, Any]]:
    """What the jobs find out, by the store's keys: known there in this shape, or asked and kept."""
    if not how.force:
        store.expect([key for key, _ in work])
    found = {}
    for key, _ in work:
        kept = None if how.force else store.get_product(key)
        if fits(kept, shape):
            found[key] = kept
    left = [(key, job) for key, job in work if key not in found]
    for (key, _), outcome in zip(left, run_work(how, [job for _, job in left]), strict=True):
        if outcome.error:
            raise outcome.error
        store.put_product(key, outcome.value)
        found[key] = outcome.value
    return [found[key] for key, _ in work]


def settled(asked: Mapping[str, Any], kept: int) -> dict[str, Any]:
    """What is asked of a texture, of what bake_asked told of it with and without its flat triangles. kept:
    the level up to which these keep their colours (bake_flat)."""
    others: dict[str, Any] = asked["others"]
    if kept >= others["level"] and others["view"] is not None:
        return others
    told = {key: value for key, value in asked.items() if key != "others"}
    return told | {"level": max(told["level"], min(kept, others["level"]))}


Part = tuple[dict[str, Any], list[str], dict[str, Any]]


def _parts(scene: Scene, data: Mapping[str, bytes | Path], facts: Mapping[str, MeshFacts]) -> list[Part]:
    """Arguments of required_detail.measure_required_detail for each object, and for what is no object; with
    the meshes whose bytes are in them, and the rest of the arguments: what decides the answer."""
    sight = ground_sight(scene)
    sight["scales"] = finest_scales(scene)
    sight["light_m"] = finest_shadow_texel_m(scene)
    alone: dict[str, Any] = {"sight": sight, "things": {}, "ground": None, "water": None, "sky": None}
    found: list[Part] = []
    for item in scene.objects:
        thing, mesh = _thing(item, facts[f"{item.name}_mesh"], data), f"{item.name}_mesh"
        arguments = alone | {"things": {item.name: thing | {"glb": data[mesh]}}}
        found.append((arguments, [mesh], alone | {"things": {item.name: thing}}))
    decides, meshes, more = dict(alone), [], {}
    tiles = [name for name in data if name.startswith("terrain_mesh")] if scene.terrain else []
    if scene.terrain and sum(_size(data[name]) for name in tiles) <= _MOST_TILES_BYTES:
        meshes = tiles
        names = [f"{stem}_{key}" for stem in ("sand", "effect") for key in maps_of("ground")]
        repeat_m = scene.terrain.size_m[0] / scene.terrain.sand_repeat
        decides["ground"] = {"textures": _sizes(names, data), "repeat_m": repeat_m}
        held = [data[name] for name in tiles]
        files = [one if isinstance(one, bytes) else str(one) for one in held]
        more["ground"] = decides["ground"] | {"tiles": files}
    if scene.water:
        water = scene.water
        told = {"level_m": water.level_m, "size_m": water.size_m, "tile": water.tile}
        decides["water"] = {"textures": _sizes([f"water_{key}" for key in maps_of("water")], data)} | told
    if scene.sky and isinstance(cube := data["sky"], bytes):
        side, _, levels = ktx2_size(cube)
        decides["sky"] = {"side": side, "levels": levels, "smoothest": _smoothest(scene)}
    found.append((decides | more, meshes, decides))
    return found


def _thing(item: SceneObject, known: MeshFacts, data: Mapping[str, bytes | Path]) -> dict[str, Any]:
    """bake_asked.Thing's fields, but for the GLB."""
    sizes = _sizes([f"{item.name}_{key}" for key in maps_of("object")], data)
    materials = item.materials.values()
    deep = f"{item.name}_height" in sizes
    return {
        "textures": {name.rpartition("_")[2]: size for name, size in sizes.items()},
        "drawn": item.views,
        "spread": max((material.parallax_scale for material in materials), default=0.0) if deep else 0.0,
        "leaves": any(material.alpha_cutoff > 0.0 for material in materials),
        "instances": [asdict(instance) for instance in item.instances],
        "center": known.center,
        "radius_m": known.radius_m,
        "errors_m": [error_m for _, error_m in known.lods],
    }


def _smoothest(scene: Scene) -> float | None:
    """The largest smoothness of anything that mirrors the sky; None where nothing does."""
    found = [m.smoothness for item in scene.objects for m in item.materials.values() if m.specular > 0.0]
    if scene.terrain:
        found += [scene.terrain.smoothness, scene.terrain.wet_smoothness]
    return max(found, default=None)


def _size(data: bytes | Path) -> int:
    return len(data) if isinstance(data, bytes) else data.stat().st_size


def _sizes(names: list[str], data: Mapping[str, bytes | Path]) -> dict[str, tuple[int, int]]:
    found = {}
    for name in names:
        held = data.get(name)
        if isinstance(held, bytes):
            width, height, _ = ktx2_size(held)
            found[name] = (width, height)
    return found


def without(data: bytes, file: str, left: int) -> bytes:
    """A GLB or KTX2 without its `left` finest levels. Raises FormatError for what we did not write."""
    from paradize.formats.glb.cut import cut_glb
    from paradize.formats.ktx2.cut import cut_ktx2

    if file.endswith(".glb"):
        return cut_glb(data, finer=left, file=file)
    return cut_ktx2(data, left, zstd_level=ZSTD_LEVEL, file=file)


def sha256_without(data: bytes, file: str, left: int) -> str:
    """The SHA-256 of that."""
    return hashlib.sha256(without(data, file, left)).hexdigest()


def trimmed(one: Artifact, asked: Mapping[str, Any], path: Path) -> tuple[Artifact, bytes | None]:
    """An artifact without the levels that no view asks for, at most as many as its gutters allow; and its
    bytes, None where nothing is left out of those that `path` holds. Errors of a texture are then those of
    the finest level that is published. asked: as `ask` tells of it."""
    left = asked["level"] if one.max_level is None else min(asked["level"], one.max_level)
    data = read_artifact(path) if left else b""
    if left and one.kind != "mesh":
        from paradize.formats.ktx2.cut import can_cut

        width, height, levels = ktx2_size(data)
        left = min(left, levels - 1)
        fmt = one.format or ""
        while left and not can_cut(width, height, fmt, left):
            left -= 1
    rest = without(data, str(one.file), left) if left else None
    saved = 0 if rest is None else len(data) - len(rest)
    told = {"left_out": left, "saved_bytes": saved}
    told |= {key: asked[key] for key in ("texels", "second_s", "view")}
    one = replace(one, left_out=left, asked=told)
    if rest is None:
        return one, None
    finest, errors = one.levels[left:], dict(one.errors)
    if one.suffix == "ktx2" and finest:
        flat = flat_errors(one.name.rpartition("_")[2], finest[0])
        errors |= {metric: value for metric, value in flat.items() if metric in errors}
    if one.gutter is not None:
        gutter = cut_gutter(one.gutter | {"max_level": one.max_level}, left)
        one = replace(one, max_level=gutter.pop("max_level"), gutter=gutter)
    sha256 = hashlib.sha256(rest).hexdigest()
    return replace(one, sha256=sha256, bytes=len(rest), levels=finest, errors=errors), rest


def cut_gutter(facts: dict[str, Any], left: int) -> dict[str, Any]:
    """What is told of a map's gutters (gutter_limits.py) without its `left` finest levels."""
    part = float(1 << left)
    safe, width = facts["max_level"], facts["width_texels"]
    return facts | {
        "needed_texels": facts["needed_texels"] / part,
        "width_texels": None if width is None else width / part,
        "level_in_use": max(0, facts["level_in_use"] - left),
        "level_by_width": max(-1, facts["level_by_width"] - left),
        "max_level": None if safe is None else safe - left,
        "bleed_p99": facts["bleed_p99"][left:],
        "bleed_max": facts["bleed_max"][left:],
    }

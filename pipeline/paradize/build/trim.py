"""Leaves out what no view needs: the finest mips, the finest and the coarsest levels of detail.

Jobs bake whole chains, because each mip is a mean of the finer ones, and another flight then bakes nothing
again. required_detail.py, in a worker, finds what the scene's views need of each artifact.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from paradize.artifact import Artifact
from paradize.bakers.product import flat_errors
from paradize.bakers.registry import LARGEST_OF_LEVELS
from paradize.build.artifacts import read_artifact
from paradize.build.entries import FLAT, REQUIRED_DETAIL, fits
from paradize.build.measurements.switches import SEEN_OF_LEVELS
from paradize.build.options import BuildOptions
from paradize.build.tasks import ZSTD_LEVEL
from paradize.build.work import run_build_jobs
from paradize.formats.ktx2.size import ktx2_size
from paradize.formats.scene.fields import Check
from paradize.jobs.code import code_digest, code_of
from paradize.jobs.pool import Job
from paradize.map_table import maps_of
from paradize.scene.finest_views import COARSEST_LOD, finest_scales, finest_shadow_texel_m, scene_views
from paradize.scene.map_sets import SceneMaps
from paradize.scene.motion import stands
from paradize.scene.settings import Scene, SceneObject
from paradize.store.local import Store, key_of

if TYPE_CHECKING:
    from pathlib import Path

    from paradize.build.manifest import MeshFacts

_MODULE, _FLAT = "paradize.build.measurements.required_detail", "paradize.build.materials.flat_colors"
_MEASURED_LATER = {f"lod_{key}": key for key in ("mapped_p99_deg", "mapped_mean_deg", *SEEN_OF_LEVELS)}
_MOST_TILES_BYTES = 64_000_000  # larger terrains keep their textures whole
RequiredDetail = dict[
    str, dict[str, Any]
]  # by artifact, as required_detail.measure_required_detail returns it


def required_detail_job(**arguments: Any) -> RequiredDetail:
    """Calls required_detail.measure_required_detail, in a worker."""
    from paradize.build.measurements.required_detail import measure_required_detail

    return measure_required_detail(**arguments)


def flat_colors_job(**arguments: Any) -> dict[str, int]:
    """Calls flat_colors.measure_flat, in a worker."""
    from paradize.build.materials.flat_colors import measure_flat

    return measure_flat(**arguments)


def find_required_detail(
    store: Store,
    scene: Scene,
    maps: SceneMaps,
    data: Mapping[str, bytes | Path],
    sha256: Mapping[str, str],
    facts: Mapping[str, MeshFacts],
    options: BuildOptions,
) -> RequiredDetail:
    """Returns what the views need of each texture and mesh; of a texture that objects share, the most that
    any of them needs. Objects are measured separately; results are kept in the store. data, sha256, facts:
    by artifact. Raises the error of a worker."""
    keyed_jobs = []
    for arguments, meshes, decides in _queries(scene, maps, data, facts):
        hashes = {name: sha256[name] for name in meshes}
        name = next(iter(arguments["objects"]), "the scene")
        job = Job(f"required detail of {name}", required_detail_job, arguments, code=code_of(_MODULE))
        keyed_jobs.append((key_of("required_detail", code_digest(_MODULE), hashes, decides), job))
    *of_objects, of_scene = _stored_or_run(store, keyed_jobs, REQUIRED_DETAIL, options)
    measured, keyed_jobs = [], []
    for item, detail in zip(scene.objects, of_objects, strict=True):
        for map_set, materials in maps.of_object(item.name):
            names = {key: f"{map_set.name}_{key}" for key in maps_of("object")}
            names = {key: name for key, name in names.items() if "others" in detail.get(name, {})}
            if not names:
                continue
            levels = {key: detail[name]["others"]["level"] for key, name in names.items()}
            settings = {"name": map_set.name, "levels": levels, "wrap": map_set.wrap, "materials": materials}
            mesh = f"{item.name}_mesh"
            hashes = {name: sha256[name] for name in (mesh, *names.values())}
            textures = {key: data[name] for key, name in names.items()}
            arguments = settings | {"glb": data[mesh], "textures": textures}
            job = Job(
                f"flat colors of {item.name} {map_set.name}", flat_colors_job, arguments, code=code_of(_FLAT)
            )
            keyed_jobs.append((key_of("flat", code_digest(_FLAT), hashes, settings), job))
            measured.append((detail, names))
    answers = _stored_or_run(store, keyed_jobs, FLAT, options)
    for (detail, names), levels_kept in zip(measured, answers, strict=True):
        for key, level in levels_kept.items():
            detail[names[key]] = with_flat_colors(detail[names[key]], level)
    found: RequiredDetail = dict(of_scene)
    for name, one_detail in (part for detail in of_objects for part in detail.items()):
        found[name] = finest_of([found[name], one_detail]) if name in found else one_detail
    return found


def finest_of(details: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Returns the required detail of a texture with several users: the most that any of them needs."""
    most = min(details, key=_fineness)
    for detail in details:
        most = most | {"levels_s": _earlier(most["levels_s"], detail["levels_s"])}
    return most


def _earlier(a: Sequence[float | None], b: Sequence[float | None]) -> list[float | None]:
    """Returns of each level the earlier of two seconds; None: never."""
    return [
        min((value for value in pair if value is not None), default=None) for pair in zip(a, b, strict=True)
    ]


def _fineness(detail: Mapping[str, Any]) -> tuple[int, float]:
    """The order in which users of a texture decide how fine it is."""
    return detail["level"], float("inf") if detail["texels"] is None else detail["texels"]


def _stored_or_run(
    store: Store, keyed_jobs: Sequence[tuple[str, Job]], shape: Check, options: BuildOptions
) -> list[dict[str, Any]]:
    """Returns the results of jobs, by store key: from the store if they have this shape, else by running
    them."""
    if not options.force:
        store.expect([key for key, _ in keyed_jobs])
    answers = {}
    for key, _ in keyed_jobs:
        stored = None if options.force else store.get_product(key)
        if fits(stored, shape):
            answers[key] = stored
    missing = [(key, job) for key, job in keyed_jobs if key not in answers]
    for (key, _), outcome in zip(missing, run_build_jobs(options, [job for _, job in missing]), strict=True):
        if outcome.error:
            raise outcome.error
        store.put_product(key, outcome.value)
        answers[key] = outcome.value
    return [answers[key] for key, _ in keyed_jobs]


def with_flat_colors(detail: Mapping[str, Any], level: int) -> dict[str, Any]:
    """Returns the required detail of a texture, given that with and without its flat triangles. level: up
    to which flat triangles keep their colours (flat_colors.measure_flat)."""
    others: dict[str, Any] = detail["others"]
    if level >= others["level"] and others["view"] is not None:
        return others
    whole = {key: value for key, value in detail.items() if key != "others"}
    return whole | {"level": max(whole["level"], min(level, others["level"]))}


Part = tuple[dict[str, Any], list[str], dict[str, Any]]


def _queries(
    scene: Scene, maps: SceneMaps, data: Mapping[str, bytes | Path], facts: Mapping[str, MeshFacts]
) -> list[Part]:
    """Returns for each object, and last for the rest of the scene: the arguments of
    required_detail.measure_required_detail, the meshes whose bytes are among them, and the other
    arguments, which are part of the key."""
    flight_views = scene_views(scene)
    flight_views["scales"] = finest_scales(scene)
    flight_views["light_m"] = finest_shadow_texel_m(scene)
    empty: dict[str, Any] = {
        "flight_views": flight_views,
        "objects": {},
        "terrain": None,
        "water": None,
        "sky": None,
    }
    queries: list[Part] = []
    for item in scene.objects:
        mesh = f"{item.name}_mesh"
        seen_object = _seen_object(item, maps, facts[mesh], data)
        arguments = empty | {"objects": {item.name: seen_object | {"glb": data[mesh]}}}
        queries.append((arguments, [mesh], empty | {"objects": {item.name: seen_object}}))
    decides, meshes, with_data = dict(empty), [], {}
    tiles = [name for name in data if name.startswith("terrain_mesh")] if scene.terrain else []
    if scene.terrain and sum(_size(data[name]) for name in tiles) <= _MOST_TILES_BYTES:
        meshes = tiles
        names = [f"{stem}_{key}" for stem in ("sand", "effect") for key in maps_of("ground")]
        repeat_m = scene.terrain.size_m[0] / scene.terrain.sand_repeat
        decides["terrain"] = {"textures": _sizes(names, data), "repeat_m": repeat_m}
        tiles_data = [data[name] for name in tiles]
        files = [tile if isinstance(tile, bytes) else str(tile) for tile in tiles_data]
        with_data["terrain"] = decides["terrain"] | {"tiles": files}
    if scene.water:
        water = scene.water
        square = {"level_m": water.level_m, "size_m": water.size_m, "repeat": water.wave_repeat}
        decides["water"] = {"textures": _sizes([f"water_{key}" for key in maps_of("water")], data)} | square
    if scene.sky and not scene.daytime and isinstance(cube := data["sky"], bytes):
        side, _, levels = ktx2_size(cube)
        decides["sky"] = {"side": side, "levels": levels, "smoothest": _smoothest(scene, maps)}
    queries.append((decides | with_data, meshes, decides))
    return queries


def _seen_object(
    item: SceneObject, maps: SceneMaps, known: MeshFacts, data: Mapping[str, bytes | Path]
) -> dict[str, Any]:
    """Returns the fields of required_detail.SeenObject, without the GLB."""
    textures: dict[str, dict[str, Any]] = {}
    for map_set, materials in maps.of_object(item.name):
        drawn = [maps.objects[item.name].drawn[name] for name in materials]
        sizes = _sizes([f"{map_set.name}_{key}" for key in maps_of("object")], data)
        deep = (
            max(material.parallax_scale for material in drawn) if f"{map_set.name}_height" in sizes else 0.0
        )
        leaves = any(material.alpha_mode != "opaque" for material in drawn)
        textures |= {
            name: {
                "size": size,
                "materials": materials,
                "spread": max(deep, 0.0),
                "lit": leaves and name == f"{map_set.name}_color",
                "second": map_set.second,
            }
            for name, size in sizes.items()
        }
    return {
        "textures": textures,
        "drawn": item.views,
        "instances": stands(item),
        "center": known.center,
        "radius_m": known.radius_m,
        "errors_m": known.switch_m,
    }


def _smoothest(scene: Scene, maps: SceneMaps) -> float | None:
    """Returns the largest smoothness of anything that mirrors the sky; None if nothing does."""
    values = [
        material.smoothness
        for known in maps.objects.values()
        for material in known.drawn.values()
        if material.specular > 0.0 or material.metalness > 0.0
    ]
    if scene.terrain:
        values += [scene.terrain.smoothness, scene.terrain.wet_smoothness]
    return max(values, default=None)


def _size(data: bytes | Path) -> int:
    return len(data) if isinstance(data, bytes) else data.stat().st_size


def _sizes(names: list[str], data: Mapping[str, bytes | Path]) -> dict[str, tuple[int, int]]:
    sizes = {}
    for name in names:
        texture = data.get(name)
        if isinstance(texture, bytes):
            width, height, _ = ktx2_size(texture)
            sizes[name] = (width, height)
    return sizes


def without_levels(data: bytes, file: str, finer: int, coarser: int) -> bytes:
    """Returns a GLB or KTX2 without its `finer` finest levels, and a GLB without its `coarser` coarsest.
    Raises FormatError for bytes that Paradize did not write."""
    from paradize.formats.glb.cut import cut_glb
    from paradize.formats.ktx2.cut import cut_ktx2

    if file.endswith(".glb"):
        return cut_glb(data, finer=finer, coarser=coarser, file=file)
    return cut_ktx2(data, finer, zstd_level=ZSTD_LEVEL, file=file)


def sha256_without_levels(data: bytes, file: str, finer: int, coarser: int) -> str:
    """Returns the SHA-256 of without_levels."""
    return hashlib.sha256(without_levels(data, file, finer, coarser)).hexdigest()


def levels_never_drawn(scene: Scene, facts: MeshFacts, pixel_m: float | None) -> int:
    """How many of the coarsest levels of a mesh no view of the flight draws, at the player's coarsest quality
    either: those that take over where it is smaller than at its farthest. pixel_m: as ObjectSighting. 0 where
    a free camera may go farther, and where the flight never shows it."""
    if pixel_m is None or scene.free_camera is not None:
        return 0
    farthest_m = COARSEST_LOD * scene.head.lod_error_px * pixel_m
    drawn = [k for k, switch_m in enumerate(facts.switch_m) if switch_m <= farthest_m]
    return len(facts.switch_m) - 1 - max(drawn, default=0)


def trimmed(
    artifact: Artifact, detail: Mapping[str, Any], path: Path, coarser: int
) -> tuple[Artifact, bytes | None]:
    """Returns an artifact without the levels that no view needs, at most as many as its gutters allow; and
    its new bytes, None if nothing is left out. Errors are then those of the published levels, of a texture
    those of its finest. detail: as find_required_detail returns it. path: of its bytes. coarser: coarsest
    levels of a mesh that may go; one level stays."""
    left_out = detail["level"] if artifact.max_level is None else min(detail["level"], artifact.max_level)
    if artifact.kind == "mesh":
        coarser = max(0, min(coarser, len(artifact.levels) - 1 - left_out))
    data = read_artifact(path) if left_out or coarser else b""
    if left_out and artifact.kind != "mesh":
        from paradize.formats.ktx2.cut import can_cut

        width, height, levels = ktx2_size(data)
        left_out = min(left_out, levels - 1)
        fmt = artifact.format or ""
        while left_out and not can_cut(width, height, fmt, left_out):
            left_out -= 1
    rest = without_levels(data, str(artifact.file), left_out, coarser) if left_out or coarser else None
    saved = 0 if rest is None else len(data) - len(rest)
    record = {"left_out": left_out, "saved_bytes": saved}
    record |= {key: detail[key] for key in ("texels", "second_s", "view")}
    record["levels_s"] = detail["levels_s"][left_out : len(detail["levels_s"]) - coarser]
    record |= {"coarser_left_out": coarser} if coarser else {}
    artifact = replace(artifact, left_out=left_out, coarser_left_out=coarser, required_detail=record)
    if rest is None:
        return artifact, None
    finest, errors = artifact.levels[left_out : len(artifact.levels) - coarser], dict(artifact.errors)
    if coarser:
        errors |= {metric: value for metric, value in _of_levels(finest).items() if metric in errors}
    if artifact.suffix == "ktx2" and finest:
        flat = flat_errors(artifact.name.rpartition("_")[2], finest[0])
        errors |= {metric: value for metric, value in flat.items() if metric in errors}
    if artifact.gutter is not None:
        gutter = gutter_without_finest(artifact.gutter | {"max_level": artifact.max_level}, left_out)
        artifact = replace(artifact, max_level=gutter.pop("max_level"), gutter=gutter)
    elif artifact.max_level is not None:
        artifact = replace(artifact, max_level=artifact.max_level - left_out)
    sha256 = hashlib.sha256(rest).hexdigest()
    return replace(artifact, sha256=sha256, bytes=len(rest), levels=finest, errors=errors), rest


def _of_levels(levels: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """The errors of a mesh that budgets may limit: the largest of its levels, by metric."""
    return {
        metric: max(level[key] for level in levels)
        for metric, key in (LARGEST_OF_LEVELS | _MEASURED_LATER).items()
        if all(key in level for level in levels)
    }


def gutter_without_finest(facts: dict[str, Any], left_out: int) -> dict[str, Any]:
    """Returns the facts of a map's gutters (gutter_limits.py) without its `left_out` finest levels."""
    factor = float(1 << left_out)
    safe, width = facts["max_level"], facts["width_texels"]
    return facts | {
        "needed_texels": facts["needed_texels"] / factor,
        "width_texels": None if width is None else width / factor,
        "level_in_use": max(0, facts["level_in_use"] - left_out),
        "level_by_width": max(-1, facts["level_by_width"] - left_out),
        "max_level": None if safe is None else safe - left_out,
        "bleed_p99": facts["bleed_p99"][left_out:],
        "bleed_max": facts["bleed_max"][left_out:],
    }

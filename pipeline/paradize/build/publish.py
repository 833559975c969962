"""Publishes artifacts to a folder. Renaming scene.json is the only commit.

Artifacts carry their hash in the name, so the old scene.json and its files stay whole until the new one is in
place; files that it no longer names are then deleted. If anything fails, the old scene.json stays.

`publish` in order: collect, compare with the scene, measure, note late errors, trim, share, check totals,
write.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from paradize import player_limits
from paradize.artifact import Artifact
from paradize.build.artifacts import Artifacts, keep_artifact, read_artifact
from paradize.build.manifest import MeshFacts, build_manifest, mesh_facts
from paradize.build.materials.shared_textures import equal_textures, shared, with_equal_detail
from paradize.build.measurements.nearest_view import stored_pixels, stored_sightings
from paradize.build.measurements.object_measurements import measure_objects
from paradize.build.measurements.switches import with_levels_seen
from paradize.build.options import BuildContext
from paradize.build.provenance import BakeReport, strays
from paradize.build.ripple_circles import add_ripples
from paradize.build.tasks import Task
from paradize.build.tiers.auto_tier import LateErrors, TriedTiers
from paradize.build.trim import find_required_detail, levels_never_drawn, trimmed
from paradize.documents import SCENE_FILE, parse_json
from paradize.errors import BakeError, GroupedError, ParadizeError, SceneError, SourceError
from paradize.files import read_file
from paradize.formats.device import device_bytes
from paradize.formats.scene.manifest import encode_scene
from paradize.scene.budget import excesses
from paradize.scene.map_sets import SceneMaps
from paradize.scene.settings import Scene
from paradize.scene.sightings import ObjectSighting
from paradize.store.atomic import flush_folder, write_whole
from paradize.store.local import hash_file, stamp
from paradize.tiers import AUTO


@dataclass
class _Baked:
    """The baked artifacts, by name; each step replaces what it changes. data: paths of the bytes. meshes:
    facts of each object's mesh. flight_errors, tree: of the camera's path and of the terrain. gutters: by
    (object, map set), as gutter_limits.measure_gutters returns them. constants: of textures that are not
    published, because all their texels are equal. palettes: the coarsest level of a palette that shows the
    same colours; palettes_psnr_db: its PSNR against the finest."""

    artifacts: dict[str, Artifact]
    data: dict[str, Path] = field(default_factory=dict)
    meshes: dict[str, MeshFacts] = field(default_factory=dict)
    flight_errors: dict[str, float] = field(default_factory=dict)
    tree: dict[str, Any] | None = None
    gutters: dict[tuple[str, str], dict[str, Any]] = field(default_factory=dict)
    constants: dict[str, list[float]] = field(default_factory=dict)
    palettes: dict[str, int] = field(default_factory=dict)
    palettes_psnr_db: dict[str, float] = field(default_factory=dict)

    @property
    def hashes(self) -> dict[str, str]:
        return {name: str(artifact.sha256) for name, artifact in self.artifacts.items()}

    @property
    def tiles(self) -> set[str]:
        """The terrain's meshes, which together may not fit into memory."""
        return {
            name for name, artifact in self.artifacts.items() if artifact.kind == "mesh"
        } - self.meshes.keys()


def report_of(context: BuildContext, tasks: list[Task], tried: TriedTiers) -> BakeReport:
    """Returns the report of the baked artifacts and of what exceeds the budget. tried: from
    auto_tier.bake_jobs."""
    budget = context.scene.budget
    report = BakeReport(context.out, budget=budget.soft | budget.hard)
    for task in tasks:
        if task.error:
            report.errors += task.error.errors if isinstance(task.error, GroupedError) else [task.error]
        for output in task.outputs:
            product = task.products.get(output.product, Artifact(output.product))
            report.warnings += product.warnings
            if output.kind and product.constant is None:
                size = task.data[output.product].stat().st_size if product.sha256 else 0
                artifact = replace(
                    product, name=output.artifact, kind=output.kind, bytes=size, status=task.status
                )
                artifact = replace(artifact, seconds=round(task.seconds, 3), tried=tried.get(output.artifact))
                artifact = _with_excesses(context.scene, artifact)
                report.warnings += [f"{artifact.name}: {text}" for text in artifact.over]
                report.artifacts.append(artifact)
    report.warnings = list(dict.fromkeys(report.warnings))
    return report


def publish(
    context: BuildContext, maps: SceneMaps, tasks: list[Task], report: BakeReport, late_errors: LateErrors
) -> bool:
    """Publishes what the tasks baked, with a scene.json. Errors are added to the report; nothing is then
    published. Where errors were measured that change the choice of tier `auto`, they are added to
    `late_errors`, nothing is published, and True is returned: `auto` must choose again. Else False."""
    baked = _Baked({artifact.name: artifact for artifact in report.artifacts})
    try:
        _collect(baked, tasks)
        missing, without_triangles = _missing_materials(context, maps, baked)
        report.errors += missing + _too_large(context, baked)
        report.warnings += without_triangles
        if report.errors:
            return False
        report.warnings += [
            f"flight: {excess}" for excess in excesses(context.scene.budget, baked.flight_errors)
        ]
        sightings = _sightings(context, baked)
        normal_mapped = _measure_objects(context, maps, baked, sightings, report)
        if report.errors:
            return False
        if _note_late_errors(context.scene, baked, normal_mapped, late_errors):
            return True
        pixels = stored_pixels(
            context.store,
            context.scene,
            context.flight,
            baked.data,
            baked.hashes,
            force=context.options.force,
        )
        equal = equal_textures(maps, baked.artifacts)
        _trim(context, maps, baked, equal, sightings, report)
        baked.artifacts = shared(baked.artifacts, equal)
        baked.data = {name: data for name, data in baked.data.items() if name in baked.artifacts}
        _check_totals(context, baked, report)
        if report.errors:
            return False
        manifest, warnings = build_manifest(
            context.scene,
            maps=maps,
            owners={output.artifact: task.job.objects for task in tasks for output in task.outputs},
            flight=context.flight,
            flight_errors=baked.flight_errors,
            artifacts=baked.artifacts,
            facts=baked.meshes,
            sightings=sightings,
            gutters=baked.gutters,
            constants=baked.constants,
            pixels=pixels,
            terrain_tables=baked.tree,
        )
        report.warnings += warnings
        report.warnings += _add_ripples(context, baked, manifest)
        files = {
            str(artifact.file): (baked.data[name], artifact.sha256)
            for name, artifact in baked.artifacts.items()
        }
        report.warnings += _write(context.out, files, encode_scene(manifest))
    except ParadizeError as error:
        report.errors.append(error)
    finally:
        report.artifacts = list(baked.artifacts.values())
    return False


def _add_ripples(context: BuildContext, baked: _Baked, manifest: dict[str, Any]) -> list[str]:
    water = context.scene.water
    if water is None or water.ripple_height_m == 0.0:
        return []
    force = context.options.force
    return add_ripples(manifest, water.ripple_height_m, baked.data, baked.hashes, context.store, force=force)


def _with_excesses(scene: Scene, artifact: Artifact) -> Artifact:
    """Returns the artifact with the metrics that exceed the scene's budget."""
    return replace(artifact, over=[str(excess) for excess in excesses(scene.budget, artifact.errors)])


def _collect(baked: _Baked, tasks: list[Task]) -> None:
    """Notes where the bytes of all artifacts are, and reads facts of some."""
    for task in tasks:
        for output in task.outputs:
            data, product = task.data[output.product], task.products[output.product]
            if output.product == "flight":
                baked.flight_errors = product.errors
            if output.product == "tree":
                baked.tree = parse_json(read_artifact(data))
            if product.constant is not None:
                baked.constants[output.artifact] = product.constant
            elif output.kind:
                baked.data[output.artifact] = data
            if output.kind == "mesh" and not output.many:
                file = str(baked.artifacts[output.artifact].file)
                baked.meshes[output.artifact] = mesh_facts(read_artifact(data), file)


def _missing_materials(
    context: BuildContext, maps: SceneMaps, baked: _Baked
) -> tuple[list[ParadizeError], list[str]]:
    """Returns an error for each material that the scene sets and its model lacks, and a warning for each that
    the model has, but whose triangles were all dropped."""
    errors: list[ParadizeError] = []
    warnings: list[str] = []
    for i, item in enumerate(context.scene.objects):
        known = baked.meshes[f"{item.name}_mesh"].materials
        for material in item.materials:
            place = f"object[{i}].material.{material}"
            if material in known:
                continue
            if material in maps.objects[item.name].drawn:
                why = f"no triangle of this material in {item.mesh} has an area, so all were dropped"
                warnings.append(f"{context.scene_path}: {place}: sets nothing: {why}")
            else:
                mend = f"it has: {', '.join(known)}"
                what = f"the mesh of {item.name} has no such material"
                errors.append(SceneError(what, file=context.scene_path, place=place, mend=mend))
    return errors, warnings


def _too_large(context: BuildContext, baked: _Baked) -> list[ParadizeError]:
    """Returns an error for each mesh that is larger than the player takes one."""
    errors: list[ParadizeError] = []
    limit = f"limit {player_limits.LARGEST_M:g}"
    for item in {item.mesh: item for item in context.scene.objects}.values():
        facts = baked.meshes[f"{item.name}_mesh"]
        if facts.radius_m > player_limits.LARGEST_M:
            what = f"its radius is {facts.radius_m:g} metres, {limit}"
            errors.append(SourceError(what, file=item.mesh, mend="scale the model down"))
        elif facts.farthest > player_limits.LARGEST_M:
            what = f"a coordinate is {facts.farthest:g} metres, {limit}"
            mend = "scale the model down, or move it nearer to its origin"
            errors.append(SourceError(what, file=item.mesh, mend=mend))
    return errors


def _sightings(context: BuildContext, baked: _Baked) -> dict[str, ObjectSighting]:
    """Returns how the flight sees each object, by name."""
    objects = {item.name: baked.meshes[f"{item.name}_mesh"] for item in context.scene.objects}
    bounds = {name: (known.center, known.radius_m) for name, known in objects.items()}
    force = context.options.force
    return stored_sightings(context.store, context.scene, context.flight, bounds, force=force)


def _measure_objects(
    context: BuildContext,
    maps: SceneMaps,
    baked: _Baked,
    sightings: dict[str, ObjectSighting],
    report: BakeReport,
) -> list[str]:
    """Adds what is measured of each object's files together: the gutters of its maps, and the normal
    errors of its levels under its maps. Returns the names of the meshes whose levels were so measured."""
    scene = context.scene
    measured, errors = measure_objects(
        context.store,
        scene,
        maps=maps,
        sightings=sightings,
        errors_m=_errors_m(baked),
        data=baked.data,
        sha256=baked.hashes,
        options=context.options,
    )
    report.errors += errors
    if errors:
        return []
    baked.gutters = measured["gutters"]
    for (_, map_set), facts_of_set in baked.gutters.items():
        for key, facts in facts_of_set["maps"].items():
            if facts:
                rest = {name: value for name, value in facts.items() if name != "max_level"}
                name = f"{map_set}_{key}"
                baked.artifacts[name] = replace(
                    baked.artifacts[name], max_level=facts["max_level"], gutter=rest
                )
    for (_, map_set), palette in measured["palettes"].items():
        for key, facts in palette.items():
            name = f"{map_set}_{key}"
            before = baked.artifacts[name].max_level
            last = facts["max_level"] if before is None else min(before, facts["max_level"])
            baked.artifacts[name] = replace(baked.artifacts[name], max_level=last)
            for known, fact in ((baked.palettes, "level"), (baked.palettes_psnr_db, "level_psnr_db")):
                known[name] = min(facts[fact], known.get(name, facts[fact]))
    normal_mapped: dict[str, list[list[dict[str, float]]]] = {}  # levels of each set, by mesh
    for (owner, _), found in measured["lod_normal_error"].items():
        normal_mapped.setdefault(f"{owner}_mesh", []).append(found["levels"])
    for name, of_sets in normal_mapped.items():
        mesh = baked.artifacts[name]
        levels = [
            {key: max(level[key] for level in same) for key in same[0]} for same in zip(*of_sets, strict=True)
        ]
        worst = {
            f"lod_{key}": max(level[key] for level in levels) for key in ("mapped_p99_deg", "mapped_mean_deg")
        }
        levels_with_errors = [
            level | errors_found for level, errors_found in zip(mesh.levels, levels, strict=True)
        ]
        over = [str(excess) for excess in excesses(scene.budget, worst)]
        report.warnings += [f"{mesh.name}: {text}" for text in over]
        baked.artifacts[mesh.name] = replace(
            mesh, levels=levels_with_errors, errors=mesh.errors | worst, over=[*mesh.over, *over]
        )
    for (owner, _), found in measured["lods_seen"].items():
        _take_levels(context, baked, owner, found["levels"], report)
    return sorted({*normal_mapped, *(f"{owner}_mesh" for owner, _ in measured["lods_seen"])})


def _take_levels(
    context: BuildContext,
    baked: _Baked,
    owner: str,
    seen: list[dict[str, Any]],
    report: BakeReport,
) -> None:
    """Notes where the levels of an object's mesh take over."""
    name = f"{owner}_mesh"
    before = {f"{name}: {text}" for text in baked.artifacts[name].over}
    mesh, facts = with_levels_seen(context.scene, baked.artifacts[name], baked.meshes[name], seen)
    mesh = _with_excesses(context.scene, mesh)
    baked.artifacts[name], baked.meshes[name] = mesh, facts
    now = [f"{name}: {text}" for text in mesh.over]
    report.warnings = [text for text in report.warnings if text not in before] + now


def _errors_m(baked: _Baked) -> dict[str, list[float]]:
    """Returns the errors of the levels of each mesh, metres."""
    return {name: [error_m for _, error_m in facts.lods] for name, facts in baked.meshes.items()}


def _note_late_errors(scene: Scene, baked: _Baked, meshes: list[str], late_errors: LateErrors) -> bool:
    """Adds to `late_errors` the errors of meshes that `auto` chose and that exceed their budget under their
    maps, which were not known when it chose. Returns whether there are any."""
    is_new = False
    for name in meshes:
        artifact = baked.artifacts[name]
        if (
            not artifact.tried
            or artifact.tried["requested"] != AUTO
            or artifact.tried["taken"] in late_errors.get(name, {})
        ):
            continue
        late = ("lod_mapped_", "lod_seen_")
        errors = {metric: value for metric, value in artifact.errors.items() if metric.startswith(late)}
        if excesses(scene.budget, errors):
            late_errors.setdefault(name, {})[artifact.tried["taken"]] = errors
            is_new = True
    return is_new


def _trim(
    context: BuildContext,
    maps: SceneMaps,
    baked: _Baked,
    equal: list[list[str]],
    sightings: dict[str, ObjectSighting],
    report: BakeReport,
) -> None:
    """Leaves out of every artifact the levels that no view needs. equal: names of equal textures."""
    if context.options.whole:
        return
    data = Artifacts(baked.data, baked.tiles)
    needed = find_required_detail(
        context.store,
        context.scene,
        maps=maps,
        data=data,
        sha256=baked.hashes,
        facts=baked.meshes,
        options=context.options,
    )
    detail = with_equal_detail(needed, baked.palettes, equal)
    for name, required in detail.items():
        artifact = baked.artifacts[name]
        if artifact.kind == "mesh" and name not in baked.meshes:
            continue
        coarser = 0
        if name in baked.meshes:
            pixel_m = sightings[name.removesuffix("_mesh")].pixel_m
            coarser = levels_never_drawn(context.scene, baked.meshes[name], pixel_m)
        baked.artifacts[name], rest = trimmed(artifact, required, baked.data[name], coarser)
        if rest is None:
            continue
        if baked.artifacts[name].left_out > needed[name]["level"]:  # views see the loss
            metric, errors = f"{name.rpartition('_')[2]}_psnr_db", dict(baked.artifacts[name].errors)
            if metric in errors:
                errors[metric] = min(errors[metric], baked.palettes_psnr_db[name])
            baked.artifacts[name] = replace(baked.artifacts[name], errors=errors)
        before = [f"{name}: {text}" for text in baked.artifacts[name].over]
        baked.artifacts[name] = _with_excesses(context.scene, baked.artifacts[name])
        gone = {*before} - {f"{name}: {text}" for text in baked.artifacts[name].over}
        report.warnings = [text for text in report.warnings if text not in gone]
        baked.data[name] = keep_artifact(context.store, rest)[1]
        if name in baked.meshes:
            finer, coarser = baked.artifacts[name].left_out, baked.artifacts[name].coarser_left_out
            known = baked.meshes[name]
            kept = slice(finer, len(known.lods) - coarser)
            nodes = tuple((f"lod{k}", error_m) for k, (_, error_m) in enumerate(known.lods[kept]))
            baked.meshes[name] = replace(known, lods=nodes, switch_m=known.switch_m[kept])


def _check_totals(context: BuildContext, baked: _Baked, report: BakeReport) -> None:
    """Compares the sums of all artifacts with the budget: warnings; with tier `auto` hard limits are
    errors."""
    budget = context.scene.budget
    sums = {}
    if "folder_mb" in budget.aim:
        sums["folder_mb"] = sum(artifact.bytes for artifact in baked.artifacts.values()) / 1e6
    if "gpu_mb" in budget.aim:
        sums["gpu_mb"] = sum(device_bytes(read_artifact(data)) for data in baked.data.values()) / 1e6
    over = excesses(budget, sums)
    if (context.options.tier or context.scene.head.tier) == AUTO:
        mend = "take something out, or allow more"
        report.errors += [
            SceneError(str(excess), file=context.scene_path, place=f"budget.{excess.metric}", mend=mend)
            for excess in over
            if excess.hard
        ]
    if not report.errors:
        report.warnings += [f"scene: {excess}" for excess in over]


def _write(out: Path, files: dict[str, tuple[Path, str | None]], manifest: bytes) -> list[str]:
    """Writes artifacts (file name -> source file, SHA-256), then scene.json; then deletes files that it does
    not name. Returns warnings.

    Raises BakeError if the folder cannot be written; scene.json is then the old one, and new artifacts are
    deleted. Where scene.json is the new one and cannot be flushed, they stay.
    """
    wrote: list[tuple[Path, bool]] = []  # and whether a damaged file stood there
    scene = out / SCENE_FILE
    try:
        for name, (data, sha256) in files.items():
            path = out / name
            if not _is_file(path, data.stat().st_size, sha256):
                was_there = os.path.lexists(path)
                write_whole(path, data, flush=False, sha256=sha256, owned=True)
                wrote.append((path, was_there))
        if wrote:
            flush_folder(out)  # before scene.json, which names them
        if not _has_bytes(scene, manifest):
            write_whole(scene, manifest, owned=True)
    except BakeError:
        is_named = _has_bytes(scene, manifest)
        for path, was_there in wrote:
            if not was_there and not is_named:
                _removed(path)
        raise
    return [text for path in strays(out, files) for text in _removed(path)]


def _is_file(path: Path, size: int, sha256: str | None) -> bool:
    """Whether a file has this size and hash."""
    known = stamp(path)
    try:
        return known is not None and known[0] == size and hash_file(path) == sha256
    except BakeError:
        return False


def _has_bytes(path: Path, data: bytes) -> bool:
    """Whether a file holds these bytes."""
    try:
        return read_file(path, len(data)) == data
    except OSError:
        return False


def _removed(path: Path) -> list[str]:
    """Deletes a file. Returns a warning if that fails."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        return [f"{path} is of no use and cannot be removed: {error.strerror}"]
    return []

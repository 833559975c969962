"""Artifacts -> a folder, published with one commit: the renaming of scene.json.

Artifacts carry their hash in the name, so the old scene.json and its files stay whole until the new one
stands; files that it no longer names are swept afterwards. If anything fails, the old scene.json stays.

`publish` reads in order: collect, compare with the scene, measure, learn, trim, limit, write.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from paradize.artifact import Artifact
from paradize.build.artifacts import Artifacts, keep_artifact, read_artifact
from paradize.build.auto_tier import Later, Tried
from paradize.build.manifest import MeshFacts, build_manifest, mesh_facts
from paradize.build.nearest_view import known_pixels
from paradize.build.object_measurements import measure_objects
from paradize.build.options import BuildContext
from paradize.build.provenance import BakeReport, strays
from paradize.build.tasks import Task
from paradize.build.tier_choice import AUTO
from paradize.build.trim import ask, trimmed
from paradize.documents import SCENE_FILE, parse_json
from paradize.errors import BakeError, GroupedError, ParadizeError, SceneError
from paradize.files import read_file
from paradize.formats.device import device_bytes
from paradize.formats.scene_manifest import encode_scene
from paradize.scene.budget import excesses
from paradize.scene.requirements import ObjectSighting, meet
from paradize.scene.settings import Scene
from paradize.store.atomic import flush_folder, write_whole
from paradize.store.local import hash_file, stamp


@dataclass
class _Made:
    """What the tasks made, by artifact; each step below replaces what it changes. data: where the bytes are.
    meshes: what is read of each object's. flight_errors, tree: of the camera's path and of the terrain.
    gutters: by object, as gutter_limits.measure_gutters returns them."""

    artifacts: dict[str, Artifact]
    data: dict[str, Path] = field(default_factory=dict)
    meshes: dict[str, MeshFacts] = field(default_factory=dict)
    flight_errors: dict[str, float] = field(default_factory=dict)
    tree: dict[str, Any] | None = None
    gutters: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def hashes(self) -> dict[str, str]:
        return {name: str(one.sha256) for name, one in self.artifacts.items()}

    @property
    def tiles(self) -> set[str]:
        """The terrain's meshes, of which there may be more than memory holds."""
        return {name for name, one in self.artifacts.items() if one.kind == "mesh"} - self.meshes.keys()


def report_of(context: BuildContext, tasks: list[Task], tried: Tried) -> BakeReport:
    """What was baked, and what is beyond its budget. tried: as auto_tier.bake_orders tells it."""
    budget = context.scene.budget
    report = BakeReport(context.out, budget=budget.soft | budget.hard)
    for task in tasks:
        if task.error:
            report.errors += task.error.errors if isinstance(task.error, GroupedError) else [task.error]
        for want in task.wants:
            made = task.products.get(want.product, Artifact(want.product))
            report.warnings += made.warnings
            if want.kind:
                size = task.data[want.product].stat().st_size if made.sha256 else 0
                one = replace(made, name=want.artifact, kind=want.kind, bytes=size, status=task.status)
                one = replace(one, seconds=round(task.seconds, 3), tried=tried.get(want.artifact))
                one = _judged(context.scene, one)
                report.warnings += [f"{one.name}: {text}" for text in one.over]
                report.artifacts.append(one)
    report.warnings = list(dict.fromkeys(report.warnings))
    return report


def publish(context: BuildContext, tasks: list[Task], report: BakeReport, later: Later) -> bool:
    """Publishes what the tasks made, with a scene.json; adds what goes wrong to the report's errors, and then
    nothing is published. False, and nothing is published either, where it measured what `auto` must know:
    added to `later`."""
    made = _Made({one.name: one for one in report.artifacts})
    try:
        _collect(made, tasks)
        report.errors += _missing_materials(context, made)
        if report.errors:
            return True
        report.warnings += [
            f"flight: {excess}" for excess in excesses(context.scene.budget, made.flight_errors)
        ]
        met = _sightings(context, made)
        bumps = _measure(context, made, met, report)
        if report.errors:
            return True
        if _learn(context.scene, made, bumps, later):
            return False
        pixels = known_pixels(
            context.store, context.scene, context.flight, made.data, made.hashes, force=context.how.force
        )
        _trim(context, made)
        _limit(context, made, report)
        if report.errors:
            return True
        manifest = build_manifest(
            context.scene,
            context.flight,
            made.flight_errors,
            made.artifacts,
            made.meshes,
            met,
            made.gutters,
            pixels,
            made.tree,
        )
        files = {str(one.file): (made.data[name], one.sha256) for name, one in made.artifacts.items()}
        report.warnings += _write(context.out, files, encode_scene(manifest))
    except ParadizeError as error:
        report.errors.append(error)
    finally:
        report.artifacts = list(made.artifacts.values())
    return True


def _judged(scene: Scene, one: Artifact) -> Artifact:
    """With the metrics that are beyond the scene's budget."""
    return replace(one, over=[str(excess) for excess in excesses(scene.budget, one.errors)])


def _collect(made: _Made, tasks: list[Task]) -> None:
    """Where the bytes of all artifacts are, and what is read of some."""
    for task in tasks:
        for want in task.wants:
            data, product = task.data[want.product], task.products[want.product]
            if want.product == "flight":
                made.flight_errors = product.errors
            if want.product == "tree":
                made.tree = parse_json(read_artifact(data))
            if want.kind:
                made.data[want.artifact] = data
            if want.kind == "mesh" and not want.many:
                file = str(made.artifacts[want.artifact].file)
                made.meshes[want.artifact] = mesh_facts(read_artifact(data), file)


def _missing_materials(context: BuildContext, made: _Made) -> list[ParadizeError]:
    """The materials that the scene sets and its meshes lack."""
    errors: list[ParadizeError] = []
    for i, item in enumerate(context.scene.objects):
        known = made.meshes[f"{item.name}_mesh"].materials
        for material in item.materials:
            if material not in known:
                place = f"object[{i}].material.{material}"
                mend = f"it has: {', '.join(known)}"
                what = f"the mesh of {item.name} has no such material"
                errors.append(SceneError(what, file=context.scene_path, place=place, mend=mend))
    return errors


def _sightings(context: BuildContext, made: _Made) -> dict[str, ObjectSighting]:
    """How the flight meets each object."""
    objects = {item.name: made.meshes[f"{item.name}_mesh"] for item in context.scene.objects}
    bounds = {name: (known.center, known.radius_m) for name, known in objects.items()}
    return meet(context.scene, context.flight, bounds)


def _measure(
    context: BuildContext, made: _Made, met: dict[str, ObjectSighting], report: BakeReport
) -> list[str]:
    """Adds what is measured of each object's files together: the gutters of its maps, and its levels of
    detail under its normal map. Returns the meshes of those with a normal map."""
    scene = context.scene
    names = {item.name: list(made.meshes[f"{item.name}_mesh"].materials) for item in scene.objects}
    measured, errors = measure_objects(context.store, scene, met, names, made.data, made.hashes, context.how)
    report.errors += errors
    if errors:
        return []
    made.gutters = measured["gutters"]
    for owner, told in made.gutters.items():
        for key, facts in told["maps"].items():
            if facts:
                rest = {name: value for name, value in facts.items() if name != "max_level"}
                name = f"{owner}_{key}"
                made.artifacts[name] = replace(
                    made.artifacts[name], max_level=facts["max_level"], gutter=rest
                )
    for owner, told in measured["bumps"].items():
        mesh = made.artifacts[f"{owner}_mesh"]
        levels = told["levels"]
        worst = {
            f"lod_{key}": max(level[key] for level in levels) for key in ("mapped_p99_deg", "mapped_mean_deg")
        }
        more = [level | found for level, found in zip(mesh.levels, levels, strict=True)]
        over = [str(excess) for excess in excesses(scene.budget, worst)]
        report.warnings += [f"{mesh.name}: {text}" for text in over]
        made.artifacts[mesh.name] = replace(
            mesh, levels=more, errors=mesh.errors | worst, over=[*mesh.over, *over]
        )
    return [f"{owner}_mesh" for owner in measured["bumps"]]


def _learn(scene: Scene, made: _Made, meshes: list[str], later: Later) -> bool:
    """Whether a mesh that `auto` chose is beyond its budget under its normal map, which was not known then:
    its errors with that tier are added to `later`."""
    learnt = False
    for name in meshes:
        one = made.artifacts[name]
        if not one.tried or one.tried["asked"] != AUTO or one.tried["taken"] in later.get(name, {}):
            continue
        found = {metric: value for metric, value in one.errors.items() if metric.startswith("lod_mapped_")}
        if excesses(scene.budget, found):
            later.setdefault(name, {})[one.tried["taken"]] = found
            learnt = True
    return learnt


def _trim(context: BuildContext, made: _Made) -> None:
    """Takes out of everything what no view asks for."""
    if context.how.whole:
        return
    data = Artifacts(made.data, made.tiles)
    asked = ask(context.store, context.scene, data, made.hashes, made.meshes, context.how)
    for name, wanted in asked.items():
        one = made.artifacts[name]
        if one.kind == "mesh" and name not in made.meshes:
            continue
        made.artifacts[name], rest = trimmed(one, wanted, made.data[name])
        if rest is None:
            continue
        made.artifacts[name] = _judged(context.scene, made.artifacts[name])
        made.data[name] = keep_artifact(context.store, rest)[1]
        if name in made.meshes:
            lods = made.meshes[name].lods[made.artifacts[name].left_out :]
            known = tuple((f"lod{k}", error_m) for k, (_, error_m) in enumerate(lods))
            made.meshes[name] = replace(made.meshes[name], lods=known)


def _limit(context: BuildContext, made: _Made, report: BakeReport) -> None:
    """Compares all artifacts together with the budget: warnings; errors of a hard limit with tier `auto`."""
    budget = context.scene.budget
    sums = {}
    if "folder_mb" in budget.aim:
        sums["folder_mb"] = sum(one.bytes for one in made.artifacts.values()) / 1e6
    if "gpu_mb" in budget.aim:
        sums["gpu_mb"] = sum(device_bytes(read_artifact(data)) for data in made.data.values()) / 1e6
    over = excesses(budget, sums)
    if (context.how.tier or context.scene.head.tier) == AUTO:
        mend = "take something out, or allow more"
        report.errors += [
            SceneError(str(one), file=context.scene_path, place=f"budget.{one.metric}", mend=mend)
            for one in over
            if one.hard
        ]
    if not report.errors:
        report.warnings += [f"scene: {one}" for one in over]


def _write(out: Path, files: dict[str, tuple[Path, str | None]], manifest: bytes) -> list[str]:
    """Writes artifacts (file name -> the file that holds them, SHA-256), then scene.json, then sweeps what it
    no longer names; returns warnings.

    Raises BakeError when the folder cannot be written; scene.json is then the old one.
    """
    wrote = False
    for name, (data, sha256) in files.items():
        path = out / name
        if not _is_file(path, data.stat().st_size, sha256):
            write_whole(path, data, flush=False, sha256=sha256, owned=True)
            wrote = True
    if wrote:
        flush_folder(out)  # their names stand before the one that names them
    scene = out / SCENE_FILE
    if not _holds(scene, manifest):
        write_whole(scene, manifest, owned=True)
    return [text for path in strays(out, files) for text in _removed(path)]


def _is_file(path: Path, size: int, sha256: str | None) -> bool:
    """Whether a file has this size and hash."""
    was = stamp(path)
    try:
        return was is not None and was[0] == size and hash_file(path) == sha256
    except BakeError:
        return False


def _holds(path: Path, data: bytes) -> bool:
    """Whether a file holds these bytes."""
    try:
        return read_file(path, len(data)) == data
    except OSError:
        return False


def _removed(path: Path) -> list[str]:
    """Removes a file; a warning where that is refused."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        return [f"{path} is of no use and cannot be removed: {error.strerror}"]
    return []

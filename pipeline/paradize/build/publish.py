"""Artifacts -> a folder, published with one commit: the renaming of scene.json.

Artifacts carry their hash in the name, so the old scene.json and its files stay whole until the new one
stands; files that it no longer names are swept afterwards. If anything fails, the old scene.json stays.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from paradize.build.artifacts import Artifacts, keep_artifact, read_artifact
from paradize.build.auto_tier import Later, Tried
from paradize.build.manifest import MeshFacts, build_manifest, mesh_facts
from paradize.build.nearest_view import known_pixels
from paradize.build.object_measurements import measure_objects
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport, strays
from paradize.build.tasks import MEASURED, Task
from paradize.build.tier_choice import AUTO
from paradize.build.trim import Asked, ask, cut, cut_gutter, cut_row
from paradize.documents import SCENE_FILE, parse_json
from paradize.errors import BakeError, GroupedError, ParadizeError, SceneError
from paradize.files import read_file
from paradize.formats.device import device_bytes
from paradize.formats.scene_manifest import encode_scene
from paradize.scene.budget import excesses
from paradize.scene.flight import Flight
from paradize.scene.requirements import meet
from paradize.scene.settings import Scene
from paradize.store.atomic import flush_folder, write_whole
from paradize.store.local import Store, hash_file, stamp


def report_of(scene: Scene, out: Path, tasks: list[Task], tried: Tried) -> BakeReport:
    """What was baked, and what is beyond its budget. tried: as auto_tier.bake_orders tells it."""
    report = BakeReport(out, budget=scene.budget.soft | scene.budget.hard)
    for task in tasks:
        if task.error:
            report.errors += task.error.errors if isinstance(task.error, GroupedError) else [task.error]
        for want in task.wants:
            product = task.products.get(want.product)
            report.warnings += product["warnings"] if product else []
            if not want.kind:
                continue
            row: dict[str, Any] = {"name": want.artifact, "file": None, "sha256": None, "bytes": 0}
            row |= {"tier": None, "errors": {}, "status": task.status, "seconds": round(task.seconds, 3)}
            row |= {"levels": [], "format": None, "reason": None, "filter": None}
            row["tried"] = tried.get(want.artifact)
            if product:
                file = f"{want.artifact}-{product['sha256'][:8]}.{product['suffix']}"
                size = task.data[want.product].stat().st_size
                row |= {"file": file, "sha256": product["sha256"], "bytes": size}
                row |= {key: product[key] for key in MEASURED}
            row["over"] = [str(excess) for excess in excesses(scene.budget, row["errors"])]
            report.warnings += [f"{want.artifact}: {text}" for text in row["over"]]
            report.artifacts.append(row)
    report.warnings = list(dict.fromkeys(report.warnings))
    return report


def _lit(scene: Scene, row: dict[str, Any], bumps: list[dict[str, float]]) -> list[str]:
    """Adds what was measured of a mesh's levels under its bumps to its row; warnings, of budgets exceeded."""
    row["levels"] = [level | more for level, more in zip(row["levels"], bumps, strict=True)]
    worst = {
        f"lod_{key}": max(level[key] for level in bumps) for key in ("mapped_p99_deg", "mapped_mean_deg")
    }
    row["errors"] = row["errors"] | worst
    over = [str(excess) for excess in excesses(scene.budget, worst)]
    row["over"] = [*row["over"], *over]
    return [f"{row['name']}: {text}" for text in over]


def _learnt(scene: Scene, row: dict[str, Any], later: Later) -> bool:
    """Whether a mesh that `auto` chose is beyond its budget under its bumps, which was not known then: its
    errors with that tier are added to `later`."""
    tried = row["tried"]
    if not tried or tried["asked"] != AUTO or tried["taken"] in later.get(row["name"], {}):
        return False
    found = {metric: value for metric, value in row["errors"].items() if metric.startswith("lod_mapped_")}
    if not excesses(scene.budget, found):
        return False
    later.setdefault(row["name"], {})[tried["taken"]] = found
    return True


def commit(
    store: Store,
    scene: Scene,
    scene_path: Path,
    flight: Flight,
    out: Path,
    tasks: list[Task],
    report: BakeReport,
    how: BuildOptions,
    later: Later,
) -> bool:
    """Measures the gutters, builds scene.json and publishes everything; adds what goes wrong to the report's
    errors. False, and nothing is published, where it measured what `auto` must know: added to `later`."""
    entries: dict[str, dict[str, Any]] = {}
    files: dict[str, tuple[Path, str]] = {}
    facts = {}
    rows = {row["name"]: row for row in report.artifacts}
    tried = {name: row["tried"] for name, row in rows.items() if row["tried"]}
    flight_errors: dict[str, float] = {}
    ground: dict[str, Any] | None = None
    try:
        for task in tasks:
            for want in task.wants:
                data, product = task.data[want.product], task.products[want.product]
                if want.product == "flight":
                    flight_errors = product["errors"]
                if want.product == "tree":
                    ground = parse_json(read_artifact(data))
                if not want.kind:
                    continue
                row = rows[want.artifact]
                files[row["file"]] = (data, row["sha256"])
                entries[want.artifact] = {"file": row["file"], "kind": want.kind} | {
                    key: row[key] for key in ("sha256", "bytes", "tier", "errors", "levels")
                }
                if want.kind == "mesh" and not want.many:
                    facts[want.artifact] = mesh_facts(read_artifact(data), row["file"])
        for i, item in enumerate(scene.objects):
            known = facts[f"{item.name}_mesh"].materials
            for material in item.materials:
                if material not in known:
                    place = f"object[{i}].material.{material}"
                    mend = f"it has: {', '.join(known)}"
                    what = f"the mesh of {item.name} has no such material"
                    report.errors.append(SceneError(what, file=scene_path, place=place, mend=mend))
        if report.errors:
            return True
        report.warnings += [f"flight: {excess}" for excess in excesses(scene.budget, flight_errors)]
        objects = {item.name: facts[f"{item.name}_mesh"] for item in scene.objects}
        bounds = {name: (known.center, known.radius_m) for name, known in objects.items()}
        met = meet(scene, flight, bounds)
        names = {name: list(known.materials) for name, known in objects.items()}
        held = {name: files[entry["file"]][0] for name, entry in entries.items()}
        tiles = {name for name, entry in entries.items() if entry["kind"] == "mesh"} - facts.keys()
        texels = Artifacts(held, tiles)
        hashes = {name: entry["sha256"] for name, entry in entries.items()}
        measured, errors = measure_objects(store, scene, met, names, held, hashes, how)
        report.errors += errors
        if errors:
            return True
        gutters = measured["gutters"]
        for name, bumps in measured["bumps"].items():
            mesh = rows[f"{name}_mesh"]
            report.warnings += _lit(scene, mesh, bumps["levels"])
            entries[mesh["name"]] |= {key: mesh[key] for key in ("errors", "levels")}
        learnt = [_learnt(scene, rows[f"{name}_mesh"], later) for name in measured["bumps"]]
        if any(learnt):
            return False
        pixels = known_pixels(store, scene, flight, held, hashes, force=how.force)
        asked = {} if how.whole else ask(store, scene, texels, hashes, facts, how)
        told = _cut(store, asked, scene, rows, entries, files, facts, gutters)
        over = excesses(scene.budget, _sums(scene, [data for data, _ in files.values()]))
        if (how.tier or scene.head.tier) == AUTO:
            mend = "take something out, or allow more"
            for one in over:
                if one.hard:
                    error = SceneError(str(one), file=scene_path, place=f"budget.{one.metric}", mend=mend)
                    report.errors.append(error)
            if report.errors:
                return True
        report.warnings += [f"scene: {one}" for one in over]
        manifest = encode_scene(
            build_manifest(
                scene, flight, flight_errors, entries, facts, met, gutters, pixels, ground, tried, told
            )
        )
        report.warnings += _publish(out, files, manifest)
    except ParadizeError as error:
        report.errors.append(error)
    return True


def _sums(scene: Scene, files: list[Path]) -> dict[str, float]:
    """What the budget limits of all artifacts together, in MB."""
    found = {}
    if "folder_mb" in scene.budget.aim:
        found["folder_mb"] = sum(data.stat().st_size for data in files) / 1e6
    if "gpu_mb" in scene.budget.aim:
        found["gpu_mb"] = sum(device_bytes(read_artifact(data)) for data in files) / 1e6
    return found


def _cut(
    store: Store,
    asked: Asked,
    scene: Scene,
    rows: dict[str, dict[str, Any]],
    entries: dict[str, dict[str, Any]],
    files: dict[str, tuple[Path, str]],
    facts: dict[str, MeshFacts],
    gutters: dict[str, dict[str, Any]],
) -> dict[str, dict[str, Any]]:
    """Takes out of everything what no view asks for; by artifact, what scene.json tells of that."""
    found = {}
    for name, wanted in asked.items():
        row = rows[name]
        kind, (owner, _, key) = entries[name]["kind"], name.rpartition("_")
        if kind == "mesh" and name not in facts:
            continue
        maps = gutters[owner]["maps"] if owner in gutters else {}
        facts_of_map = maps.get(key)
        most = facts_of_map["max_level"] if facts_of_map else None
        rest, found[name] = cut(wanted, kind, row, files[row["file"]][0], most)
        row["left_out"] = left = found[name]["left_out"]
        if rest is None:
            continue
        del files[row["file"]]
        row |= cut_row(row, rest, left)
        row["over"] = [str(excess) for excess in excesses(scene.budget, row["errors"])]
        files[row["file"]] = (keep_artifact(store, rest)[1], row["sha256"])
        entries[name] |= {fact: row[fact] for fact in ("file", "sha256", "bytes", "errors", "levels")}
        if facts_of_map:
            maps[key] = cut_gutter(facts_of_map, left)
        if name in facts:
            lods = facts[name].lods[left:]
            known = tuple((f"lod{k}", error_m) for k, (_, error_m) in enumerate(lods))
            facts[name] = replace(facts[name], lods=known)
    return found


def _publish(out: Path, files: dict[str, tuple[Path, str]], manifest: bytes) -> list[str]:
    """Writes artifacts (file name -> the file that holds them, SHA-256), then scene.json, then sweeps what it
    no longer names; returns warnings.

    Raises BakeError when the folder cannot be written; scene.json is then the old one.
    """
    wrote = False
    for name, (data, sha256) in files.items():
        path = out / name
        if not _is_file(path, data.stat().st_size, sha256):
            write_whole(path, data, flush=False, sha256=sha256, ours=True)
            wrote = True
    if wrote:
        flush_folder(out)  # their names stand before the one that names them
    scene = out / SCENE_FILE
    if not _holds(scene, manifest):
        write_whole(scene, manifest, ours=True)
    return [text for path in strays(out, files) for text in _removed(path)]


def _is_file(path: Path, size: int, sha256: str) -> bool:
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

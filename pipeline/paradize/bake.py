"""Requirements -> tasks -> artifacts, published with one commit: the renaming of scene.json.

A task's key hashes its sources, its settings and the code behind it; what the store knows is not baked again.
Artifacts carry their hash in the name, so the old scene.json and its files stay whole until the new one
stands; files that it no longer names are swept afterwards. If anything fails, the old scene.json stays.
"""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from paradize import bake_makers
from paradize.bake_borders import measure_objects
from paradize.bake_estimate import memory_of
from paradize.bake_manifest import build_manifest, mesh_facts
from paradize.bake_nearest import least_pixels, places_of
from paradize.bake_record import SCENE_FILE, BakeReport, record_name, remember, unchanged_bake
from paradize.engine.code import code_digest, code_files, code_of, forget
from paradize.engine.memory import FileMemory
from paradize.engine.publish import sweep_aside, write_whole
from paradize.engine.store import Stamp, Store, default_root, hash_file, key_of, stamp
from paradize.engine.workers import Job, Outcome, run_jobs
from paradize.errors import BakeError, GroupedError, ParadizeError, SceneError, SourceError
from paradize.flight import Flight, plan_flight
from paradize.formats.scene_manifest import encode_scene
from paradize.require import Look, Order, Want, meet, require
from paradize.scene import METRICS, Scene, load_scene

OURS = re.compile(r"[a-z0-9_]+-[0-9a-f]{8}\.(glb|ktx2|ogg)")  # the only files that a sweep may remove

# What the store knows of a product.
_MEASURED = ("tier", "errors", "levels", "format", "reason", "filter")  # what a row tells of it
ZSTD_LEVEL = 10  # of supercompressed textures
TEXTURES = ("color", "maps", "cubemap")  # the makers of textures
_ASKED = "paradize.bake_makers"  # what stands between a task and its baker, part of every key
_TOLD = {"sha256", "suffix", "warnings", *_MEASURED}

Told = Callable[[str, int, int], None]  # what was just done, how many are done, of how many


@dataclass
class _Task:
    """An order on its way: its key, the sources' hashes, and what it gave (products by name)."""

    order: Order
    settings: dict[str, Any]
    key: str
    status: str = "reused"
    seconds: float = 0.0
    products: dict[str, dict[str, Any]] = field(default_factory=dict)
    data: dict[str, bytes | Path] = field(default_factory=dict)
    error: ParadizeError | None = None

    @property
    def wants(self) -> list[Want]:
        """The order's wants, and those that its products show to be there."""
        return [made for want in self.order.wants for made in want.made(self.products)]


def bake(
    scene_path: Path,
    out: Path | None = None,
    *,
    jobs: int | None = None,
    tier: str = "balanced",
    force: bool = False,
    told: Told | None = None,
) -> BakeReport:
    """Bakes a scene into `out` (default: build/assets/<scene name>). jobs: worker processes, default one a
    core.

    Raises SceneError (or GroupedError) for a scene that asks for the impossible; what fails later is in the
    report's errors, all of it, and the folder then holds what it held.
    """
    start = time.monotonic()
    forget()  # what an earlier bake of this process saw of the code
    store = Store(default_root())
    name = record_name(scene_path, out, tier)
    report = None if force else unchanged_bake(store, name)
    if report is None:
        was = stamp(scene_path)
        scene = load_scene(scene_path)
        folder = out or Path("build/assets") / scene.head.name
        lock = key_of(str(folder.resolve()))[:32]
        with store.in_use(), store.locked(lock), store.room(lock) as room:
            hands = jobs or os.cpu_count() or 1
            report = _bake(store, room, name, scene_path, was, scene, folder, hands, tier, force, told)
    report.seconds = time.monotonic() - start
    return report


def _bake(
    store: Store,
    room: Path,
    name: str,
    scene_path: Path,
    was: Stamp | None,
    scene: Scene,
    out: Path,
    jobs: int,
    tier: str,
    force: bool,
    told: Told | None,
) -> BakeReport:
    code = code_files("paradize.bake")
    flight = plan_flight(scene.flight)
    looks, libraries, absent = looks_of(scene, scene_path)
    orders = [*require(scene, looks).orders, _flight_order(scene, flight)]
    last = store.get_bake(name)
    memory = FileMemory.from_json(last["memory"] if isinstance(last, dict) and "memory" in last else None)
    inputs = [*libraries, *(path for order in orders for path in order.sources.values())]
    stamps = {path: stamp(path) for path in [*inputs, *code]} | {scene_path.resolve(): was}
    tasks = [_task(order, memory, tier, scene) for order in orders]
    for task in tasks:
        if force or not _recall(store, task):
            task.status = "baked"
    _run(store, room, [task for task in tasks if task.status == "baked"], stamps, jobs, tier, told)
    report = _report(scene, out, tasks)
    if not report.errors:
        _commit(store, scene, scene_path, flight, out, tasks, report, jobs, force)
    # What was edited meanwhile is not remembered, so that the next bake looks at everything anew.
    if not report.errors and all(stamp(path) == old for path, old in stamps.items()):
        remember(store, name, report, list(stamps), absent, memory)
    return report


def looks_of(scene: Scene, scene_path: Path) -> tuple[dict[str, Look], list[Path], list[Path]]:
    """The look of each object by name: the colour map that the scene or the OBJ's materials name, else their
    own colours; the files that were read for it, and those that were looked for in vain. Raises SceneError,
    or GroupedError, for objects whose materials name several colour maps."""
    looks: dict[str, Look] = {}
    libraries: list[Path] = []
    absent: list[Path] = []
    errors: list[ParadizeError] = []
    for i, item in enumerate(scene.objects):
        if item.color:
            looks[item.name] = Look(item.color)
            continue
        from paradize.readers.mtl import base_colors_of
        from paradize.readers.obj import read_obj

        try:
            read = read_obj(item.mesh, scene_path.resolve().parent)
        except ParadizeError as error:
            errors.append(error)
            continue
        libraries += [item.mesh, *read.libraries]
        absent += read.absent
        used = [read.materials.get(group.material) for group in read.mesh.groups]
        maps = {material.map_kd for material in used if material and material.map_kd}
        if len(maps) < 2:
            own = {} if maps else base_colors_of(read.materials)
            looks[item.name] = Look(maps.pop() if maps else None, own)
            continue
        what = f"{len(maps)} colour maps are named by the materials of {item.mesh.name}; one is needed"
        mend = "name one in the scene, or join them into one atlas"
        errors.append(SceneError(what, file=scene_path, place=f"object[{i}].color", mend=mend))
    if errors:
        raise GroupedError(errors) if len(errors) > 1 else errors[0]
    return looks, libraries, absent


def _flight_order(scene: Scene, flight: Flight) -> Order:
    settings = {
        "flight": flight.as_json(),
        "eye": [list(point.position) for point in scene.flight.eye],
        "target": [list(point.position) for point in scene.flight.target],
        "speed": [point.speed for point in scene.flight.eye],
    }
    return Order("flight", "flight", {}, settings, (Want("flight", "", "flight", "the camera's path"),))


def _settings(order: Order, scene: Scene) -> dict[str, Any]:
    """What the maker is told, and its task's key hashes: also whether textures are supercompressed, and the
    part of the budget that decides formats."""
    packed = {"zstd": ZSTD_LEVEL} if scene.head.zstd and order.maker in TEXTURES else {}
    if order.maker not in ("color", "maps"):
        return order.settings | packed
    products = [want.product for want in order.wants]
    owners = ["color", "alpha"] if order.maker == "color" else products
    limits = {metric: limit for metric, limit in scene.budget.items() if metric.partition("_")[0] in owners}
    for metric in [metric for metric in limits if metric.startswith("normal_filter_")]:
        del limits[metric]  # no format betters it
    settings = order.settings | packed | {"budget": limits}
    if order.maker == "maps":
        settings["only"] = products
    return settings


def _task(order: Order, memory: FileMemory, tier: str, scene: Scene) -> _Task:
    module, maker = bake_makers.MAKERS[order.maker]
    sources = {role: memory.sha256(path) for role, path in order.sources.items()}
    code = code_digest(module, _ASKED)
    settings = _settings(order, scene)
    return _Task(order, settings, key_of(maker.__name__, code, sources, settings, tier))


def _recall(store: Store, task: _Task) -> bool:
    """Takes a task's products from the store; False where any of them is missing or damaged."""
    products = store.get_product(task.key)
    if not isinstance(products, dict) or {want.product for want in task.order.wants} - products.keys():
        return False
    for want in (made for first in task.order.wants for made in first.made(products)):
        product = products[want.product]
        if not isinstance(product, dict) or _TOLD - product.keys():
            return False
        sha256 = str(product["sha256"])
        data = store.find(sha256) if want.many else store.get(sha256)
        if data is None:
            return False
        task.data[want.product] = data
    task.products = products
    return True


def _run(
    store: Store,
    room: Path,
    tasks: list[_Task],
    stamps: Mapping[Path, Stamp | None],
    jobs: int,
    tier: str,
    told: Told | None,
) -> None:
    """Bakes the tasks in worker processes and keeps what they make; their errors stay with them. room: where
    they write what they do not hand over. stamps: of the sources when they were hashed; what was made of a
    source that changed since is refused."""
    by_name = {task.order.name: task for task in tasks}
    done = 0

    def ended(outcome: Outcome) -> None:
        nonlocal done
        done += 1
        task = by_name[outcome.name]
        task.seconds = outcome.seconds
        moved = [path for path in task.order.sources.values() if stamp(path) != stamps[path]]
        error = outcome.error
        if moved and not error:
            error = SourceError("changed while it was baked", file=moved[0], mend="bake again")
        if error:
            task.error, task.status = error, "failed"
        else:
            for product in outcome.value:
                sha256, task.data[product.name] = _keep(store, product.data)
                task.products[product.name] = {
                    "sha256": sha256,
                    "suffix": product.suffix,
                    "tier": product.tier,
                    "errors": product.errors,
                    "levels": product.levels,
                    "format": product.format,
                    "reason": product.reason,
                    "filter": product.filter,
                    "warnings": product.warnings,
                }
            store.put_product(task.key, task.products)
        if told:
            told(outcome.name, done, len(tasks))

    work = [
        Job(
            task.order.name,
            bake_makers.MAKERS[task.order.maker][1],
            {"sources": task.order.sources, "settings": task.settings, "tier": tier}
            | ({"room": room / task.key} if task.order.maker in bake_makers.ROOMS else {}),
            file=next(iter(task.order.sources.values()), None),
            code=code_of(bake_makers.MAKERS[task.order.maker][0], _ASKED),
            memory_bytes=memory_of(task.order.sources.values()),
        )
        for task in tasks
    ]
    if work:
        run_jobs(work, min(jobs, len(work)), ended)


def _keep(store: Store, data: bytes | Path) -> tuple[str, bytes | Path]:
    """The hash of what a worker made, and where it is now: bytes stay in memory, a file goes to the store."""
    if isinstance(data, bytes):
        return store.put(data), data
    sha256 = store.take(data)
    kept = store.find(sha256)
    if kept is None:
        raise BakeError("was changed as it was written", file=store.root)
    return sha256, kept


def derive(
    store: Store, scene_path: Path, names: set[str], jobs: int, tier: str
) -> tuple[dict[str, str], list[ParadizeError]]:
    """Bakes the tasks of these artifacts, whatever is known of them, into a store of the caller's. Returns
    the SHA-256 of each, and what went wrong."""
    scene = load_scene(scene_path)
    looks, _, _ = looks_of(scene, scene_path)
    memory = FileMemory()

    def asked(want: Want) -> bool:
        return want.artifact in names or (
            want.many and any(name.startswith(f"{want.artifact}_") for name in names)
        )

    orders = [order for order in require(scene, looks).orders if any(map(asked, order.wants))]
    tasks = [_task(order, memory, tier, scene) for order in orders]
    stamps = {path: stamp(path) for order in orders for path in order.sources.values()}
    _run(store, store.root / "rooms", tasks, stamps, jobs, tier, None)
    made = {
        want.artifact: str(task.products[want.product]["sha256"])
        for task in tasks
        for want in task.wants
        if want.kind and want.product in task.products
    }
    return made, [task.error for task in tasks if task.error]


def _report(scene: Scene, out: Path, tasks: list[_Task]) -> BakeReport:
    report = BakeReport(out, budget=scene.budget)
    for task in tasks:
        if task.error:
            report.errors.append(task.error)
        for want in task.wants:
            product = task.products.get(want.product)
            report.warnings += product["warnings"] if product else []
            if not want.kind:
                continue
            row: dict[str, Any] = {"name": want.artifact, "file": None, "sha256": None, "bytes": 0}
            row |= {"tier": None, "errors": {}, "status": task.status, "seconds": round(task.seconds, 3)}
            row |= {"levels": [], "format": None, "reason": None, "filter": None}
            if product:
                file = f"{want.artifact}-{product['sha256'][:8]}.{product['suffix']}"
                row |= {"file": file, "sha256": product["sha256"], "bytes": size_of(task.data[want.product])}
                row |= {key: product[key] for key in _MEASURED}
            row["over"] = over_budget(scene.budget, row["errors"])
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
    over = over_budget(scene.budget, worst)
    row["over"] = [*row["over"], *over]
    return [f"{row['name']}: {text}" for text in over]


def over_budget(budget: dict[str, float], errors: dict[str, float]) -> list[str]:
    """The metrics that are worse than their budget, each as `metric value unit, budget limit`."""
    found = []
    for metric, limit in budget.items():
        if metric in errors:
            known = METRICS[metric]
            worse = errors[metric] > limit if known.less_is_better else errors[metric] < limit
            if worse:
                found.append(f"{metric} is {errors[metric]:g} {known.unit}, budget {limit:g}")
    return found


def _commit(
    store: Store,
    scene: Scene,
    scene_path: Path,
    flight: Flight,
    out: Path,
    tasks: list[_Task],
    report: BakeReport,
    jobs: int,
    force: bool,
) -> None:
    """Measures the gutters, builds scene.json and publishes everything; adds what goes wrong to the report's
    errors."""
    entries: dict[str, dict[str, Any]] = {}
    files: dict[str, tuple[bytes | Path, str]] = {}
    facts = {}
    rows = {row["name"]: row for row in report.artifacts}
    flight_errors: dict[str, float] = {}
    ground: dict[str, Any] | None = None
    try:
        for task in tasks:
            for want in task.wants:
                data, product = task.data[want.product], task.products[want.product]
                if want.product == "flight":
                    flight_errors = product["errors"]
                if want.product == "tree" and isinstance(data, bytes):
                    ground = json.loads(data)
                if not want.kind:
                    continue
                row = rows[want.artifact]
                files[row["file"]] = (data, row["sha256"])
                entries[want.artifact] = {"file": row["file"], "kind": want.kind} | {
                    key: row[key] for key in ("sha256", "bytes", "tier", "errors", "levels")
                }
                if want.kind == "mesh" and isinstance(data, bytes):
                    facts[want.artifact] = mesh_facts(data, row["file"])
        for i, item in enumerate(scene.objects):
            known = facts[f"{item.name}_mesh"].materials
            for material in item.materials:
                if material not in known:
                    place = f"object[{i}].material.{material}"
                    mend = f"it has: {', '.join(known)}"
                    what = f"the mesh of {item.name} has no such material"
                    report.errors.append(SceneError(what, file=scene_path, place=place, mend=mend))
        if report.errors:
            return
        report.warnings += [f"flight: {text}" for text in over_budget(scene.budget, flight_errors)]
        objects = {item.name: facts[f"{item.name}_mesh"] for item in scene.objects}
        bounds = {name: (known.center, known.radius_m) for name, known in objects.items()}
        met = meet(scene, flight, bounds)
        names = {name: list(known.materials) for name, known in objects.items()}
        held = {name: files[entry["file"]][0] for name, entry in entries.items()}
        texels = {name: data for name, data in held.items() if isinstance(data, bytes)}
        hashes = {name: entry["sha256"] for name, entry in entries.items()}
        measured, errors = measure_objects(store, scene, met, names, texels, hashes, jobs, force)
        report.errors += errors
        if errors:
            return
        gutters = measured["gutters"]
        for name, bumps in measured["bumps"].items():
            mesh = rows[f"{name}_mesh"]
            report.warnings += _lit(scene, mesh, bumps["levels"])
            entries[mesh["name"]] |= {key: mesh[key] for key in ("errors", "levels")}
        places = {
            name: places_of(texels[f"{name}_mesh"], entries[f"{name}_mesh"]["file"]) for name in objects
        }
        pixels = least_pixels(scene, flight, places)
        manifest = encode_scene(
            build_manifest(scene, flight, flight_errors, entries, facts, met, gutters, pixels, ground)
        )
        _publish(out, files, manifest)
    except ParadizeError as error:
        report.errors.append(error)


def size_of(data: bytes | Path) -> int:
    """How many bytes there are, here or in a file."""
    return data.stat().st_size if isinstance(data, Path) else len(data)


def _publish(out: Path, files: dict[str, tuple[bytes | Path, str]], manifest: bytes) -> None:
    """Writes artifacts (file name -> bytes or the file that holds them, SHA-256), then scene.json, then
    sweeps what it no longer names.

    Raises BakeError when the folder cannot be written; scene.json is then the old one.
    """
    for name, (data, sha256) in files.items():
        path = out / name
        was = stamp(path)
        if was is None or was[0] != size_of(data) or hash_file(path) != sha256:
            write_whole(path, data)
    scene = out / SCENE_FILE
    if stamp(scene) is None or scene.read_bytes() != manifest:
        write_whole(scene, manifest)
    sweep_aside(out)
    for path in out.iterdir():
        if path.name not in files and OURS.fullmatch(path.name):
            path.unlink(missing_ok=True)

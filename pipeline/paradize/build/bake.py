"""Bakes a scene: requirements -> tasks -> artifacts, published together (publish.py). Tasks and keys:
tasks.py."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

from paradize.build.budget_metrics import measured_by, unmeasured
from paradize.build.job_inputs import keep_inputs
from paradize.build.materials.map_sets import find_map_sets
from paradize.build.options import BuildContext, BuildOptions
from paradize.build.provenance import BakeReport, record_name, remember, unchanged_bake
from paradize.build.publish import publish, report_of
from paradize.build.tasks import check_tier_names, flight_job, run_tasks, task_of
from paradize.build.tiers.auto_tier import LateErrors, TaskRunner, bake_jobs
from paradize.documents import SCENE_FILE
from paradize.errors import BakeError, GroupedError, ParadizeError, SceneError, renamed
from paradize.files import resolved
from paradize.jobs.code import clear_caches, code_files
from paradize.jobs.process import WorkerPool
from paradize.kinds import require_folder
from paradize.scene.flight import plan_flight
from paradize.scene.jobs import BakeJob, Output
from paradize.scene.requirements import require
from paradize.scene.settings import Scene, load_scene
from paradize.store.atomic import require_place
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Stamp, Store, default_root, key_of, stamp


def bake(scene_path: Path, out: Path | None = None, options: BuildOptions | None = None) -> BakeReport:
    """Bakes a scene into `out` (default: build/assets/<scene name>).

    Raises SceneError (or GroupedError) for a scene with faults, and BakeError where `out` or the store cannot
    be written. Errors of baking are collected in the report; the folder then keeps what it held.
    """
    start = time.monotonic()
    options = options or BuildOptions()
    clear_caches()
    name = record_name(scene_path, out, options.tier, options.tiers)
    known = options.usual and not options.force
    report = unchanged_bake(Store(default_root()), name, options.store) if known else None
    if report is None:
        store = _store(options)
        scene_stamp = stamp(scene_path)
        scene = load_scene(scene_path)
        if out is not None:
            require_folder(out)
        folder = out or Path("build/assets") / scene.head.name
        if not os.path.lexists(folder / SCENE_FILE):
            require_place(folder)  # before minutes are spent
        lock = key_of(str(resolved(folder)))[:32]
        pool = options.pool or WorkerPool()  # the same workers bake and measure
        try:
            with store.in_use(), store.locked(lock), store.scratch(lock) as scratch:
                flight = plan_flight(scene.flight)
                used = replace(options, pool=pool)
                context = BuildContext(
                    store=store,
                    scratch=scratch,
                    scene_path=scene_path,
                    scene=scene,
                    flight=flight,
                    out=folder,
                    options=used,
                )
                report = _bake(context, name, scene_stamp)
        finally:
            if pool is not options.pool:
                pool.stop()
    report.seconds = time.monotonic() - start
    return report


def _store(options: BuildOptions) -> Store:
    if options.store is None:
        return Store(default_root())
    from paradize.store.shared import SharedStore  # here: few bakes need it

    return SharedStore(default_root(), options.store)


def _bake(context: BuildContext, name: str, scene_stamp: Stamp | None) -> BakeReport:
    """name: of the build's record. scene_stamp: of the scene file before it was read."""
    store, scene, scene_path, options = context.store, context.scene, context.scene_path, context.options
    code = code_files("paradize.build.bake")
    last = store.get_bake(name)
    hash_cache = FileHashCache.from_json(
        last["file_hashes"] if isinstance(last, dict) and "file_hashes" in last else None
    )
    found = find_map_sets(scene, scene_path, hash_cache, options=options)
    jobs = [*require(scene, found.maps).jobs, flight_job(scene, context.flight)]
    for job in jobs:
        if options.whole and job.baker == "terrain":
            job.settings["flight_views"] = None
    check_tier_names(options, jobs)
    check_budget_metrics(scene, jobs, scene_path)
    tables = [item.instances_file for item in scene.objects if item.instances_file]
    inputs = [*found.libraries, *tables, *(path for job in jobs for path in job.sources.values())]
    stamps = {path: stamp(path) for path in [*inputs, *code]} | {resolved(scene_path): scene_stamp}
    runner = TaskRunner(context, hash_cache, stamps)
    late_errors: LateErrors = {}
    while True:
        tasks, tried = bake_jobs(runner, jobs, late_errors)
        report = report_of(context, tasks, tried)
        whole = {
            artifact.name: artifact.sha256 for artifact in report.artifacts
        }  # stores hold them; `publish` trims some
        if report.errors or not publish(context, found.maps, tasks, report, late_errors):
            break
    report.errors = [error.renamed(found.inside) for error in report.errors]
    report.warnings = [str(renamed(text, found.inside)) for text in report.warnings]
    warnings = store.settle()
    reused = [artifact for artifact in report.artifacts if artifact.status == "reused"]
    report.fetched = sum(whole[artifact.name] in store.fetched for artifact in reused)
    report.pushed = sum(whole[artifact.name] in store.pushed for artifact in report.artifacts)
    # After an edit during the bake no record is kept, so that the next bake checks everything.
    if options.usual and not report.errors and all(stamp(path) == old for path, old in stamps.items()):
        try:
            keep_inputs(store, context.out, scene, tasks, hash_cache, options)
            remember(store, name, report, list(stamps), found.missing, hash_cache)
        except BakeError as error:  # all is published; the next bake looks at every file
            warnings.append(f"no record of this bake: {error}")
    report.warnings += [*found.warnings, *warnings]
    return report


def check_budget_metrics(scene: Scene, jobs: list[BakeJob], path: Path) -> None:
    """Raises SceneError (several: GroupedError) for a budget of a metric that no job of the scene
    measures."""
    known = {"folder_mb", "gpu_mb"}  # check sums them up
    for job in jobs:
        settings = {} if job.baker == "terrain" else job.settings  # tiles of terrain do not tell of codes
        known |= measured_by(job.baker, [output.product for output in job.outputs], settings)
    unused, mend = unmeasured((*scene.budget.hard, *scene.budget.soft), known)
    problem = "nothing in this scene measures it, so that it cannot be kept"
    if unused:
        raise GroupedError(
            SceneError(problem, file=path, place=f"budget.{metric}", mend=mend) for metric in unused
        )


def derive(
    store: Store, scene_path: Path, names: set[str], options: BuildOptions
) -> tuple[dict[str, str], list[ParadizeError]]:
    """Bakes the jobs of these artifacts again, into a store of the caller's. Returns the SHA-256 of each,
    and the errors."""
    scene = load_scene(scene_path)
    hash_cache = FileHashCache()
    maps = find_map_sets(scene, scene_path, hash_cache).maps

    def is_wanted(output: Output) -> bool:
        return output.artifact in names or (
            output.many and any(name.startswith(f"{output.artifact}_") for name in names)
        )

    jobs = [job for job in require(scene, maps).jobs if any(map(is_wanted, job.outputs))]
    tasks = [task_of(job, hash_cache, options.tier_of(job, scene), scene) for job in jobs]
    stamps = {path: stamp(path) for job in jobs for path in job.sources.values()}
    run_tasks(store, store.root / "scratch", tasks, stamps, options, resolved(scene_path).parent)
    sha256 = {
        output.artifact: str(task.products[output.product].sha256)
        for task in tasks
        for output in task.outputs
        if output.kind and output.product in task.products
    }
    return sha256, [task.error for task in tasks if task.error]

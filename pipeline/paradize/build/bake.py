"""Requirements -> tasks -> artifacts, published as one (publish.py).

What a bake reads and where it keeps what it makes is here; tasks and their keys are in tasks.py.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

from paradize.build.auto_tier import Bench, Later, bake_orders
from paradize.build.budget_metrics import measured_by, unmeasured
from paradize.build.job_inputs import keep_inputs
from paradize.build.material_colors import material_colors_of
from paradize.build.options import BuildContext, BuildOptions
from paradize.build.provenance import BakeReport, record_name, remember, unchanged_bake
from paradize.build.publish import publish, report_of
from paradize.build.tasks import flight_order, known_tiers, run_tasks, task_of
from paradize.errors import GroupedError, ParadizeError, SceneError
from paradize.files import resolved
from paradize.jobs.code import clear_caches, code_files
from paradize.jobs.process import WorkerPool
from paradize.kinds import require_folder
from paradize.scene.flight import plan_flight
from paradize.scene.requirements import BakeJob, Output, require
from paradize.scene.settings import Scene, load_scene
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Stamp, Store, default_root, key_of, stamp


def bake(scene_path: Path, out: Path | None = None, how: BuildOptions | None = None) -> BakeReport:
    """Bakes a scene into `out` (default: build/assets/<scene name>).

    Raises SceneError (or GroupedError) for a scene that asks for the impossible; what fails later is in the
    report's errors, all of it, and the folder then holds what it held.
    """
    start = time.monotonic()
    how = how or BuildOptions()
    clear_caches()
    name = record_name(scene_path, out, how.tier, how.tiers)
    known = how.usual and not how.force
    report = unchanged_bake(Store(default_root()), name, how.store) if known else None
    if report is None:
        store = _store(how)
        was = stamp(scene_path)
        scene = load_scene(scene_path)
        if out is not None:
            require_folder(out)
        folder = out or Path("build/assets") / scene.head.name
        lock = key_of(str(resolved(folder)))[:32]
        pool = how.pool or WorkerPool()  # the same workers bake and measure
        try:
            with store.in_use(), store.locked(lock), store.scratch(lock) as scratch:
                flight = plan_flight(scene.flight)
                used = replace(how, pool=pool)
                context = BuildContext(store, scratch, scene_path, scene, flight, folder, used)
                report = _bake(context, name, was)
        finally:
            if pool is not how.pool:
                pool.stop()
    report.seconds = time.monotonic() - start
    return report


def _store(how: BuildOptions) -> Store:
    if how.store is None:
        return Store(default_root())
    from paradize.store.shared import SharedStore  # here: few bakes need it

    return SharedStore(default_root(), how.store)


def _bake(context: BuildContext, name: str, was: Stamp | None) -> BakeReport:
    """name: under which the bake is remembered. was: the scene file's stamp before it was read."""
    store, scene, scene_path, how = context.store, context.scene, context.scene_path, context.how
    code = code_files("paradize.build.bake")
    looks, libraries, absent = material_colors_of(scene, scene_path)
    orders = [*require(scene, looks).orders, flight_order(scene, context.flight)]
    for order in orders:
        if how.whole and order.maker == "terrain":
            order.settings["sight"] = None
    known_tiers(how, orders)
    known_budget(scene, orders, scene_path)
    last = store.get_bake(name)
    memory = FileHashCache.from_json(last["memory"] if isinstance(last, dict) and "memory" in last else None)
    inputs = [*libraries, *(path for order in orders for path in order.sources.values())]
    stamps = {path: stamp(path) for path in [*inputs, *code]} | {resolved(scene_path): was}
    bench = Bench(context, memory, stamps)
    later: Later = {}
    while True:
        tasks, tried = bake_orders(bench, orders, later)
        report = report_of(context, tasks, tried)
        if report.errors or publish(context, tasks, report, later):
            break
    told = store.settle()
    reused = [one for one in report.artifacts if one.status == "reused"]
    report.fetched = sum(one.sha256 in store.fetched for one in reused)
    report.pushed = sum(one.sha256 in store.pushed for one in report.artifacts)
    # What was edited meanwhile is not remembered, so that the next bake looks at everything anew.
    if how.usual and not report.errors and all(stamp(path) == old for path, old in stamps.items()):
        keep_inputs(store, context.out, scene, tasks, memory, how)
        remember(store, name, report, list(stamps), absent, memory)
    report.warnings += told
    return report


def known_budget(scene: Scene, orders: list[BakeJob], path: Path) -> None:
    """Raises SceneError (several: GroupedError) for a budget that nothing of the scene measures."""
    known = {"folder_mb", "gpu_mb"}  # check sums them up
    for order in orders:
        settings = order.settings if order.maker == "mesh" else {}  # tiles of terrain do not tell of codes
        known |= measured_by(order.maker, [want.product for want in order.wants], settings)
    idle, mend = unmeasured((*scene.budget.hard, *scene.budget.soft), known)
    what = "nothing in this scene measures it, so that it cannot be kept"
    if idle:
        raise GroupedError(SceneError(what, file=path, place=f"budget.{one}", mend=mend) for one in idle)


def derive(
    store: Store, scene_path: Path, names: set[str], how: BuildOptions
) -> tuple[dict[str, str], list[ParadizeError]]:
    """Bakes the tasks of these artifacts, whatever is known of them, into a store of the caller's. Returns
    the SHA-256 of each, and what went wrong."""
    scene = load_scene(scene_path)
    looks, _, _ = material_colors_of(scene, scene_path)
    memory = FileHashCache()

    def asked(want: Output) -> bool:
        return want.artifact in names or (
            want.many and any(name.startswith(f"{want.artifact}_") for name in names)
        )

    orders = [order for order in require(scene, looks).orders if any(map(asked, order.wants))]
    tasks = [task_of(order, memory, how.tier_of(order, scene), scene) for order in orders]
    stamps = {path: stamp(path) for order in orders for path in order.sources.values()}
    run_tasks(store, store.root / "rooms", tasks, stamps, how)
    made = {
        want.artifact: str(task.products[want.product].sha256)
        for task in tasks
        for want in task.wants
        if want.kind and want.product in task.products
    }
    return made, [task.error for task in tasks if task.error]

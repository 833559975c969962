"""Runs jobs: gives each a key, looks it up in the store, bakes it in a worker process.

A task's key hashes its sources, its settings and the code that bakes it. What the store has is not baked
again.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from paradize.artifact import KEPT, Artifact
from paradize.bakers import registry
from paradize.build.artifacts import keep_artifact
from paradize.build.entries import PRODUCTS, fits
from paradize.build.estimate import memory_of, seconds_of
from paradize.build.options import BuildOptions
from paradize.build.tiers.tuned_settings import split_label
from paradize.build.work import files_read_by, run_build_jobs
from paradize.errors import BakeError, ParadizeError, SourceError
from paradize.jobs.code import code_digest, code_of
from paradize.jobs.limits import time_limit
from paradize.jobs.pool import Job, Outcome
from paradize.scene.flight import Flight
from paradize.scene.jobs import BakeJob, Output
from paradize.scene.settings import Scene
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Stamp, Store, key_of, stamp

ZSTD_LEVEL = 10  # of supercompressed textures
# Code between a task and its baker. It is part of every key.
SHARED_MODULES = ("paradize.bakers.registry", "paradize.artifact")


@dataclass
class Task:
    """A job with its key. products: what it baked, by name. data: by product, its file in the store."""

    job: BakeJob
    settings: dict[str, Any]
    tier: str
    key: str
    status: str = "reused"
    seconds: float = 0.0
    products: dict[str, Artifact] = field(default_factory=dict)
    data: dict[str, Path] = field(default_factory=dict)  # by product: its file in the store
    error: ParadizeError | None = None

    @property
    def outputs(self) -> list[Output]:
        """The outputs of the job, numbered ones included."""
        return [output for declared in self.job.outputs for output in declared.expand(self.products)]


def flight_job(scene: Scene, flight: Flight) -> BakeJob:
    """Returns the job that measures the camera's path."""
    settings = {
        "flight": flight.as_json(),
        "eye": [list(point.position) for point in scene.flight.eye],
        "target": [list(point.position) for point in scene.flight.target],
        "speed": [point.speed for point in scene.flight.eye],
    }
    return BakeJob("flight", "flight", {}, settings, (Output("flight", "", "flight", "the camera's path"),))


def job_settings(job: BakeJob, scene: Scene, finer_format: bool) -> dict[str, Any]:
    """Returns the settings passed to the baker; they are part of the key. Besides the job's own: the level of
    supercompression, and for textures the part of the budget that chooses their format.

    finer_format: a texture takes a more exact format where its first one exceeds the budget.
    """
    packed = {"zstd": ZSTD_LEVEL} if scene.head.zstd and job.baker in registry.TEXTURES else {}
    if job.baker not in registry.BUDGET_FORMATS:
        return job.settings | packed
    products = [output.product for output in job.outputs]
    owners = [*products, *(["alpha"] if "color" in products else [])]
    limits = {
        metric: limit for metric, limit in scene.budget.hard.items() if metric.partition("_")[0] in owners
    }
    for metric in [metric for metric in limits if metric.startswith("normal_filter_")]:
        del limits[metric]  # no format betters it
    return job.settings | packed | {"budget": limits if finer_format else {}}


def task_of(
    job: BakeJob,
    hash_cache: FileHashCache,
    tier: str,
    scene: Scene,
    *,
    finer_format: bool = True,
    uncompressed: bool = False,
) -> Task:
    """Makes the task of a job. tier: a tier, or one with a tuned setting (tuned_settings.tuned_label).
    finer_format: as in job_settings. uncompressed: as in BuildOptions."""
    module, baker = registry.BAKERS[job.baker]
    sources = {role: hash_cache.sha256(path) for role, path in job.sources.items()}
    if job.baker == "mesh":
        sources["name"] = job.sources["mesh"].stem  # the GLB holds it
    code = code_digest(module, *SHARED_MODULES)
    tier, tuned = split_label(tier)
    settings = job_settings(job, scene, finer_format) | tuned
    if uncompressed and job.baker in registry.BUDGET_FORMATS:
        settings = settings | {"uncompressed": True}
    return Task(job, settings, tier, key_of(baker.__name__, code, sources, settings, tier))


def check_tier_names(options: BuildOptions, jobs: list[BakeJob]) -> None:
    """Raises BakeError where `options.tiers` names neither a job nor an artifact."""
    names = {name for job in jobs for name in (job.name, *(output.artifact for output in job.outputs))}
    if wrong := sorted(options.tiers.keys() - names):
        raise BakeError(
            f"no task {', '.join(map(repr, wrong))}", mend=f"there are {', '.join(sorted(names))}"
        )


def stored_products(store: Store, task: Task) -> dict[str, Artifact] | None:
    """Returns what the store knows of a task's products, without their bytes; None if one is missing."""
    entry = store.get_product(task.key)
    if not fits(entry, PRODUCTS) or {output.product for output in task.job.outputs} - entry.keys():
        return None
    products = {name: Artifact.from_json(product, name=name) for name, product in entry.items()}
    return _reworded(products, {mark: path for path, mark in _path_marks(task.job)})


def _path_marks(job: BakeJob) -> list[tuple[str, str]]:
    """Returns (path, mark) of each source and its folder, the longest path first. In stored warnings marks
    replace paths, because another scene may have the same source elsewhere."""
    marks = [(str(path), f"\0{role}\0") for role, path in job.sources.items()]
    folders = [(role, path.parent) for role, path in job.sources.items() if path.parent.name]
    marks += [(f"{folder}{os.sep}", f"\0{role}/\0") for role, folder in folders]
    return sorted(marks, key=lambda row: -len(row[0]))


def _reworded(products: dict[str, Artifact], words: Mapping[str, str]) -> dict[str, Artifact]:
    """Returns the products with texts in their warnings replaced, in order."""
    reworded = {}
    for name, product in products.items():
        texts = list(product.warnings)
        for old, new in words.items():
            texts = [text.replace(old, new) for text in texts]
        reworded[name] = replace(product, warnings=texts)
    return reworded


def take_from_store(store: Store, task: Task) -> bool:
    """Takes a task's products from the store. Returns False if one is missing or damaged."""
    products = task.products or stored_products(store, task)
    if products is None:
        return False
    data: dict[str, Path] = {}
    for output in (output for declared in task.job.outputs for output in declared.expand(products)):
        path = store.find(str(products[output.product].sha256))
        if path is None:
            return False
        data[output.product] = path
    task.data, task.products = data, products
    return True


def run_tasks(
    store: Store,
    scratch: Path,
    tasks: list[Task],
    stamps: Mapping[Path, Stamp | None],
    options: BuildOptions,
    root: Path,
) -> None:
    """Bakes the tasks in worker processes and stores their products. Errors are kept in the tasks.

    scratch: folder for files that workers write. stamps: of the sources when they were hashed; products of a
    source that changed since are refused. root: folder that the files of models must lie in, the scene's.
    """
    by_name = {task.job.name: task for task in tasks}

    def on_outcome(outcome: Outcome) -> None:
        task = by_name[outcome.name]
        task.seconds = outcome.seconds
        changed = [path for path in task.job.sources.values() if stamp(path) != stamps[path]]
        error = outcome.error
        if changed and not error:
            error = SourceError("changed while it was baked", file=changed[0], mend="bake again")
        if error:
            task.error, task.status = error, "failed"
        else:
            for product in outcome.value:
                name = product.artifact.name
                sha256, task.data[name] = keep_artifact(store, product.data)
                task.products[name] = replace(product.artifact, sha256=sha256)
            portable = _reworded(task.products, dict(_path_marks(task.job)))
            store.put_product(task.key, {name: product.to_json(KEPT) for name, product in portable.items()})

    pool_jobs = [
        Job(
            task.job.name,
            registry.BAKERS[task.job.baker][1],
            {"sources": task.job.sources, "settings": task.settings, "tier": task.tier}
            | ({"scratch": scratch / task.key} if task.job.baker in registry.WITH_SCRATCH else {})
            | ({"root": root} if task.job.baker in registry.MODEL_READERS else {}),
            file=next(iter(task.job.sources.values()), None),
            code=code_of(registry.BAKERS[task.job.baker][0], *SHARED_MODULES),
            timeout_s=time_limit(seconds_of(task.job.sources.values())),
            memory_bytes=memory_of(task.job.sources.values()),
            files=files_read_by(task.job.sources.values(), root) if options.cluster else {},
        )
        for task in tasks
    ]
    run_build_jobs(options, pool_jobs, on_outcome)

"""An order on its way: its key, what the store knows of it, its baking in a worker process.

A task's key hashes its sources, its settings and the code behind it; what the store knows is not baked again.
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
from paradize.build.dial import setting_of
from paradize.build.entries import PRODUCTS, fits
from paradize.build.estimate import memory_of, seconds_of
from paradize.build.options import BuildOptions
from paradize.build.work import read_by, run_work
from paradize.errors import BakeError, ParadizeError, SourceError
from paradize.jobs.code import code_digest, code_of
from paradize.jobs.limits import time_limit
from paradize.jobs.pool import Job, Outcome
from paradize.scene.flight import Flight
from paradize.scene.requirements import BakeJob, Output
from paradize.scene.settings import Scene
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Stamp, Store, key_of, stamp

ZSTD_LEVEL = 10  # of supercompressed textures
TEXTURES = ("color", "maps", "cubemap")  # the makers of textures
# What stands between a task and its baker, part of every key.
ASKED = ("paradize.bakers.registry", "paradize.artifact")


@dataclass
class Task:
    """An order on its way: its key, the sources' hashes, and what it gave (products by name)."""

    order: BakeJob
    settings: dict[str, Any]
    tier: str
    key: str
    status: str = "reused"
    seconds: float = 0.0
    products: dict[str, Artifact] = field(default_factory=dict)
    data: dict[str, Path] = field(default_factory=dict)  # by product: its file in the store
    error: ParadizeError | None = None

    @property
    def wants(self) -> list[Output]:
        """The order's wants, and those that its products show to be there."""
        return [made for want in self.order.wants for made in want.made(self.products)]


def flight_order(scene: Scene, flight: Flight) -> BakeJob:
    settings = {
        "flight": flight.as_json(),
        "eye": [list(point.position) for point in scene.flight.eye],
        "target": [list(point.position) for point in scene.flight.target],
        "speed": [point.speed for point in scene.flight.eye],
    }
    return BakeJob("flight", "flight", {}, settings, (Output("flight", "", "flight", "the camera's path"),))


def settings_of(order: BakeJob, scene: Scene, grow: bool) -> dict[str, Any]:
    """What the maker is told, and its task's key hashes: also whether textures are supercompressed, and, to
    let formats grow, the part of the budget that decides them."""
    packed = {"zstd": ZSTD_LEVEL} if scene.head.zstd and order.maker in TEXTURES else {}
    if order.maker not in ("color", "maps"):
        return order.settings | packed
    products = [want.product for want in order.wants]
    owners = ["color", "alpha"] if order.maker == "color" else products
    limits = {
        metric: limit for metric, limit in scene.budget.hard.items() if metric.partition("_")[0] in owners
    }
    for metric in [metric for metric in limits if metric.startswith("normal_filter_")]:
        del limits[metric]  # no format betters it
    return order.settings | packed | {"budget": limits if grow else {}}


def task_of(
    order: BakeJob,
    memory: FileHashCache,
    tier: str,
    scene: Scene,
    *,
    grow: bool = True,
    uncompressed: bool = False,
) -> Task:
    """tier: a tier, with a setting of its own or not, as bake_dial names it. grow: textures take a more exact
    format where theirs exceeds the budget. uncompressed: as in BuildOptions."""
    module, maker = registry.MAKERS[order.maker]
    sources = {role: memory.sha256(path) for role, path in order.sources.items()}
    code = code_digest(module, *ASKED)
    tier, turned = setting_of(tier)
    settings = settings_of(order, scene, grow) | turned
    if uncompressed and order.maker in ("color", "maps"):
        settings = settings | {"uncompressed": True}
    return Task(order, settings, tier, key_of(maker.__name__, code, sources, settings, tier))


def known_tiers(how: BuildOptions, orders: list[BakeJob]) -> None:
    """Raises BakeError where `how.tiers` names what is neither a task nor an artifact."""
    names = {name for order in orders for name in (order.name, *(want.artifact for want in order.wants))}
    if wrong := sorted(how.tiers.keys() - names):
        raise BakeError(
            f"no task {', '.join(map(repr, wrong))}", mend=f"there are {', '.join(sorted(names))}"
        )


def known(store: Store, task: Task) -> dict[str, Artifact] | None:
    """What the store tells of a task's products, their bytes aside; None where it knows not all of them."""
    told = store.get_product(task.key)
    if not fits(told, PRODUCTS) or {want.product for want in task.order.wants} - told.keys():
        return None
    products = {name: Artifact.from_json(one, name=name) for name, one in told.items()}
    return _worded(products, {mark: path for path, mark in _places(task.order)})


def _places(order: BakeJob) -> list[tuple[str, str]]:
    """The paths that warnings of an order may name, the longest first, each with what the store holds
    instead: another scene that finds the entry has them elsewhere."""
    found = [(str(path), f"\0{role}\0") for role, path in order.sources.items()]
    folders = [(role, path.parent) for role, path in order.sources.items() if path.parent.name]
    found += [(f"{folder}{os.sep}", f"\0{role}/\0") for role, folder in folders]
    return sorted(found, key=lambda row: -len(row[0]))


def _worded(products: dict[str, Artifact], words: Mapping[str, str]) -> dict[str, Artifact]:
    """The products, with words of their warnings replaced, one after the other."""
    found = {}
    for name, product in products.items():
        texts = list(product.warnings)
        for old, new in words.items():
            texts = [text.replace(old, new) for text in texts]
        found[name] = replace(product, warnings=texts)
    return found


def recall(store: Store, task: Task) -> bool:
    """Takes a task's products from the store; False where any of them is missing or damaged."""
    products = task.products or known(store, task)
    if products is None:
        return False
    data: dict[str, Path] = {}
    for want in (made for first in task.order.wants for made in first.made(products)):
        found = store.find(str(products[want.product].sha256))
        if found is None:
            return False
        data[want.product] = found
    task.data, task.products = data, products
    return True


def run_tasks(
    store: Store,
    scratch: Path,
    tasks: list[Task],
    stamps: Mapping[Path, Stamp | None],
    how: BuildOptions,
) -> None:
    """Bakes the tasks in worker processes and stores their products; errors stay with their tasks. scratch:
    folder for files that workers write. stamps: of the sources when they were hashed; a product of a source
    that changed since is refused."""
    by_name = {task.order.name: task for task in tasks}

    def ended(outcome: Outcome) -> None:
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
                name = product.artifact.name
                sha256, task.data[name] = keep_artifact(store, product.data)
                task.products[name] = replace(product.artifact, sha256=sha256)
            kept = _worded(task.products, dict(_places(task.order)))
            store.put_product(task.key, {name: one.to_json(KEPT) for name, one in kept.items()})

    work = [
        Job(
            task.order.name,
            registry.MAKERS[task.order.maker][1],
            {"sources": task.order.sources, "settings": task.settings, "tier": task.tier}
            | ({"scratch": scratch / task.key} if task.order.maker in registry.WITH_SCRATCH else {}),
            file=next(iter(task.order.sources.values()), None),
            code=code_of(registry.MAKERS[task.order.maker][0], *ASKED),
            timeout_s=time_limit(seconds_of(task.order.sources.values())),
            memory_bytes=memory_of(task.order.sources.values()),
            files=read_by(task.order.sources.values()) if how.cluster else {},
        )
        for task in tasks
    ]
    run_work(how, work, ended)

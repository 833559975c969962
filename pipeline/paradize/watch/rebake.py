"""Bakes a watched scene in a process that stays alive, and lists the files that the bake read.

It imports the pipeline only inside functions: watch/loop.py imports this module and must outlive changes of
the code."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from paradize.documents import TOML_BYTES, parse_toml
from paradize.errors import GroupedError, ParadizeError
from paradize.files import read_file, resolved
from paradize.jobs.pool import Job, WorkerPool, run_jobs
from paradize.jobs.progress import report_step
from paradize.store.local import Stamp, Store, default_root, stamp

_POOL = WorkerPool()  # the workers of this process, kept from bake to bake


@dataclass
class Baked:
    """report: the object of `bake --json`, or None if the bake raised. out: the folder. reads: the files that
    the bake reads, also missing ones, with their stamps. foreign: a module whose file changed after this
    process loaded it; then nothing else counts."""

    report: dict[str, Any] | None = None
    out: Path | None = None
    errors: list[ParadizeError] = field(default_factory=list)
    reads: dict[Path, Stamp | None] = field(default_factory=dict)
    foreign: str | None = None


def bake_again(
    scene: Path,
    out: Path | None,
    jobs: int,
    tier: str | None,
    cluster: str | None,
    store_url: str | None,
    forget_record: bool,
) -> Baked:
    """Bakes what changed of the scene. jobs, tier, cluster, store_url: as in options.BuildOptions.
    forget_record: ignore the record of the last bake, because it may be of other code; the store is used all
    the same."""
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(0))  # ends a bake cleanly

    from paradize.build.bake import bake
    from paradize.build.options import BuildOptions, JobObserver
    from paradize.build.provenance import record_name

    store = Store(default_root())
    name = record_name(scene, out, tier)
    if forget_record:
        store.put_bake(name, None)
    if module := _foreign():
        return Baked(foreign=module)

    class Steps(JobObserver):
        """Reports the jobs of the bake as the counted steps of this process's job."""

        count = done = 0

        def planned(self, names: Sequence[str]) -> None:
            self.count += len(names)

        def began(self, name: str) -> None:
            report_step(name, self.done, self.count)

        def ended(self, name: str, seconds: float) -> None:
            self.done += 1

    start_ns = time.time_ns()
    options = BuildOptions(jobs, tier, observer=Steps(), pool=_POOL, cluster=cluster, store=store_url)
    baked = Baked()
    try:
        report = bake(scene, out, options)
    except ParadizeError as error:
        baked.errors = list(error.errors) if isinstance(error, GroupedError) else [error]
    else:
        baked.report, baked.out, baked.errors = report.as_json(), report.out, report.errors
    if module := _foreign():  # code was saved during the bake, so the record of its code may be wrong
        store.put_bake(name, None)
        return Baked(foreign=module)
    baked.reads = _reads(store.get_bake(name), baked) or _candidates(scene, baked.errors, start_ns)
    return baked


def warm_up(jobs: int) -> None:
    """Starts the workers that a change of a picture needs, for one job or two."""
    for count in range(1, min(jobs, 2) + 1):
        run_jobs([Job(f"warm {i}", load_bakers, {}) for i in range(count)], count, pool=_POOL)


def load_bakers() -> None:
    """Imports the baker of maps."""
    from paradize.bakers.maps import bake as bake_maps  # noqa: F401


def _foreign() -> str | None:
    """A module whose file changed after this process loaded it."""
    from paradize.jobs.code import clear_caches, code_of, foreign_module

    clear_caches()
    return foreign_module(code_of("paradize.build.bake"))


def _reads(record: Any, baked: Baked) -> dict[Path, Stamp | None]:
    """The files that the record of a bake says it read; empty without a record."""
    from paradize.build.provenance import is_record

    if baked.errors or not is_record(record):
        return {}
    outputs = resolved(baked.out) if baked.out else None
    reads: dict[Path, Stamp | None] = {Path(path): None for path in record["absent"]}
    for path, (was, _) in record["file_hashes"]["files"].items():
        if resolved(Path(path)).parent != outputs and Path(path).suffix not in (".py", ".so"):
            reads[Path(path)] = was
    return reads


def _candidates(scene: Path, errors: list[ParadizeError], start_ns: int) -> dict[Path, Stamp | None]:
    """The files that may repair a failed bake, existing or not: the scene, each file that it or its models
    may name, and the files of the errors. A file that was saved after start_ns, the start of the bake, has no
    stamp: it differs from what the bake began with."""
    from paradize.build.materials.map_sets import find_map_sets
    from paradize.scene.settings import load_scene

    files = {scene, *(Path(error.file) for error in errors if error.file)}
    tried_libraries: list[Path] = []
    try:
        tree = parse_toml(read_file(scene, TOML_BYTES), scene)
        files |= {resolved(scene).parent / text for text in _texts(tree) if "\0" not in text}
        found = find_map_sets(load_scene(scene), scene, tried_libraries=tried_libraries)
        files |= {*found.libraries, *found.missing}
    except (OSError, ValueError, ParadizeError):  # the bake itself reported it
        files |= {*tried_libraries}
    stamps = {path.absolute(): stamp(path) for path in files}
    return {path: was if was is None or was[2] < start_ns else None for path, was in stamps.items()}


def _texts(tree: Any) -> Iterator[str]:
    """Every string in a TOML document."""
    if isinstance(tree, str):
        yield tree
    elif isinstance(tree, dict | list):
        for part in tree.values() if isinstance(tree, dict) else tree:
            yield from _texts(part)

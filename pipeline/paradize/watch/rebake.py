"""One bake of a watched scene, in a process that stays: what it gave, and what it read.

Light to import: the process that asks for it (watch/loop.py) loads nothing of the pipeline, so that it
outlives code that is being written.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from paradize.documents import TOML_BYTES, parse_toml
from paradize.errors import GroupedError, ParadizeError
from paradize.files import read_file, resolved
from paradize.jobs.pool import Job, WorkerPool, run_jobs
from paradize.store.local import Stamp, Store, default_root, stamp

_POOL = WorkerPool()  # this process's workers, kept warm from bake to bake


@dataclass
class Baked:
    """report: as `bake --json` prints it; None where it did not come to that. out: the folder. errors: all.
    reads: what the bake reads, or looks for in vain, with the stamp that each had. foreign: a module that
    this process runs in another version than the file has: nothing here counts."""

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
    afresh: bool,
) -> Baked:
    """Bakes the scene where something changed. jobs, tier, cluster, store_url: as in options.BuildOptions.
    afresh: the last bake's record may be of other code and does not count; the store does."""
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(0))  # ends a bake in good order

    from paradize.build.bake import bake
    from paradize.build.options import BuildOptions
    from paradize.build.provenance import record_name

    store = Store(default_root())
    name = record_name(scene, out, tier)
    if afresh:
        store.put_bake(name, None)
    if found := _foreign():
        return Baked(foreign=found)
    made = Baked()
    try:
        report = bake(scene, out, BuildOptions(jobs, tier, pool=_POOL, cluster=cluster, store=store_url))
    except ParadizeError as error:
        made.errors = list(error.errors) if isinstance(error, GroupedError) else [error]
    else:
        made.report, made.out, made.errors = report.as_json(), report.out, report.errors
    if found := _foreign():  # written as it baked: what the record says of the code may be wrong
        store.put_bake(name, None)
        return Baked(foreign=found)
    made.reads = _reads(store.get_bake(name), made) or _named(scene, made.errors)
    return made


def warm_up(jobs: int) -> None:
    """Has the workers loaded that a change of a picture needs, one task or two."""
    for count in range(1, min(jobs, 2) + 1):
        run_jobs([Job(f"warm {i}", load_bakers, {}) for i in range(count)], count, pool=_POOL)


def load_bakers() -> None:
    """Loads what bakes pictures."""
    from paradize.bakers.maps import bake as bake_maps  # noqa: F401


def _foreign() -> str | None:
    from paradize.jobs.code import clear_caches, code_of, foreign_module

    clear_caches()
    return foreign_module(code_of("paradize.build.bake"))


def _reads(record: Any, made: Baked) -> dict[Path, Stamp | None]:
    """What the record of a bake says that it read; nothing where the bake was not remembered."""
    from paradize.build.provenance import is_record

    if made.errors or not is_record(record):
        return {}
    outputs = resolved(made.out) if made.out else None
    found: dict[Path, Stamp | None] = {Path(path): None for path in record["absent"]}
    for path, (was, _) in record["memory"]["files"].items():
        if resolved(Path(path)).parent != outputs and Path(path).suffix not in (".py", ".so"):
            found[Path(path)] = was
    return found


def _named(scene: Path, errors: list[ParadizeError]) -> dict[Path, Stamp | None]:
    """Whatever may mend a bake that failed: the scene, each file that it may name, what its models name, and
    what the errors name; there or not."""
    from paradize.build.material_colors import material_colors_of
    from paradize.scene.settings import load_scene

    found = {scene, *(Path(error.file) for error in errors if error.file)}
    begun: list[Path] = []
    try:
        tree = parse_toml(read_file(scene, TOML_BYTES), scene)
        found |= {resolved(scene).parent / text for text in _texts(tree) if "\0" not in text}
        _, libraries, absent = material_colors_of(load_scene(scene), scene, begun)
        found |= {*libraries, *absent}
    except (OSError, ValueError, ParadizeError):  # told already, as what failed
        found |= {*begun}
    return {path.absolute(): stamp(path) for path in found}


def _texts(tree: Any) -> Iterator[str]:
    """Every string in a TOML document."""
    if isinstance(tree, str):
        yield tree
    elif isinstance(tree, dict | list):
        for part in tree.values() if isinstance(tree, dict) else tree:
            yield from _texts(part)

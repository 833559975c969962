"""How a build is done: its options, and who hears of its jobs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from paradize.jobs.pool import WorkerPool
from paradize.scene.flight import Flight
from paradize.scene.requirements import BakeJob
from paradize.scene.settings import Scene
from paradize.store.local import Store


class JobObserver:
    """Hears what becomes of the jobs of a bake, each by its name; this one does nothing about it."""

    def planned(self, names: Sequence[str]) -> None:
        """These are to be run."""

    def began(self, name: str) -> None:
        """One runs, maybe once more."""

    def reached(self, name: str, step: str) -> None:
        """A running one begins this step. Called from another thread."""

    def ended(self, name: str, seconds: float) -> None:
        """One is done with, well or not."""

    def warned(self, text: str) -> None:
        """Something went wrong that the bake can do without."""


@dataclass(frozen=True)
class BuildOptions:
    """How a bake is done. jobs: worker processes (0: one a core). tier: one of scene.TIERS; None: the scene's
    own. force: everything anew, nothing is read from the store. watcher: hears of every job. tiers: the tier
    of a task, or of the task of an artifact, by name, where it is another than `tier`. pool: workers that are
    kept (jobs/pool.py). cluster: the address of a Dask scheduler whose workers bake; `jobs` at once
    there, or as many as they have threads. store: the URL of a
    store that is shared (store/shared.py). uncompressed: textures in the most exact of their formats. whole:
    also what no view asks for; with these two, what pictures are held against (scene/settings.py)."""

    jobs: int = 0
    tier: str | None = None
    force: bool = False
    observer: JobObserver | None = None
    tiers: Mapping[str, str] = field(default_factory=dict)
    pool: WorkerPool | None = None
    cluster: str | None = None
    store: str | None = None
    uncompressed: bool = False
    whole: bool = False

    @property
    def usual(self) -> bool:
        """Whether it is a bake that others may look up on record."""
        return not (self.uncompressed or self.whole)

    @property
    def workers(self) -> int:
        """Worker processes."""
        return self.jobs or os.cpu_count() or 1

    def tier_of(self, job: BakeJob, scene: Scene) -> str:
        """The tier of a task: what its own name says, else the name of one of its artifacts, else `tier`."""
        names = [job.name, *(output.artifact for output in job.outputs)]
        named = (self.tiers[name] for name in names if name in self.tiers)
        return next(named, self.tier or scene.head.tier)


@dataclass(frozen=True)
class BuildContext:
    """A scene that is being baked. scratch: a folder for what workers write. scene_path: its file. out: where
    the artifacts go."""

    store: Store
    scratch: Path
    scene_path: Path
    scene: Scene
    flight: Flight
    out: Path
    options: BuildOptions

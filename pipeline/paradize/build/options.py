"""The options of a build, its context, and the observer of its jobs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from paradize.jobs.limits import default_jobs
from paradize.jobs.pool import WorkerPool
from paradize.scene.flight import Flight
from paradize.scene.jobs import BakeJob
from paradize.scene.settings import Scene
from paradize.store.local import Store


class JobObserver:
    """Is called as the jobs of a bake run, each with its name. This one does nothing."""

    def planned(self, names: Sequence[str]) -> None:
        """These jobs will run."""

    def began(self, name: str) -> None:
        """A job starts, perhaps again."""

    def reached(self, name: str, step: str) -> None:
        """A running job begins this step. Called from another thread."""

    def ended(self, name: str, seconds: float) -> None:
        """A job has ended, with or without error."""

    def warned(self, text: str) -> None:
        """A problem that does not stop the bake."""


@dataclass(frozen=True)
class BuildOptions:
    """jobs: worker processes (0: limits.default_jobs); on a cluster, jobs at once (0: one per thread). tier:
    one of tiers.TIER_OPTIONS; None: the scene's own. force: bake everything; read nothing from the store.
    observer: of the jobs. tiers: tier by job or artifact name, where it differs from `tier`. pool: workers
    to reuse (jobs/pool.py). cluster: address of a Dask scheduler. store: URL of a shared store
    (store/shared.py). uncompressed: textures in their most exact format. whole: publish also what no view
    needs; the last two make reference pictures."""

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
        """Whether the result may be reused by later builds."""
        return not (self.uncompressed or self.whole)

    @property
    def workers(self) -> int:
        """Number of worker processes. Raises BakeError for an invalid $PARADIZE_JOBS."""
        return self.jobs or default_jobs()

    def tier_of(self, job: BakeJob, scene: Scene) -> str:
        """Returns the tier of a job: by its name, else by the name of one of its artifacts, else `tier`."""
        names = [job.name, *(output.artifact for output in job.outputs)]
        named = (self.tiers[name] for name in names if name in self.tiers)
        return next(named, self.tier or scene.head.tier)


@dataclass(frozen=True)
class BuildContext:
    """A scene that is being baked. scratch: folder for files of workers. scene_path: the scene's file.
    out: the published folder."""

    store: Store
    scratch: Path
    scene_path: Path
    scene: Scene
    flight: Flight
    out: Path
    options: BuildOptions

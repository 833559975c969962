"""Where a bake's jobs run, here or on a cluster, and who hears of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from paradize.build.options import BuildOptions, Watcher
from paradize.errors import ParadizeError
from paradize.jobs.pool import Job, Outcome, run_jobs


def run_work(
    how: BuildOptions, jobs: list[Job], on_outcome: Callable[[Outcome], None] | None = None
) -> list[Outcome]:
    """The jobs' outcomes, in their order. on_outcome: called when one ends. Raises ClusterLost where there is
    no cluster to begin with."""
    if not jobs:
        return []
    watcher = how.watcher or Watcher()
    watcher.planned([job.name for job in jobs])

    def began(job: Job) -> None:
        watcher.began(job.name)

    def ended(outcome: Outcome) -> None:
        if on_outcome:
            on_outcome(outcome)
        watcher.ended(outcome.name, outcome.seconds)

    if how.cluster is None:
        workers = min(how.workers, len(jobs))
        return run_jobs(jobs, workers, ended, on_start=began, on_step=watcher.reached, pool=how.pool)
    from paradize.cluster.scheduler import run_on_cluster  # here: few bakes need it

    max_parallel = how.jobs or None
    return run_on_cluster(
        how.cluster, jobs, ended, on_start=began, warn=watcher.warned, max_parallel=max_parallel
    )


def read_by(sources: Iterable[Path]) -> dict[Path, bool]:
    """All that a bake of these files reads, for another machine: with an OBJ also its material files, and,
    as False, the maps that those name, which need only be there."""
    found: dict[Path, bool] = {}
    for path in sources:
        found[path] = True
        if path.suffix.lower() == ".obj":
            from paradize.readers.obj import read_obj

            try:
                read = read_obj(path)
            except ParadizeError:
                continue  # the baker reads it again, and raises
            found |= dict.fromkeys(read.libraries, True)
            for material in read.materials.values():
                for value in vars(material).values():
                    if isinstance(value, Path):
                        found.setdefault(value, False)
    return found

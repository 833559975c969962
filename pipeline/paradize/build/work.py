"""Runs the jobs of a build, on this machine or on a cluster, and reports their progress."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from paradize.build.options import BuildOptions, JobObserver
from paradize.errors import ParadizeError
from paradize.jobs.pool import Job, Outcome, run_jobs
from paradize.kinds import MODEL_SUFFIXES


def run_build_jobs(
    options: BuildOptions, jobs: list[Job], on_outcome: Callable[[Outcome], None] | None = None
) -> list[Outcome]:
    """Returns the jobs' outcomes, in their order. on_outcome: called when one ends. Raises ClusterLost if
    the cluster cannot be reached."""
    if not jobs:
        return []
    observer = options.observer or JobObserver()
    observer.planned([job.name for job in jobs])

    def on_start(job: Job) -> None:
        observer.began(job.name)

    def on_end(outcome: Outcome) -> None:
        if on_outcome:
            on_outcome(outcome)
        observer.ended(outcome.name, outcome.seconds)

    if options.cluster is None:
        workers = min(options.workers, len(jobs))
        return run_jobs(jobs, workers, on_end, on_start=on_start, on_step=observer.reached, pool=options.pool)
    from paradize.cluster.scheduler import run_on_cluster  # here: few bakes need it

    max_parallel = options.jobs or None
    return run_on_cluster(
        options.cluster, jobs, on_end, on_start=on_start, warn=observer.warned, max_parallel=max_parallel
    )


def files_read_by(sources: Iterable[Path], root: Path) -> dict[Path, bool]:
    """Returns all files that a bake of these sources reads, for another machine: with a model also the
    files beside it; and, as False, the maps that those name, which only have to exist. root: as of
    read_model."""
    files: dict[Path, bool] = {}
    for path in sources:
        files[path] = True
        if path.suffix.lower() in MODEL_SUFFIXES:
            from paradize.readers.model import read_model

            try:
                read = read_model(path, root)
            except ParadizeError:
                continue  # the baker reads it again, and raises
            files |= dict.fromkeys(read.libraries, True)
            for material in read.materials.values():
                for source in material.maps.values():
                    files.setdefault(source.picture.file, False)
    return files

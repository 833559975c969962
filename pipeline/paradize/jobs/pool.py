"""Runs jobs in worker processes. A job that crashes, hangs or runs out of memory does not affect the others.

Workers are fresh interpreters (never forked). They talk over a socket pair and die with their parent. A job
whose process crashes or hangs is killed and tried once more. The memory of all running jobs stays below a
limit: a job starts when its estimate fits beside what the running jobs use. One job may always run. Outcomes
are returned in the order of the jobs, so they do not depend on the number of workers.
"""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from paradize.errors import BakeError, ParadizeError
from paradize.jobs.limits import TIME_VARIABLE, VARIABLE, cores, given_threads, memory_limit, time_limit
from paradize.jobs.process import Answer, Job, Worker, WorkerPool, require_own_names, start_worker
from paradize.jobs.progress import Step

__all__ = ["Job", "Outcome", "WorkerPool", "run_jobs"]

_TRIES = 2
_POLL_S = 0.05  # how often memory and time are checked


@dataclass(frozen=True)
class Outcome:
    """The result of a job: its value or its error. seconds: of the last try. tries: how often the job ran."""

    name: str
    value: Any
    error: ParadizeError | None
    seconds: float
    tries: int = 1


def run_jobs(
    jobs: Sequence[Job],
    workers: int,
    on_outcome: Callable[[Outcome], None] | None = None,
    *,
    on_start: Callable[[Job], None] | None = None,
    on_step: Callable[[str, str], None] | None = None,
    threads: int | None = None,
    pool: WorkerPool | None = None,
) -> list[Outcome]:
    """Runs the jobs, at most `workers` at once: each as `job.call(**job.arguments)`, in another process.
    Returns their outcomes in the order of the jobs.

    on_start, on_outcome: called when a job starts and when it ends. on_step: called from another thread with
    the job's name and the step that it begins (progress.report_step). threads: native threads of each worker
    (default: $PARADIZE_THREADS, else the cores divided by the number of workers). pool: workers to use and to
    keep for the next call (default: new workers, which end with this call).

    A failed job raises nothing: its outcome holds the error. Raises ValueError for two jobs of one name, and
    BakeError for an invalid $PARADIZE_MEMORY, $PARADIZE_TIMEOUT or $PARADIZE_THREADS.
    """
    if threads is None and given_threads() is None:
        threads = max(1, cores() // max(1, workers))
    used = WorkerPool() if pool is None else pool
    scheduler = _Scheduler(
        jobs=jobs,
        workers=max(1, workers),
        threads=threads,
        on_start=on_start,
        on_step=on_step,
        on_outcome=on_outcome,
        pool=used,
    )
    try:
        return scheduler.run()
    finally:
        if pool is None or scheduler.busy():
            used.stop()


class _Scheduler:
    """One call of run_jobs."""

    def __init__(
        self,
        jobs: Sequence[Job],
        workers: int,
        threads: int | None,
        on_start: Callable[[Job], None] | None,
        on_step: Callable[[str, str], None] | None,
        on_outcome: Callable[[Outcome], None] | None,
        pool: WorkerPool,
    ) -> None:
        self.jobs, self.workers, self.threads = jobs, workers, threads
        self.on_start, self.on_step, self.on_outcome = on_start, on_step, on_outcome
        self.limit = memory_limit()
        time_limit()  # raises for an invalid setting before any job starts
        require_own_names(jobs)
        self.waiting = [(job, 1) for job in jobs]  # jobs, and the number of their next try
        self.alone: list[
            tuple[Job, int]
        ] = []  # jobs that ran out of memory beside others: they run last, alone
        self.outcomes: dict[str, Outcome] = {}
        self.pool = pool

    def run(self) -> list[Outcome]:
        while self.waiting or self.alone or self.busy():
            self.start_jobs()
            with suppress(queue.Empty):
                self.receive(self.pool.answers.get(timeout=_POLL_S))
            self.enforce_limits()
        return [self.outcomes[job.name] for job in self.jobs]

    def busy(self) -> list[Worker]:
        return [worker for worker in self.pool.workers if worker.job]

    def start_jobs(self) -> None:
        """Gives waiting jobs to workers as long as there is memory for them."""
        while len(busy := self.busy()) < self.workers:
            if self.waiting:
                fitting = self.first_fitting(busy)
                if fitting is None:
                    return
                job, tries = self.waiting.pop(fitting)
            elif self.alone and not busy:
                job, tries = self.alone.pop(0)
            else:
                return
            idle = [worker for worker in self.pool.workers if worker.job is None]
            idle_worker = next((worker for worker in idle if worker.threads == self.threads), None)
            if idle_worker is None:
                if len(self.pool.workers) >= 2 * self.workers:  # idle interpreters take memory
                    self.dismiss(idle[0])
                idle_worker = start_worker(self.pool.answers, self.threads, self.limit)
                self.pool.workers.append(idle_worker)
            if self.on_start:
                self.on_start(job)
            idle_worker.send(job, tries, partial(self.reached, job.name) if self.on_step else None)

    def reached(self, name: str, step: Step) -> None:
        assert self.on_step
        self.on_step(name, step.name)

    def first_fitting(self, busy: list[Worker]) -> int | None:
        """Returns the index of the first waiting job that fits beside the running ones, or None."""
        if not busy or self.limit is None:
            return 0
        free_bytes = self.limit - sum(
            max(worker.job.memory_bytes, worker.used_bytes()) for worker in busy if worker.job
        )
        return next((i for i, (job, _) in enumerate(self.waiting) if job.memory_bytes <= free_bytes), None)

    def receive(self, answer: Answer) -> None:
        """Handles an answer of a worker."""
        worker = answer.worker
        if worker not in self.pool.workers:
            return  # killed meanwhile
        if answer.dead:
            how, mend = worker.death()
            self.fail(worker, f"could not be baked: {how}", mend, self.waiting)
        else:
            self.end(worker, answer.value, answer.error)

    def enforce_limits(self) -> None:
        """Kills workers that exceed the time limit, and the worker that exceeds its memory estimate most when
        all workers together exceed the memory limit."""
        now = time.monotonic()
        for worker in self.busy():
            if worker.job and now - worker.since > worker.job.most_s:
                mend = f"where it only needs longer, set ${TIME_VARIABLE} to more seconds"
                self.fail(worker, f"took longer than {worker.job.most_s:g} s", mend, self.waiting)
        if self.limit is None or sum(worker.used_bytes() for worker in self.pool.workers) <= self.limit:
            return
        for worker in [worker for worker in self.pool.workers if not worker.job]:
            self.dismiss(worker)
        beyond = {
            worker: worker.used_bytes() - worker.job.memory_bytes for worker in self.busy() if worker.job
        }
        if beyond and sum(worker.used_bytes() for worker in beyond) > self.limit:
            what = f"needs more memory than the limit of {self.limit / 1e6:.0f} MB"
            mend = f"bake a smaller input, or set ${VARIABLE}"
            again = self.alone if len(beyond) > 1 else None
            self.fail(max(beyond, key=beyond.__getitem__), what, mend, again)

    def fail(self, worker: Worker, what: str, mend: str | None, again: list[tuple[Job, int]] | None) -> None:
        """Kills a worker. Its job is appended to `again` if it has a try left; else it ends with an error."""
        job = worker.job
        assert job is not None
        if again is not None and worker.tries < _TRIES and not self.pool.closed:
            again.append((job, worker.tries + 1))
            worker.job = None
        else:
            twice = ", twice" if worker.tries > 1 else ""
            self.end(worker, None, BakeError(f"{job.name} {what}{twice}", file=job.file, mend=mend))
        self.dismiss(worker)

    def end(self, worker: Worker, value: Any, error: ParadizeError | None) -> None:
        """Stores the outcome of a worker's job."""
        job = worker.job
        assert job is not None
        outcome = Outcome(job.name, value, error, time.monotonic() - worker.since, worker.tries)
        self.outcomes[job.name] = outcome
        worker.job = None
        if self.on_outcome:
            self.on_outcome(outcome)

    def dismiss(self, worker: Worker) -> None:
        worker.stop()
        self.pool.workers.remove(worker)

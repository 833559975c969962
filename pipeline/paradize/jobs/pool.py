"""Runs jobs in worker processes of our own: a crash, a hang or a hunger for memory spoils one job, no other.

Workers are fresh interpreters (never forked), talk over a socket pair, and die with their parent. A job whose
process crashes or hangs is killed and tried once more. The memory of all running jobs stays under a limit: a
job starts when what it is thought to take fits beside what the others take; one may always run. Results
come back by job, so their order does not depend on how many workers there were.
"""

from __future__ import annotations

import os
import queue
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from paradize.errors import BakeError, ParadizeError
from paradize.jobs.limits import TIME_VARIABLE, VARIABLE, cores, memory_limit, time_limit
from paradize.jobs.process import Answer, Job, Worker, WorkerPool, start_worker
from paradize.kernels.threads import VARIABLE as THREADS

__all__ = ["Job", "Outcome", "WorkerPool", "run_jobs"]

_TRIES = 2
_LOOK_S = 0.05  # how often memory and time are looked at


@dataclass(frozen=True)
class Outcome:
    """What became of a job: its value, or the error that it met; the seconds of the last try; the tries."""

    name: str
    value: Any
    error: ParadizeError | None
    seconds: float
    tries: int = 1


def run_jobs(
    jobs: Sequence[Job],
    workers: int,
    told: Callable[[Outcome], None] | None = None,
    *,
    began: Callable[[Job], None] | None = None,
    threads: int | None = None,
    crew: WorkerPool | None = None,
) -> list[Outcome]:
    """Runs the jobs, at most `workers` at once; returns their outcomes in the order of the jobs. `began` and
    `told` hear of each as it starts and ends. threads: what native kernels use in each worker (default:
    $PARADIZE_THREADS, else the cores shared out among the workers). crew: workers to take, and to leave there
    for the next call (default: new ones, which end with this call). Never raises for a job's own failure:
    that is in its outcome. Raises BakeError where $PARADIZE_MEMORY is no amount of memory, or
    $PARADIZE_TIMEOUT no time."""
    if threads is None and not os.environ.get(THREADS):
        threads = max(1, cores() // max(1, workers))
    hands = WorkerPool() if crew is None else crew
    shift = _Scheduler(jobs, max(1, workers), threads, began, told, hands)
    try:
        return shift.run()
    finally:
        if crew is None or shift.busy():
            hands.stop()


class _Scheduler:
    """One call of run_jobs."""

    def __init__(
        self,
        jobs: Sequence[Job],
        workers: int,
        threads: int | None,
        began: Callable[[Job], None] | None,
        told: Callable[[Outcome], None] | None,
        crew: WorkerPool,
    ) -> None:
        self.jobs, self.workers, self.threads, self.began, self.told = jobs, workers, threads, began, told
        self.limit = memory_limit()
        time_limit()  # a wrong setting is told before anything starts
        self.waiting = [(job, 1) for job in jobs]  # and which try it would be
        self.alone: list[tuple[Job, int]] = []  # those that took too much beside others: after all others
        self.outcomes: dict[str, Outcome] = {}
        self.hands, self.crew, self.answers = crew, crew.workers, crew.answers

    def run(self) -> list[Outcome]:
        while self.waiting or self.alone or self.busy():
            self.hand_out()
            with suppress(queue.Empty):
                self.hear(self.answers.get(timeout=_LOOK_S))
            self.look()
        return [self.outcomes[job.name] for job in self.jobs]

    def busy(self) -> list[Worker]:
        return [worker for worker in self.crew if worker.job]

    def hand_out(self) -> None:
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
            idle = [worker for worker in self.crew if worker.job is None]
            free = next((worker for worker in idle if worker.threads == self.threads), None)
            if free is None:
                if len(self.crew) >= 2 * self.workers:  # a crew that is kept: its interpreters take memory
                    self.dismiss(idle[0])
                free = start_worker(self.answers, self.threads, self.limit)
                self.crew.append(free)
            if self.began:
                self.began(job)
            free.give(job, tries)

    def first_fitting(self, busy: list[Worker]) -> int | None:
        """The first waiting job that fits beside those that run: its place; None where none does."""
        if not busy or self.limit is None:
            return 0
        room = self.limit - sum(max(worker.job.memory_bytes, worker.held()) for worker in busy if worker.job)
        return next((i for i, (job, _) in enumerate(self.waiting) if job.memory_bytes <= room), None)

    def hear(self, answer: Answer) -> None:
        """Takes what a worker sent."""
        worker = answer.worker
        if worker not in self.crew:
            return  # killed meanwhile
        if answer.dead:
            what = f"could not be baked: {worker.death()}"
            self.fail(worker, what, "the input may be at fault; please report it", self.waiting)
        else:
            self.end(worker, answer.value, answer.error)

    def look(self) -> None:
        """Kills what takes too long, and what takes more memory than there may be."""
        now = time.monotonic()
        for worker in self.busy():
            if worker.job and now - worker.since > worker.job.most_s:
                mend = f"where it only needs longer, set ${TIME_VARIABLE} to more seconds"
                self.fail(worker, f"took longer than {worker.job.most_s:g} s", mend, self.waiting)
        if self.limit is None or sum(worker.held() for worker in self.crew) <= self.limit:
            return
        for worker in [worker for worker in self.crew if not worker.job]:
            self.dismiss(worker)
        beyond = {worker: worker.held() - worker.job.memory_bytes for worker in self.crew if worker.job}
        if beyond and sum(worker.held() for worker in beyond) > self.limit:
            what = f"needs more memory than the {self.limit / 1e6:.0f} MB that there may be"
            mend = f"bake a smaller input, or set ${VARIABLE}"
            again = self.alone if len(beyond) > 1 else None
            self.fail(max(beyond, key=beyond.__getitem__), what, mend, again)

    def fail(self, worker: Worker, what: str, mend: str | None, again: list[tuple[Job, int]] | None) -> None:
        """Kills a worker; its job goes to `again` where it has a try left, and is an error else."""
        job = worker.job
        assert job is not None
        if again is not None and worker.tries < _TRIES and not self.hands.closed:
            again.append((job, worker.tries + 1))
            worker.job = None
        else:
            twice = ", twice" if worker.tries > 1 else ""
            self.end(worker, None, BakeError(f"{job.name} {what}{twice}", file=job.file, mend=mend))
        self.dismiss(worker)

    def end(self, worker: Worker, value: Any, error: ParadizeError | None) -> None:
        """Notes what became of a worker's job."""
        job = worker.job
        assert job is not None
        outcome = Outcome(job.name, value, error, time.monotonic() - worker.since, worker.tries)
        self.outcomes[job.name] = outcome
        worker.job = None
        if self.told:
            self.told(outcome)

    def dismiss(self, worker: Worker) -> None:
        worker.stop()
        self.crew.remove(worker)

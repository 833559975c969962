"""The workers of a cluster and the jobs that run on them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from paradize.errors import BakeError
from paradize.jobs.pool import Job


@dataclass(eq=False)
class PendingTask:
    """A job that waits or runs on the cluster. tries: number of the current try. lost: how often it was lost
    through no fault of its own. alone: whether it must run alone on its machine, because it lost a worker
    before."""

    job: Job
    tries: int = 1
    lost: int = 0
    alone: bool = False
    future: Any = None
    since: float = 0.0


@dataclass(eq=False)
class DaskWorker:
    """A Dask worker: its threads, its answer to the greeting (info; None: none yet), the tasks that it runs
    (pending)."""

    address: str
    threads: int
    since: float
    info: dict[str, Any] | None = None
    refused: str = ""  # why it gets no jobs
    foreign: set[str] = field(default_factory=set)  # modules whose code differs there
    pending: list[PendingTask] = field(default_factory=list)
    greeting: Any = None

    def load(self) -> float:
        """Jobs per thread."""
        return len(self.pending) / self.threads

    @property
    def name(self) -> str:
        host = (self.info or {}).get("host")
        return f"{host} ({self.address})" if host else self.address

    def foreign_to(self, job: Job) -> str:
        """A module of the job whose code differs on this worker; "" where there is none."""
        return next(iter(sorted(self.foreign & job.code.keys())), "")

    def takes(self, job: Job) -> bool:
        return not self.refused and not self.foreign_to(job)

    def same_host(self, other: DaskWorker) -> bool:
        """Whether both run on the same computer."""
        return bool(self.info and other.info and self.info["host"] == other.info["host"])

    def reason(self, job: Job) -> str:
        """Why it does not take the job."""
        return self.refused or f"runs other code: {self.foreign_to(job)}"

    def error(self, why: str) -> BakeError:
        """The message about a worker that cannot be used."""
        mend = "install the same paradize there, and start the worker again"
        return BakeError(f"the worker {self.name} {why}", mend=mend)

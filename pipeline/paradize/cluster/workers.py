"""The workers of a cluster, and the jobs that are on their way to them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from paradize.errors import BakeError
from paradize.jobs.pool import Job


@dataclass(eq=False)
class PendingTask:
    """A job on its way. tries: which one it is of the job's. lost: how often it went down without a fault of
    its own. alone: whether it lost its machine before."""

    job: Job
    tries: int = 1
    lost: int = 0
    alone: bool = False
    future: Any = None
    since: float = 0.0


@dataclass(eq=False)
class Machine:
    """A Dask worker: its threads, what it said of itself (None: nothing yet), what runs there."""

    address: str
    threads: int
    since: float
    told: dict[str, Any] | None = None
    refused: str = ""  # why it gets nothing
    foreign: set[str] = field(default_factory=set)  # modules that it has in other versions
    errands: list[PendingTask] = field(default_factory=list)
    greeting: Any = None

    def load(self) -> float:
        """How many jobs each thread has."""
        return len(self.errands) / self.threads

    @property
    def name(self) -> str:
        host = (self.told or {}).get("host")
        return f"{host} ({self.address})" if host else self.address

    def foreign_to(self, job: Job) -> str:
        """A module of the job's that is another version here; empty where there is none."""
        return next(iter(sorted(self.foreign & job.code.keys())), "")

    def takes(self, job: Job) -> bool:
        return not self.refused and not self.foreign_to(job)

    def near(self, other: Machine) -> bool:
        """Whether both run on one computer."""
        return bool(self.told and other.told and self.told["host"] == other.told["host"])

    def why_not(self, job: Job) -> str:
        """Why it does not take the job."""
        return self.refused or f"runs other code: {self.foreign_to(job)}"

    def refusal(self, why: str) -> BakeError:
        """The message about it."""
        mend = "install the same paradize there, and start the worker again"
        return BakeError(f"the worker {self.name} {why}", mend=mend)

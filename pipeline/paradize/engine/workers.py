"""Runs jobs in worker processes of our own: a crash or a hang spoils one job and no other.

Workers are fresh interpreters (never forked), talk over a socket pair, and die with their parent. Results
come back by job, so their order does not depend on how many workers there were.
"""

from __future__ import annotations

import os
import pickle
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from typing import Any

from paradize.errors import BakeError, ParadizeError
from paradize.kernels.threads import VARIABLE

_BOOT = "import sys; from paradize.engine.worker import serve; serve(int(sys.argv[1]))"


@dataclass(frozen=True)
class Job:
    """A call to a module-level function; arguments and result are pickled. `name` stands in messages."""

    name: str
    call: Callable[..., Any]
    arguments: dict[str, Any]
    timeout_s: float = 1800.0


@dataclass(frozen=True)
class Outcome:
    """What became of a job: its value, or the error that it met; and the seconds it took."""

    name: str
    value: Any
    error: ParadizeError | None
    seconds: float


@dataclass
class _Worker:
    process: subprocess.Popen[bytes]
    link: Connection
    job: Job | None = None
    since: float = field(default=0.0)


def _start(threads: int | None = None) -> _Worker:
    ours, theirs = socket.socketpair()
    with theirs:
        process = subprocess.Popen(
            [sys.executable, "-c", _BOOT, str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            env=None if threads is None else {**os.environ, VARIABLE: str(threads)},
            stdout=2,  # what libraries print goes to standard error: standard output is the caller's
        )
    return _Worker(process, Connection(ours.detach()))


def _stop(worker: _Worker) -> None:
    worker.link.close()
    worker.process.kill()
    worker.process.wait()


def _death(worker: _Worker) -> str:
    try:
        code = worker.process.wait(timeout=5.0)
    except subprocess.TimeoutExpired:
        return "its process stopped answering"
    if code >= 0:
        return f"its process ended with code {code}"
    try:
        return f"its process crashed ({signal.Signals(-code).name})"
    except ValueError:
        return f"its process was killed by signal {-code}"


def run_jobs(
    jobs: Sequence[Job],
    workers: int,
    told: Callable[[Outcome], None] | None = None,
    *,
    threads: int | None = None,
) -> list[Outcome]:
    """Runs the jobs, at most `workers` at once; returns their outcomes in the order of the jobs. `told` hears
    of each as it ends. threads: what native kernels use in each worker (default: `default_threads`). Never
    raises for a job's own failure: that is in its outcome."""
    waiting = list(reversed(jobs))
    outcomes: dict[str, Outcome] = {}
    crew: list[_Worker] = []

    def ended(worker: _Worker, value: Any, error: ParadizeError | None) -> None:
        assert worker.job is not None
        outcome = Outcome(worker.job.name, value, error, time.monotonic() - worker.since)
        outcomes[worker.job.name] = outcome
        worker.job = None
        if told:
            told(outcome)

    def give(worker: _Worker) -> None:
        worker.job, worker.since = waiting.pop(), time.monotonic()
        with suppress(BrokenPipeError, ConnectionError):  # its death is read from the link
            worker.link.send((worker.job.call, worker.job.arguments))

    try:
        while waiting or any(worker.job for worker in crew):
            for worker in crew:
                if worker.job is None and waiting:
                    give(worker)
            while waiting and len(crew) < max(1, workers):
                crew.append(_start(threads))
                give(crew[-1])
            busy = [worker for worker in crew if worker.job]
            ready = wait([worker.link for worker in busy], timeout=0.5)
            now = time.monotonic()
            for worker in busy:
                assert worker.job is not None
                if worker.link in ready:
                    try:
                        value, error = worker.link.recv()
                    except (EOFError, ConnectionError, pickle.UnpicklingError):
                        what = f"{worker.job.name} could not be baked: {_death(worker)}"
                        ended(
                            worker, None, BakeError(what, mend="the input may be at fault; please report it")
                        )
                        _stop(worker)
                        crew.remove(worker)
                        continue
                    ended(worker, value, error)
                elif now - worker.since > worker.job.timeout_s:
                    limit = worker.job.timeout_s
                    _stop(worker)
                    crew.remove(worker)
                    ended(worker, None, BakeError(f"{worker.job.name} took longer than {limit:g} s"))
    finally:
        for worker in crew:
            _stop(worker)
    return [outcomes[job.name] for job in jobs]

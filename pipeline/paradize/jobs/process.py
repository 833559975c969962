"""A worker process, seen from its parent: start it, send jobs, measure it, kill it.

Each worker has a thread that sends and waits. A worker that stops in the middle of an answer blocks no other.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from paradize.errors import ParadizeError
from paradize.jobs.limits import process_memory, time_limit
from paradize.jobs.progress import Step
from paradize.jobs.scratch import Scratch
from paradize.kernels.threads import VARIABLE, limit_blas

# Modules are found as in this process, not in the folder where it stands, which may hold a json.py.
_BOOT = (
    "import sys; sys.path[:] = {!r}; from paradize.jobs.loader import install; install(); "
    "from paradize.jobs.worker import serve; serve(*map(int, sys.argv[1:]))"
)


@dataclass(frozen=True)
class Job:
    """A call to a module-level function. Arguments and result are pickled. name: used in messages.

    file: the input that messages name. timeout_s: after this time the job counts as hanging; None:
    $PARADIZE_TIMEOUT, else half an hour. memory_bytes: estimate of its peak memory; 0: unknown. code: digests
    that its key was made with (code.code_of); a worker that has loaded other code refuses the job. files:
    files that the call reads, for machines without a shared disk; False: the file only has to exist.
    """

    name: str
    call: Callable[..., Any]
    arguments: dict[str, Any]
    timeout_s: float | None = None
    file: object = None
    memory_bytes: int = 0
    code: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[Path, bool] = field(default_factory=dict)

    @property
    def most_s(self) -> float:
        """The time limit in seconds. Raises BakeError for an invalid $PARADIZE_TIMEOUT."""
        return time_limit() if self.timeout_s is None else self.timeout_s


def require_own_names(jobs: Sequence[Job]) -> None:
    """Raises ValueError where two jobs of one call have one name: outcomes are found by name."""
    names = [job.name for job in jobs]
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        raise ValueError(f"several jobs are named {twice[0]!r}")


@dataclass(frozen=True)
class Answer:
    """The answer of a worker. dead: no valid answer came; the process has ended or sent garbage."""

    worker: Worker
    value: Any = None
    error: ParadizeError | None = None
    dead: bool = False


@dataclass(eq=False)
class Worker:
    """A worker process and its current job. threads: its native threads. tries: number of tries of the job,
    this one included. on_step: hears of the steps of the job, in a thread of its own. scratch: its folder for
    temporary files, removed with it."""

    process: subprocess.Popen[bytes]
    link: Connection
    scratch: Scratch
    threads: int | None = None
    job: Job | None = None
    tries: int = 0
    since: float = 0.0
    on_step: Callable[[Step], None] | None = None
    work: queue.SimpleQueue[Job | None] = field(default_factory=queue.SimpleQueue)

    def send(self, job: Job, tries: int, on_step: Callable[[Step], None] | None = None) -> None:
        """Sends a job. The answer arrives in the queue that the worker was started with."""
        self.job, self.tries, self.since, self.on_step = job, tries, time.monotonic(), on_step
        self.work.put(job)

    def used_bytes(self) -> int:
        """Memory of the process and its children in bytes."""
        return process_memory(self.process.pid)

    def stop(self) -> None:
        """Kills the process."""
        self.process.kill()
        self.process.wait()
        self.scratch.remove()
        self.work.put(None)

    def death(self) -> tuple[str, str]:
        """Says how the process ended, and what to do. Kills it if it still runs."""
        mend = "the input may be at fault; please report it"
        try:
            code = self.process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            return "its process stopped answering", mend
        if code >= 0:
            return f"its process ended with code {code}", mend
        if -code in (signal.SIGKILL, signal.SIGXCPU):  # of Linux without memory, of `ulimit -t`, of a person
            what = f"its process was killed from outside ({signal.Signals(-code).name})"
            return what, "the machine may lack memory: free some, or work with one process: `-j 1`"
        try:
            return f"its process crashed ({signal.Signals(-code).name})", mend
        except ValueError:
            return f"its process was killed by signal {-code}", mend


@dataclass(eq=False)
class WorkerPool:
    """Workers and their queue of answers. A kept pool saves the start of interpreters; `with` ends its
    workers. closed: failed jobs are not tried again."""

    workers: list[Worker] = field(default_factory=list)
    answers: queue.SimpleQueue[Answer] = field(default_factory=queue.SimpleQueue)
    closed: bool = False

    def __enter__(self) -> WorkerPool:
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Kills all workers."""
        for worker in self.workers:
            worker.stop()
        self.workers.clear()


def start_worker(answers: queue.SimpleQueue[Answer], threads: int | None, memory_bytes: int | None) -> Worker:
    """Starts a fresh interpreter that serves jobs; each job ends with one answer. threads: native threads of
    its kernels (None: as in this process). memory_bytes: limit of its allocations (Linux)."""
    parent_end, child_end = socket.socketpair()
    scratch = Scratch()
    environment = {**os.environ, "TMPDIR": str(scratch.path)}
    limit_blas(environment)
    if threads is not None:
        environment[VARIABLE] = str(threads)
    words = (str(child_end.fileno()), str(os.getpid()), str(memory_bytes or 0))
    # Ctrl-C reaches the whole process group. The parent handles it; a starting interpreter would print it.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        process = subprocess.Popen(
            [sys.executable, "-c", _BOOT.format([*map(str, sys.path)]), *words],
            pass_fds=[child_end.fileno()],
            stdin=subprocess.DEVNULL,
            env=environment,
            stdout=2,  # output of libraries goes to standard error; standard output belongs to the caller
        )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        child_end.close()
    worker = Worker(process, Connection(parent_end.detach()), scratch, threads)
    threading.Thread(target=_exchange, args=(worker, answers), daemon=True).start()
    return worker


def _show_step(worker: Worker, step: Step) -> None:
    """Calls on_step. A display that is gone (its terminal closed) is called no more; the job goes on."""
    try:
        if worker.on_step:
            worker.on_step(step)
    except (OSError, ValueError):
        worker.on_step = None


def _exchange(worker: Worker, answers: queue.SimpleQueue[Answer]) -> None:
    with worker.link:
        while (job := worker.work.get()) is not None:
            try:
                worker.link.send((job.call, job.arguments, job.file, job.code))
                while isinstance(answer := worker.link.recv(), Step):
                    _show_step(worker, answer)
                value, error = answer
            except (EOFError, OSError, pickle.UnpicklingError, ValueError, TypeError):
                answers.put(Answer(worker, dead=True))
                return
            answers.put(Answer(worker, value, error))

"""A worker process, seen from its parent: started, given jobs, measured, killed.

A thread for each worker sends and waits, so that one that stops in the middle of an answer holds up nobody.
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
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from paradize.errors import ParadizeError
from paradize.jobs.limits import held_bytes, time_limit
from paradize.jobs.scratch import Scratch
from paradize.kernels.threads import VARIABLE

_BOOT = (
    "import sys; from paradize.jobs.loader import install; install(); "
    "from paradize.jobs.worker import serve; serve(*map(int, sys.argv[1:]))"
)


@dataclass(frozen=True)
class Job:
    """A call to a module-level function; arguments and result are pickled. `name` stands in messages.

    file: the input that messages name. timeout_s: longer is a hang; None: $PARADIZE_TIMEOUT, else half an
    hour. memory_bytes: what it is thought to take at most; 0: not known. code: the digests of the code that
    its result is keyed by (code.code_of); a worker that has loaded other code refuses. files: what the call
    reads, for machines that do not see it; those with False need only be there.
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
        """Longer is a hang. Raises BakeError where $PARADIZE_TIMEOUT is no time."""
        return time_limit() if self.timeout_s is None else self.timeout_s


@dataclass(frozen=True)
class Answer:
    """What a worker sent back for its job. dead: nothing came, its process is gone or talks nonsense."""

    worker: Worker
    value: Any = None
    error: ParadizeError | None = None
    dead: bool = False


@dataclass(eq=False)
class Worker:
    """A worker process and what it is at. threads: as it was started with. tries: how often its job was given
    to any worker, this one included. scratch: its own folder for temporary files, gone with it however it
    ends."""

    process: subprocess.Popen[bytes]
    link: Connection
    scratch: Scratch
    threads: int | None = None
    job: Job | None = None
    tries: int = 0
    since: float = 0.0
    work: queue.SimpleQueue[Job | None] = field(default_factory=queue.SimpleQueue)

    def give(self, job: Job, tries: int) -> None:
        """Sends a job; the answer comes into the queue that the worker was started with."""
        self.job, self.tries, self.since = job, tries, time.monotonic()
        self.work.put(job)

    def held(self) -> int:
        """Bytes of memory that the process and its children hold now."""
        return held_bytes(self.process.pid)

    def stop(self) -> None:
        """Kills the process, whatever it is at."""
        self.process.kill()
        self.process.wait()
        self.scratch.remove()
        self.work.put(None)

    def death(self) -> str:
        """How the process ended, in words; kills it where it did not."""
        try:
            code = self.process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            return "its process stopped answering"
        if code >= 0:
            return f"its process ended with code {code}"
        try:
            return f"its process crashed ({signal.Signals(-code).name})"
        except ValueError:
            return f"its process was killed by signal {-code}"


@dataclass(eq=False)
class WorkerPool:
    """Workers, and the queue that they answer into. One that is kept finds its interpreters warm. closed:
    nothing is tried again in it."""

    workers: list[Worker] = field(default_factory=list)
    answers: queue.SimpleQueue[Answer] = field(default_factory=queue.SimpleQueue)
    closed: bool = False

    def stop(self) -> None:
        """Kills all of them, whatever they are at."""
        for worker in self.workers:
            worker.stop()
        self.workers.clear()


def start_worker(answers: queue.SimpleQueue[Answer], threads: int | None, memory_bytes: int | None) -> Worker:
    """A fresh interpreter that serves jobs, each of which ends in one answer. threads: what native kernels
    use there (None: as this process). memory_bytes: what it may allocate (Linux)."""
    ours, theirs = socket.socketpair()
    scratch = Scratch()
    environment = {**os.environ, "TMPDIR": str(scratch.path)}
    # An interrupt is our business: Ctrl-C reaches the whole group, and a starting interpreter would print it.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        process = subprocess.Popen(
            [sys.executable, "-c", _BOOT, str(theirs.fileno()), str(os.getpid()), str(memory_bytes or 0)],
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            env=environment if threads is None else {**environment, VARIABLE: str(threads)},
            stdout=2,  # what libraries print goes to standard error: standard output is the caller's
        )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()
    worker = Worker(process, Connection(ours.detach()), scratch, threads)
    threading.Thread(target=_talk, args=(worker, answers), daemon=True).start()
    return worker


def _talk(worker: Worker, answers: queue.SimpleQueue[Answer]) -> None:
    with worker.link:
        while (job := worker.work.get()) is not None:
            try:
                worker.link.send((job.call, job.arguments, job.file, job.code))
                value, error = worker.link.recv()
            except (EOFError, OSError, pickle.UnpicklingError, ValueError, TypeError):
                answers.put(Answer(worker, dead=True))
                return
            answers.put(Answer(worker, value, error))

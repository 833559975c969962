"""What runs in a Dask worker: one of our own worker processes for each of its threads, which bakes.

So a crash, a hang or a hunger for memory spoils one job on another machine too, and what is asked for its
code is a fresh interpreter of ours. Arguments and results are plain values, which any version understands.
"""

from __future__ import annotations

import hashlib
import os
import platform
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from paradize.cluster.serialization import pack_answer, place_in, run_packed
from paradize.errors import ParadizeError
from paradize.files import resolved
from paradize.jobs.limits import cores, memory_limit
from paradize.jobs.pool import Job, Outcome, WorkerPool, run_jobs
from paradize.jobs.worker import ForeignCode
from paradize.kernels.threads import VARIABLE as THREADS

# What the two sides must agree on: the text of the modules that talk to each other, as they were imported.
_TALK = ("cluster/dask_worker", "cluster/serialization", "jobs/pool", "jobs/process", "jobs/worker")
_PACKAGE = Path(__file__).parents[1]
PROTOCOL = hashlib.sha256(b"".join((_PACKAGE / f"{name}.py").read_bytes() for name in _TALK)).hexdigest()[:8]

IDLE_S = 60.0  # so long a process waits for work
_LOOK_S = 1.0  # how often it is looked whether a result is still asked for
_LOCK = threading.Lock()
_IDLE: dict[WorkerPool, threading.Timer] = {}  # those whose process waits for work, and what ends the waiting
_AT_WORK: dict[str, list[WorkerPool]] = {}  # bake -> those that work for it


def greet() -> dict[str, Any]:
    """Who this is: what the two sides must agree on, and what its machine has."""
    try:
        memory = memory_limit()
    except ParadizeError as error:
        return {"error": str(error)}
    return {
        "engine": PROTOCOL,
        "python": ".".join(platform.python_version_tuple()[:2]),
        "host": platform.node(),
        "memory": memory,
    }


def bake_here(
    bake: str, task: dict[str, Any], call: bytes, paths: list[str], blobs: list[bytes], threads: int
) -> dict[str, Any]:
    """Runs a job. bake: whose. task: name, file, timeout_s, memory_bytes, code as in a Job; given: as of
    parcel.pack_call; empty: the files that need only be there. call: packed. paths, blobs: the other files.
    threads: of the Dask worker, which share the cores. Returns value or error as packed answers, seconds,
    tries; foreign: the module whose code here is another."""
    share = None if os.environ.get(THREADS) else max(1, cores() // max(1, threads))
    with tempfile.TemporaryDirectory(prefix="paradize-", dir=_own_folder()) as name:
        folder = resolved(Path(name))
        for path, blob in zip(paths, blobs, strict=True):
            _write(place_in(folder, path), blob)
        for path in task["empty"]:
            _write(place_in(folder, path), b"")
        job = Job(
            task["name"],
            run_packed,
            {"packed": call, "folder": folder, "given": task["given"]},
            task["timeout_s"],
            task["file"],
            task["memory_bytes"],
            task["code"],
        )
        outcome = _run(bake, job, share)
        error = outcome.error
        return {
            "value": outcome.value,
            "error": None if error is None else pack_answer(error, folder, task["given"]),
            "foreign": error.module if isinstance(error, ForeignCode) else None,
            "seconds": outcome.seconds,
            "tries": outcome.tries,
        }


def leave(bake: str) -> None:
    """Ends the processes that work for a bake that is over, and those that wait."""
    with _LOCK:
        for crew in _AT_WORK.pop(bake, []):
            _close(crew)
        while _IDLE:
            crew, timer = _IDLE.popitem()
            timer.cancel()
            crew.stop()


def _run(bake: str, job: Job, threads: int | None) -> Outcome:
    while True:
        with _LOCK:
            warm = bool(_IDLE)
            crew = _wake() if warm else WorkerPool()
            _AT_WORK.setdefault(bake, []).append(crew)
        try:
            with _while_asked(crew):
                (outcome,) = run_jobs([job], 1, threads=threads, crew=crew)
        finally:
            with _LOCK:
                if crew in (crews := _AT_WORK.get(bake, [])):
                    crews.remove(crew)
                    if not crews:
                        del _AT_WORK[bake]
        if warm and isinstance(outcome.error, ForeignCode):  # it began before the code here was changed
            crew.stop()
            continue
        with _LOCK:
            if crew.closed:
                crew.stop()
            else:
                _rest(crew)
        return outcome


def _wake() -> WorkerPool:
    crew, timer = _IDLE.popitem()
    timer.cancel()
    return crew


def _rest(crew: WorkerPool) -> None:
    """Keeps a process for the next job; not for ever: a bake that was killed says no farewell."""
    timer = _IDLE[crew] = threading.Timer(IDLE_S, _dismiss, [crew])
    timer.daemon = True
    timer.start()


def _dismiss(crew: WorkerPool) -> None:
    with _LOCK:
        if _IDLE.pop(crew, None):
            crew.stop()


@contextmanager
def _while_asked(crew: WorkerPool) -> Iterator[None]:
    """Ends the crew's process once Dask takes the task back: its bake is gone."""
    from distributed import get_worker

    try:
        worker = get_worker()
        key = worker.get_current_task()
    except ValueError:  # outside Dask
        yield
        return
    over = threading.Event()

    def look() -> None:
        while not over.wait(_LOOK_S):
            task = worker.state.tasks.get(key)
            if task is None or task.state == "cancelled":
                with _LOCK:
                    _close(crew)

    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _close(crew: WorkerPool) -> None:
    """Ends what works; whoever works with it hears of that."""
    crew.closed = True
    for worker in [*crew.workers]:
        worker.process.kill()


def _own_folder() -> str | None:
    """The Dask worker's folder, which is swept after it even where it is killed."""
    from distributed import get_worker

    try:
        return str(get_worker().local_directory)
    except ValueError:
        return None


def _write(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)

"""Runs in a Dask worker. For each of its threads it keeps one of our own worker processes, which bakes.

So a crash, a hang or too much memory fails one job only, here too, and the code is loaded by a fresh
interpreter of ours. Arguments and results are plain values, which any version can read.
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

from paradize.cluster.serialization import pack_answer, path_in, run_packed
from paradize.errors import ParadizeError
from paradize.files import resolved
from paradize.jobs.limits import cores, memory_limit
from paradize.jobs.pool import Job, Outcome, WorkerPool, run_jobs
from paradize.jobs.worker import ForeignCode
from paradize.kernels.threads import VARIABLE as THREADS

# Both sides must have the same text of the modules that talk to each other, as they were imported.
_PROTOCOL_MODULES = (
    "cluster/dask_worker",
    "cluster/serialization",
    "jobs/pool",
    "jobs/process",
    "jobs/worker",
)
_PACKAGE = Path(__file__).parents[1]
PROTOCOL = hashlib.sha256(
    b"".join((_PACKAGE / f"{name}.py").read_bytes() for name in _PROTOCOL_MODULES)
).hexdigest()[:8]

IDLE_S = 60.0  # an idle process ends after this time
_POLL_S = 1.0  # how often a running task checks whether it was cancelled
_LOCK = threading.Lock()
_IDLE: dict[WorkerPool, threading.Timer] = {}  # pools with an idle process, and the timer that ends it
_BUSY: dict[str, list[WorkerPool]] = {}  # bake -> its pools


def greet() -> dict[str, Any]:
    """Describes this worker: its protocol and Python version, which must match the scheduler's, its host and
    its memory."""
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
    """Runs a job in a worker process of this machine.

    bake: id of the bake. task: name, file, timeout_s, memory_bytes and code as in a Job; originals: as from
    serialization.pack_call; empty: paths of files that only have to exist. call: the packed call. paths,
    blobs: the other files and their bytes. threads: number of threads of the Dask worker, which share the
    cores.

    Returns value or error as packed answers, seconds and tries. foreign: a module whose code differs here, or
    None.
    """
    share = None if os.environ.get(THREADS) else max(1, cores() // max(1, threads))
    with tempfile.TemporaryDirectory(prefix="paradize-", dir=_own_folder()) as name:
        folder = resolved(Path(name))
        for path, blob in zip(paths, blobs, strict=True):
            _write(path_in(folder, path), blob)
        for path in task["empty"]:
            _write(path_in(folder, path), b"")
        job = Job(
            name=task["name"],
            call=run_packed,
            arguments={"packed": call, "folder": folder, "originals": task["originals"]},
            timeout_s=task["timeout_s"],
            file=task["file"],
            memory_bytes=task["memory_bytes"],
            code=task["code"],
        )
        outcome = _run(bake, job, share)
        error = outcome.error
        return {
            "value": outcome.value,
            "error": None if error is None else pack_answer(error, folder, task["originals"]),
            "foreign": error.module if isinstance(error, ForeignCode) else None,
            "seconds": outcome.seconds,
            "tries": outcome.tries,
        }


def end_bake(bake: str) -> None:
    """Ends the processes of a bake that is over, and all idle ones."""
    with _LOCK:
        for pool in _BUSY.pop(bake, []):
            _close(pool)
        while _IDLE:
            pool, timer = _IDLE.popitem()
            timer.cancel()
            pool.stop()


def _run(bake: str, job: Job, threads: int | None) -> Outcome:
    while True:
        with _LOCK:
            warm = bool(_IDLE)
            pool = _take_warm() if warm else WorkerPool()
            _BUSY.setdefault(bake, []).append(pool)
        try:
            with _stop_when_cancelled(pool):
                (outcome,) = run_jobs([job], 1, threads=threads, pool=pool)
        finally:
            with _LOCK:
                if pool in (pools := _BUSY.get(bake, [])):
                    pools.remove(pool)
                    if not pools:
                        del _BUSY[bake]
        if warm and isinstance(outcome.error, ForeignCode):  # it had loaded the code before it was changed
            pool.stop()
            continue
        with _LOCK:
            if pool.closed:
                pool.stop()
            else:
                _keep_warm(pool)
        return outcome


def _take_warm() -> WorkerPool:
    pool, timer = _IDLE.popitem()
    timer.cancel()
    return pool


def _keep_warm(pool: WorkerPool) -> None:
    """Keeps a process for the next job for IDLE_S seconds. A bake that was killed cannot end it."""
    timer = _IDLE[pool] = threading.Timer(IDLE_S, _stop_idle, [pool])
    timer.daemon = True
    timer.start()


def _stop_idle(pool: WorkerPool) -> None:
    with _LOCK:
        if _IDLE.pop(pool, None):
            pool.stop()


@contextmanager
def _stop_when_cancelled(pool: WorkerPool) -> Iterator[None]:
    """Ends the pool's process once Dask cancels the task, because its bake has gone."""
    from distributed import get_worker

    try:
        worker = get_worker()
        key = worker.get_current_task()
    except ValueError:  # outside Dask
        yield
        return
    over = threading.Event()

    def poll() -> None:
        while not over.wait(_POLL_S):
            task = worker.state.tasks.get(key)
            if task is None or task.state == "cancelled":
                with _LOCK:
                    _close(pool)

    thread = threading.Thread(target=poll, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _close(pool: WorkerPool) -> None:
    """Kills the pool's processes. The thread that waits for an answer sees that they ended."""
    pool.closed = True
    for worker in [*pool.workers]:
        worker.process.kill()


def _own_folder() -> str | None:
    """The Dask worker's own folder. Dask removes it even if the worker is killed. None outside Dask."""
    from distributed import get_worker

    try:
        return str(get_worker().local_directory)
    except ValueError:
        return None


def _write(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)

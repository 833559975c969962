"""Worker processes that the bakes of one process share."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

# These keep their own run_jobs: what runs isolated limits its worker for good, what is timed its threads.
import paradize.jobs.isolate
import paradize.tradeoff.tiers
import paradize.watch.rebake  # noqa: F401
from paradize.jobs.pool import Outcome, run_jobs
from paradize.jobs.process import Job, Worker, WorkerPool

# Of the environment, what no worker reads.
ELSEWHERE = {"PARADIZE_STORE", "PARADIZE_REPORT", "PARADIZE_JOBS", "PYTEST_CURRENT_TEST"}
ELSEWHERE |= {"HOME", "SSH_AUTH_SOCK"}


class KeptPool(WorkerPool):
    """Workers that stay for the next bake of this process: to start one takes longer than most small bakes.
    They follow into another working folder. A bake that is broken off, and another environment, end them."""

    def __init__(self) -> None:
        super().__init__()
        self.begun_with: object = None
        self.folder: os.stat_result | None = None

    def for_bake(self) -> WorkerPool:
        """These workers, without those that died; others for a thread, which takes its workers with it."""
        if threading.current_thread() is not threading.main_thread():
            return WorkerPool()
        now = {name: text for name, text in os.environ.items() if name not in ELSEWHERE}
        for worker in list(self.workers):
            if now != self.begun_with or worker.process.poll() is not None:
                worker.stop()
                self.workers.remove(worker)
        folder = Path().stat()
        if self.folder is None or not os.path.samestat(
            folder, self.folder
        ):  # it may be a new one of that name
            for worker in self.workers:
                self.move(worker)
        self.begun_with, self.folder = now, folder
        return self

    def move(self, worker: Worker) -> None:
        """Has an idle worker go into the working folder of this process."""
        worker.send(Job("chdir", os.chdir, {"path": str(Path.cwd())}), 1)
        while (answer := self.answers.get(timeout=60.0)).worker is not worker:
            pass  # of one that was stopped
        assert not answer.dead and answer.error is None, answer.error
        worker.job = None

    def stop(self) -> None:
        if any(worker.job for worker in self.workers):
            super().stop()


@contextmanager
def keeping_workers() -> Iterator[None]:
    """Bakes in this process share their workers: of scenes, and of single files by their commands."""
    kept = KeptPool()

    def run(*given: Any, pool: WorkerPool | None = None, **more: Any) -> list[Outcome]:
        return run_jobs(*given, pool=pool or kept.for_bake(), **more)

    with (
        patch("paradize.build.bake.WorkerPool", kept.for_bake),
        patch("paradize.jobs.pool.run_jobs", run),  # where it is imported late: cli/single_file.py
        patch("paradize.build.materials.model_reader.run_jobs", run),
    ):
        yield
    WorkerPool.stop(kept)

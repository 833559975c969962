"""Shared by the tests of the pipeline: workers, and a small picture of an exported terrain."""

from __future__ import annotations

import io
import os
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import pytest

# These keep their own run_jobs: what runs isolated limits its worker for good, what is timed its threads.
import paradize.jobs.isolate
import paradize.tradeoff.tiers
import paradize.watch.rebake  # noqa: F401
from paradize.cli.main import main
from paradize.jobs.pool import Outcome, run_jobs
from paradize.jobs.process import WorkerPool

# Of the environment, what no worker reads.
ELSEWHERE = {"PARADIZE_STORE", "PARADIZE_REPORT", "PARADIZE_JOBS", "PYTEST_CURRENT_TEST"}


class KeptPool(WorkerPool):
    """Workers that stay for the next bake of this process: to start one takes longer than most small bakes. A
    bake that is broken off, and another environment or working folder, end them."""

    def __init__(self) -> None:
        super().__init__()
        self.begun_with: object = None

    def for_bake(self) -> WorkerPool:
        """These workers, without those that died; others for a thread, which takes its workers with it."""
        if threading.current_thread() is not threading.main_thread():
            return WorkerPool()
        now = Path.cwd(), {name: text for name, text in os.environ.items() if name not in ELSEWHERE}
        for worker in list(self.workers):
            if now != self.begun_with or worker.process.poll() is not None:
                worker.stop()
                self.workers.remove(worker)
        self.begun_with = now
        return self

    def stop(self) -> None:
        if any(worker.job for worker in self.workers):
            super().stop()


@pytest.fixture(scope="session", autouse=True)
def kept_workers() -> Iterator[None]:
    """Bakes in this process share their workers: of scenes, and of single files by their commands."""
    kept = KeptPool()

    def run(*given: Any, pool: WorkerPool | None = None, **more: Any) -> list[Outcome]:
        return run_jobs(*given, pool=pool or kept.for_bake(), **more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("paradize.build.bake.WorkerPool", kept.for_bake)
        patch.setattr("paradize.jobs.pool.run_jobs", run)  # where it is imported late: cli/single_file.py
        patch.setattr("paradize.build.materials.model_reader.run_jobs", run)
        yield
    WorkerPool.stop(kept)


@pytest.fixture(scope="session")
def paradize_here() -> Callable[..., subprocess.CompletedProcess[str]]:
    """As `paradize`, in this process, whose workers are kept: for tests that do not judge the process."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        words = [str(word) for word in arguments]
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            code = main(words)
        return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())

    return run


@pytest.fixture(scope="session", autouse=True)
def small_ground() -> Iterator[None]:
    """64 texels instead of 2048 a side: drawing it takes seconds. tests/e2e/test_export.py exports it all."""
    with pytest.MonkeyPatch.context() as patch:
        for module in ("scene", "heights"):
            patch.setattr(f"paradize.export.{module}.GROUND_TEXELS", 64)
        yield

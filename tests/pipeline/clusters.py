"""A real Dask scheduler and real workers on this machine, and what tests have them do."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from paradize.bakers.registry import Product, make_sound
from tests.processes import end, start

ROOT = Path(__file__).resolve().parents[2]
FIFO = "PARADIZE_TEST_FIFO"  # where `stall` tells that it runs


@dataclass
class Cluster:
    """folder: where its processes run, and where `fifo` is. To be closed."""

    folder: Path
    address: str = ""
    scheduler: subprocess.Popen[str] | None = None
    workers: list[subprocess.Popen[str]] = field(default_factory=list)

    @property
    def fifo(self) -> Path:
        return self.folder / "fifo"

    def start(self, workers: int) -> Cluster:
        os.mkfifo(self.fifo)
        self.scheduler = self._run("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        self.address = self._await(self.scheduler, r"Scheduler at:\s+(tcp://\S+)")
        for _ in range(workers):
            self.add_worker()
        return self

    def add_worker(self, *options: str) -> None:
        worker = self._run(
            "worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", *options
        )
        self.workers.append(worker)
        self._await(worker, "(Starting established connection)")

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            if process:
                end(process)

    def listens(self) -> bool:
        """Whether its scheduler runs."""
        return self.scheduler is not None and self.scheduler.poll() is None

    def replace_workers(self) -> None:
        """Starts workers in place of those that were killed."""
        for worker in [worker for worker in self.workers if worker.poll() is not None]:
            self.workers.remove(worker)
            end(worker)
            self.add_worker()

    def stalled_job(self) -> str:
        """Waits until `stall` runs; returns what it writes."""
        return self.fifo.read_text()

    def _run(self, what: str, *options: str) -> subprocess.Popen[str]:
        places = {"PYTHONPATH": str(ROOT), FIFO: str(self.fifo), "TMPDIR": str(self.folder)}
        return start(
            [sys.executable, "-m", f"distributed.cli.dask_{what}", *options],
            cwd=self.folder,
            env={**os.environ, **places},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    @staticmethod
    def _await(process: subprocess.Popen[str], pattern: str) -> str:
        assert process.stderr
        said = []
        for line in process.stderr:
            said.append(line)
            if found := re.search(pattern, line):
                return found[1]
        raise AssertionError("".join(said))


def double(value: int) -> int:
    return 2 * value


def read(paths: list[Path]) -> list[bytes]:
    return [path.read_bytes() for path in paths]


def stall() -> None:
    """The first time, tells the numbers of its Dask worker and of its own process, and stops there."""
    fifo = Path(os.environ[FIFO])
    mark = fifo.with_suffix(".done")
    if mark.exists():
        return
    mark.touch()
    fifo.write_text(f"{os.getppid()} {os.getpid()}")
    while True:
        signal.pause()


def stall_once(**settings: Any) -> list[Product]:
    stall()
    return make_sound(**settings)


def read_late(paths: list[Path]) -> list[bytes]:
    stall()
    return read(paths)


def kill_worker() -> None:
    os.kill(os.getppid(), signal.SIGKILL)
    while True:
        signal.pause()

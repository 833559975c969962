"""Runs jobs on the workers of a Dask cluster. Sources are sent to them, results come back as bytes.

This scheduler decides which job runs where, with the rules of jobs/pool.py: a job is tried twice; a machine
runs as many jobs as its memory allows; a job whose worker died is tried again alone, so that it cannot end
others. Dask transports calls, files (each once, however many jobs read it) and answers, and lists the
workers. dask_worker.py is the code that runs there.
"""

from __future__ import annotations

import platform
import queue
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from secrets import token_hex
from typing import Any

from paradize.cluster.connection import ClusterLost, connect
from paradize.cluster.dask_worker import PROTOCOL, bake_here, end_bake, greet
from paradize.cluster.file_transfer import FileTransfer
from paradize.cluster.serialization import absolute, pack_call, unpack
from paradize.cluster.workers import DaskWorker, PendingTask
from paradize.errors import BakeError, ParadizeError, one_line
from paradize.jobs.pool import Job, Outcome
from paradize.jobs.process import require_own_names

ABSENT_S = 30.0  # without any worker for this time the bake fails
LEAVE_S = 5.0  # limit of the clean-up at the end
ANSWER_S = 60.0  # a worker must answer the greeting within this time
_POLL_S = 0.25  # how often the list of workers is read
_TRIES = 2
_FETCH_S = 10.0  # time limit for fetching a result; doubled at each further try while its worker lives
_LOST = 8  # how often a job is sent again whose files were lost with a worker


def run_on_cluster(
    address: str,
    jobs: Sequence[Job],
    on_outcome: Callable[[Outcome], None] | None = None,
    *,
    on_start: Callable[[Job], None] | None = None,
    warn: Callable[[str], None] | None = None,
    max_parallel: int | None = None,
) -> list[Outcome]:
    """Runs the jobs on the workers of the Dask scheduler at `address`. Returns their outcomes in the order of
    the jobs, as jobs.pool.run_jobs does.

    on_start, on_outcome: called when a job starts and when it ends. warn: called with a message about each
    worker that cannot be used. max_parallel: largest number of jobs that run at once.

    Raises ValueError for two jobs of one name, and ClusterLost where no cluster answers. If the cluster
    disappears later, the outcomes of unfinished jobs hold ClusterLost.
    """
    require_own_names(jobs)
    client = connect(address)
    scheduler = _ClusterScheduler(
        client=client,
        address=address,
        jobs=jobs,
        on_outcome=on_outcome,
        on_start=on_start,
        warn=warn,
        max_parallel=max_parallel or len(jobs),
    )
    try:
        return scheduler.run()
    finally:
        scheduler.end_bake()


class _ClusterScheduler:
    """One call of run_on_cluster."""

    def __init__(
        self,
        client: Any,
        address: str,
        jobs: Sequence[Job],
        on_outcome: Callable[[Outcome], None] | None,
        on_start: Callable[[Job], None] | None,
        warn: Callable[[str], None] | None,
        max_parallel: int,
    ) -> None:
        self.client, self.address, self.jobs, self.max_parallel = client, address, jobs, max_parallel
        self.on_outcome, self.on_start, self.warn = on_outcome, on_start, warn
        self.name = token_hex(4)  # id of this bake on the workers
        self.waiting = [PendingTask(job) for job in jobs]
        self.outcomes: dict[str, Outcome] = {}
        self.workers: dict[str, DaskWorker] = {}
        self.answers: queue.SimpleQueue[tuple[DaskWorker, PendingTask | None, Any]] = queue.SimpleQueue()
        self.transfer = FileTransfer(client, jobs)
        self.updated_s = 0.0
        self.last_worker_s = time.monotonic()  # when a worker was last seen

    def run(self) -> list[Outcome]:
        try:
            while len(self.outcomes) < len(self.jobs):
                self.update_workers()
                self.start_jobs()
                with suppress(queue.Empty):
                    self.receive(*self.answers.get(timeout=_POLL_S))
        except ClusterLost as lost:
            for job in self.jobs:
                if job.name not in self.outcomes:
                    self.end(Outcome(job.name, None, lost, 0.0))
        return [self.outcomes[job.name] for job in self.jobs]

    def update_workers(self) -> None:
        """Adds new workers, removes lost ones, and ends tasks that take too long. Raises ClusterLost after
        ABSENT_S without a worker."""
        now = time.monotonic()
        if now - self.updated_s < _POLL_S:
            return
        self.updated_s = now
        threads_by_address = self.threads_of_workers()
        for address, threads in threads_by_address.items():
            if address not in self.workers:
                worker = self.workers[address] = DaskWorker(address, threads, now)
                self.send(worker, None, self.client.submit(greet, workers=[address], pure=False))
        for address in [address for address in self.workers if address not in threads_by_address]:
            self.remove_worker(self.workers.pop(address))
        for worker in self.workers.values():
            if worker.info is None and not worker.refused and now - worker.since > ANSWER_S:
                self.refuse(worker, f"has not answered within {ANSWER_S:g} s")
            for pending in [*worker.pending]:
                if now - pending.since > 2.0 * _TRIES * pending.job.most_s + ANSWER_S:
                    self.retry(worker, pending, f"took longer than {pending.job.most_s:g} s on {worker.name}")
        if self.workers:
            self.last_worker_s = now
        elif now - self.last_worker_s > ABSENT_S:
            what = f"the cluster has had no worker for {ABSENT_S:g} s"
            raise ClusterLost(
                what,
                file=self.address,
                mend="start some with `dask worker`",
            )
        self.fail_refused()

    def threads_of_workers(self) -> dict[str, int]:
        """The number of threads of each worker, by address."""
        if self.client.status == "running":
            with suppress(Exception):  # any error of Dask means that the connection is lost
                threads: dict[str, int] = self.client.sync(
                    self.client.scheduler.ncores, workers=None, callback_timeout=ANSWER_S
                )
                return threads
        what = "the connection to the scheduler was lost; finished jobs are kept"
        raise ClusterLost(what, file=self.address, mend="start it again, and bake again")

    def fail_refused(self) -> None:
        """Fails the jobs that no worker takes, once all workers have answered the greeting."""
        workers = list(self.workers.values())
        if not any(worker.refused or worker.foreign for worker in workers):
            return
        if any(worker.info is None and not worker.refused for worker in workers):
            return
        for pending in [
            task for task in self.waiting if not any(worker.takes(task.job) for worker in workers)
        ]:
            self.waiting.remove(pending)
            self.fail(pending, workers[0].error(workers[0].reason(pending.job)), 0.0)

    def start_jobs(self) -> None:
        """Sends waiting jobs to free workers."""
        while sum(len(worker.pending) for worker in self.workers.values()) < self.max_parallel:
            greeted = [worker for worker in self.workers.values() if worker.info]
            free = [worker for worker in greeted if len(worker.pending) < worker.threads]
            free.sort(key=DaskWorker.load)
            pairs = (
                (worker, pending) for pending in self.waiting for worker in free if self.fits(worker, pending)
            )
            worker, pending = next(pairs, (None, None)) if free else (None, None)
            if worker is None or pending is None:
                return
            self.waiting.remove(pending)
            if not self.start(worker, pending):
                return

    def fits(self, worker: DaskWorker, pending: PendingTask) -> bool:
        """Whether the worker takes the job and its machine has memory for it beside the running ones."""
        assert worker.info is not None
        if not worker.takes(pending.job):
            return False
        same_host = [other for other in self.workers.values() if worker.same_host(other)]
        running = [task for other in same_host for task in other.pending]
        if not running:
            return True
        if pending.alone or any(task.alone for task in running):
            return False
        limit = worker.info["memory"]
        return (
            limit is None
            or sum(task.job.memory_bytes for task in running) + pending.job.memory_bytes <= limit
        )

    def start(self, worker: DaskWorker, pending: PendingTask) -> bool:
        """Sends a job. Returns False if the connection failed."""
        job = pending.job
        packed, originals = pack_call(job.call, job.arguments)
        task = {
            "name": job.name,
            "file": None if job.file is None else str(job.file),
            "timeout_s": job.most_s,
            "memory_bytes": job.memory_bytes,
            "code": dict(job.code),
            "originals": originals,
            "empty": [absolute(path) for path, whole in job.files.items() if not whole],
        }
        try:
            paths, blobs = self.transfer.files(job, worker.address)
            call = self.transfer.call(packed, worker.address)
            key = f"paradize {job.name} {token_hex(4)}"
            future = self.client.submit(
                bake_here, self.name, task, call, paths, blobs, worker.threads,
                workers=[worker.address], pure=False, key=key,
            )  # fmt: skip
        except ParadizeError as error:
            self.fail(pending, error, 0.0)
            return True
        except Exception as error:  # of Dask or of the connection
            self.resend(pending, f"{type(error).__name__}: {error}")
            return False
        pending.since = time.monotonic()
        worker.pending.append(pending)
        if self.on_start:
            self.on_start(job)
        self.send(worker, pending, future)
        return True

    def send(self, worker: DaskWorker, pending: PendingTask | None, future: Any) -> None:
        """Puts the answer into the queue when it arrives."""
        if pending:
            pending.future = future
        else:
            worker.greeting = future  # keeps a reference: Dask cancels calls without one
        answers = self.answers
        future.add_done_callback(lambda done: answers.put((worker, pending, done)))

    def receive(self, worker: DaskWorker, pending: PendingTask | None, future: Any) -> None:
        """Handles the end of a call."""
        if pending and (pending not in worker.pending or pending.future is not future):
            return  # another worker has it by now
        try:
            value, problem = self.fetch(worker, future), ""
        except Exception as error:  # of the connection, of Dask, or a failed import on the worker
            value, problem = None, f"{type(error).__name__}: {one_line(str(error)).strip()[:300]}"
        if pending is None:
            self.on_greeting(worker, value, problem)
        elif future.status in ("cancelled", "lost"):
            worker.pending.remove(pending)
            self.resend(pending, problem)
        elif value is None:
            self.retry(worker, pending, f"could not be baked on {worker.name}: {problem}")
        else:
            worker.pending.remove(pending)
            self.on_answer(worker, pending, value)

    def fetch(self, worker: DaskWorker, future: Any) -> Any:
        """Returns the result of a call. Raises what the call raised, and TimeoutError where its worker has
        gone."""
        timeout_s = _FETCH_S
        while True:
            try:
                return future.result(timeout=timeout_s)
            except TimeoutError:
                if worker.address not in self.threads_of_workers():
                    raise
            timeout_s *= 2.0

    def on_greeting(self, worker: DaskWorker, info: dict[str, Any] | None, problem: str) -> None:
        """Checks a worker's answer to the greeting: same Python, same protocol."""
        ours = {"python": ".".join(platform.python_version_tuple()[:2]), "engine": PROTOCOL}
        if info is None:
            if self.workers.get(worker.address) is worker:
                self.refuse(worker, f"cannot run this paradize ({problem})")
            return
        worker.info = info
        if "error" in info:
            self.refuse(worker, f"cannot work: {info['error']}")
        for name, value in ours.items():
            if "error" not in info and info.get(name) != value:
                self.refuse(worker, f"runs {name} {info.get(name)}, this bake {value}")

    def on_answer(self, worker: DaskWorker, pending: PendingTask, answer: dict[str, Any]) -> None:
        """Handles a complete answer of a job."""
        if answer["foreign"] is not None:
            worker.foreign.add(answer["foreign"])
            self.report(worker, f"runs other code: {answer['foreign']}")
            self.waiting.insert(0, pending)
            return
        error = None if answer["error"] is None else unpack(answer["error"])
        value = None if answer["value"] is None else unpack(answer["value"])
        self.end(Outcome(pending.job.name, value, error, answer["seconds"], answer["tries"]), pending.job)

    def retry(self, worker: DaskWorker, pending: PendingTask, what: str) -> None:
        """A call failed on its worker. It is tried again if it has a try left."""
        worker.pending.remove(pending)
        pending.future.cancel()
        if pending.tries >= _TRIES:
            error = BakeError(f"{pending.job.name} {what}, twice", file=pending.job.file)
            self.fail(pending, error, time.monotonic() - pending.since)
            return
        pending.tries, pending.alone = pending.tries + 1, True
        self.waiting.append(pending)

    def remove_worker(self, worker: DaskWorker) -> None:
        """A worker has gone. Its tasks are tried once more, each alone on its machine."""
        for pending in [*worker.pending]:
            self.retry(worker, pending, f"could not be baked: its worker {worker.name} died")

    def resend(self, pending: PendingTask, why: str) -> None:
        """A call was lost with files on another worker. It is sent again with all its files."""
        pending.lost += 1
        self.updated_s = 0.0  # the worker may have gone
        self.transfer.forget(pending.job)
        if pending.lost > _LOST:
            what = f"{pending.job.name} could not be sent: {why}"
            self.fail(pending, BakeError(what, file=pending.job.file), 0.0)
        else:
            self.waiting.insert(0, pending)

    def fail(self, pending: PendingTask, error: ParadizeError, seconds: float) -> None:
        self.end(Outcome(pending.job.name, None, error, seconds, pending.tries), pending.job)

    def end(self, outcome: Outcome, job: Job | None = None) -> None:
        """Stores the outcome of a job and releases the files that only it read."""
        self.outcomes[outcome.name] = outcome
        if job:
            self.transfer.release(job)
        if self.on_outcome:
            self.on_outcome(outcome)

    def refuse(self, worker: DaskWorker, why: str) -> None:
        worker.refused = why
        self.report(worker, why)

    def report(self, worker: DaskWorker, why: str) -> None:
        if self.warn:
            self.warn(str(worker.error(why)))

    def end_bake(self) -> None:
        """Ends what still runs on the workers, and closes the connection."""

        def quietly() -> None:
            with suppress(Exception):  # the cluster may have gone, or some of its workers hang
                busy = [task.future for worker in self.workers.values() for task in worker.pending]
                self.client.cancel(busy, force=True)
                self.client.run(end_bake, self.name, on_error="ignore")

        if self.client.status == "running":
            thread = threading.Thread(target=quietly, daemon=True)
            thread.start()
            thread.join(LEAVE_S)
        with suppress(Exception):
            self.client.close(timeout=LEAVE_S)

"""Runs jobs on the workers of a Dask cluster: the sources travel to them, the results come back as bytes.

Which job runs where is decided here, as workers.py does for its processes, so that the same rules hold: a job
is tried twice, at most as many run on a machine as fit its memory, and one that lost its machine goes on
alone, so that it cannot take others down with it. Dask carries calls, files (each once, however many jobs
read it) and answers, and tells who is there. What runs there is dask_worker.py.
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

from paradize.cluster.connection import HOWTO, ClusterLost, connect
from paradize.cluster.dask_worker import PROTOCOL, bake_here, greet, leave
from paradize.cluster.file_transfer import FileTransfer
from paradize.cluster.serialization import full, pack_call, unpack
from paradize.cluster.workers import Machine, PendingTask
from paradize.errors import BakeError, ParadizeError, one_line
from paradize.jobs.pool import Job, Outcome

ABSENT_S = 30.0  # so long a bake waits for a worker to come, or to come back
LEAVE_S = 5.0  # for what is done last
ANSWER_S = 60.0  # until a worker must have said who it is
_LOOK_S = 0.25  # how often it is looked who is there
_TRIES = 2
_FETCH_S = 10.0  # a result that takes longer is asked for anew, twice as patiently, if its worker is there
_LOST = 8  # so often a job is sent anew whose files went with a worker, not the job's own fault


def run_on_cluster(
    address: str,
    jobs: Sequence[Job],
    told: Callable[[Outcome], None] | None = None,
    *,
    began: Callable[[Job], None] | None = None,
    warn: Callable[[str], None] | None = None,
    most: int | None = None,
) -> list[Outcome]:
    """Runs the jobs on the workers of the Dask scheduler at `address`; outcomes as of workers.run_jobs. warn:
    hears of workers that are of no use. most: so many at once at most.

    Raises ClusterLost where there is no cluster to begin with. What a cluster that is lost in between leaves
    undone is in the outcomes.
    """
    client = connect(address)
    tour = _ClusterScheduler(client, address, jobs, told, began, warn, most or len(jobs))
    try:
        return tour.run()
    finally:
        tour.leave()


class _ClusterScheduler:
    """One call of run_on_cluster."""

    def __init__(
        self,
        client: Any,
        address: str,
        jobs: Sequence[Job],
        told: Callable[[Outcome], None] | None,
        began: Callable[[Job], None] | None,
        warn: Callable[[str], None] | None,
        most: int,
    ) -> None:
        self.client, self.address, self.jobs, self.most = client, address, jobs, most
        self.told, self.began, self.warn = told, began, warn
        self.name = token_hex(4)  # of this bake, on the machines
        self.waiting = [PendingTask(job) for job in jobs]
        self.outcomes: dict[str, Outcome] = {}
        self.machines: dict[str, Machine] = {}
        self.answers: queue.SimpleQueue[tuple[Machine, PendingTask | None, Any]] = queue.SimpleQueue()
        self.freight = FileTransfer(client, jobs)
        self.looked = 0.0
        self.seen = time.monotonic()  # when there was a worker last

    def run(self) -> list[Outcome]:
        try:
            while len(self.outcomes) < len(self.jobs):
                self.look()
                self.hand_out()
                with suppress(queue.Empty):
                    self.hear(*self.answers.get(timeout=_LOOK_S))
        except ClusterLost as lost:
            for job in self.jobs:
                if job.name not in self.outcomes:
                    self.end(Outcome(job.name, None, lost, 0.0))
        return [self.outcomes[job.name] for job in self.jobs]

    def look(self) -> None:
        """Who came, who has gone, who takes too long. Raises ClusterLost where nobody is left."""
        now = time.monotonic()
        if now - self.looked < _LOOK_S:
            return
        self.looked = now
        there = self.ask_who()
        for address, threads in there.items():
            if address not in self.machines:
                machine = self.machines[address] = Machine(address, threads, now)
                self.send(machine, None, self.client.submit(greet, workers=[address], pure=False))
        for address in [address for address in self.machines if address not in there]:
            self.bury(self.machines.pop(address))
        for machine in self.machines.values():
            if machine.told is None and not machine.refused and now - machine.since > ANSWER_S:
                self.refuse(machine, f"has not said who it is within {ANSWER_S:g} s")
            for errand in [*machine.errands]:
                if now - errand.since > 2.0 * _TRIES * errand.job.most_s + ANSWER_S:
                    self.again(machine, errand, f"took longer than {errand.job.most_s:g} s on {machine.name}")
        if self.machines:
            self.seen = now
        elif now - self.seen > ABSENT_S:
            what = f"the cluster has had no worker for {ABSENT_S:g} s"
            raise ClusterLost(what, file=self.address, mend=f"start some with `dask worker`; {HOWTO}")
        self.give_up()

    def ask_who(self) -> dict[str, int]:
        """The threads of each worker, by address."""
        if self.client.status == "running":
            with suppress(Exception):  # whatever Dask raises of a line that broke: it is gone
                there: dict[str, int] = self.client.sync(
                    self.client.scheduler.ncores, workers=None, callback_timeout=ANSWER_S
                )
                return there
        what = "the scheduler has gone; what was baked until then is kept"
        raise ClusterLost(what, file=self.address, mend="start it again, and bake again")

    def give_up(self) -> None:
        """Ends the jobs that no machine takes, once all have said who they are."""
        machines = list(self.machines.values())
        if not any(one.refused or one.foreign for one in machines):
            return
        if any(one.told is None and not one.refused for one in machines):
            return
        for errand in [one for one in self.waiting if not any(on.takes(one.job) for on in machines)]:
            self.waiting.remove(errand)
            self.fail(errand, machines[0].refusal(machines[0].why_not(errand.job)), 0.0)

    def hand_out(self) -> None:
        """Sends what there is room for."""
        while sum(len(machine.errands) for machine in self.machines.values()) < self.most:
            free = [one for one in self.machines.values() if one.told and len(one.errands) < one.threads]
            free.sort(key=Machine.load)
            pairs = ((on, errand) for errand in self.waiting for on in free if self.fits(on, errand))
            machine, errand = next(pairs, (None, None)) if free else (None, None)
            if machine is None or errand is None:
                return
            self.waiting.remove(errand)
            if not self.start(machine, errand):
                return

    def fits(self, machine: Machine, errand: PendingTask) -> bool:
        """Whether it takes the job, and there is memory for it beside what runs on that computer."""
        assert machine.told is not None
        if not machine.takes(errand.job):
            return False
        near = [other for other in self.machines.values() if machine.near(other)]
        beside = [one for other in near for one in other.errands]
        if not beside:
            return True
        if errand.alone or any(one.alone for one in beside):
            return False
        limit = machine.told["memory"]
        return limit is None or sum(one.job.memory_bytes for one in beside) + errand.job.memory_bytes <= limit

    def start(self, machine: Machine, errand: PendingTask) -> bool:
        """Sends a job; False where the line is at fault."""
        job = errand.job
        packed, given = pack_call(job.call, job.arguments)
        task = {
            "name": job.name,
            "file": None if job.file is None else str(job.file),
            "timeout_s": job.most_s,
            "memory_bytes": job.memory_bytes,
            "code": dict(job.code),
            "given": given,
            "empty": [full(path) for path, whole in job.files.items() if not whole],
        }
        try:
            paths, blobs = self.freight.files(job, machine.address)
            call = self.freight.call(packed, machine.address)
            key = f"paradize {job.name} {token_hex(4)}"
            future = self.client.submit(
                bake_here, self.name, task, call, paths, blobs, machine.threads,
                workers=[machine.address], pure=False, key=key,
            )  # fmt: skip
        except ParadizeError as error:
            self.fail(errand, error, 0.0)
            return True
        except Exception as error:  # of Dask, or of the line
            self.lose(errand, f"{type(error).__name__}: {error}")
            return False
        errand.since = time.monotonic()
        machine.errands.append(errand)
        if self.began:
            self.began(job)
        self.send(machine, errand, future)
        return True

    def send(self, machine: Machine, errand: PendingTask | None, future: Any) -> None:
        """Has the answer come into the queue."""
        if errand:
            errand.future = future
        else:
            machine.greeting = future  # held, or Dask would drop the call
        answers = self.answers
        future.add_done_callback(lambda done: answers.put((machine, errand, done)))

    def hear(self, machine: Machine, errand: PendingTask | None, future: Any) -> None:
        """Takes what came of a call."""
        if errand and (errand not in machine.errands or errand.future is not future):
            return  # given to another meanwhile
        try:
            value, wrong = self.fetch(machine, future), ""
        except Exception as error:  # of the line, of Dask, or of what the other side cannot import
            value, wrong = None, f"{type(error).__name__}: {one_line(str(error)).strip()[:300]}"
        if errand is None:
            self.meet(machine, value, wrong)
        elif future.status in ("cancelled", "lost"):
            machine.errands.remove(errand)
            self.lose(errand, wrong)
        elif value is None:
            self.again(machine, errand, f"could not be baked on {machine.name}: {wrong}")
        else:
            machine.errands.remove(errand)
            self.take(machine, errand, value)

    def fetch(self, machine: Machine, future: Any) -> Any:
        """The result of a call. Raises what the call raised; TimeoutError where its worker went with it."""
        patience = _FETCH_S
        while True:
            try:
                return future.result(timeout=patience)
            except TimeoutError:
                if machine.address not in self.ask_who():
                    raise
            patience *= 2.0

    def meet(self, machine: Machine, told: dict[str, Any] | None, wrong: str) -> None:
        """A worker has said who it is."""
        ours = {"python": ".".join(platform.python_version_tuple()[:2]), "engine": PROTOCOL}
        if told is None:
            if self.machines.get(machine.address) is machine:
                self.refuse(machine, f"cannot run this paradize ({wrong})")
            return
        machine.told = told
        if "error" in told:
            self.refuse(machine, f"cannot work: {told['error']}")
        for name, value in ours.items():
            if "error" not in told and told.get(name) != value:
                self.refuse(machine, f"runs {name} {told.get(name)}, this bake {value}")

    def take(self, machine: Machine, errand: PendingTask, answer: dict[str, Any]) -> None:
        """An answer that came whole."""
        if answer["foreign"] is not None:
            machine.foreign.add(answer["foreign"])
            self.say(machine, f"runs other code: {answer['foreign']}")
            self.waiting.insert(0, errand)
            return
        error = None if answer["error"] is None else unpack(answer["error"])
        value = None if answer["value"] is None else unpack(answer["value"])
        self.end(Outcome(errand.job.name, value, error, answer["seconds"], answer["tries"]), errand.job)

    def again(self, machine: Machine, errand: PendingTask, what: str) -> None:
        """A call failed on its machine: once more, where it has a try left."""
        machine.errands.remove(errand)
        errand.future.cancel()
        if errand.tries >= _TRIES:
            error = BakeError(f"{errand.job.name} {what}, twice", file=errand.job.file)
            self.fail(errand, error, time.monotonic() - errand.since)
            return
        errand.tries, errand.alone = errand.tries + 1, True
        self.waiting.append(errand)

    def bury(self, machine: Machine) -> None:
        """A worker is gone: what ran there is tried once more, with nothing beside it."""
        for errand in [*machine.errands]:
            self.again(machine, errand, f"could not be baked: its worker {machine.name} died")

    def lose(self, errand: PendingTask, why: str) -> None:
        """A call went down with somebody else's data: sent anew with all its files."""
        errand.lost += 1
        self.looked = 0.0  # the worker may have gone
        self.freight.lost(errand.job)
        if errand.lost > _LOST:
            what = f"{errand.job.name} could not be sent: {why}"
            self.fail(errand, BakeError(what, file=errand.job.file), 0.0)
        else:
            self.waiting.insert(0, errand)

    def fail(self, errand: PendingTask, error: ParadizeError, seconds: float) -> None:
        self.end(Outcome(errand.job.name, None, error, seconds, errand.tries), errand.job)

    def end(self, outcome: Outcome, job: Job | None = None) -> None:
        """Notes what became of a job; what only it read is let go."""
        self.outcomes[outcome.name] = outcome
        if job:
            self.freight.done(job)
        if self.told:
            self.told(outcome)

    def refuse(self, machine: Machine, why: str) -> None:
        machine.refused = why
        self.say(machine, why)

    def say(self, machine: Machine, why: str) -> None:
        if self.warn:
            self.warn(str(machine.refusal(why)))

    def leave(self) -> None:
        """Ends what still runs there, and the connection."""

        def quietly() -> None:
            with suppress(Exception):  # the cluster may be gone, or some of its workers hang
                busy = [errand.future for one in self.machines.values() for errand in one.errands]
                self.client.cancel(busy, force=True)
                self.client.run(leave, self.name, on_error="ignore")

        if self.client.status == "running":
            thread = threading.Thread(target=quietly, daemon=True)
            thread.start()
            thread.join(LEAVE_S)
        with suppress(Exception):
            self.client.close(timeout=LEAVE_S)

"""Runs jobs on the workers of a Dask cluster: the sources travel to them, the results come back as bytes.

Which job runs where is decided here, as workers.py does for its processes, so that the same rules hold: a job
is tried twice, at most as many run on a machine as fit its memory, and one that lost its machine goes on
alone, so that it cannot take others down with it. Dask carries calls, files (each once, however many jobs
read it) and answers, and tells who is there. What runs there is cluster_far.py.
"""

from __future__ import annotations

import platform
import queue
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from secrets import token_hex
from typing import Any

from paradize.engine.cluster_far import PROTOCOL, bake_here, greet, leave
from paradize.engine.cluster_link import CONNECT_S, HOWTO, ClusterLost, connect
from paradize.engine.parcel import full, pack_call, unpack
from paradize.engine.workers import Job, Outcome
from paradize.errors import BakeError, ParadizeError, one_line

ABSENT_S = 30.0  # so long a bake waits for a worker to come, or to come back
LEAVE_S = 5.0  # for what is done last
LARGE = 1 << 20  # bytes of a call that do not go by the scheduler's books
ANSWER_S = 60.0  # until a worker must have said who it is
_LOOK_S = 0.25  # how often it is looked who is there
_TRIES = 2
_LOST = 8  # so often a job is sent anew whose files went with a worker, not the job's own fault


@dataclass(eq=False)
class _Errand:
    """A job on its way. tries: which one it is of the job's. lost: how often it went down without a fault of
    its own. alone: whether it lost its machine before."""

    job: Job
    tries: int = 1
    lost: int = 0
    alone: bool = False
    future: Any = None
    since: float = 0.0


@dataclass(eq=False)
class _Machine:
    """A Dask worker: its threads, what it said of itself (None: nothing yet), what runs there."""

    address: str
    threads: int
    since: float
    told: dict[str, Any] | None = None
    refused: str = ""  # why it gets nothing
    foreign: set[str] = field(default_factory=set)  # modules that it has in other versions
    errands: list[_Errand] = field(default_factory=list)
    greeting: Any = None

    def load(self) -> float:
        """How many jobs each thread has."""
        return len(self.errands) / self.threads

    @property
    def name(self) -> str:
        host = (self.told or {}).get("host")
        return f"{host} ({self.address})" if host else self.address


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
    tour = _Tour(client, address, jobs, told, began, warn, most or len(jobs))
    try:
        return tour.run()
    finally:
        tour.leave()


class _Tour:
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
        self.waiting = [_Errand(job) for job in jobs]
        self.outcomes: dict[str, Outcome] = {}
        self.machines: dict[str, _Machine] = {}
        self.answers: queue.SimpleQueue[tuple[_Machine, _Errand | None, Any]] = queue.SimpleQueue()
        self.blobs: dict[str, Any] = {}  # a file's path -> the future of its bytes
        self.readers: dict[str, int] = {}  # how many jobs that are not done read it
        for job in jobs:
            for path, whole in job.files.items():
                if whole:
                    self.readers[full(path)] = self.readers.get(full(path), 0) + 1
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
                machine = self.machines[address] = _Machine(address, threads, now)
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
                    self.client.scheduler.ncores, workers=None, callback_timeout=CONNECT_S
                )
                return there
        what = "the scheduler has gone; what was baked until then is kept"
        raise ClusterLost(what, file=self.address, mend="start it again, and bake again")

    def give_up(self) -> None:
        """Ends the jobs that no machine takes, once all have said who they are."""
        if not self.machines or any(one.told is None and not one.refused for one in self.machines.values()):
            return
        for errand in [*self.waiting]:
            if not any(self.takes(machine, errand.job) for machine in self.machines.values()):
                self.waiting.remove(errand)
                machine = next(iter(self.machines.values()))
                what = machine.refused or f"runs other code: {self.foreign(machine, errand.job)}"
                self.fail(errand, _refusal(machine, what), 0.0)

    @staticmethod
    def foreign(machine: _Machine, job: Job) -> str:
        """A module of the job's that the machine has in another version; empty where there is none."""
        return next(iter(sorted(machine.foreign & job.code.keys())), "")

    def takes(self, machine: _Machine, job: Job) -> bool:
        return not machine.refused and not self.foreign(machine, job)

    def hand_out(self) -> None:
        """Sends what there is room for."""
        while sum(len(machine.errands) for machine in self.machines.values()) < self.most:
            pair = next(
                (
                    (machine, errand)
                    for errand in self.waiting
                    for machine in sorted(self.machines.values(), key=_Machine.load)
                    if self.fits(machine, errand)
                ),
                None,
            )
            if pair is None:
                return
            self.waiting.remove(pair[1])
            self.start(*pair)

    def fits(self, machine: _Machine, errand: _Errand) -> bool:
        if machine.told is None or not self.takes(machine, errand.job):
            return False
        if not machine.errands:
            return True
        near = [other for other in self.machines.values() if self.near(machine, other)]
        beside = [one for other in near for one in other.errands]
        if errand.alone or len(machine.errands) >= machine.threads or any(one.alone for one in beside):
            return False
        limit = machine.told["memory"]
        return limit is None or sum(one.job.memory_bytes for one in beside) + errand.job.memory_bytes <= limit

    @staticmethod
    def near(one: _Machine, other: _Machine) -> bool:
        """Whether two workers run on one computer."""
        return bool(one.told and other.told and one.told["host"] == other.told["host"])

    def start(self, machine: _Machine, errand: _Errand) -> None:
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
        paths = [path for path, whole in job.files.items() if whole]
        try:
            blobs = [self.blob(path, machine) for path in paths]
            call: Any = packed
            if len(packed) > LARGE:
                call = self.client.scatter(packed, workers=[machine.address], hash=False)
            key = f"paradize {job.name} {token_hex(4)}"
            future = self.client.submit(
                bake_here, self.name, task, call, list(map(full, paths)), blobs, machine.threads,
                workers=[machine.address], pure=False, key=key,
            )  # fmt: skip
        except ParadizeError as error:
            self.fail(errand, error, 0.0)
            return
        except Exception as error:  # of Dask, or of the line
            self.lose(errand, f"{type(error).__name__}: {error}")
            return
        errand.since = time.monotonic()
        machine.errands.append(errand)
        if self.began:
            self.began(job)
        self.send(machine, errand, future)

    def blob(self, path: Path, machine: _Machine) -> Any:
        """The bytes of a file, on the cluster, named by their hash. Raises BakeError where there are none."""
        held = self.blobs.get(full(path))
        if held is None or held.status != "finished":
            try:
                data = path.read_bytes()
            except OSError as error:
                raise BakeError(f"cannot be read: {error.strerror or error}", file=path) from None
            held = self.client.scatter(data, workers=[machine.address], hash=True)
            self.blobs[full(path)] = held
        return held

    def send(self, machine: _Machine, errand: _Errand | None, future: Any) -> None:
        """Has the answer come into the queue."""
        if errand:
            errand.future = future
        else:
            machine.greeting = future  # held, or Dask would drop the call
        answers = self.answers
        future.add_done_callback(lambda done: answers.put((machine, errand, done)))

    def hear(self, machine: _Machine, errand: _Errand | None, future: Any) -> None:
        """Takes what came of a call."""
        if errand and (errand not in machine.errands or errand.future is not future):
            return  # given to another meanwhile
        value, wrong = None, ""
        try:
            value = future.result(timeout=ANSWER_S + 600.0)
        except Exception as error:  # of the line, of Dask, or of what the other side cannot import
            wrong = f"{type(error).__name__}: {one_line(str(error)).strip()[:300]}"
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

    def meet(self, machine: _Machine, told: dict[str, Any] | None, wrong: str) -> None:
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

    def take(self, machine: _Machine, errand: _Errand, answer: dict[str, Any]) -> None:
        """An answer that came whole."""
        if answer["foreign"] is not None:
            machine.foreign.add(answer["foreign"])
            self.say(machine, f"runs other code: {answer['foreign']}")
            self.waiting.insert(0, errand)
            return
        error = None if answer["error"] is None else unpack(answer["error"])
        value = None if answer["value"] is None else unpack(answer["value"])
        self.end(Outcome(errand.job.name, value, error, answer["seconds"], answer["tries"]), errand.job)

    def again(self, machine: _Machine, errand: _Errand, what: str) -> None:
        """A call failed on its machine: once more, where it has a try left."""
        machine.errands.remove(errand)
        errand.future.cancel()
        if errand.tries >= _TRIES:
            error = BakeError(f"{errand.job.name} {what}, twice", file=errand.job.file)
            self.fail(errand, error, time.monotonic() - errand.since)
            return
        errand.tries, errand.alone = errand.tries + 1, True
        self.waiting.append(errand)

    def bury(self, machine: _Machine) -> None:
        """A worker is gone: what ran there is tried once more, with nothing beside it."""
        for errand in [*machine.errands]:
            self.again(machine, errand, f"could not be baked: its worker {machine.name} died")

    def lose(self, errand: _Errand, why: str) -> None:
        """A call went down with somebody else's data: sent anew with all its files."""
        errand.lost += 1
        for path in errand.job.files:
            self.blobs.pop(full(path), None)
        if errand.lost > _LOST:
            what = f"{errand.job.name} could not be sent: {why}"
            self.fail(errand, BakeError(what, file=errand.job.file), 0.0)
        else:
            self.waiting.insert(0, errand)

    def fail(self, errand: _Errand, error: ParadizeError, seconds: float) -> None:
        self.end(Outcome(errand.job.name, None, error, seconds, errand.tries), errand.job)

    def end(self, outcome: Outcome, job: Job | None = None) -> None:
        """Notes what became of a job; what only it read is let go."""
        self.outcomes[outcome.name] = outcome
        for path in [full(path) for path, whole in job.files.items() if whole] if job else []:
            self.readers[path] -= 1
            if not self.readers[path]:
                self.blobs.pop(path, None)
        if self.told:
            self.told(outcome)

    def refuse(self, machine: _Machine, why: str) -> None:
        machine.refused = why
        self.say(machine, why)

    def say(self, machine: _Machine, why: str) -> None:
        if self.warn:
            self.warn(str(_refusal(machine, why)))

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


def _refusal(machine: _Machine, why: str) -> BakeError:
    mend = "install the same paradize there, and start the worker again"
    return BakeError(f"the worker {machine.name} {why}", mend=mend)

"""Bakes a scene again whenever a file is saved that its bake reads, or the code that bakes it.

Three parties: file events (watchfiles: inotify, FSEvents), one process that bakes (watch/rebake.py) and keeps
its workers warm, and the loop here, which waits for either. The process is replaced when code changes, so
that no bake runs an old module; the loop itself loads nothing of the pipeline.
"""

from __future__ import annotations

import queue
import subprocess
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from paradize.errors import BakeError
from paradize.files import resolved
from paradize.jobs.code import clear_caches, code_files
from paradize.jobs.libraries import library_versions
from paradize.jobs.limits import cores
from paradize.jobs.process import Answer, Job, Worker, start_worker
from paradize.kinds import SCENE, require
from paradize.store.local import Stamp, stamp
from paradize.watch.rebake import Baked, bake_again, warm_up

STEP_MS = 20  # a burst of events is over when so long none came
BURST_MS = 200  # and is looked at when it goes on for so long
CALM_S = 0.2  # an error counts when nothing is saved so long after it: a file may have been half written
_LEAVE_S = 5.0  # how long a bake may take to end in good order
Late = tuple[Stamp | None, Stamp | None]  # of a file: the stamp that a bake knows, and the one that it has


@dataclass(frozen=True)
class Told:
    """What a bake gave. changed: the sources that were saved since the one before. restarted: it ran in a new
    process, because code had changed."""

    baked: Baked
    changed: tuple[Path, ...]
    restarted: bool


class _Events:
    """From its making on, puts the entries of some folders that are written, made, renamed or removed into a
    queue, as sets of paths."""

    def __init__(self, folders: Iterable[Path], into: queue.SimpleQueue[Any]) -> None:
        from watchfiles._rust_notify import RustNotify

        self._into, self._over = into, threading.Event()
        self._notify = RustNotify([str(folder) for folder in folders], False, False, 0, False, True)
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        with self._notify:
            while isinstance(found := self._notify.watch(BURST_MS, STEP_MS, 0, self._over), set):
                self._into.put({Path(path) for _, path in found})

    def stop(self) -> None:
        self._over.set()


@dataclass(eq=False)
class Watch:
    """A scene under watch. jobs, tier, cluster, store: as in tasks.How. told hears of every bake; of an
    error once, until something else is to be told."""

    scene: Path
    out: Path | None
    jobs: int
    tier: str | None
    told: Callable[[Told], None]
    cluster: str | None = None
    store: str | None = None
    _queue: queue.SimpleQueue[Any] = field(default_factory=queue.SimpleQueue)
    _events: _Events | None = None
    _folders: frozenset[Path] = frozenset()
    _reads: frozenset[Path] = frozenset()  # what the scene is made of, and what leads there
    _late: dict[Path, Late] = field(default_factory=dict)  # what the last bake had begun too early for
    _code: frozenset[Path] = frozenset()
    _libraries: tuple[str, ...] = ()
    _worker: Worker | None = None
    _due: bool = True  # a bake
    _changed: set[Path] = field(default_factory=set)  # since the last bake began
    _baking: set[Path] = field(default_factory=set)  # what it was begun for
    _restarted: bool = False
    _failed: Baked | None = None  # not told yet
    _last: list[str] = field(default_factory=list)  # the errors that were told last

    def run(self) -> None:
        """Bakes, waits, bakes ... until it is interrupted. Raises SceneError where there is no scene."""
        require(SCENE, self.scene)
        self._look_at({self.scene.absolute(): stamp(self.scene)})
        while True:
            if self._due and not (self._worker and self._worker.job):
                self._bake()
            try:
                found = self._queue.get(timeout=CALM_S if self._failed else None)
            except queue.Empty:
                assert self._failed
                self._tell(self._failed)
                continue
            if isinstance(found, Answer):
                self._answered(found)
            else:
                self._saved(found)

    def stop(self) -> None:
        """Ends what runs, in good order."""
        if self._events:
            self._events.stop()
        if self._worker:
            self._worker.process.terminate()
            with suppress(subprocess.TimeoutExpired):
                self._worker.process.wait(_LEAVE_S)
            self._worker.stop()

    def _bake(self) -> None:
        """Gives the process that bakes its work; the answer comes into the queue."""
        clear_caches()
        if self._worker and library_versions() != self._libraries:
            self._replace()
        self._libraries = library_versions()
        self._due, self._failed = False, None
        self._baking |= self._changed
        self._changed = set()
        how = {"scene": self.scene, "out": self.out, "jobs": self.jobs, "tier": self.tier}
        how |= {"cluster": self.cluster, "store_url": self.store}
        self._give(Job("the bake", bake_again, how | {"afresh": self._restarted}))

    def _give(self, job: Job) -> None:
        if self._worker is None:
            self._worker = start_worker(self._queue, None, None)
        self._worker.send(job, 1)

    def _replace(self) -> None:
        """Ends the process that bakes, whatever it is at; the next bake runs in a new one."""
        if self._worker:
            self._worker.stop()
        self._worker, self._restarted, self._due = None, True, True

    def _saved(self, paths: set[Path]) -> None:
        """Something happened to these files and folders."""
        if paths & self._code:
            self._replace()
        if found := paths & self._reads:
            self._changed |= found
            self._due = True

    def _answered(self, answer: Answer) -> None:
        """A process that bakes has done something, or is gone."""
        worker = answer.worker
        if worker is not self._worker or worker.job is None:
            return  # replaced meanwhile
        job, worker.job = worker.job, None
        baked = answer.value
        if answer.dead:
            self._worker = None
            baked = Baked(errors=[BakeError(f"{job.name} {worker.death()}", file=self.scene)])
        elif answer.error:
            baked = Baked(errors=[answer.error])
        if job.call is warm_up:
            return
        if baked.foreign:
            self._replace()
            return
        self._look_at(baked.reads, keep=bool(baked.errors))
        if not baked.errors:
            first = not self._last and not self._baking and not self._restarted
            self._tell(baked)
            if first and not self._due:
                self._give(Job("warm up", warm_up, {"jobs": self.jobs or cores()}))
        elif not self._due:
            self._failed = baked

    def _tell(self, baked: Baked) -> None:
        self._failed = None
        changed, restarted = tuple(sorted(self._baking)), self._restarted
        errors = [str(error) for error in baked.errors]
        if not errors or errors != self._last:
            self.told(Told(baked, changed, restarted))
        self._last, self._baking, self._restarted = errors, set(), False

    def _look_at(self, reads: dict[Path, Stamp | None], *, keep: bool = False) -> None:
        """Watches these files and the code from here on; one that is not as its stamp says has changed
        already. keep: and those of before."""
        paths = {one for path in reads for one in (path, resolved(path))}
        ways = {folder for path in paths for folder in path.parents}
        self._reads = frozenset(paths | ways | (self._reads if keep else set()))
        clear_caches()
        self._code = frozenset(code_files("paradize.build.bake"))
        near = {place for path in paths | self._code for place in _places(path)}
        folders = frozenset(near | (self._folders if keep else set()))
        if folders != self._folders:
            old, self._events = self._events, _Events(folders, self._queue)
            self._folders = folders
            if old:
                old.stop()
        late = {path: (was, now) for path, was in reads.items() if (now := stamp(path)) != was}
        # What a bake for it left as it was has not changed again.
        if new := {path for path in late if late[path] != self._late.get(path)}:
            self._changed |= new
            self._due = True
        self._late = late


def _places(path: Path) -> list[Path]:
    """The folders whose entries tell of a file: the one that it is in, or will be, and the one above."""
    parent = next(folder for folder in path.parents if folder.is_dir())
    return [parent, parent.parent]

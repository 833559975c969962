"""Bakes a scene again whenever a file is saved that its bake reads, or the code that bakes it.

File events come from watchfiles (inotify, FSEvents). One process bakes (watch/rebake.py) and keeps its
workers warm. The loop here waits for either. When code changes, the process is replaced, so that no bake runs
an old module; the loop itself imports nothing of the bakers."""

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
from paradize.jobs.limits import default_jobs
from paradize.jobs.process import Answer, Job, Worker, start_worker
from paradize.jobs.progress import Step
from paradize.kinds import SCENE, require
from paradize.store.local import Stamp, stamp
from paradize.watch.rebake import Baked, bake_again, warm_up

STEP_MS = 20  # a burst of events ends after this time without an event
BURST_MS = 200  # and after this time at the latest
CALM_S = 0.2  # an error is reported after this time without a save: a file may have been half written
_LEAVE_S = 5.0  # a bake may take this long to end cleanly
Stamps = tuple[Stamp | None, Stamp | None]  # of a file: as a bake read it, and as it is now


@dataclass(frozen=True)
class WatchEvent:
    """A finished bake. changed: the sources saved since the one before. restarted: it ran in a new process,
    because code had changed."""

    baked: Baked
    changed: tuple[Path, ...]
    restarted: bool


class _Events:
    """Puts the paths of files in some folders that are written, made, renamed or removed into a queue, as
    sets."""

    def __init__(self, folders: Iterable[Path], into: queue.SimpleQueue[Any]) -> None:
        from watchfiles._rust_notify import RustNotify

        self._into, self._over = into, threading.Event()
        self._notify = RustNotify([str(folder) for folder in folders], False, False, 0, False, True)
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        with self._notify:
            while isinstance(events := self._notify.watch(BURST_MS, STEP_MS, 0, self._over), set):
                self._into.put({Path(path) for _, path in events})

    def stop(self) -> None:
        self._over.set()


@dataclass(eq=False)
class Watch:
    """Watches a scene. jobs, tier, cluster, store: as in options.BuildOptions. on_bake hears of every bake;
    of the same errors only once. on_start, on_step, on_end: a bake begins, has begun a step (called from
    another thread), or has ended, whatever came of it."""

    scene: Path
    out: Path | None
    jobs: int
    tier: str | None
    on_bake: Callable[[WatchEvent], None]
    cluster: str | None = None
    store: str | None = None
    on_start: Callable[[], None] = lambda: None
    on_step: Callable[[Step], None] = lambda step: None
    on_end: Callable[[], None] = lambda: None
    _queue: queue.SimpleQueue[Any] = field(default_factory=queue.SimpleQueue)
    _events: _Events | None = None
    _folders: frozenset[Path] = frozenset()  # whose events come
    _moved: bool = False  # whether one of them was made, renamed or removed: its events come no more
    _reads: frozenset[Path] = frozenset()  # the files of the scene, and the folders above them
    _late: dict[Path, Stamps] = field(default_factory=dict)  # files saved while the last bake ran
    _code: frozenset[Path] = frozenset()
    _libraries: tuple[str, ...] = ()
    _worker: Worker | None = None
    _due: bool = True  # whether a bake is to begin
    _changed: set[Path] = field(default_factory=set)  # since the last bake began
    _baking: set[Path] = field(default_factory=set)  # the saved files for which it began
    _restarted: bool = False
    _failed: Baked | None = None  # a failed bake that is not reported yet
    _last: list[str] = field(default_factory=list)  # the errors reported last

    def run(self) -> None:
        """Bakes and waits in turn until it is interrupted. Raises SceneError if there is no scene."""
        require(SCENE, self.scene)
        self._look_at({self.scene.absolute(): stamp(self.scene)})
        while True:
            if self._due and not (self._worker and self._worker.job):
                self._bake()
            try:
                event = self._queue.get(timeout=CALM_S if self._failed else None)
            except queue.Empty:
                assert self._failed
                self._report(self._failed)
                continue
            if isinstance(event, Answer):
                self._answered(event)
            else:
                self._saved(event)

    def stop(self) -> None:
        """Ends the bake under way cleanly."""
        if self._events:
            self._events.stop()
        if self._worker:
            self._worker.process.terminate()
            with suppress(subprocess.TimeoutExpired):
                self._worker.process.wait(_LEAVE_S)
            self._worker.stop()

    def _bake(self) -> None:
        """Begins a bake; the answer comes into the queue."""
        clear_caches()
        if self._worker and library_versions() != self._libraries:
            self._replace()
        self._libraries = library_versions()
        self._due, self._failed = False, None
        self._baking |= self._changed
        self._changed = set()
        options = {"scene": self.scene, "out": self.out, "jobs": self.jobs, "tier": self.tier}
        options |= {"cluster": self.cluster, "store_url": self.store}
        self.on_start()
        self._give(Job("the bake", bake_again, options | {"forget_record": self._restarted}), self.on_step)

    def _give(self, job: Job, on_step: Callable[[Step], None] | None = None) -> None:
        if self._worker is None:
            self._worker = start_worker(self._queue, None, None)
        self._worker.send(job, 1, on_step)

    def _replace(self) -> None:
        """Kills the process that bakes; the next bake runs in a new one."""
        if self._worker:
            self._worker.stop()
        self.on_end()
        self._worker, self._restarted, self._due = None, True, True

    def _saved(self, paths: set[Path]) -> None:
        """These files and folders changed."""
        self._moved = self._moved or not paths.isdisjoint(self._folders)
        if paths & self._code:
            self._replace()
        if read := paths & self._reads:
            self._changed |= read
            self._due = True

    def _answered(self, answer: Answer) -> None:
        """The process that bakes has answered, or is gone."""
        worker = answer.worker
        if worker is not self._worker or worker.job is None:
            return  # it was replaced
        job, worker.job = worker.job, None
        self.on_end()
        baked = answer.value
        if answer.dead:
            self._worker = None
            how, mend = worker.death()
            baked = Baked(errors=[BakeError(f"{job.name} {how}", file=self.scene, mend=mend)])
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
            self._report(baked)
            if first and not self._due:
                self._give(Job("warm up", warm_up, {"jobs": self.jobs or default_jobs()}))
        elif not self._due:
            self._failed = baked

    def _report(self, baked: Baked) -> None:
        """Passes a bake to on_bake, unless its errors are those reported last."""
        self._failed = None
        changed, restarted = tuple(sorted(self._baking)), self._restarted
        errors = [str(error) for error in baked.errors]
        if not errors or errors != self._last:
            self.on_bake(WatchEvent(baked, changed, restarted))
        self._last, self._baking, self._restarted = errors, set(), False

    def _look_at(self, reads: dict[Path, Stamp | None], *, keep: bool = False) -> None:
        """Watches these files and the code from here on. A file whose stamp differs has changed already.
        keep: also watch the files of before."""
        paths = {each for path in reads for each in (path, resolved(path))}
        parents = {folder for path in paths for folder in path.parents}
        self._reads = frozenset(paths | parents | (self._reads if keep else set()))
        clear_caches()
        self._code = frozenset(code_files("paradize.build.bake"))
        watched = {folder for path in paths | self._code for folder in _folders_of(path)}
        kept = {folder for folder in self._folders if folder.is_dir()} if keep else set()
        folders = frozenset(watched | kept)
        if folders != self._folders or self._moved:
            old, self._events = self._events, _Events(folders, self._queue)
            self._folders, self._moved = folders, False
            if old:
                old.stop()
        late = {path: (was, now) for path, was in reads.items() if (now := stamp(path)) != was}
        # A file that changed during the bake that it caused has not changed again.
        if new := {path for path in late if late[path] != self._late.get(path)}:
            self._changed |= new
            self._due = True
        self._late = late


def _folders_of(path: Path) -> list[Path]:
    """The folders to watch for a file: the nearest one that exists, and the one above."""
    parent = next(folder for folder in path.parents if folder.is_dir())
    return [parent, parent.parent]

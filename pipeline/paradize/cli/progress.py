"""Shows how a command gets on: a bar on a terminal; elsewhere a line on standard error every few seconds.

A bake stores the seconds of each job, so that the next bake of the scene can say how much time is left. A job
without stored seconds counts as the mean of those that have some.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from paradize.build.entries import SECONDS, fits
from paradize.build.options import JobObserver
from paradize.cli.output import say
from paradize.errors import BakeError, one_line
from paradize.store.local import Store, key_of

_NAMES = 4  # running jobs that are named
_FORM = "{desc} |{bar:20}| {n_fmt}/{total_fmt}{postfix}"
_TICK_S = 1.0  # between two updates of the time on a terminal
_LINE_S = 5.0  # between two lines elsewhere


class Progress(JobObserver):
    """The display of one command, until `close`. It appears with the first job or step.

    store, name: where the seconds of jobs are stored, and under which name (provenance.record_name); without
    a store nothing is remembered. line_s: seconds between two lines where standard error is not a terminal.
    """

    def __init__(self, store: Store | None = None, name: str = "", line_s: float = _LINE_S) -> None:
        self.store, self.key = store, key_of("seconds", name)[:32]
        stored = store.get_bake(self.key) if store else None
        self.known: dict[str, float] = dict(stored) if fits(stored, SECONDS) else {}
        self.work = Work(self.known)
        self.terminal = sys.stderr.isatty()
        self.tick_s = _TICK_S if self.terminal else line_s
        self.bar: Any = None
        self.shown = False
        self.lock, self.over = threading.Lock(), threading.Event()

    def planned(self, names: Sequence[str]) -> None:
        with self.lock:
            self.work.planned(names)
            self._show()

    def began(self, name: str) -> None:
        with self.lock:
            self.work.began(name, time.monotonic())
            self._show()

    def reached(self, name: str, step: str) -> None:
        with self.lock:
            self.work.steps[name] = step
            if not self.over.is_set():
                self._show()

    def ended(self, name: str, seconds: float) -> None:
        with self.lock:
            self.work.ended(name, seconds)
            self.known[name] = round(seconds, 3)
            self._show()

    def step(self, name: str, done: int, total: int) -> None:
        """For work that counts its own steps: `name` runs now, `done` of `total` steps are finished."""
        with self.lock:
            self.work.step(name, done, total, time.monotonic())
            self._show()

    def warned(self, text: str) -> None:
        with self.lock:
            if self.bar is not None:
                self.bar.clear()
            say(f"paradize: warning: {text}")
            self._show()

    def close(self) -> None:
        """Removes the display and stores the seconds."""
        with self.lock:
            self.over.set()
            if self.bar is not None:
                self.bar.close()
                self.bar = None
            if self.store and self.work.done:
                with suppress(BakeError):  # the bake itself reports a store that cannot be written
                    self.store.put_bake(self.key, self.known)

    def _show(self) -> None:
        """Updates the bar; the first call makes it and starts the thread that keeps the time."""
        if not self.shown:
            self.shown = True
            if self.terminal:
                from tqdm import tqdm

                self.bar = tqdm(total=0, file=sys.stderr, leave=False, bar_format=_FORM, dynamic_ncols=True)
            threading.Thread(target=self._tick, daemon=True).start()
        if self.bar is None:
            return
        self.bar.total, self.bar.n = self.work.count, self.work.done
        self.bar.set_description_str(self._running(), refresh=False)
        self.bar.set_postfix_str(self._time(), refresh=False)
        self.bar.refresh()

    def _tick(self) -> None:
        while not self.over.wait(self.tick_s):
            with self.lock:
                if self.over.is_set():
                    return
                if self.terminal:
                    self._show()
                else:
                    count = f"{self.work.done} of {self.work.count} done, {self._time()}"
                    running = self._running()
                    say(f"paradize: {count}{': ' if running else ''}{running}")

    def _running(self) -> str:
        names = [self.work.named(name) for name in self.work.running]
        more = f" +{len(names) - _NAMES}" if len(names) > _NAMES else ""
        return one_line(", ".join(names[:_NAMES]) + more)

    def _time(self) -> str:
        """The time left; where that is not known, the time so far."""
        now = time.monotonic()
        left = self.work.left_s(now)
        if left is not None:
            return f"{clock(left)} left"
        return "" if self.work.since is None else f"{clock(now - self.work.since)} so far"


@contextmanager
def progress() -> Iterator[Progress]:
    """The display of a command that is not a bake."""
    shown = Progress()
    try:
        yield shown
    finally:
        shown.close()


class Work:
    """How many jobs there are, which run and since when, and how many are done.

    known: seconds of jobs in earlier bakes, by name.
    """

    def __init__(self, known: Mapping[str, float]) -> None:
        self.known = dict(known)
        self.count = self.done = 0
        self.running: dict[str, float] = {}  # name -> the time of its start
        self.steps: dict[str, str] = {}  # name -> the step that it reached
        self.done_s = 0.0  # seconds of the jobs that are done
        self.waiting_s = 0.0  # seconds of waiting jobs that are known
        self.waiting_unknown = 0  # waiting jobs whose seconds are not known
        self.timed, self.timed_s = 0, 0.0  # jobs whose seconds are known by now, and their sum
        self.since: float | None = None  # the time of the first start

    def planned(self, names: Sequence[str]) -> None:
        self.count += len(names)
        for name in names:
            self._wait(name, 1)
            if name in self.known:
                self.timed, self.timed_s = self.timed + 1, self.timed_s + self.known[name]

    def began(self, name: str, now: float) -> None:
        self.since = now if self.since is None else self.since
        if name not in self.running:  # else it is tried once more
            self._wait(name, -1)
        self.running[name] = now
        self.steps.pop(name, None)

    def ended(self, name: str, seconds: float) -> None:
        if self.running.pop(name, None) is None:
            self._wait(name, -1)
        self.done += 1
        self.done_s += seconds
        if name not in self.known:
            self.timed, self.timed_s = self.timed + 1, self.timed_s + seconds

    def named(self, name: str) -> str:
        """A job and the step that it reached."""
        return f"{name}: {self.steps[name]}" if name in self.steps else name

    def step(self, name: str, done: int, total: int, now: float) -> None:
        """Work that counts its own steps. Another total begins other work."""
        if self.since is None or total != self.count:
            self.since = now
        self.running = {name: now} if done < total else {}
        self.done, self.count = done, total

    def left_s(self, now: float) -> float | None:
        """Seconds until all jobs are done: the seconds of work left, over the seconds of work done in each
        second so far, and at least those of the longest job that runs. Of steps, as long for each as so far.
        None where nothing is known yet, or no second is left beside jobs that take longer than known."""
        if self.since is None:
            return None
        passed = now - self.since
        if not self.timed:
            return passed * (self.count - self.done) / self.done if self.done else None
        mean = self.timed_s / self.timed
        spent = {name: now - start for name, start in self.running.items()}
        rests = [self.known.get(name, mean) - seconds for name, seconds in spent.items()]
        left = self.waiting_s + self.waiting_unknown * mean + sum(max(0.0, rest) for rest in rests)
        worked = self.done_s + sum(spent.values())
        seconds = max(left * passed / worked if worked > 0.0 else left, *rests, 0.0)
        return None if seconds < 1.0 and any(rest < 0.0 for rest in rests) else seconds

    def _wait(self, name: str, more: int) -> None:
        if name in self.known:
            self.waiting_s += more * self.known[name]
        else:
            self.waiting_unknown += more


def clock(seconds: float) -> str:
    """Minutes and seconds as 1:05; hours where there are some."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"

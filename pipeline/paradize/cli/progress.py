"""The display of a bake: what runs, how much is done, how long it will take; on a terminal only.

What each task took is remembered by its name, so that a later bake of the scene knows how much work is left;
of tasks that are not known the mean of those that are counts.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from paradize.build.entries import SECONDS, fits
from paradize.build.options import Watcher
from paradize.cli.output import say
from paradize.errors import BakeError, one_line
from paradize.store.local import Store, key_of

_NAMES = 4  # so many of those that run are named
_FORM = "{desc} |{bar:20}| {n_fmt}/{total_fmt}{postfix}"
_TICK_S = 1.0  # so often the time that is left is told anew


class Progress(Watcher):
    """store, name: where seconds are remembered, under the name of the bake (bake_record.record_name). To be
    closed."""

    def __init__(self, store: Store, name: str) -> None:
        self.store, self.key = store, key_of("seconds", name)[:32]
        known = store.get_bake(self.key)
        self.known: dict[str, float] = dict(known) if fits(known, SECONDS) else {}
        self.work = Work(self.known)
        self.shown = sys.stderr.isatty()
        self.bar: Any = None
        self.lock, self.over = threading.Lock(), threading.Event()

    def planned(self, names: Sequence[str]) -> None:
        with self.lock:
            self.work.planned(names)
            if self.shown and self.bar is None:
                from tqdm import tqdm

                self.bar = tqdm(total=0, file=sys.stderr, leave=False, bar_format=_FORM, dynamic_ncols=True)
                threading.Thread(target=self._tick, daemon=True).start()
            self._show()

    def began(self, name: str) -> None:
        with self.lock:
            self.work.began(name, time.monotonic())
            self._show()

    def ended(self, name: str, seconds: float) -> None:
        with self.lock:
            self.work.ended(name, seconds)
            self.known[name] = round(seconds, 3)
            self._show()

    def warned(self, text: str) -> None:
        with self.lock:
            if self.bar is not None:
                self.bar.clear()
            say(f"paradize: warning: {text}")
            self._show()

    def close(self) -> None:
        """Takes the display away, and remembers what was learned."""
        with self.lock:
            self.over.set()
            if self.bar is not None:
                self.bar.close()
                self.bar = None
            if self.work.done:
                with suppress(BakeError):  # of use, no more: what the bake itself could not write is told
                    self.store.put_bake(self.key, self.known)

    def _tick(self) -> None:
        while not self.over.wait(_TICK_S):
            with self.lock:
                self._show()

    def _show(self) -> None:
        if self.bar is None:
            return
        running = list(self.work.running)
        more = f" +{len(running) - _NAMES}" if len(running) > _NAMES else ""
        left = self.work.left_s(time.monotonic())
        self.bar.total, self.bar.n = self.work.count, self.work.done
        self.bar.set_description_str(one_line(", ".join(running[:_NAMES]) + more), refresh=False)
        self.bar.set_postfix_str("" if left is None else f"{clock(left)} left", refresh=False)
        self.bar.refresh()


class Work:
    """What is to be done, what runs since when, and what was done. known: seconds by name, of earlier
    bakes."""

    def __init__(self, known: Mapping[str, float]) -> None:
        self.known = dict(known)
        self.count = self.done = 0
        self.running: dict[str, float] = {}  # since when
        self.worked = 0.0  # seconds, of what is done
        self.sure_s = 0.0  # seconds of what waits, of those that are known
        self.unsure = 0  # how many others wait
        self.told, self.told_s = 0, 0.0  # of which the mean is taken
        self.since: float | None = None

    def planned(self, names: Sequence[str]) -> None:
        self.count += len(names)
        for name in names:
            self._wait(name, 1)
            if name in self.known:
                self.told, self.told_s = self.told + 1, self.told_s + self.known[name]

    def began(self, name: str, now: float) -> None:
        self.since = now if self.since is None else self.since
        if name not in self.running:  # else it is tried once more
            self._wait(name, -1)
        self.running[name] = now

    def ended(self, name: str, seconds: float) -> None:
        if self.running.pop(name, None) is None:
            self._wait(name, -1)
        self.done += 1
        self.worked += seconds
        if name not in self.known:
            self.told, self.told_s = self.told + 1, self.told_s + seconds

    def left_s(self, now: float) -> float | None:
        """Seconds until all is done; None where nothing is known yet: the work that is left over the work
        that was done in each second so far."""
        if not self.told or self.since is None:
            return None
        mean = self.told_s / self.told
        spent = {name: now - since for name, since in self.running.items()}
        left = self.sure_s + self.unsure * mean
        left += sum(max(0.0, self.known.get(name, mean) - seconds) for name, seconds in spent.items())
        worked, passed = self.worked + sum(spent.values()), now - self.since
        return left * passed / worked if worked > 0.0 else left

    def _wait(self, name: str, more: int) -> None:
        if name in self.known:
            self.sure_s += more * self.known[name]
        else:
            self.unsure += more


def clock(seconds: float) -> str:
    """Minutes and seconds, hours where there are some."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"

"""Processes that a test starts and that run beside it. None is left when the test ends, however it ends."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any


def start(command: Sequence[object], **options: Any) -> subprocess.Popen[Any]:
    """Starts a process in a group of its own, by default without standard input. `end` ends it."""
    options = {"stdin": subprocess.DEVNULL, "start_new_session": True} | options
    return subprocess.Popen([str(word) for word in command], **options)


def kill(process: subprocess.Popen[Any]) -> None:
    """Kills a process with all of its group."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def end(process: subprocess.Popen[Any]) -> None:
    """The same, and closes its pipes."""
    kill(process)
    for pipe in (process.stdin, process.stdout, process.stderr):
        if pipe:
            pipe.close()


@contextmanager
def started(command: Sequence[object], **options: Any) -> Iterator[subprocess.Popen[Any]]:
    """The same for a `with` statement."""
    process = start(command, **options)
    try:
        yield process
    finally:
        end(process)


def take_signals() -> None:
    """Lets a run of pytest end in good order on SIGTERM and SIGHUP, as on SIGINT. Signals that it was started
    to ignore, as `nohup` and a script's background do, it ignores by a handler: what it starts gets the
    default back, where an ignored signal would stay ignored."""
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
        ignored = signal.getsignal(number) is signal.SIG_IGN
        signal.signal(number, (lambda *_: None) if ignored else signal.default_int_handler)

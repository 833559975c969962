"""Jobs for the tests of workers: a module that loads little, because each worker that runs one loads it."""

from __future__ import annotations

import errno
import inspect
import os
import resource
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from paradize.jobs.progress import report_step
from paradize.kernels.threads import VARIABLE as THREADS
from paradize.kernels.threads import default_threads

MB = 1_000_000


def double(value: int) -> int:
    return 2 * value


def climb(steps: int) -> int:
    for at in range(steps):
        report_step(f"step {at}")
    return steps


def tell_threads() -> str | None:
    return os.environ.get(THREADS)


def threads_of_kernels() -> list[int]:
    from paradize.kernels import maps

    defaults = inspect.signature(maps.halve).parameters["threads"].default
    return [maps.THREADS, defaults, default_threads(8)]


def blas_threads() -> str | None:
    return os.environ.get("OPENBLAS_NUM_THREADS")


def crash(tally: Path, times: int, number: int = signal.SIGSEGV) -> str:
    """Dies of a signal so many times, then answers."""
    with tally.open("a") as stream:
        stream.write("x")
    if len(tally.read_text()) <= times:
        os.kill(os.getpid(), number)
    return "survived"


def open_too_many() -> None:
    raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))


def hang(tally: Path, times: int) -> str:
    """Sleeps for ever so many times, then answers."""
    with tally.open("a") as stream:
        stream.write("x")
    if len(tally.read_text()) <= times:
        tally.with_suffix(".hangs").write_text(str(os.getpid()))
        time.sleep(600)
    return "woke"


def stop_in_an_answer() -> None:
    """Sends the beginning of an answer, and nothing more."""
    links = [link for link in Path("/proc/self/fd").iterdir() if int(link.name) > 2]
    sockets = [link for link in links if link.is_symlink() and str(link.readlink()).startswith("socket:")]
    os.write(int(sockets[0].name), (1000).to_bytes(4, "big") + b"half")
    time.sleep(600)


def allocate(amount: int) -> int:
    return len(bytearray(amount))


def eat(amount: int, then: Path | None = None) -> int:
    """Takes memory piece by piece, whatever limit the process has; leaves a mark, and waits for a while."""
    resource.setrlimit(resource.RLIMIT_DATA, (resource.getrlimit(resource.RLIMIT_DATA)[1],) * 2)
    held = _take(amount)
    time.sleep(0.5)
    if then:
        then.touch()
    return len(held)


def eat_beside(amount: int, folder: Path, name: str) -> int:
    """Takes memory beside another job that does the same, and keeps it until that one dies; alone where it is
    called again."""
    resource.setrlimit(resource.RLIMIT_DATA, (resource.getrlimit(resource.RLIMIT_DATA)[1],) * 2)
    with (folder / name).open("a") as tally:
        tally.write("x")
    if (folder / name).read_text() != "x":
        return len(_take(amount))
    # A pipe is opened when both ends are; its reader hears of the end of whoever holds the other.
    if name == "a":
        mine, theirs = (folder / "from a").open("wb"), (folder / "from b").open("rb")
    else:
        theirs, mine = (folder / "from a").open("rb"), (folder / "from b").open("wb")
    with mine, theirs:
        held = _take(amount)
        theirs.read()
    return len(held)


def _take(amount: int) -> list[bytes]:
    return [b"x" * (20 * MB) for _ in range(amount // (20 * MB))]


def unsendable() -> Callable[[], int]:
    return lambda: 3


def tell_process() -> tuple[int, str | None]:
    return os.getpid(), os.environ.get(THREADS)


def leave_files(tally: Path) -> None:
    """Dies while it has temporary files."""
    folder = Path(tempfile.mkdtemp())
    (folder / "file").write_text("here")
    tally.write_text(str(folder))
    os.kill(os.getpid(), signal.SIGKILL)


def meet(pipe: Path, mode: str) -> bool:
    """Opens one end of a named pipe, which waits until another job opens the other end."""
    with pipe.open(mode):
        return True


def alone(own: Path, folder: Path) -> bool:
    """Whether no other job has its mark in the folder while this one has."""
    own.mkdir()
    time.sleep(0.2)
    found = list(folder.iterdir())
    own.rmdir()
    return found == [own]


def crash_on(**settings: Any) -> None:
    os.abort()


def hunger_on(**settings: Any) -> None:
    eat(2000 * MB)

"""Files that are none: what a name may lead to instead, and a process that tries commands on them."""

from __future__ import annotations

import errno
import io
import json
import os
import shutil
import signal
import socket
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage

VAST = 2 << 30
PATIENCE_S = 60  # a command that takes longer hangs


def pipe(path: Path) -> None:
    """Keeps whoever opens it waiting."""
    os.mkfifo(path)


def endless(path: Path) -> None:
    """A device that never ends; a link to it where this user may make none (see makes_devices)."""
    try:
        os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, 5))
    except PermissionError:
        path.symlink_to("/dev/zero")


def makes_devices() -> bool:
    """Whether this user may: a link leads out of the folder, where a scene may name nothing."""
    with tempfile.TemporaryDirectory() as folder:
        endless(Path(folder) / "device")
        return not (Path(folder) / "device").is_symlink()


def folder(path: Path) -> None:
    path.mkdir()


def circle(path: Path) -> None:
    path.symlink_to(path.name)


def listener(path: Path) -> None:
    """A socket."""
    with socket.socket(socket.AF_UNIX) as end, chdir(path.parent):
        end.bind(path.name)


def nowhere(path: Path) -> None:
    path.symlink_to("gone")


def vast(path: Path) -> None:
    """VAST bytes that no disk holds."""
    with path.open("wb") as file:
        file.truncate(VAST)


KINDS: dict[str, Callable[[Path], None]] = {
    made.__name__: made for made in (pipe, endless, folder, circle, listener, nowhere, vast)
}


SAID = {  # of each kind, by what opens files
    "pipe": "is not a regular file", "endless": "is not a regular file", "listener": "is not a regular file",
    "folder": "is a folder", "circle": os.strerror(errno.ELOOP), "nowhere": os.strerror(errno.ENOENT),
}  # fmt: skip
MANY = [kind for kind in KINDS if kind != "vast"]  # what is not a file at all


def spoil(path: Path, kind: str) -> None:
    """Puts something of this kind where a file is."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    KINDS[kind](path)


def cases(words: list[str], places: list[str], kinds: list[str], base: Path, work: Path) -> Iterator[str]:
    """Runs `paradize WORDS` in a copy of `base`, each place (all that the pattern meets) spoilt in turn. A
    line of JSON each: place, kind, exit code, what was said, the most bytes that this process or one of its
    children has held so far."""
    from paradize.cli.main import main

    # Its many folders take longer to copy and to remove than most commands run.
    bare = None if words[0] in ("bake", "explain", "clean") else shutil.ignore_patterns("store")
    for place in places:
        for kind in kinds:
            shutil.rmtree(work, ignore_errors=True)
            # Commands write files anew.
            shutil.copytree(base, work, symlinks=True, copy_function=os.link, ignore=bare)
            found = sorted(work.glob(place))
            assert found, place
            for path in found:
                spoil(path, kind)
            said = io.StringIO()
            os.environ["PARADIZE_STORE"] = str(work / "store")
            signal.alarm(PATIENCE_S)
            with chdir(work), redirect_stderr(said), redirect_stdout(said):
                code = main(words)
            signal.alarm(0)
            held = max(getrusage(who).ru_maxrss for who in (RUSAGE_SELF, RUSAGE_CHILDREN)) * 1024
            yield json.dumps([place, kind, code, said.getvalue(), held])


if __name__ == "__main__":
    tried = json.loads(sys.argv[1])
    with ExitStack() as stack:
        if (
            len(tried) > 1
        ):  # what workers held is known once they have ended: those of a single case are not kept
            from tests.pipeline.kept_workers import keeping_workers

            stack.enter_context(keeping_workers())
        for words, places, kinds in tried:
            for line in cases(words, places, kinds, Path(sys.argv[2]), Path(sys.argv[3])):
                print(line, flush=True)

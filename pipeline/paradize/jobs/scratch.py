"""A folder for a worker's temporary files, which goes with the worker however it ends. Where its parent is
killed too, nobody is left to take it away: the next worker that is started anywhere does, for the lock of a
process that is gone is free."""

from __future__ import annotations

import fcntl
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir

from paradize.files import open_lock

_PREFIX = "paradize-worker-"
_LOCK = "lock"


class Scratch:
    """path: the folder, among the system's temporary files."""

    def __init__(self) -> None:
        _sweep(Path(gettempdir()))
        self._folder = TemporaryDirectory(prefix=_PREFIX, ignore_cleanup_errors=True)
        self.path = Path(self._folder.name)
        self._lock = open_lock(self.path / _LOCK)
        fcntl.flock(self._lock, fcntl.LOCK_EX)

    def remove(self) -> None:
        """With all that is in it. May be called again."""
        self._lock.close()
        self._folder.cleanup()


def _sweep(temporary: Path) -> None:
    for path in temporary.glob(f"{_PREFIX}*/{_LOCK}"):
        try:
            with open_lock(path) as lock:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(path.parent, ignore_errors=True)
        except OSError:
            continue  # at work, or another user's

"""Folders for the temporary files of workers.

A folder is removed with its worker. If the parent was killed as well, the next worker that starts removes it:
the lock of a process that has ended is free.
"""

from __future__ import annotations

import fcntl
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir

from paradize.files import open_lock

_PREFIX = "paradize-worker-"
_LOCK = "lock"


class Scratch:
    """path: the folder, inside the system's folder for temporary files."""

    def __init__(self) -> None:
        _sweep(Path(gettempdir()))
        self._folder = TemporaryDirectory(prefix=_PREFIX, ignore_cleanup_errors=True)
        self.path = Path(self._folder.name)
        self._lock = open_lock(self.path / _LOCK)
        fcntl.flock(self._lock, fcntl.LOCK_EX)

    def remove(self) -> None:
        """Removes the folder. May be called again."""
        self._lock.close()
        self._folder.cleanup()


def _sweep(temporary: Path) -> None:
    for path in temporary.glob(f"{_PREFIX}*/{_LOCK}"):
        try:
            with open_lock(path) as lock:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(path.parent, ignore_errors=True)
        except OSError:
            continue  # in use, or owned by another user

"""Caches the hashes of files, so that unchanged files are not read again.

A file counts as unchanged if its size, times and inode are the recorded ones and its times lie well before
the moment of recording. Any other file is hashed again.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from paradize.errors import BakeError
from paradize.store.local import Stamp, hash_file, stamp

_SETTLE_NS = 2_000_000_000  # some file systems store times in steps of two seconds


class FileHashCache:
    """Hashes of files by path, with the stamps that the files had. hashed: number of files that had to be
    read."""

    def __init__(self, files: dict[str, tuple[Stamp, str]] | None = None, recorded_ns: int = 0) -> None:
        self._files = files or {}
        self._recorded_ns = recorded_ns
        self.hashed = 0

    @classmethod
    def from_json(cls, tree: Any) -> FileHashCache:
        """Restores the result of `as_json`; an empty cache from anything else."""
        try:
            files = {str(path): (list(old), str(sha256)) for path, (old, sha256) in tree["files"].items()}
            return cls(files, int(tree["since_ns"]))
        except (TypeError, KeyError, ValueError, AttributeError):
            return cls()

    def sha256(self, path: Path) -> str:
        """The SHA-256 of a file. Raises BakeError when it is missing or cannot be read."""
        new = stamp(path)
        entry = self._files.get(str(path))
        if entry and new and self._same_and_settled(entry[0], new):
            return entry[1]
        self.hashed += 1
        return hash_file(path)

    def unchanged(self, paths: Iterable[str]) -> bool:
        """Whether all these files exist and have their recorded content. A file that cannot be read counts as
        changed; the code that reads it reports the error."""
        for path in paths:
            entry = self._files.get(path)
            new = stamp(path)
            if entry is None or new is None:
                return False
            if not self._same_and_settled(entry[0], new):
                self.hashed += 1
                try:
                    if hash_file(Path(path)) != entry[1]:
                        return False
                except BakeError:
                    return False
        return True

    def _same_and_settled(self, old: Stamp, new: Stamp) -> bool:
        """Whether the stamps are equal and the file was last changed well before it was recorded."""
        return new == old and max(new[1], new[2]) < self._recorded_ns - _SETTLE_NS

    def as_json(self, paths: Iterable[Path]) -> dict[str, Any]:
        """The cache of these files as they are now, without missing ones."""
        recorded_ns = time.time_ns()
        files = {}
        for path in paths:
            old = stamp(path)
            if old is not None:
                files[str(path)] = (old, self.sha256(path))
        return {"since_ns": recorded_ns, "files": files}

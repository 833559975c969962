"""Tells whether files are what they were, reading as few of them as is safe.

A file whose size, times and inode are those remembered, and which had come to rest before it was
remembered, is taken for unchanged; any other is hashed again.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from paradize.errors import BakeError
from paradize.store.local import Stamp, hash_file, stamp

_REST_NS = 2_000_000_000  # coarse file systems keep times of two seconds


class FileHashCache:
    """Hashes of files by path, with the stamps that they had; `as_json` and `from_json` keep it."""

    def __init__(self, files: dict[str, tuple[Stamp, str]] | None = None, since_ns: int = 0) -> None:
        self._files = files or {}
        self._since_ns = since_ns
        self.hashed = 0  # files that had to be read

    @classmethod
    def from_json(cls, tree: Any) -> FileHashCache:
        """Reads back what `as_json` gave; an empty memory where it is something else."""
        try:
            files = {str(path): (list(was), str(sha256)) for path, (was, sha256) in tree["files"].items()}
            return cls(files, int(tree["since_ns"]))
        except (TypeError, KeyError, ValueError, AttributeError):
            return cls()

    def sha256(self, path: Path) -> str:
        """The hash of a file's present bytes. Raises BakeError when there is none or it cannot be read."""
        now = stamp(path)
        known = self._files.get(str(path))
        if known and now and self._at_rest(known[0], now):
            return known[1]
        self.hashed += 1
        return hash_file(path)

    def unchanged(self, paths: Iterable[str]) -> bool:
        """Whether all these files are there and hold what they held when they were remembered. What cannot be
        read has changed: who needs it says what is wrong with it."""
        for path in paths:
            known = self._files.get(path)
            now = stamp(path)
            if known is None or now is None:
                return False
            if not self._at_rest(known[0], now):
                self.hashed += 1
                try:
                    if hash_file(Path(path)) != known[1]:
                        return False
                except BakeError:
                    return False
        return True

    def _at_rest(self, was: Stamp, now: Stamp) -> bool:
        """Whether stamps tell that a file is what it was: it was remembered after it had come to rest."""
        return now == was and max(now[1], now[2]) < self._since_ns - _REST_NS

    def as_json(self, paths: Iterable[Path]) -> dict[str, Any]:
        """The memory of these files as they are now; those that are gone are left out."""
        since_ns = time.time_ns()
        files = {}
        for path in paths:
            was = stamp(path)
            if was is not None:
                files[str(path)] = (was, self.sha256(path))
        return {"since_ns": since_ns, "files": files}

"""Reads what is to be checked: regular files only, so that no pipe or device keeps the checker waiting."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

MAX_BYTES = 4 << 30  # a GLB cannot be larger, and no texture that we write is


def read_file(path: Path) -> bytes:
    """The bytes of a regular file. Raises OSError, its strerror for a person, for anything else."""
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise OSError(errno.EISDIR, "is a folder")
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, "is no regular file")
    if status.st_size > MAX_BYTES:
        raise OSError(errno.EFBIG, f"holds {status.st_size} bytes, limit {MAX_BYTES}")
    return path.read_bytes()

"""Opens files for reading: regular files of bounded size only. Pipes, devices and sockets are refused,
because a reader might wait for them or never end.

Files of users, output folders and the store may be of any kind and may be replaced at any moment. So the
opened file is checked, not only its name. tests/test_house.py refuses other ways of opening files.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

MAX_BYTES = 4 << 30  # limit of a GLB; our textures are smaller
_CHUNK = 1 << 20
_FLAGS = os.O_CLOEXEC | os.O_NONBLOCK | os.O_NOCTTY
_ABSENT = (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG, errno.EINVAL)  # there is no such file
_DESCRIPTOR_FOLDER = "/proc/self/fd"  # Linux: links to open files, also when their names change


class NotARegularFileError(OSError):
    """Not a regular file, or a file that is too large; strerror says which."""


def open_file(path: Path | str, limit: int = MAX_BYTES) -> BinaryIO:
    """Opens a regular file for reading bytes. Never waits.

    Raises OSError, its strerror for a user, for a file that is missing, not regular, not readable, or larger
    than `limit` bytes.
    """
    return _open(path, os.O_RDONLY, limit)


def is_there(path: Path, limit: int = MAX_BYTES) -> bool:
    """Whether `open_file` can open the file. False only where nothing has this name or no file can have it.
    Raises OSError as `open_file` where something is there that cannot be opened."""
    try:
        open_file(path, limit).close()
    except NotARegularFileError:
        raise
    except OSError as error:
        if error.errno in _ABSENT:
            return False
        raise
    return True


def missing_reason(path: Path) -> str | None:
    """Why a file was not found although its name exists: a broken link. None where nothing has this name."""
    return "is a link that leads to nothing" if os.path.islink(path) else None  # noqa: PTH114


def open_lock(path: Path) -> BinaryIO:
    """Opens a regular file to lock, and makes it where it is missing. Raises OSError as `open_file`."""
    return _open(path, os.O_RDWR | os.O_CREAT, MAX_BYTES)


def _open(path: Path | str, flags: int, limit: int) -> BinaryIO:
    def descriptor_of(*_: object) -> int:
        descriptor = os.open(path, flags | _FLAGS, 0o666)
        try:
            _check_status(os.fstat(descriptor), limit)  # the file may have been replaced
        except BaseException:
            os.close(descriptor)
            raise
        return descriptor

    try:
        if not flags & os.O_CREAT or os.path.exists(path):  # noqa: PTH110 (faster)
            _check_status(os.stat(path), limit)  # noqa: PTH116 (before opening: opening a device may have effects)
        # The stream owns the descriptor as soon as there is one: closed twice where a signal came in between,
        # it was an OSError in place of the KeyboardInterrupt, and could have been a file of another thread.
        return open(path, "r+b" if flags & os.O_RDWR else "rb", opener=descriptor_of)
    except ValueError:
        raise OSError(errno.EINVAL, "no file can have this name") from None


def _check_status(status: os.stat_result, limit: int) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise NotARegularFileError(errno.EISDIR, "is a folder")
    if not stat.S_ISREG(status.st_mode):
        raise NotARegularFileError(errno.EINVAL, "is not a regular file")
    if status.st_size > limit:
        raise NotARegularFileError(errno.EFBIG, f"holds {status.st_size} bytes, limit {limit}")


def read_file(path: Path | str, limit: int = MAX_BYTES) -> bytes:
    """Reads a regular file. Raises OSError as `open_file`, and where the file changes while it is read or
    does not fit into memory."""
    with open_file(path, limit) as stream:
        size = os.fstat(stream.fileno()).st_size
        try:
            data = stream.read(size + 1)
        except MemoryError:
            raise OSError(errno.ENOMEM, f"holds {size} bytes, more than memory can hold") from None
    _check_size(len(data or b""), size)
    return data


def read_parts(path: Path | str, limit: int = MAX_BYTES) -> Iterator[bytes]:
    """Reads a regular file in parts of 1 MiB. Raises as `read_file`."""
    with open_file(path, limit) as stream:
        size, read_bytes = os.fstat(stream.fileno()).st_size, 0
        while read_bytes <= size and (part := stream.read(_CHUNK)):
            read_bytes += len(part)
            yield part
    _check_size(read_bytes, size)


def _check_size(read_bytes: int, size: int) -> None:
    """Raises OSError where a file had more or fewer bytes than its size: it is being written, or it is a
    virtual file."""
    if read_bytes != size:
        count = f"fewer than {size}" if read_bytes < size else f"more than {size}"
        raise OSError(errno.EIO, f"changed while it was read: {count} bytes")


def resolved(path: Path) -> Path:
    """The absolute path with links followed. Circular links stay in the path; opening it then fails."""
    return Path(os.path.realpath(path))


def library_path(path: Path) -> AbstractContextManager[str]:
    """A path for a library that opens files itself. It leads to the file that is at `path` now and has the
    same suffix. Raises OSError as `open_file`."""
    import tempfile  # imported here: rarely needed
    from contextlib import contextmanager

    @contextmanager
    def named() -> Iterator[str]:
        with open_file(path) as stream:
            if not os.path.isdir(_DESCRIPTOR_FOLDER):  # noqa: PTH112
                yield str(path)
                return
            with tempfile.TemporaryDirectory(prefix="paradize-") as folder:
                name = os.path.join(folder, f"file{path.suffix}")  # noqa: PTH118
                os.symlink(f"{_DESCRIPTOR_FOLDER}/{stream.fileno()}", name)  # noqa: PTH211
                yield name

    return named()


def bytes_text(count: float) -> str:
    """A number of bytes for people: a MB is a million."""
    return f"{count / 1e6:.3g} MB" if count >= 1e6 else f"{count / 1e3:.3g} kB"

"""The one way to open a file for reading: a regular file of bounded size, and nothing that keeps a reader
waiting or never ends, such as a pipe, a device or a socket.

What a person, an output folder or the store holds may be anything, and may be replaced at any moment. So what
counts is what was opened, not what stood there before. tests/test_house.py refuses other ways.
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

MAX_BYTES = 4 << 30  # a GLB cannot be larger, and no texture that we write is
_CHUNK = 1 << 20
_FLAGS = os.O_CLOEXEC | os.O_NONBLOCK | os.O_NOCTTY
_NOTHING = (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG, errno.EINVAL)  # has such a name
_DESCRIPTORS = "/proc/self/fd"  # Linux: each leads to the file itself, whatever its name leads to now


class NotAFileError(OSError):
    """No regular file, or one too large: strerror says which."""


def open_file(path: Path | str, most: int = MAX_BYTES) -> BinaryIO:
    """A regular file, open for reading its bytes. Never waits.

    Raises OSError, its strerror for a person, for what is missing, no regular file, not readable, or larger
    than `most` bytes.
    """
    return _opened(path, os.O_RDONLY, most)


def is_there(path: Path, most: int = MAX_BYTES) -> bool:
    """Whether `open_file` opens what has this name; False only where nothing has it, or no file can. Raises
    OSError as `open_file` for what is there and cannot be opened."""
    try:
        open_file(path, most).close()
    except NotAFileError:
        raise
    except OSError as error:
        if error.errno in _NOTHING:
            return False
        raise
    return True


def absence(path: Path) -> str | None:
    """What stands where a file was looked for in vain, if anything does."""
    return "is a link that leads to nothing" if os.path.islink(path) else None  # noqa: PTH114


def open_lock(path: Path) -> BinaryIO:
    """A regular file to hold a lock on; made where there is none. Raises OSError as `open_file`."""
    return _opened(path, os.O_RDWR | os.O_CREAT, MAX_BYTES)


def _opened(path: Path | str, how: int, most: int) -> BinaryIO:
    try:
        if not how & os.O_CREAT or os.path.exists(path):  # noqa: PTH110 (a bake with nothing to do)
            _require(os.stat(path), most)  # noqa: PTH116 (opening a device may already do something)
        descriptor = os.open(path, how | _FLAGS, 0o666)
    except ValueError:
        raise OSError(errno.EINVAL, "no file can have this name") from None
    try:
        _require(os.fstat(descriptor), most)  # another may stand there by now
        return os.fdopen(descriptor, "r+b" if how & os.O_RDWR else "rb")
    except BaseException:
        os.close(descriptor)
        raise


def _require(status: os.stat_result, most: int) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise NotAFileError(errno.EISDIR, "is a folder")
    if not stat.S_ISREG(status.st_mode):
        raise NotAFileError(errno.EINVAL, "is no regular file")
    if status.st_size > most:
        raise NotAFileError(errno.EFBIG, f"holds {status.st_size} bytes, limit {most}")


def read_file(path: Path | str, most: int = MAX_BYTES) -> bytes:
    """The bytes of a regular file. Raises OSError as `open_file`, and where the file changes while it is read
    or does not fit into memory."""
    with open_file(path, most) as stream:
        size = os.fstat(stream.fileno()).st_size
        try:
            data = stream.read(size + 1)
        except MemoryError:
            raise OSError(errno.ENOMEM, f"holds {size} bytes, more than memory has room for") from None
    _require_whole(len(data or b""), size)
    return data


def read_parts(path: Path | str, most: int = MAX_BYTES) -> Iterator[bytes]:
    """The same bytes, a part at a time."""
    with open_file(path, most) as stream:
        size, found = os.fstat(stream.fileno()).st_size, 0
        while found <= size and (part := stream.read(_CHUNK)):
            found += len(part)
            yield part
    _require_whole(found, size)


def _require_whole(found: int, size: int) -> None:
    """Raises OSError where a file holds more or fewer bytes than its size said: it is being written, or is
    none that a disk holds."""
    if found != size:
        count = f"fewer than {size}" if found < size else f"more than {size}"
        raise OSError(errno.EIO, f"changed while it was read: {count} bytes")


def resolved(path: Path) -> Path:
    """The path from the root on, links followed. Links that lead in a circle stay, and are no error before
    the file is opened."""
    return Path(os.path.realpath(path))


def name_for_library(path: Path) -> AbstractContextManager[str]:
    """A name for a library that opens files itself: it leads to the file that stands at `path` now, and ends
    in the same suffix. Raises OSError as `open_file`."""
    import tempfile  # here: few need it
    from contextlib import contextmanager

    @contextmanager
    def named() -> Iterator[str]:
        with open_file(path) as stream:
            if not os.path.isdir(_DESCRIPTORS):  # noqa: PTH112
                yield str(path)
                return
            with tempfile.TemporaryDirectory(prefix="paradize-") as folder:
                name = os.path.join(folder, f"file{path.suffix}")  # noqa: PTH118
                os.symlink(f"{_DESCRIPTORS}/{stream.fileno()}", name)  # noqa: PTH211
                yield name

    return named()

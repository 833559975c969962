"""Writes files atomically: to a temporary name, flushed, then renamed."""

from __future__ import annotations

import errno
import hashlib
import os
from pathlib import Path
from typing import BinaryIO

from paradize.errors import BakeError
from paradize.files import read_parts, resolved

PARTIAL = ".part-"  # in the name of a file that is being written; a killed writer leaves it behind

# The advice where the file system refuses to write, beside naming another place.
_MENDS = dict.fromkeys((errno.ENOSPC, errno.EDQUOT), "free space there, or {}")
_MENDS |= dict.fromkeys(
    (errno.ENOTDIR, errno.EEXIST), "a file stands where a folder is needed: move it away, or {}"
)
_MENDS[errno.EFBIG] = "allow larger files (`ulimit -f`), or {}"


def write_whole(
    path: Path,
    data: bytes | Path,
    *,
    durable: bool = True,
    flush: bool = True,
    sha256: str | None = None,
    owned: bool = False,
    option: str = "-o",
) -> None:
    """Writes `data`, or a copy of the file at `data`, to `path`. A reader finds the old file or the new one,
    never a part, even after a kill or a power cut. Makes missing folders.

    durable: flush the file and its folder; False for files that can be made again. flush: False leaves out
    the flush of the folder, for callers that write many files and then call flush_folder once. sha256:
    expected hash of a copied file. owned: only Paradize uses such a name, so a device, pipe, socket or link
    there is replaced; else a link stays, and the file that it leads to is written. option: what names another
    place, for messages.

    Raises BakeError (file, reason) where the file system refuses, where a folder is in the way, or a device,
    pipe or socket that is not owned, or where the hash differs. No partial file stays.
    """
    if path.name in ("", ".."):
        raise BakeError("names a folder, not a file", file=path, mend=f"name a file with {option}")
    target = path if owned else resolved(path)
    partial = target.with_name(f".{target.name[:40]}{PARTIAL}{os.urandom(4).hex()}")
    try:
        if target.is_symlink() and not owned:  # circular
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        target.parent.mkdir(parents=True, exist_ok=True)
        folder = target.is_dir() and not target.is_symlink()
        if folder or (not owned and target.exists() and not target.is_file()):
            what = "is a folder" if folder else "is not a regular file"  # a rename would replace it
            raise BakeError(what, file=path, mend=f"move it away, or name another path with {option}")
        try:
            with partial.open("xb") as stream:
                if isinstance(data, Path):
                    _copy(data, stream, sha256)
                else:
                    stream.write(data)
                if durable:
                    stream.flush()
                    os.fsync(stream.fileno())
            partial.replace(target)
        except BaseException:
            partial.unlink(missing_ok=True)
            raise
        if durable and flush:
            flush_folder(target.parent)
    except OSError as error:
        raise unwritten(path, error, f"name another place with {option}") from None


def unwritten(path: Path, error: OSError, elsewhere: str = "name another place") -> BakeError:
    """Returns the error of a file or folder that the file system refuses to write. elsewhere: how to name
    another place."""
    mend = _MENDS.get(error.errno or 0, "{}").format(elsewhere)
    return BakeError(f"cannot be written: {error.strerror or error}", file=path, mend=mend)


def write_report(path: Path, data: bytes) -> None:
    """Writes a file of a report as write_whole does."""
    write_whole(path, data, durable=False, option="PARADIZE_REPORT or --report")


def require_place(path: Path, option: str = "-o") -> None:
    """Raises BakeError where nothing can be written in the folder `path`, as write_whole would after the work
    of a bake: where a file stands in a folder's place, or this process may not write. option: what names
    another place, for messages."""
    folder = path.absolute()
    while not os.path.lexists(folder):
        folder = folder.parent
    if not folder.is_dir():
        error = OSError(errno.ENOTDIR, os.strerror(errno.ENOTDIR))
    elif not os.access(folder, os.W_OK | os.X_OK):
        error = OSError(errno.EACCES, f"{folder} is not yours to write, or read-only")
    else:
        return
    raise unwritten(path, error, f"name another place with {option}")


def _copy(source: Path, stream: BinaryIO, sha256: str | None) -> None:
    """Copies a file. Raises BakeError where its hash is not the expected one."""
    digest = hashlib.sha256()
    for part in read_parts(source):
        if sha256:
            digest.update(part)
        stream.write(part)
    if sha256 and digest.hexdigest() != sha256:
        raise BakeError("was changed while it was copied", file=source, mend="bake again")


def flush_folder(folder: Path) -> None:
    """Makes renames in a folder durable, as POSIX requires. Raises BakeError (file, reason)."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        raise BakeError(f"cannot be flushed: {error.strerror or error}", file=folder) from None


def is_partial(name: str) -> bool:
    """Whether a file of this name is being written or was left by a killed writer."""
    return name.startswith(".") and PARTIAL in name


def remove_partial(folder: Path) -> None:
    """Removes the partial files of killed writers in `folder`."""
    for path in folder.glob(f".*{PARTIAL}*"):
        path.unlink(missing_ok=True)

"""Files appear whole or not at all: written aside, flushed, renamed."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import BinaryIO

from paradize.errors import BakeError
from paradize.files import read_parts

ASIDE = ".part-"  # marks a file that is being written; a sweep may remove what a kill left behind


def write_whole(
    path: Path,
    data: bytes | Path,
    *,
    durable: bool = True,
    flush: bool = True,
    sha256: str | None = None,
    ours: bool = False,
) -> None:
    """Writes `data`, or what the file at `data` holds, to `path` so that a reader, also after a kill or a
    power cut, finds the old file or the new one. Makes missing folders. `durable=False` leaves out the flush,
    for what can be derived again; `flush=False` that of the folder alone, for who writes many and then calls
    flush_folder once. sha256: what the bytes of a file that is copied must be. ours: only Paradize gives
    such a name, so that a device, a pipe or a socket there goes.

    Raises BakeError (file, reason) when the file system refuses, where a folder is, or a device, a pipe or a
    socket that is not ours, or where the bytes are others; nothing half-written stays.
    """
    if path.name in ("", ".."):
        raise BakeError("names a folder, not a file", file=path, mend="name a file with -o")
    aside = path.with_name(f".{path.name[:40]}{ASIDE}{os.urandom(4).hex()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        folder = path.is_dir() and not path.is_symlink()
        if folder or (not ours and path.exists() and not (path.is_file() or path.is_dir())):
            what = "is a folder" if folder else "is no regular file"  # whose place a rename would take
            raise BakeError(what, file=path, mend="move it away, or name another place with -o")
        try:
            with aside.open("xb") as stream:
                if isinstance(data, Path):
                    _copy(data, stream, sha256)
                else:
                    stream.write(data)
                if durable:
                    stream.flush()
                    os.fsync(stream.fileno())
            aside.replace(path)
        except BaseException:
            aside.unlink(missing_ok=True)
            raise
        if durable and flush:
            flush_folder(path.parent)
    except OSError as error:
        reason = error.strerror or str(error)
        raise BakeError(f"cannot be written: {reason}", file=path, mend="free the place or use -o") from None


def _copy(source: Path, stream: BinaryIO, sha256: str | None) -> None:
    """Copies a file's bytes. Raises BakeError where their hash is not the one that is asked for."""
    digest = hashlib.sha256()
    for part in read_parts(source):
        if sha256:
            digest.update(part)
        stream.write(part)
    if sha256 and digest.hexdigest() != sha256:
        raise BakeError("was damaged while it was used", file=source, mend="bake again")


def flush_folder(folder: Path) -> None:
    """Makes renames in a folder themselves durable (POSIX asks for it). Raises BakeError (file, reason)."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        raise BakeError(f"cannot be flushed: {error.strerror or error}", file=folder) from None


def is_aside(name: str) -> bool:
    """Whether a file of this name is being written, or was left by a killed writer."""
    return name.startswith(".") and ASIDE in name


def sweep_aside(folder: Path) -> None:
    """Removes what killed writers left in `folder`."""
    for path in folder.glob(f".*{ASIDE}*"):
        path.unlink(missing_ok=True)

"""Files appear whole or not at all: written aside, flushed, renamed."""

from __future__ import annotations

import os
from pathlib import Path

from paradize.errors import BakeError

ASIDE = ".part-"  # marks a file that is being written; a sweep may remove what a kill left behind


def write_whole(path: Path, data: bytes | Path, *, durable: bool = True, flush: bool = True) -> None:
    """Writes `data`, or what the file at `data` holds, to `path` so that a reader, also after a kill or a
    power cut, finds the old file or the new one. Makes missing folders. `durable=False` leaves out the flush,
    for what can be derived again; `flush=False` that of the folder alone, for who writes many and then calls
    flush_folder once.

    Raises BakeError (file, reason) when the file system refuses, or where a device, a pipe or a socket is;
    nothing half-written stays.
    """
    if path.name in ("", ".."):
        raise BakeError("names a folder, not a file", file=path, mend="name a file with -o")
    aside = path.with_name(f".{path.name[:40]}{ASIDE}{os.urandom(4).hex()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and not (path.is_file() or path.is_dir()):  # a rename would take a device's place
            raise BakeError("is no regular file", file=path, mend="name a file with -o")
        try:
            with aside.open("xb") as stream:
                if isinstance(data, Path):
                    import shutil  # here: a bake with nothing to do loads less

                    with data.open("rb") as source:
                        shutil.copyfileobj(source, stream, 1 << 20)
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

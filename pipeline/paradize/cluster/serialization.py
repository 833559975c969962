"""A call for another machine: its paths stand for files that travel beside it, and come back as bytes.

There each file lies under a folder of the call's own, at the path that it has here, so that files still find
one another; texts that come back (messages, warnings) name the paths of here.
"""

from __future__ import annotations

import io
import os
import pickle
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from paradize.files import read_file


def place_in(folder: Path, path: str) -> Path:
    """Where the sender's file `path` lies under `folder`. path: as `full` gives it."""
    return folder / path.lstrip("/")


def full(path: Path) -> str:
    """The path from the root on, without dots; links are not followed."""
    return os.path.abspath(path)  # noqa: PTH100 (resolve would follow links)


def pack_call(call: Callable[..., Any], arguments: dict[str, Any]) -> tuple[bytes, dict[str, str]]:
    """A call to a module-level function, for `run_packed`; and its paths: in full -> as they were given."""
    given: dict[str, str] = {}

    def away(thing: object) -> str | None:
        if not isinstance(thing, Path):
            return None
        given.setdefault(full(thing), str(thing))
        return full(thing)

    return _pack((call, arguments), away), given


def run_packed(packed: bytes, folder: Path, given: Mapping[str, str]) -> bytes:
    """Runs the call with its paths under `folder`; what it returns, for `unpack`. Raises what it raises."""
    call, arguments = _unpack(packed, lambda path: place_in(folder, path))
    return pack_answer(call(**arguments), folder, given)


def pack_answer(value: Any, folder: Path, given: Mapping[str, str]) -> bytes:
    """What came of a call, for `unpack`: files under `folder` as their bytes, and texts that name some as the
    sender's paths."""
    root = str(folder)

    def back(thing: object) -> bytes | str | None:
        if isinstance(thing, Path) and thing.is_relative_to(folder):
            return read_file(thing)
        if type(thing) is not str or root not in thing:
            return None
        for path in sorted(given, key=len, reverse=True):
            thing = thing.replace(str(place_in(folder, path)), given[path])
        return thing.replace(root, "")

    return _pack(value, back)


def unpack(packed: bytes) -> Any:
    """What `run_packed` or `pack_answer` gave."""
    return _unpack(packed, lambda thing: thing)


class _Packer(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, instead: Callable[[object], Any]) -> None:
        super().__init__(stream, protocol=5)
        self.instead = instead

    def persistent_id(self, obj: Any) -> Any:
        return self.instead(obj)


class _Unpacker(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, meant: Callable[[Any], Any]) -> None:
        super().__init__(stream)
        self.meant = meant

    def persistent_load(self, pid: Any) -> Any:
        return self.meant(pid)


def _pack(value: Any, instead: Callable[[object], Any]) -> bytes:
    stream = io.BytesIO()
    _Packer(stream, instead).dump(value)
    return stream.getvalue()


def _unpack(packed: bytes, meant: Callable[[Any], Any]) -> Any:
    return _Unpacker(io.BytesIO(packed), meant).load()

"""Serializes a call for another machine. Its paths stand for files that are sent beside it; result files
return as bytes.

On the other machine each file lies in a folder of the call, at the path that it has here, so that relative
references between files work. Texts that come back (messages, warnings) name the paths of this machine.
"""

from __future__ import annotations

import io
import os
import pickle
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from paradize.files import read_file


def path_in(folder: Path, path: str) -> Path:
    """The path under `folder` of the sender's file `path`, which is absolute (`absolute`)."""
    return folder / path.lstrip("/")


def absolute(path: Path) -> str:
    """The absolute path without dots; links are not followed."""
    return os.path.abspath(path)  # noqa: PTH100 (resolve would follow links)


def pack_call(call: Callable[..., Any], arguments: dict[str, Any]) -> tuple[bytes, dict[str, str]]:
    """Packs a call to a module-level function for `run_packed`. Also returns its paths: absolute path -> path
    as it was written."""
    originals: dict[str, str] = {}

    def replace(value: object) -> str | None:
        if not isinstance(value, Path):
            return None
        originals.setdefault(absolute(value), str(value))
        return absolute(value)

    return _pack((call, arguments), replace), originals


def run_packed(packed: bytes, folder: Path, originals: Mapping[str, str]) -> bytes:
    """Runs a packed call with its paths under `folder`. Returns its packed result for `unpack`; raises what
    the call raises."""
    call, arguments = _unpack(packed, lambda path: path_in(folder, path))
    return pack_answer(call(**arguments), folder, originals)


def pack_answer(value: Any, folder: Path, originals: Mapping[str, str]) -> bytes:
    """Packs the result of a call for `unpack`. Paths of files under `folder` become the files' bytes. In
    texts, paths under `folder` become the sender's paths."""
    root = str(folder)

    def replace(part: object) -> bytes | str | None:
        if isinstance(part, Path) and part.is_relative_to(folder):
            return read_file(part)
        if type(part) is not str or root not in part:
            return None
        for path in sorted(originals, key=len, reverse=True):
            part = part.replace(str(path_in(folder, path)), originals[path])
        return part.replace(root, "")

    return _pack(value, replace)


def unpack(packed: bytes) -> Any:
    """Unpacks what `run_packed` or `pack_answer` returned."""
    return _unpack(packed, lambda value: value)


class _Packer(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, replace: Callable[[object], Any]) -> None:
        super().__init__(stream, protocol=5)
        self.replace = replace

    def persistent_id(self, obj: Any) -> Any:
        return self.replace(obj)


class _Unpacker(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, restore: Callable[[Any], Any]) -> None:
        super().__init__(stream)
        self.restore = restore

    def persistent_load(self, pid: Any) -> Any:
        return self.restore(pid)


def _pack(value: Any, replace: Callable[[object], Any]) -> bytes:
    stream = io.BytesIO()
    _Packer(stream, replace).dump(value)
    return stream.getvalue()


def _unpack(packed: bytes, restore: Callable[[Any], Any]) -> Any:
    return _Unpacker(io.BytesIO(packed), restore).load()

"""Notes which text of each of our modules the interpreter runs, and where a task must find other code.

Python takes a cached bytecode for that of a source when time and size agree; here the source's hash decides.
Installed in workers, before they import anything of the pipeline.
"""

from __future__ import annotations

import hashlib
import importlib.abc
import importlib.util
import marshal
import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType

LOADED: dict[str, str] = {}  # module -> SHA-256 of the text that it was compiled from
EXPECTED: dict[
    str, str
] = {}  # of the task that this worker is at: module -> digest of the code it is keyed by
_HASH_BYTES = 32


class CheckedLoader(SourceFileLoader):
    """Reads a module's text once: what is hashed is what is compiled."""

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        source = self.get_data(path)
        digest = hashlib.sha256(source)
        kept = Path(importlib.util.cache_from_source(path)).with_suffix(".by-hash.pyc")
        code = _kept_code(kept, digest.digest())
        if code is None:
            code = self.source_to_code(source, path)
            if not sys.dont_write_bytecode:
                _keep(kept, digest.digest(), code)
        LOADED[fullname] = digest.hexdigest()
        return code


class _Finder(importlib.abc.MetaPathFinder):
    """Finds what the others find, and has our sources read by CheckedLoader."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname.partition(".")[0] != "paradize":
            return None
        for finder in sys.meta_path:
            if finder is self:
                continue
            spec = finder.find_spec(fullname, path, target)
            if spec is not None:
                if spec.origin and spec.origin.endswith(".py"):
                    spec.loader = CheckedLoader(fullname, spec.origin)
                return spec
        return None


def install() -> None:
    """From here on modules of the package are noted; the few that are loaded already are read again."""
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] == "paradize" and module.__file__:
            LOADED[name] = hashlib.sha256(Path(module.__file__).read_bytes()).hexdigest()
    sys.meta_path.insert(0, _Finder())


def expect(code: Mapping[str, str]) -> None:
    """Remembers what code the task at hand is keyed by, also for the processes that it starts itself."""
    EXPECTED.clear()
    EXPECTED.update(code)


def _kept_code(path: Path, source: bytes) -> CodeType | None:
    """The bytecode kept for a source with this hash; None where there is none or it is damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    body = data[2 * _HASH_BYTES :]
    if data[: 2 * _HASH_BYTES] != source + _hash_of(body):
        return None
    code = marshal.loads(body)
    return code if isinstance(code, CodeType) else None


def _keep(path: Path, source: bytes, code: CodeType) -> None:
    body = marshal.dumps(code)
    aside = path.with_name(f"{path.name}.{os.getpid()}")
    with suppress(OSError):  # a folder that cannot be written: compiled again next time
        path.parent.mkdir(exist_ok=True)
        try:
            aside.write_bytes(source + _hash_of(body) + body)
            aside.replace(path)
        finally:
            aside.unlink(missing_ok=True)


def _hash_of(body: bytes) -> bytes:
    """Of a bytecode, and of the interpreter that it is for."""
    return hashlib.sha256(importlib.util.MAGIC_NUMBER + body).digest()

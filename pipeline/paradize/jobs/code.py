"""Digests of the code behind a product: a changed stage bakes its products again and no others.

The modules that a product's module imports, directly or through others, are found by reading their import
lines. Python files are hashed by their text; a native module carries a digest of what it was built of
(kernels/digest.py); third-party libraries count by name and version. A worker compares the digests of what
it has really loaded (`foreign_module`), and refuses where they differ: nobody raises a version by hand.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Mapping
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import paradize
from paradize.jobs.libraries import library_versions

SUFFIXES = (".py", *EXTENSION_SUFFIXES)
_ENGINE = ("paradize.cluster", "paradize.jobs", "paradize.store")  # they run jobs and decide no result
_VERSIONS = "libraries"  # stands in a code's dict beside the modules
_IMPORT = re.compile(
    rb"^[ \t]*(?:from[ \t]+(paradize[\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)"
    rb"|import[ \t]+(paradize[\w.]*))",
    re.MULTILINE,
)
_DIGEST = re.compile(rb"paradize-kernel-digest:([0-9a-f]{64})\0")
_SYMBOL, _SYMBOL_BYTES = "paradize_digest", 87


def code_files(module: str) -> tuple[Path, ...]:
    """The Python and native files that `module` loads of this package, sorted."""
    return tuple(sorted(_closure(module).values()))


@cache
def code_of(module: str, *alone: str) -> Mapping[str, str]:
    """The digests of what `module` loads of this package, by module; of each module of `alone` and its
    packages, without what those load; and of the libraries' versions. What runs jobs is left out: it decides
    no result."""
    named = {".".join(name.split(".")[:k]) for name in alone for k in range(1, name.count(".") + 2)}
    files = _closure(module) | {name: path for name in named if (path := _find(name))}
    code = {name: _look(path)[0] for name, path in sorted(files.items()) if not name.startswith(_ENGINE)}
    return code | {_VERSIONS: _versions_digest()}


def code_digest(module: str, *alone: str) -> str:
    """SHA-256 over `code_of`."""
    items = code_of(module, *alone).items()
    return hashlib.sha256("\0".join(f"{name} {digest}" for name, digest in items).encode()).hexdigest()


def forget() -> None:
    """Looks at all files anew from here on: for a process that bakes more than once."""
    for known in (code_of, library_versions, _find, _names, _look):
        known.cache_clear()


def foreign_module(code: Mapping[str, str]) -> str | None:
    """A module that this process has loaded, whose code is not the one in `code`; None where there is none.
    Modules that `code` does not hold do not count."""
    from paradize.jobs.loader import LOADED  # here: a bake with nothing to do loads less

    for name, digest in code.items():
        if name == _VERSIONS:
            here: str | None = _versions_digest()
        elif name in LOADED:
            here = LOADED[name]
        else:
            file = getattr(sys.modules.get(name), "__file__", None)
            here = loaded_kernel_digest(file) if file and file.endswith(tuple(EXTENSION_SUFFIXES)) else None
        if here is not None and here != digest:
            return name
    return None


def kernel_digest(path: Path) -> str:
    """The digest that a native module's file carries; the hash of its bytes where it carries none."""
    data = path.read_bytes()
    found = _DIGEST.search(data)
    return found[1].decode() if found else hashlib.sha256(data).hexdigest()


def loaded_kernel_digest(file: str) -> str:
    """The same of the native module that was loaded from `file`, whatever that file is now (the loader knows
    a library that is loaded by its name)."""
    import ctypes

    try:
        library = ctypes.CDLL(file, mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
        held = (ctypes.c_char * (_SYMBOL_BYTES + 1)).in_dll(library, _SYMBOL)
    except (OSError, ValueError):
        return kernel_digest(Path(file))
    found = _DIGEST.match(held.raw)
    return found[1].decode() if found else ""


def _versions_digest() -> str:
    return hashlib.sha256("\0".join(library_versions()).encode()).hexdigest()


@cache
def _find(module: str) -> Path | None:
    """The file of a module of this package, found without importing anything."""
    *packages, name = module.split(".")[1:] or [""]
    for root in paradize.__path__:
        folder = os.path.join(root, *packages)  # noqa: PTH118 (hundreds of names are looked for)
        names = _names(folder)
        if (not name or name in names) and "__init__.py" in _names(os.path.join(folder, name)):  # noqa: PTH118
            return Path(folder, name, "__init__.py")
        for suffix in SUFFIXES:
            if name + suffix in names:
                return Path(folder, name + suffix)
    return None


@cache
def _names(folder: str) -> frozenset[str]:
    """What lies in a folder; nothing where it is none."""
    try:
        return frozenset(os.listdir(folder))  # noqa: PTH208
    except OSError:
        return frozenset()


@cache
def _look(path: Path) -> tuple[str, tuple[str, ...]]:
    """A module's digest, and the names that it imports of this package, modules or not."""
    if path.suffix != ".py":
        return kernel_digest(path), ()
    source = path.read_bytes()
    named = []
    for package, names, plain in _IMPORT.findall(source):
        base = (package or plain).decode()
        named += [base, *(f"{base}.{word}" for word in re.findall(r"\w+", names.decode()))]
    return hashlib.sha256(source).hexdigest(), tuple(named)


def _closure(module: str) -> dict[str, Path]:
    """The files of `module` and of all that it imports, by module."""
    todo, seen, files = [module], {module}, {}
    while todo:
        name = todo.pop()
        path = _find(name)
        if path is None:
            continue
        files[name] = path
        for found in (name.rpartition(".")[0], *_look(path)[1]):  # a package is loaded before what it holds
            if found not in seen:
                seen.add(found)
                todo.append(found)
    return files

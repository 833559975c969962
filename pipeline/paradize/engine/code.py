"""Digests of the code behind a product: a changed stage bakes its products again and no others.

The modules that a product's module imports, directly or through others, are found by reading their import
lines; Python files and native modules are hashed by content, third-party libraries by name and version.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import paradize

SUFFIXES = (".py", *EXTENSION_SUFFIXES)
LIBRARIES = (
    "meshoptimizer",
    "nanobind",
    "numpy",
    "openimageio",
    "openmesh",
    "soundfile",
    "zstandard",
)
_IMPORT = re.compile(
    rb"^[ \t]*(?:from[ \t]+(paradize[\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)"
    rb"|import[ \t]+(paradize[\w.]*))",
    re.MULTILINE,
)


def code_files(module: str) -> tuple[Path, ...]:
    """The Python and native files that `module` loads of this package, sorted."""
    return tuple(sorted(_closure(module)))


@cache
def code_digest(module: str) -> str:
    """SHA-256 over everything of this package that `module` loads, and the versions of the libraries."""
    digest = hashlib.sha256()
    for path in code_files(module):
        digest.update(path.name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    digest.update("\0".join(library_versions()).encode())
    return digest.hexdigest()


@cache
def library_versions() -> tuple[str, ...]:
    """`name-version` of each library that can change an artifact, as its dist-info folder is called."""
    found = set()
    for folder in sys.path:
        try:
            names = os.listdir(folder)  # noqa: PTH208 (names only, and fast)
        except OSError:
            continue
        for name in names:
            stem, _, kind = name.rpartition(".")
            if kind == "dist-info" and stem.rpartition("-")[0].lower().replace("-", "_") in LIBRARIES:
                found.add(stem.lower())
    return tuple(sorted(found))


@cache
def _find(module: str) -> Path | None:
    """The file of a module of this package, found without importing anything."""
    parts = module.split(".")[1:]
    for root in paradize.__path__:
        place = Path(root, *parts)
        for found in (place / "__init__.py", *(Path(f"{place}{suffix}") for suffix in SUFFIXES)):
            if found.is_file():
                return found
    return None


def _closure(module: str) -> set[Path]:
    todo, seen, files = [module], {module}, set()
    while todo:
        name = todo.pop()
        path = _find(name)
        if path is None:
            continue
        files.add(path)
        if path.suffix != ".py":
            continue
        for package, names, plain in _IMPORT.findall(path.read_bytes()):
            base = (package or plain).decode()
            words = re.findall(r"\w+", names.decode())
            for found in [base, *(f"{base}.{word}" for word in words)]:
                if found not in seen:
                    seen.add(found)
                    todo.append(found)
    return files

"""Digests of the code behind a product. When the code of a stage changes, only its products are baked again.

The imports of a product's module are found by reading the import lines of the sources. Python files are
hashed by their text. A native module contains a digest of its sources (kernels/digest.py). Third-party
libraries count by name and version. A worker compares these digests with the code that it has loaded
(`foreign_module`) and refuses a job if they differ. No version number has to be raised by hand.
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

from paradize.jobs.libraries import library_versions
from paradize.jobs.loader import LOADED

SUFFIXES = (".py", *EXTENSION_SUFFIXES)
_ENGINE_PACKAGES = (
    "paradize.cluster",
    "paradize.jobs",
    "paradize.store",
)  # they run jobs and do not affect results
_VERSIONS = "libraries"  # key of the libraries' digest, beside the modules
_IMPORT = re.compile(
    rb"^[ \t]*(?:from[ \t]+(paradize[\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)"
    rb"|import[ \t]+(paradize[\w.]*))",
    re.MULTILINE,
)
_DIGEST = re.compile(rb"paradize-kernel-digest:([0-9a-f]{64})\0")
_SYMBOL, _SYMBOL_BYTES = "paradize_digest", 87


@cache
def code_files(module: str) -> tuple[Path, ...]:
    """The Python and native files of this package that `module` imports, directly or indirectly, sorted."""
    return tuple(sorted(_closure(module).values()))


@cache
def code_of(module: str, *extra: str) -> Mapping[str, str]:
    """Digests of all modules of this package that `module` imports, by module name.

    extra: modules that are added with their packages, but without their imports. The result also holds one
    digest of the libraries' versions. The packages that run jobs are left out, because they do not affect
    results.
    """
    extra_modules = {".".join(name.split(".")[:k]) for name in extra for k in range(1, name.count(".") + 2)}
    files = _closure(module) | {name: Path(_modules()[name]) for name in extra_modules if name in _modules()}
    code = {
        name: _scan(path)[0] for name, path in sorted(files.items()) if not name.startswith(_ENGINE_PACKAGES)
    }
    return code | {_VERSIONS: _versions_digest()}


def code_digest(module: str, *extra: str) -> str:
    """SHA-256 over `code_of`, hexadecimal."""
    items = code_of(module, *extra).items()
    return hashlib.sha256("\0".join(f"{name} {digest}" for name, digest in items).encode()).hexdigest()


def clear_caches() -> None:
    """Clears all caches. A process that bakes more than once calls it to see changed files."""
    for known in (code_files, code_of, library_versions, _modules, _scan):
        known.cache_clear()


def foreign_module(code: Mapping[str, str]) -> str | None:
    """Returns the name of a loaded module whose code differs from its digest in `code`, or None. Modules that
    are not in `code` are ignored."""
    for name, digest in code.items():
        if name == _VERSIONS:
            loaded: str | None = _versions_digest()
        elif name in LOADED:
            loaded = LOADED[name]
        else:
            file = getattr(sys.modules.get(name), "__file__", None)
            loaded = loaded_kernel_digest(file) if file and file.endswith(tuple(EXTENSION_SUFFIXES)) else None
        if loaded is not None and loaded != digest:
            return name
    return None


def kernel_digest(path: Path) -> str:
    """The digest inside a native module's file, or the SHA-256 of the file where it contains none."""
    data = path.read_bytes()
    match = _DIGEST.search(data)
    return match[1].decode() if match else hashlib.sha256(data).hexdigest()


def loaded_kernel_digest(file: str) -> str:
    """The digest of the native module that was loaded from `file`, even if that file has changed since. The
    dynamic loader finds a loaded library by its name."""
    import ctypes

    try:
        library = ctypes.CDLL(file, mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
        symbol = (ctypes.c_char * (_SYMBOL_BYTES + 1)).in_dll(library, _SYMBOL)
    except (OSError, ValueError):
        return kernel_digest(Path(file))
    match = _DIGEST.match(symbol.raw)
    return match[1].decode() if match else ""


def _versions_digest() -> str:
    return hashlib.sha256("\0".join(library_versions()).encode()).hexdigest()


@cache
def _modules() -> Mapping[str, str]:
    """The file of every module of this package, found without importing it."""
    files: dict[str, str] = {}
    for root in sys.modules["paradize"].__path__:
        for folder, folders, names in os.walk(root):
            folders[:] = [name for name in folders if name != "__pycache__"]
            package = f"paradize{folder[len(root) :]}".replace(os.sep, ".")
            for suffix in SUFFIXES:
                for name in names:
                    if name.endswith(suffix):
                        module = f"{package}.{name.removesuffix(suffix)}".removesuffix(".__init__")
                        files.setdefault(module, f"{folder}/{name}")
    return files


@cache
def _scan(path: Path) -> tuple[str, tuple[str, ...]]:
    """Returns a module's digest and the names that it imports from this package, modules or not."""
    status = os.stat(path)  # noqa: PTH116 (called for hundreds of files)
    return _scan_as_of(path, status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino)


@cache
def _scan_as_of(path: Path, *stamp: int) -> tuple[str, tuple[str, ...]]:
    """The result for this stamp, which a file that is changed or replaced no longer has."""
    if path.suffix != ".py":
        return kernel_digest(path), ()
    source = path.read_bytes()
    return hashlib.sha256(source).hexdigest(), _imports(source)


def _imports(source: bytes) -> tuple[str, ...]:
    """The names that a Python source imports from this package."""
    imports = []
    for package, names, plain in _IMPORT.findall(source):
        base = (package or plain).decode()
        imports += [base, *(f"{base}.{word}" for word in re.findall(r"\w+", names.decode()))]
    return tuple(imports)


def _closure(module: str) -> dict[str, Path]:
    """The files of `module` and of everything that it imports, by module name."""
    todo, seen, files = [module], {module}, {}
    while todo:
        name = todo.pop()
        if name not in _modules():
            continue
        files[name] = path = Path(_modules()[name])
        for imported in (name.rpartition(".")[0], *_scan(path)[1]):  # a package is loaded before its modules
            if imported not in seen:
                seen.add(imported)
                todo.append(imported)
    return files

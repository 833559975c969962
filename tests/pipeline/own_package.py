"""A copy of the package, for tests that change its code."""

from __future__ import annotations

import shutil
from pathlib import Path

import paradize.kernels
from tests.places import ROOT


def kernels() -> list[Path]:
    """The native modules that were built."""
    return [path for top in paradize.kernels.__path__ for path in sorted(Path(top).glob("*/_*.so"))]


def copy_package(folder: Path) -> Path:
    """Copies the package with its kernels into `folder`; an interpreter with that folder in PYTHONPATH
    imports the copy, though another is installed."""
    package = folder / "paradize"
    unfinished = shutil.ignore_patterns("*.pyc.*")  # bytecode that another process is writing
    shutil.copytree(ROOT / "pipeline/paradize", package, ignore=unfinished)
    for path in kernels():
        shutil.copy(path, package / "kernels" / path.parent.name)
    (folder / "sitecustomize.py").write_text(
        "import sys\n"
        "class Own:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.partition('.')[0] == 'paradize':\n"
        "            from importlib.machinery import PathFinder\n"
        f"            return PathFinder.find_spec(name, path or [{str(folder)!r}], target)\n"
        "sys.meta_path.insert(0, Own())\n"
    )
    return package

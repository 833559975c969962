"""The quickest build of PyPI's etcpak that is right, and its instruction set.

Its package asks for builds that are named for CPython 3.7, which no later Python imports, and falls back on
the plain one without a word: ten times slower in BC1. Their files load by their path all the same. The SSE4.1
build is taken: the AVX2 and the AVX-512 build are no quicker in BC1, BC4 and BC5, and give less than 30 dB in
BC7, where the others give more than 40.
"""

from __future__ import annotations

import importlib.machinery
import importlib.util
from pathlib import Path
from types import ModuleType

from row import cpu_flags


def _load() -> tuple[ModuleType, str]:
    """The module, and the instruction set that it was built for."""
    package = importlib.util.find_spec("etcpak")
    assert package is not None and package.submodule_search_locations
    folder = Path(package.submodule_search_locations[0])
    if "sse4_1" in cpu_flags():
        for path in folder.glob("_etcpak_sse41.*.so"):
            loader = importlib.machinery.ExtensionFileLoader("_etcpak_sse41", str(path))
            spec = importlib.util.spec_from_file_location("_etcpak_sse41", path, loader=loader)
            assert spec is not None
            module = importlib.util.module_from_spec(spec)
            loader.exec_module(module)
            return module, "SSE4.1"
    return importlib.import_module("etcpak"), "the build that its package loads"


etcpak, BUILD = _load()

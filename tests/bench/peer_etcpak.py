"""The quickest build of PyPI's etcpak that is right, and the instruction sets of both sides.

Its package asks for builds that are named for CPython 3.7, which no later Python imports, and falls back on
the plain one without a word: ten times slower in BC1. Their files load by their path all the same. The SSE4.1
build is taken: the AVX2 and the AVX-512 build are no quicker in BC1, BC4 and BC5, and give less than 30 dB in
BC7, where the others give more than 40.
"""

from __future__ import annotations

import importlib.machinery
import importlib.util
import platform
from pathlib import Path
from types import ModuleType

from numpy._core import _multiarray_umath as numpy_core

CPU: dict[str, bool] = numpy_core.__cpu_features__


def _load() -> tuple[ModuleType, str]:
    """The module, and the instruction set that it was built for."""
    package = importlib.util.find_spec("etcpak")
    assert package is not None and package.submodule_search_locations
    folder = Path(package.submodule_search_locations[0])
    if platform.machine() == "x86_64" and CPU.get("SSE41"):
        for path in folder.glob("_etcpak_sse41.*.so"):
            loader = importlib.machinery.ExtensionFileLoader("_etcpak_sse41", str(path))
            spec = importlib.util.spec_from_file_location("_etcpak_sse41", path, loader=loader)
            assert spec is not None
            module = importlib.util.module_from_spec(spec)
            loader.exec_module(module)
            return module, "SSE4.1"
    return importlib.import_module("etcpak"), "the build that its package loads"


def _our_set() -> str:
    """What kernels/cpu.hpp takes on this CPU."""
    if all(CPU.get(name) for name in ("AVX512F", "AVX512VL", "AVX512DQ", "AVX512BW")):
        return "AVX-512"
    return "AVX2" if CPU.get("AVX2") else "the baseline"


etcpak, BUILD = _load()
OURS = f"1 thread, {_our_set()}"
ETCPAK = f"etcpak of PyPI, 1 thread, {BUILD}"

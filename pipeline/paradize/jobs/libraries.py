"""Names and versions of the third-party libraries that affect results."""

from __future__ import annotations

import os
import sys
from functools import cache

LIBRARIES = (
    "dracopy",
    "fast_simplification",
    "meshoptimizer",
    "nanobind",
    "numpy",
    "opengl_basisu",
    "openimageio",
    "pillow",
    "soundfile",
    "xatlas",
    "zstandard",
)


@cache
def library_versions() -> tuple[str, ...]:
    """`name-version` of each installed library that can change an artifact, as its dist-info folder is
    called."""
    versions = set()
    for folder in sys.path:
        try:
            names = os.listdir(folder)  # noqa: PTH208 (names only, and fast)
        except OSError:
            continue
        for name in names:
            stem, _, kind = name.rpartition(".")
            if kind == "dist-info" and stem.rpartition("-")[0].lower().replace("-", "_") in LIBRARIES:
                versions.add(stem.lower())
    return tuple(sorted(versions))

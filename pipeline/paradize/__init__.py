"""Paradize: bakes models, colour maps and heightmaps into measured, engine-ready assets.

`import paradize` gives the names of api.py; that module is loaded when the first of them is used. Type
checkers read `__init__.pyi`.
"""

from importlib import import_module

__version__ = "0.1.0"
__all__ = [
    "BakeReport",
    "BakedMaps",
    "BakedMesh",
    "BakedTerrain",
    "BuildOptions",
    "CheckOptions",
    "FileOptions",
    "Finding",
    "MapSettings",
    "MeshSettings",
    "OcclusionSettings",
    "TerrainSettings",
    "bake",
    "check",
    "maps",
    "measure",
    "mesh",
    "occlusion",
    "terrain",
]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module 'paradize' has no attribute {name!r}")
    return getattr(import_module("paradize.api"), name)


def __dir__() -> list[str]:
    return sorted(globals().keys() | set(__all__))

"""Reads a model of any format that Paradize knows: OBJ, glTF (`.glb`, `.gltf`), PLY, STL."""

from __future__ import annotations

from pathlib import Path

from paradize.kinds import MODEL, expecting, is_gltf, is_ply
from paradize.readers.obj import read_obj
from paradize.readers.record import UNKNOWN_SMOOTHING, Model

__all__ = ["UNKNOWN_SMOOTHING", "Model", "read_model"]


def read_model(path: Path, root: Path | None = None, on_library: list[Path] | None = None) -> Model:
    """Reads a model and the files that it names, which must lie inside `root` (default: its folder).
    on_library: a list to which each file beside the model is appended before it is read.

    Raises SourceError for a file that is missing, of another kind, damaged or without a surface. Missing
    files of materials and maps are warnings.
    """
    if is_gltf(path):
        from paradize.readers.gltf.read import read_gltf  # here: an OBJ needs none of it

        with expecting(MODEL, path):
            return read_gltf(path, root, on_library)
    if is_ply(path):
        from paradize.readers.ply import read_ply

        with expecting(MODEL, path):
            return read_ply(path)
    if path.suffix.lower() == ".stl":
        from paradize.readers.stl import read_stl

        with expecting(MODEL, path):
            return read_stl(path)
    return read_obj(path, root, on_library)

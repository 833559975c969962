"""Reads a model of any format that Paradize knows: OBJ, glTF (`.glb`, `.gltf`), PLY, STL."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from paradize.data import Mesh
from paradize.kinds import MODEL, PLY, STL, Kind, expecting, is_gltf, is_surely_other, kind_of, require
from paradize.player_limits import FARTHEST_UV
from paradize.readers.obj import read_obj
from paradize.readers.record import UNKNOWN_SMOOTHING, Model

__all__ = ["UNKNOWN_SMOOTHING", "Model", "read_model"]


def read_model(path: Path, root: Path | None = None, on_library: list[Path] | None = None) -> Model:
    """Reads a model and the files that it names, which must lie inside `root` (default:
    names.root_of).
    on_library: a list to which each file beside the model is appended before it is read.

    Raises SourceError for a file that is missing, of another kind, damaged or without a surface. Missing
    files of materials and maps are warnings, and so are texture coordinates farther from 0 than the player
    takes: they become (0, 0).
    """
    if is_surely_other(MODEL, path):  # an archive may hold text that reads as an OBJ
        require(MODEL, path)
    if is_gltf(path):
        from paradize.readers.gltf.read import read_gltf  # here: an OBJ needs none of it

        with expecting(MODEL, path):
            model = read_gltf(path, root, on_library)
    elif (kind := _kind_or_none(path)) is PLY:
        from paradize.readers.ply import read_ply

        with expecting(MODEL, path):
            model = read_ply(path, root)
    elif kind is STL:
        from paradize.readers.stl import read_stl

        with expecting(MODEL, path):
            model = read_stl(path)
    else:
        model = read_obj(path, root, on_library)
    return _with_near_uvs(model, path)


def _kind_or_none(path: Path) -> Kind | None:
    """The kind of a file; None where it cannot be opened, which its reader tells."""
    try:
        return kind_of(path)
    except OSError:
        return None


def _with_near_uvs(model: Model, path: Path) -> Model:
    """Returns the model with texture coordinates farther from 0 than the player takes as (0, 0), and a
    warning."""
    near: dict[str, Any] = {}
    warnings: list[str] = []
    for name in ("uvs", "uvs1"):
        uvs = getattr(model.mesh, name)
        if uvs is None or not (far := (np.abs(uvs) > FARTHEST_UV).any(axis=1)).any():
            continue
        u, v = uvs[int(far.argmax())].tolist()
        of = f"{int(far.sum())} vertices" if far.sum() > 1 else "1 vertex"
        what = f"texture coordinates of {of} lie farther than {FARTHEST_UV:g} tiles from 0"
        warnings.append(f"{path}: {what} (first: {u:g} {v:g}); read as (0, 0): unwrap the model again")
        near[name] = np.where(far[:, None], np.float32(0), uvs)
    if not near:
        return model
    mesh: Mesh = replace(model.mesh, **near)
    return replace(model, mesh=mesh, warnings=[*model.warnings, *warnings])

"""Turns values per corner into values per vertex. Vertices are split where their corners differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.data import ATTRIBUTES, Mesh
from paradize.errors import BakeError
from paradize.kernels.mesh import number_corners

if TYPE_CHECKING:
    import numpy.typing as npt


def split_by(mesh: Mesh, **corners: npt.NDArray[np.float32]) -> Mesh:
    """Returns the mesh with attributes set from values per corner, each (m, 3, k) float32 or (3 m, k).

    A vertex whose corners differ becomes several. Vertices are numbered in the order of their first use. All
    other attributes are copied with their vertex. Raises BakeError if an attribute of the mesh does not have
    one row per vertex.
    """
    for name in ATTRIBUTES:
        values = getattr(mesh, name)
        if values is not None and len(values) != len(mesh.positions):
            raise BakeError(f"{len(values)} {name} for {len(mesh.positions)} vertices")
    base = mesh.triangles.reshape(-1)
    flat = {name: values.reshape(len(base), values.shape[-1]) for name, values in corners.items()}
    index, first = number_corners(base, np.concatenate(list(flat.values()), axis=1))
    changed = {name: np.ascontiguousarray(values[first], np.float32) for name, values in flat.items()}
    return mesh.with_vertices(base[first], index.reshape(-1, 3), **changed)

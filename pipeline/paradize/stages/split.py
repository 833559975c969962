"""A value per corner -> a value per vertex: vertices are split where their corners differ."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Mesh
from paradize.kernels.mesh import number_corners

if TYPE_CHECKING:
    import numpy.typing as npt


def split_by(mesh: Mesh, name: str, corners: npt.NDArray[np.float32]) -> Mesh:
    """The mesh with `name` set from a value per corner (m, 3, k); vertices whose corners differ become several.

    Vertices are numbered in the order of their first use; positions and triangles keep their values.
    """
    base = mesh.triangles.reshape(-1)
    index, first = number_corners(base, corners.reshape(len(base), -1))
    source = base[first]
    arrays = {
        key: None if (values := getattr(mesh, key)) is None else np.ascontiguousarray(values[source])
        for key in ("positions", "normals", "tangents", "uvs", "uvs1", "colors")
    }
    arrays[name] = np.ascontiguousarray(corners.reshape(len(base), -1)[first])
    return replace(mesh, **arrays, triangles=index.reshape(-1, 3))  # type: ignore[arg-type]

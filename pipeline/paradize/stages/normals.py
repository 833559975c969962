"""Unit normals for every vertex: the source's, or else computed by smoothing group and crease angle."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Mesh
from paradize.kernels.mesh import corner_normals
from paradize.stages.split import split_by
from paradize.vectors import lengths

if TYPE_CHECKING:
    import numpy.typing as npt

_SHORTEST = 1e-18  # a normal below this length, metres or not, has no direction worth keeping


def complete_normals(
    mesh: Mesh, smoothing: npt.NDArray[np.uint32] | None = None, *, crease_deg: float
) -> tuple[Mesh, int]:
    """Scales given normals to length 1 and computes those that are missing (absent, or rows of zeros).

    smoothing: (m,) group per triangle (see `corner_normals`); crease_deg: 0 to 180, for triangles whose
    smoothing is unknown. A vertex is split where its corners' computed normals differ. Returns the mesh and
    how many triangles had a normal computed.
    """
    count = len(mesh.positions)
    given = np.zeros((count, 3), np.float64) if mesh.normals is None else mesh.normals.astype(np.float64)
    length = lengths(given)
    missing = length < _SHORTEST
    unit = (given / np.where(missing, 1.0, length)[:, None]).astype(np.float32)
    if not missing.any():
        return replace(mesh, normals=unit), 0
    needs = missing[mesh.triangles]
    computed = corner_normals(mesh.positions, mesh.triangles, smoothing, crease_deg=crease_deg)
    corners = np.where(needs[:, :, None], computed, unit[mesh.triangles])
    return split_by(mesh, normals=corners), int(needs.any(axis=1).sum())

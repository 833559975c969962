"""The terrain's true error: the vertical distance of its triangles from every pixel of the height field.

Brute force and independent of the mesher: it sees only the float32 positions of the finished mesh, casts a
vertical line through every pixel and meets each triangle that covers it, in float64, borders included. It
also counts the pixels that no triangle covers, and the triangles that do not face up. Native, in bands of
rows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from paradize.data import Heightfield, Mesh
from paradize.kernels.reference.terrain import patch_error as _patch_error
from paradize.kernels.reference.terrain import terrain_error as _terrain_error


@dataclass(frozen=True)
class TerrainError:
    """max_m, rms_m: vertical metres over all pixels (the worst triangle at each). holes: pixels not covered.
    flipped: triangles that face down or have no area. worst: (row, column) of the largest error.
    strays: of a patch, pixels outside of it that it covers."""

    max_m: float
    rms_m: float
    holes: int
    flipped: int
    worst: tuple[int, int]
    strays: int = 0


def terrain_error(mesh: Mesh, field: Heightfield) -> TerrainError:
    """Measures a terrain mesh against its height field (rows x columns pixels over the field's size)."""
    largest, squares, covered, holes, flipped, worst = _terrain_error(
        mesh.positions, mesh.triangles, field.heights_m, (field.size_x_m, field.size_z_m)
    )
    return TerrainError(
        max_m=largest if covered else math.inf,
        rms_m=math.sqrt(squares / max(1, covered)),
        holes=holes,
        flipped=flipped,
        worst=divmod(worst, field.heights_m.shape[1]),
    )


def patch_error(
    mesh: Mesh, field: Heightfield, corners: tuple[tuple[int, int], tuple[int, int], tuple[int, int]]
) -> TerrainError:
    """Measures the mesh of one patch at every pixel of the closed triangle `corners`, (row, column) each,
    that lies in the field; its positions are those of the whole terrain. Threads may run side by side."""
    largest, squares, covered, holes, flipped, worst, strays = _patch_error(
        mesh.positions, mesh.triangles, field.heights_m, (field.size_x_m, field.size_z_m), corners
    )
    return TerrainError(
        max_m=largest if covered else math.inf,
        rms_m=math.sqrt(squares / max(1, covered)),
        holes=holes,
        flipped=flipped,
        worst=divmod(worst, field.heights_m.shape[1]),
        strays=strays,
    )

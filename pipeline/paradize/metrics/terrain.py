"""The true error of a terrain: the vertical distance of its triangles from each pixel of the height field.

Brute force, independent of the mesher: uses only the float32 positions of the finished mesh, casts a vertical
line through each pixel and intersects all triangles that cover it, in float64, borders included. Also counts
uncovered pixels and triangles that do not face up. Native code, in bands of rows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from paradize.data import Heightfield, Mesh
from paradize.kernels.reference.terrain import patch_error as _patch_error
from paradize.kernels.reference.terrain import terrain_error as _terrain_error


@dataclass(frozen=True)
class TerrainError:
    """max_m, rms_m: vertical metres over all pixels (the worst triangle at each). holes: uncovered pixels.
    flipped: triangles that face down or have no area. worst: (row, column) of the largest error. strays:
    pixels outside a patch that its mesh covers."""

    max_m: float
    rms_m: float
    holes: int
    flipped: int
    worst: tuple[int, int]
    strays: int = 0


def terrain_error(mesh: Mesh, field: Heightfield) -> TerrainError:
    """Measures a terrain mesh against its height field, of which all pixels are used."""
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
    """Measures a patch at all pixels of the field inside the closed triangle `corners`, (row, column) each.
    mesh: positions in the space of the whole terrain. May be called from several threads."""
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

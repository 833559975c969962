"""Height field -> mesh with two UV sets, normals from the field itself, and a bound on the vertical error.

Vertices are pixels: x = -size_x / 2 + column * size_x / (columns - 1), z likewise from the row, y = height.
Tiers: `fast` a hierarchy of right triangles, every one measured at every pixel; `balanced` greedy Delaunay
insertion (Garland and Heckbert, 1995); `exact` every pixel is a vertex.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from paradize.data import Group, Heightfield, Mesh
from paradize.errors import BakeError
from paradize.kernels.terrain import bisect, refine

MAX_GRID_TRIANGLES = 64_000_000


def _grid(rows: int, columns: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Every pixel as a vertex (n, 2), and two triangles per cell (m, 3), in the turn that `refine` gives."""
    row, column = np.divmod(np.arange(rows * columns, dtype=np.int64), columns)
    corner = (
        np.arange(rows - 1, dtype=np.int64)[:, None] * columns + np.arange(columns - 1, dtype=np.int64)
    ).ravel()
    right, below, across = corner + 1, corner + columns, corner + columns + 1
    triangles = np.stack([corner, right, across, corner, across, below], axis=1).reshape(-1, 3)
    return np.stack([row, column], axis=1), triangles


def slopes(
    field: Heightfield, row: npt.NDArray[np.integer], column: npt.NDArray[np.integer]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """(dy/dx, dy/dz) at pixels (n,), float64: central differences, one-sided at the rim."""
    heights = field.heights_m
    rows, columns = heights.shape
    step_x, step_z = field.size_x_m / (columns - 1), field.size_z_m / (rows - 1)
    left, right = np.maximum(column, 1) - 1, np.minimum(column + 1, columns - 1)
    above, below = np.maximum(row, 1) - 1, np.minimum(row + 1, rows - 1)
    along_x = heights[row, right].astype(np.float64) - heights[row, left]
    along_z = heights[below, column].astype(np.float64) - heights[above, column]
    return along_x / ((right - left) * step_x), along_z / ((below - above) * step_z)


def terrain_mesh(field: Heightfield, *, tolerance_m: float, sand_repeat: float = 1.0, tier: str) -> Mesh:
    """The terrain as one mesh whose planes pass every pixel within tolerance_m (metres, >= 0).

    normals, tangents: from the height field; T points along +X, B along -Z, w = +1. uvs: the sand pattern,
    sand_repeat times along X and as often along Z as keeps its tiles square. uvs1: the effect map, once: the
    first and last column at 0 and 1. tier: "fast", "balanced" or "exact"; a tolerance of 0 is "exact".
    Raises BakeError when every pixel as a vertex would make more than MAX_GRID_TRIANGLES triangles.
    """
    rows, columns = field.heights_m.shape
    vertices: npt.NDArray[np.integer]
    triangles: npt.NDArray[np.integer]
    if tier == "exact" or tolerance_m == 0.0:
        count = 2 * (rows - 1) * (columns - 1)
        if count > MAX_GRID_TRIANGLES:
            raise BakeError(
                f"every pixel as a vertex makes {count} triangles; limit {MAX_GRID_TRIANGLES}",
                mend="allow an error (max_error_m) above 0",
            )
        vertices, triangles = _grid(rows, columns)
    else:
        make = bisect if tier == "fast" else refine
        vertices, triangles = make(field.heights_m, tolerance_m)
    return pixels_mesh(field, vertices, triangles, sand_repeat=sand_repeat)


def pixels_mesh(
    field: Heightfield,
    vertices: npt.NDArray[np.integer],
    triangles: npt.NDArray[np.integer],
    *,
    sand_repeat: float = 1.0,
) -> Mesh:
    """The mesh of pixels: positions, normals, tangents and both UV sets of each, as `terrain_mesh` says.

    vertices: (n, 2) as (row, column); triangles: (m, 3), clockwise in an image drawn with row 0 at the top.
    What a vertex gets depends on its pixel alone, so that meshes of parts have the same where they meet.
    """
    rows, columns = field.heights_m.shape
    row, column = vertices[:, 0], vertices[:, 1]
    u = column.astype(np.float64) / (columns - 1)
    v = row.astype(np.float64) / (rows - 1)
    positions = np.empty((len(vertices), 3), np.float32)
    positions[:, 0] = (u - 0.5) * field.size_x_m
    positions[:, 1] = field.heights_m[row, column]
    positions[:, 2] = (v - 0.5) * field.size_z_m
    along_x, along_z = slopes(field, row, column)
    normals = np.empty_like(positions)
    length = np.sqrt(along_x * along_x + along_z * along_z + 1.0)
    normals[:, 0] = -along_x / length
    normals[:, 1] = 1.0 / length
    normals[:, 2] = -along_z / length
    tangents = np.zeros((len(vertices), 4), np.float32)
    length = np.sqrt(along_x * along_x + 1.0)
    tangents[:, 0] = 1.0 / length
    tangents[:, 1] = along_x / length
    tangents[:, 3] = 1.0
    repeat_z = sand_repeat * (field.size_z_m / field.size_x_m)
    # Rows grow towards +Z: seen from above the kernel's positive turn is clockwise, so two corners swap.
    turned = np.ascontiguousarray(triangles[:, [0, 2, 1]], dtype=np.uint32)
    return Mesh(
        positions=positions,
        triangles=turned,
        normals=normals,
        tangents=tangents,
        uvs=np.stack([u * sand_repeat, v * repeat_z], axis=1).astype(np.float32),
        uvs1=np.stack([u, v], axis=1).astype(np.float32),
        groups=(Group("terrain", "terrain", 0, len(turned)),),
    )

"""Makes one mesh of a height field, with two UV sets, normals, and a bound on its vertical error.

Each vertex is a pixel: x = -size_x / 2 + column * size_x / (columns - 1), z the same from the row, y =
height.

- Tier `fast`: a hierarchy of right triangles, each measured at all its pixels.
- Tier `balanced`: greedy Delaunay insertion (Garland and Heckbert, 1995). Slower, with fewer triangles.
- Tier `exact`: the same, until the mesh passes through every pixel.
- `grid` makes every pixel a vertex. It is not a tier: it serves where rounding to float32 spoils the others.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from paradize.data import Group, Heightfield, Mesh
from paradize.errors import BakeError
from paradize.kernels.terrain import Vertices, bisect, refine, vertices

MAX_GRID_TRIANGLES = 64_000_000


def terrain_mesh(field: Heightfield, *, tolerance_m: float, sand_repeat: float = 1.0, tier: str) -> Mesh:
    """Returns the terrain as one mesh that is within tolerance_m (metres, >= 0) of every pixel, vertically.

    normals, tangents: of the height field; T points along +X, B along -Z, w = +1. uvs: the sand pattern,
    sand_repeat times along X, and along Z so that its tiles are square. uvs1: the effect map, once; the first
    and last column are at 0 and 1. tier: "fast", "balanced", "exact" or "grid"; a tolerance of 0 means
    "exact". Raises BakeError for a height that is not finite, or if a mesh of all pixels would have more than
    MAX_GRID_TRIANGLES triangles.
    """
    rows, columns = field.heights_m.shape
    if not np.isfinite(field.heights_m).all():
        row, column = (int(k) for k in np.argwhere(~np.isfinite(field.heights_m))[0])
        raise BakeError("a height is not a finite number", place=f"row {row}, column {column}")
    if tier == "exact" or (tolerance_m == 0.0 and tier != "grid"):
        tier, tolerance_m = "exact", 0.0
    if tier in ("exact", "grid"):
        count = 2 * (rows - 1) * (columns - 1)
        if count > MAX_GRID_TRIANGLES:
            raise BakeError(
                f"every pixel as a vertex makes {count} triangles; limit {MAX_GRID_TRIANGLES}",
                mend="allow an error (max_error_m) above 0",
            )
    if tier == "grid":
        size_m = field.size_x_m, field.size_z_m
        return _mesh(vertices(field.heights_m, size_m, sand_repeat=sand_repeat))
    make = bisect if tier == "fast" else refine
    pixels, triangles = make(field.heights_m, tolerance_m)
    return pixels_mesh(field, pixels, triangles, sand_repeat=sand_repeat)


def pixels_mesh(
    field: Heightfield,
    pixels: npt.NDArray[np.integer],
    triangles: npt.NDArray[np.integer],
    *,
    sand_repeat: float = 1.0,
) -> Mesh:
    """Returns a mesh of the given pixels, with the attributes that `terrain_mesh` describes.

    pixels: (n, 2) as (row, column); triangles: (m, 3), clockwise in an image drawn with row 0 at the top.
    A vertex depends only on its pixel, so meshes of neighbouring parts agree on their common border.
    """
    made = vertices(field.heights_m, (field.size_x_m, field.size_z_m), pixels, sand_repeat=sand_repeat)
    # Rows grow towards +Z, so the kernel's triangles are clockwise seen from above: swap two corners.
    return _mesh(made, np.ascontiguousarray(triangles[:, [0, 2, 1]], dtype=np.uint32))


def _mesh(made: Vertices, triangles: npt.NDArray[np.uint32] | None = None) -> Mesh:
    triangles = made.triangles if triangles is None else triangles
    return Mesh(
        positions=made.positions,
        triangles=triangles,
        normals=made.normals,
        tangents=made.tangents,
        uvs=made.uvs,
        uvs1=made.uvs1,
        groups=(Group("terrain", "terrain", 0, len(triangles)),),
    )

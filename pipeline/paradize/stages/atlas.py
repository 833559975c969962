"""Texture coordinates by xatlas for a mesh without any: one square, no chart over another.

xatlas gives NaN, zeros or a hang on input that is tiny, huge or far away, and invents triangles for none:
it is given a mesh at the origin with a diagonal of fixed length, and what it returns is looked at triangle
by triangle. It must run where it can be killed: `bake_mesh` gives it a process of its own and a time.
Source: Y. Young (after T. Hachisuka's Thekla Atlas), "xatlas", 2018 - 2022.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xatlas

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.stages.split import split_by

if TYPE_CHECKING:
    import numpy.typing as npt

RESOLUTION = 1024  # texels: what padding is counted in
PADDING = 4
_DIAGONAL = 10.0
_RASTER = 512
_LARGEST_OVERLAP = 0.002  # of the covered texels: triangles that share an edge share texels on it


def make_atlas(mesh: Mesh, *, resolution: int = RESOLUTION, padding: int = PADDING) -> Mesh:
    """The mesh with new uvs (n, 2) in 0..1, top-left origin; vertices are split along the charts' borders.

    mesh: validated. resolution: 64 to 8192 texels, for which `padding` texels (0 to 64) lie between charts.
    Raises BakeError where a coordinate is not finite or outside, or charts overlap.
    """
    if not 64 <= resolution <= 8192 or not 0 <= padding <= 64:
        raise BakeError(f"{resolution} texels with {padding} between, expected 64 to 8192 and 0 to 64")
    wide = mesh.positions.astype(np.float64)
    low, high = wide.min(axis=0), wide.max(axis=0)
    x, y, z = (float(side) for side in high - low)
    largest = max(x, y, z)
    x, y, z = x / largest, y / largest, z / largest
    scale = _DIAGONAL / (largest * float(np.sqrt(x * x + y * y + z * z)))
    points = ((wide - (low + high) / 2) * scale).astype(np.float32)
    atlas = xatlas.Atlas()
    atlas.add_mesh(points, np.ascontiguousarray(mesh.triangles, np.uint32))
    charts, packing = xatlas.ChartOptions(), xatlas.PackOptions()
    packing.resolution = resolution
    packing.padding = padding
    packing.bilinear = True
    packing.rotate_charts = False  # turned charts come out mirrored
    atlas.generate(charts, packing, False)
    source, triangles, uvs = atlas[0]
    if triangles.shape != mesh.triangles.shape:
        raise BakeError(f"xatlas returned {len(triangles)} triangles for {len(mesh.triangles)}")
    if not np.array_equal(np.asarray(source)[triangles], mesh.triangles):
        raise BakeError("xatlas returned other triangles than it was given")
    corners = np.ascontiguousarray(uvs, np.float32)[triangles]
    _require_sound(corners)
    return split_by(replace(mesh, tangents=None, uvs=None), uvs=corners)


def _require_sound(corners: npt.NDArray[np.float32]) -> None:
    """corners: (m, 3, 2). Finite, inside the square, and, drawn on a raster, hardly a texel twice."""
    if not np.isfinite(corners).all():
        raise BakeError(f"xatlas found no coordinates for triangle {_first(~np.isfinite(corners))}")
    if corners.min() < 0 or corners.max() > 1:
        raise BakeError(f"xatlas left the square at triangle {_first((corners < 0) | (corners > 1))}")
    covered, twice = overlap(corners)
    if twice > _LARGEST_OVERLAP * covered + 8:
        raise BakeError(f"xatlas laid charts over one another: {twice} of {covered} texels of {_RASTER}")


def _first(bad: npt.NDArray[np.bool_]) -> int:
    return int(bad.any(axis=(1, 2)).argmax())


def overlap(corners: npt.NDArray[np.float32]) -> tuple[int, int]:
    """Texel centres of a _RASTER square strictly inside some triangle, and strictly inside two or more.

    corners: (m, 3, 2) in 0..1.
    """
    count = np.zeros((_RASTER, _RASTER), np.uint16)
    points = corners.astype(np.float64) * _RASTER
    for a, b, c in points:
        low = np.maximum(np.floor(np.minimum(np.minimum(a, b), c) - 0.5).astype(int), 0)
        high = np.minimum(np.ceil(np.maximum(np.maximum(a, b), c) + 0.5).astype(int), _RASTER)
        if (high <= low).any():
            continue
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        x = np.arange(low[0], high[0])[None, :] + 0.5
        y = np.arange(low[1], high[1])[:, None] + 0.5
        turn = 1.0 if area > 0 else -1.0
        margin = 1e-3 * _RASTER / 512  # texels: rounding of shared edges is no overlap
        inside = np.ones((high[1] - low[1], high[0] - low[0]), np.bool_)
        for p, q in ((a, b), (b, c), (c, a)):
            length = float(np.sqrt((q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1])))
            side = turn * ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]))
            inside &= side > margin * length
        count[low[1] : high[1], low[0] : high[0]] += inside
    return int((count > 0).sum()), int((count > 1).sum())

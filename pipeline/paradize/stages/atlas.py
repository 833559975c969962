"""Makes texture coordinates for a mesh: charts in one square, without overlaps and not mirrored.

The unwrapper cuts the charts: our own, `paradize`, or `xatlas` (`unwrappers.py`). Ours joins triangles into
charts that are as flat as the tier demands, and flattens each chart with as little distortion as possible. A
chart that would fold or stretch is cut in two. Our packing then lays out the charts of either unwrapper with
gutters between them. The mesh is centred and scaled first, so that its size and place do not matter.
Sources: named in `atlas/charts.hpp` and `atlas/pack.hpp`. `tests/bench/topics/atlas.py` measures both.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.kernels.atlas import make_charts, max_chart_count, pack
from paradize.kernels.mesh import number_rows
from paradize.stages.split import split_by
from paradize.stages.unwrappers import require_unwrapper, xatlas_charts
from paradize.tiers import UNWRAPPERS

if TYPE_CHECKING:
    import numpy.typing as npt

RESOLUTION = 1024  # texels: what padding is counted in
PADDING = 4
# How far from flat a chart may be: 1 minus the length of its mean normal; half a sphere has 0.5. If a tier
# has several values, all are tried, and the layout with the shortest seams is kept.
DEVIATIONS = {"fast": (0.2,), "balanced": (0.5,), "exact": (0.5, 0.35, 0.65, 0.8)}


def make_atlas(
    mesh: Mesh,
    *,
    resolution: int = RESOLUTION,
    padding: int = PADDING,
    tier: str = "balanced",
    unwrapper: str = UNWRAPPERS[0],
) -> Mesh:
    """Returns the mesh with new uvs (n, 2) in 0..1, top-left origin. Vertices on borders of charts are split.

    mesh: validated. resolution: side of the texture, 64 to 8192 texels. padding: texels between charts, 0 to
    64. tier: `fast` makes flatter charts and so more seams; `exact` tries several cuts and keeps the one with
    the shortest seams. unwrapper: one of UNWRAPPERS. xatlas ignores the tier, and may crash or never return:
    run it in a subprocess. Raises BakeError if the charts do not fit, or if the unwrapper is not installed or
    makes no layout.
    """
    if not 64 <= resolution <= 8192 or not 0 <= padding <= 64:
        raise BakeError(f"{resolution} texels with {padding} between, expected 64 to 8192 and 0 to 64")
    if tier not in DEVIATIONS:
        raise BakeError(f"unknown tier {tier!r} for the atlas", mend=f"use one of {', '.join(DEVIATIONS)}")
    require_unwrapper(unwrapper)
    wide = mesh.positions.astype(np.float64)
    low, high = wide.min(axis=0), wide.max(axis=0)
    size = float((high - low).max())
    points = (wide - (low + high) / 2) / (size if size > 0 else 1.0)
    places, first = number_rows(mesh.positions)
    points, faces = points[first], places[mesh.triangles]
    most = max_chart_count(resolution=resolution, padding=padding)
    if unwrapper == "xatlas":
        ways = [xatlas_charts(points, faces)]
    else:
        ways = [
            make_charts(points, faces, deviation=deviation, max_charts=most) for deviation in DEVIATIONS[tier]
        ]
    fitting = [way for way in ways if way[2] <= most]
    if fitting[1:]:
        fitting.sort(key=lambda way: seam_length(points, faces, way[0]))
    for chart, corners, count in fitting:
        packed = pack(corners, chart, count, resolution=resolution, padding=padding)
        if packed is not None:
            break
    else:
        fewest = min(way[2] for way in ways)
        raise BakeError(
            f"{fewest} charts do not fit into {resolution} texels with {padding} between: "
            f"they hold {most} at most",
            mend="weld the mesh (--weld), so that triangles share edges, or paint its own layout",
        )
    texels, _ = packed
    uvs = texels / resolution
    uvs[:, :, 1] = 1 - uvs[:, :, 1]
    _require_sound(uvs)
    return split_by(replace(mesh, tangents=None, uvs=None), uvs=uvs.astype(np.float32))


def seam_length(
    points: npt.NDArray[np.float64], faces: npt.NDArray[np.uint32], chart: npt.NDArray[np.int32]
) -> float:
    """Returns the length of all edges between two charts, in the points' unit. points: (n, 3); faces: (m, 3);
    chart: (m,)."""
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(ends.T)
    ends, charts = ends[order], np.repeat(chart, 3)[order]
    inner = (ends[1:] == ends[:-1]).all(axis=1) & (charts[1:] != charts[:-1])
    sides = points[ends[1:][inner, 0]] - points[ends[1:][inner, 1]]
    x, y, z = sides.T  # summed in one order on every machine
    return float(np.cumsum(np.sqrt(x * x + y * y + z * z))[-1]) if len(sides) else 0.0


def _require_sound(corners: npt.NDArray[np.float64]) -> None:
    """Raises BakeError for corners (m, 3, 2) that are not finite or outside the square. The bake measures the
    rest."""
    if not np.isfinite(corners).all():
        raise BakeError(f"no coordinates for triangle {_first(~np.isfinite(corners))}")
    if corners.min() < 0 or corners.max() > 1:
        raise BakeError(f"left the square at triangle {_first((corners < 0) | (corners > 1))}")


def _first(bad: npt.NDArray[np.bool_]) -> int:
    return int(bad.any(axis=(1, 2)).argmax())

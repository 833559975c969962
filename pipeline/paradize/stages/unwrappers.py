"""Cuts charts with xatlas, and checks what it gets and returns.

xatlas returns NaN for small meshes, invents triangles for empty ones, mirrors charts, leaves triangles out,
and never returns for some huge meshes. So it gets only validated meshes, scaled to one size. Mirrored charts
are turned over, triangles that are missing are flattened as charts of their own, and callers run it in a
process that can be killed (`jobs/isolate.py`). Its packing keeps neither the requested size nor the gutter
(860 to 1794 texels for 1024), so our own packing places its charts.
"""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

import numpy as np

from paradize.errors import BakeError
from paradize.tiers import UNWRAPPERS
from paradize.vectors import cross, doubled_areas_2d, lengths

if TYPE_CHECKING:
    import numpy.typing as npt

# xatlas widens each chart to whole texels before it packs: the finer, the less it is stretched. 4096 takes up
# to twice the time.
_TEXELS = 2048
_NOTHING = 1e-6  # of a triangle's area: an image that is smaller was left out


def require_unwrapper(name: str) -> None:
    """Raises BakeError for an unknown name, or if its library is not installed."""
    if name not in UNWRAPPERS:
        raise BakeError(f"no unwrapper {name!r}", mend=f"use one of {', '.join(UNWRAPPERS)}")
    if name == "xatlas" and unwrapper_version(name) is None:
        what = "unwrapper: xatlas is not installed; it has no package for Linux on ARM or for Python 3.14"
        raise BakeError(what, mend="take the unwrapper 'paradize'")


def unwrapper_version(name: str) -> str | None:
    """Returns the version of an unwrapper's library; None for our own, or if it is not installed."""
    try:
        return None if name == "paradize" else version(name)
    except PackageNotFoundError:
        return None


def xatlas_charts(
    points: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32]
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float64], int]:
    """(chart of each triangle (m,), corners (m, 3, 2) in the chart's plane, number of charts), as
    kernels.atlas.make_charts gives them; triangles of one chart share edges that no third one has.

    points: (n, 3) finite, about the origin, one for each place; triangles: (m, 3). Raises BakeError where the
    result is not a layout of these triangles.
    """
    if not len(triangles) or int(triangles.max()) >= len(points) or not np.isfinite(points).all():
        raise BakeError("the unwrapper is given only sound meshes")
    sides = points[triangles[:, 1:]] - points[triangles[:, :1]]
    areas = lengths(cross(sides[:, 0], sides[:, 1])) / 2
    mean = float(np.cumsum(areas)[-1]) / len(areas)
    if not mean > 0:
        raise BakeError("unwrapper: no triangle has an area")
    corners, vertices = _unwrap(points / np.sqrt(mean), triangles)
    corners *= np.sqrt(mean)
    turned = _image_areas(corners)
    out = np.abs(turned) <= _NOTHING * areas
    chart = _charts(triangles, vertices, out)
    sums = np.bincount(chart, weights=turned)
    corners[sums[chart] < 0, :, 0] *= -1
    corners[out] = _laid_flat(sides[out])
    return chart, corners, int(chart.max()) + 1


def _unwrap(
    points: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
    """Corners (m, 3, 2) in the points' unit, and xatlas' number of each corner's vertex (m, 3). points: of a
    size where triangles have an area of about 1."""
    import xatlas  # here: not every machine has it

    atlas = xatlas.Atlas()
    atlas.add_mesh(points.astype(np.float32), np.ascontiguousarray(triangles))
    packing = xatlas.PackOptions()
    packing.resolution, packing.padding, packing.rotate_charts = _TEXELS, 0, False
    atlas.generate(xatlas.ChartOptions(), packing, False)
    _, vertices, uvs = atlas[0]
    if vertices.shape != triangles.shape or (len(vertices) and int(vertices.max()) >= len(uvs)):
        raise BakeError(f"xatlas returned {len(vertices)} triangles for {len(triangles)}")
    texels = np.asarray(uvs, np.float64) * [atlas.width, atlas.height]
    corners = texels[vertices] / atlas.texels_per_unit
    if not np.isfinite(corners).all():
        raise BakeError("xatlas returned coordinates that are not finite")
    return corners, vertices


def _charts(
    triangles: npt.NDArray[np.uint32], vertices: npt.NDArray[np.uint32], alone: npt.NDArray[np.bool_]
) -> npt.NDArray[np.int32]:
    """Returns the chart of each triangle, from 0. Two triangles are of one chart if they alone share an edge
    and xatlas gave them the same vertices there. alone: (m,) triangles that form charts of their own."""
    ways = [[0, 1], [1, 2], [2, 0]]
    ends = triangles[:, ways].reshape(-1, 2)
    order = np.argsort(ends, axis=1)
    ends = np.take_along_axis(ends, order, axis=1)
    names = np.take_along_axis(vertices[:, ways].reshape(-1, 2), order, axis=1)
    sort = np.lexsort(ends.T)
    ends, names, owner = ends[sort], names[sort], np.repeat(np.arange(len(triangles)), 3)[sort]
    same = np.concatenate([[False], (ends[1:] == ends[:-1]).all(axis=1), [False]])
    pair = same[1:-1] & ~same[:-2] & ~same[2:]  # not one of three
    one, other = owner[:-1], owner[1:]
    pair &= (names[1:] == names[:-1]).all(axis=1) & ~alone[one] & ~alone[other]
    return _joined(len(triangles), one[pair], other[pair])


def _joined(count: int, one: npt.NDArray[np.int64], other: npt.NDArray[np.int64]) -> npt.NDArray[np.int32]:
    """Returns the connected set, from 0, of each of `count` elements. one, other: the joined pairs."""
    label = np.arange(count)
    while (label[one] != label[other]).any():
        low = np.minimum(label[one], label[other])
        np.minimum.at(label, label[one], low)
        np.minimum.at(label, label[other], low)
        while (label != label[label]).any():
            label = label[label]
    return np.unique(label, return_inverse=True)[1].reshape(-1).astype(np.int32)


def _laid_flat(sides: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Returns triangles in the plane, (k, 3, 2), congruent to those on the surface. sides: (k, 2, 3), from
    the first corner."""
    a, b = sides[:, 0], sides[:, 1]
    length = lengths(a)
    safe = np.where(length > 0, length, 1.0)
    flat = np.zeros((len(sides), 3, 2))
    flat[:, 1, 0] = length
    flat[:, 2, 0] = (a * b).sum(axis=1) / safe
    flat[:, 2, 1] = np.where(length > 0, lengths(cross(a, b)) / safe, lengths(b))
    return flat


def _image_areas(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return doubled_areas_2d(corners) / 2

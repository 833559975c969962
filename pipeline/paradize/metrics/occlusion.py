"""The error of occlusion that was cast from a mesh, before it is stored, against brute force.

At a sample of texels, spread evenly over those whose centre a triangle covers, every triangle of the mesh
is laid over 12,868 directions in float64 (kernels/reference/occlusion.hpp): no tree, no rays, and nothing is
left out. Which triangles show at a texel, and where, is found again here. Shared with the stage: the mesh,
and what occlusion is: the share of the cosine-weighted light from above the triangle, begun LIFT above it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.data import rounded
from paradize.kernels.reference.occlusion import open_shares
from paradize.vectors import cross_2d

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Mesh

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    U32 = npt.NDArray[np.uint32]

LIFT = 1e-5  # of the diagonal
CELLS = 128
_WORK = 3e7  # pairs of a sample and a triangle
_LEAST, _MOST = 64, 1024  # samples
_PAIRS = 1 << 20  # of a triangle and a place that are tried at once
_GOLDEN = 0.6180339887498949


def cast_errors(
    values: F32, mesh: Mesh, on: U32, blocking: U32, *, reach: float, samples: int | None = None
) -> dict[str, float]:
    """cast_mean, cast_p99 and cast_max: differences from the true occlusion, 0..1, over sampled texels; none
    where no centre of a texel is covered.

    values: (h, w), what a stage made of the triangles `on` (k, 3). mesh, blocking, reach: as it was given.
    samples: places of texels at most; None: by the number of triangles.
    """
    if mesh.uvs is None or mesh.normals is None:
        raise ValueError("the mesh has no UVs or no normals")
    height, width = values.shape
    count = samples or int(min(_MOST, max(_LEAST, _WORK / max(1, len(blocking)))))
    flat = mesh.uvs[on].astype(np.float64) * [width, height]
    texels = _sample(flat, height, width, count)
    texel, triangle, weights = _some(*_places(flat, texels, height, width), count)
    if not len(texel):
        return {}
    wide = mesh.positions.astype(np.float64)
    middle = (wide.max(axis=0) + wide.min(axis=0)) / 2
    wide = wide - middle
    side = np.abs(wide).max()
    wide = wide / side
    points = wide / np.sqrt(((wide.max(axis=0) - wide.min(axis=0)) ** 2).sum())
    corners = points[on[triangle]]
    face = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    normal = _unit((mesh.normals[on[triangle]].astype(np.float64) * weights[:, :, None]).sum(axis=1))
    cosine = (normal * face).sum(axis=1, keepdims=True)
    normal, face = np.where(cosine == 0.0, face, normal), np.where(cosine < 0.0, -face, face)
    place = (corners * weights[:, :, None]).sum(axis=1) + LIFT * face
    shares = open_shares(place, normal, face, points[blocking], reach=reach, cells=CELLS)
    names, own = np.unique(texel, return_inverse=True)
    truth = np.bincount(own, shares) / np.bincount(own)
    off = np.sort(np.abs(values.reshape(-1)[names].astype(np.float64) - truth))
    p99 = off[min(len(off) - 1, int(np.ceil(0.99 * len(off))) - 1)]
    return {
        "cast_mean": rounded(float(off.mean())),
        "cast_p99": rounded(float(p99)),
        "cast_max": rounded(float(off[-1])),
    }


def _sample(flat: F64, height: int, width: int, count: int) -> npt.NDArray[np.int64]:
    """Texels (n, 2), column and row, spread over the triangles by their area on the map."""
    a, b, c = (flat[:, k] for k in range(3))
    area = np.abs(cross_2d(b - a, c - a))
    total = np.cumsum(area)
    if not len(total) or not total[-1] > 0.0:
        return np.empty((0, 2), np.int64)
    k = np.arange(count)
    triangle = np.searchsorted(total, (k + 0.5) / count * total[-1])
    u, v = (k * _GOLDEN) % 1.0, (k * _GOLDEN * _GOLDEN * 1.7) % 1.0
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    at = a[triangle] + u[:, None] * (b - a)[triangle] + v[:, None] * (c - a)[triangle]
    texels = np.floor(at).astype(np.int64) % [width, height]
    return np.unique(texels, axis=0)


def _places(
    flat: F64, texels: npt.NDArray[np.int64], height: int, width: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], F64]:
    """The flat index of each texel whose centre a triangle covers, that triangle, and the weights (n, 3) of
    its corners."""
    shift = np.floor(flat.mean(axis=1) / [width, height]) * [width, height]  # to the tile that is drawn
    a, b, c = (flat[:, k] - shift for k in range(3))
    whole = cross_2d(b - a, c - a)
    usable = np.flatnonzero(whole != 0.0)
    a, b, c, whole = a[usable], b[usable], c[usable], whole[usable]
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    left, top = low.min(axis=0, initial=0.0)
    right_most, bottom = high.max(axis=0, initial=0.0)
    tiles = [
        (right * width, down * height)
        for right, down in _TILES
        if left < (right + 1) * width and right * width < right_most
        if top < (down + 1) * height and down * height < bottom
    ]
    column, row = texels[:, :1], texels[:, 1:]
    right, down = np.array(tiles, np.float64).reshape(-1, 2).T
    x, y = (column + 0.5 + right).reshape(-1), (row + 0.5 + down).reshape(-1)
    texel = np.repeat(row * width + column, len(tiles))
    order = np.argsort(x, kind="stable")
    first = np.searchsorted(x[order], low[:, 0])
    last = np.searchsorted(x[order], high[:, 0], side="right")
    found: list[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], F64]] = []
    # Of each triangle, the places between its ends in x: some million at once, however wide triangles are.
    for some in np.split(np.arange(len(a)), np.flatnonzero(np.diff(np.cumsum(last - first) // _PAIRS)) + 1):
        count = (last - first)[some]
        k = np.repeat(some, count)
        at = order[np.arange(len(k)) - np.repeat(np.cumsum(count) - count - first[some], count)]
        near = (low[k, 1] <= y[at]) & (y[at] <= high[k, 1])
        k, at = k[near], at[near]
        p = np.stack([x[at], y[at]], axis=1)
        second = cross_2d(p - a[k], c[k] - a[k]) / whole[k]
        third = cross_2d(b[k] - a[k], p - a[k]) / whole[k]
        weights = np.stack([1.0 - second - third, second, third], axis=1)
        inside = (weights >= 0.0).all(axis=1)
        found.append((at[inside], usable[k[inside]], weights[inside]))
    place, triangle, weights = (np.concatenate(parts) for parts in zip(*found, strict=True))
    by_place = np.lexsort((triangle, place))
    return texel[place[by_place]], triangle[by_place], weights[by_place]


def _some(
    texel: npt.NDArray[np.int64], triangle: npt.NDArray[np.int64], weights: F64, most: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], F64]:
    """The places of some of the texels, spread evenly: together at most `most`, but at least one texel's. A
    texel of a layout that overlaps may have thousands."""
    names, own, counts = np.unique(texel, return_inverse=True, return_counts=True)
    order = np.argsort(np.arange(len(names)) * _GOLDEN % 1.0, kind="stable")
    kept = np.zeros(len(names), np.bool_)
    kept[order[: max(1, int(np.searchsorted(np.cumsum(counts[order]), most, side="right")))]] = True
    mask = kept[own]
    return texel[mask], triangle[mask], weights[mask]


_TILES = [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)]  # a triangle may cross the map's edge


def _unit(vectors: F64) -> F64:
    largest = np.abs(vectors).max(axis=1, keepdims=True)
    scaled = vectors / np.where(largest > 0.0, largest, 1.0)
    length = np.sqrt((scaled * scaled).sum(axis=1, keepdims=True))
    return np.asarray(scaled / np.where(length > 0.0, length, 1.0))

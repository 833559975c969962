"""The terrain of an exported scene from above: heights on a grid of texels, and colours that follow from
them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Mesh

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    U32 = npt.NDArray[np.uint32]

GROUND_TEXELS = 2048  # a side of the terrain's picture, at least; more if the effect map has more
_AT_ONCE = 1 << 17  # texels tested in one batch: a megabyte of each value, which a cache holds
_EDGE = 1e-6  # of a triangle: a texel on its edge belongs to it


def heights_of(uvs: F32, heights: F32, triangles: U32, shape: tuple[int, int]) -> F32:
    """(h, w) float32: the height at each texel's centre. uvs (n, 2) over the whole grid, top-left origin;
    heights (n,); triangles (m, 3). Texels that no triangle covers are NaN."""
    rows, columns = shape
    out = np.full(shape, np.nan, np.float32)
    # Corners in texels from the first centre.
    x = (uvs[:, 0].astype(np.float64) * columns - 0.5)[triangles]
    y = (uvs[:, 1].astype(np.float64) * rows - 0.5)[triangles]
    z = heights.astype(np.float64)[triangles]
    left, top = (np.maximum(np.ceil(v.min(axis=1) - _EDGE), 0).astype(np.int64) for v in (x, y))
    right = np.minimum(np.floor(x.max(axis=1) + _EDGE), columns - 1).astype(np.int64)
    bottom = np.minimum(np.floor(y.max(axis=1) + _EDGE), rows - 1).astype(np.int64)
    span = np.maximum(right - left, bottom - top) + 1
    span[(right < left) | (bottom < top)] = 0
    side = 1
    while (span >= side).any():  # triangles of similar size together: each tests side x side texels
        chosen = np.flatnonzero((span >= side) & (span < 2 * side))
        step = max(1, _AT_ONCE // (4 * side * side))
        for first in range(0, len(chosen), step):
            part = chosen[first : first + step]
            _draw(out, x[part], y=y[part], z=z[part], left=left[part], top=top[part], side=2 * side - 1)
        side *= 2
    return out


def _draw(
    out: F32, x: F64, y: F64, z: F64, left: npt.NDArray[np.int64], top: npt.NDArray[np.int64], side: int
) -> None:
    """Writes the heights of triangles (m, 3) whose boxes begin at left, top and are at most `side` texels
    wide."""
    offsets = np.arange(side)
    i = left[:, None, None] + offsets[None, None, :]
    j = top[:, None, None] + offsets[None, :, None]
    ax, bx, cx = (x[:, k, None, None] for k in range(3))
    ay, by, cy = (y[:, k, None, None] for k in range(3))
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    area = np.where(area == 0.0, np.inf, area)  # a sliver without area covers nothing
    b = ((i - ax) * (cy - ay) - (cx - ax) * (j - ay)) / area
    c = ((bx - ax) * (j - ay) - (i - ax) * (by - ay)) / area
    inside = (b >= -_EDGE) & (c >= -_EDGE) & (b + c <= 1.0 + _EDGE) & np.isfinite(area)
    inside &= (i < out.shape[1]) & (j < out.shape[0])
    za, zb, zc = (z[:, k, None, None] for k in range(3))
    value = za + b * (zb - za) + c * (zc - za)
    i, j = np.broadcast_arrays(i, j)
    out[j[inside], i[inside]] = value[inside]


def at_least(shape: tuple[int, ...]) -> tuple[int, int]:
    """A shape, not smaller than GROUND_TEXELS."""
    return max(GROUND_TEXELS, shape[0]), max(GROUND_TEXELS, shape[1])


def terrain_heights(meshes: list[Mesh], shape: tuple[int, int]) -> F32:
    """Metres at each texel of a picture of the whole terrain; the lowest height where no mesh covers it."""
    heights = np.full(shape, np.nan, np.float32)
    for mesh in meshes:
        assert mesh.uvs1 is not None
        drawn = heights_of(mesh.uvs1, mesh.positions[:, 1], mesh.triangles, shape)
        heights = np.where(np.isnan(drawn), heights, drawn)
    return np.nan_to_num(heights, nan=float(np.nanmin(heights)))


def smoothstep(values: F32, low: float, high: float) -> F32:
    """GLSL's smoothstep; a step if low equals high."""
    x = np.clip((values - low) / max(high - low, 1e-6), 0.0, 1.0)
    out: F32 = (x * x * (3.0 - 2.0 * x)).astype(np.float32)
    return out


def under_water(light: F32, heights: F32, water: dict[str, Any]) -> F32:
    """The terrain's colour (h, w, 3) as seen through the water: absorbed on the way down and up again."""
    depth = np.maximum(water["level_m"] - heights, 0.0)[:, :, None]
    through = np.exp(-2.0 * depth * np.array(water["absorption_per_m"], np.float32))
    out: F32 = (light * through + np.array(water["deep_color"], np.float32) * (1.0 - through)).astype(
        np.float32
    )
    return out

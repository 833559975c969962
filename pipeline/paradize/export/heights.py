"""The terrain of an exported scene from above: heights on a grid of texels, and colours that follow from
them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.preview.raster import covered_pixels

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Mesh

    F32 = npt.NDArray[np.float32]
    U32 = npt.NDArray[np.uint32]

GROUND_TEXELS = 2048  # a side of the terrain's picture, at least; more if the effect map has more


def heights_of(uvs: F32, heights: F32, triangles: U32, shape: tuple[int, int]) -> F32:
    """(h, w) float32: the height at each texel's centre. uvs (n, 2) over the whole grid, top-left origin;
    heights (n,); triangles (m, 3). Texels that no triangle covers are NaN."""
    rows, columns = shape
    out = np.full(shape, np.nan, np.float32)
    # Corners in texels from the first centre.
    x = (uvs[:, 0].astype(np.float64) * columns - 0.5)[triangles.T]
    y = (uvs[:, 1].astype(np.float64) * rows - 0.5)[triangles.T]
    z = heights.astype(np.float64)[triangles.T]
    for texels, owners, b, c in covered_pixels(x, y, shape):
        za, zb, zc = z[:, owners]
        out.flat[texels] = za + b * (zb - za) + c * (zc - za)
    return out


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

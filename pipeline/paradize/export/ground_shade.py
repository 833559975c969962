"""Shades the ground as the player's terrain shader does (shaders/terrain.frag): the contrast of grains, broad
and faint changes of tone, wet sand."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.export.heights import smoothstep
from paradize.vectors import dot

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    U32 = npt.NDArray[np.uint32]

_FACTOR, _STEP, _HALF = np.uint32(1664525), np.uint32(1013904223), np.uint32(16)
_WET_TINT = np.array([0.92, 1.0, 1.08], np.float32)
_CONTRAST = np.float32(0.45)
_SHORE_M = 0.15  # down to this depth sand looks wet


def contrasted(light: F32) -> F32:
    """The sand (h, w, 3), linear, with the contrast that its grains have close to the eye. From
    farther away it makes no difference, because grains blend there."""
    shares = np.array([0.2126, 0.7152, 0.0722], np.float32)
    luminance = dot(light, shares)
    grain = np.clip(luminance / max(float(luminance.mean()), 1e-3), 0.5, 1.6)
    out: F32 = light * (np.float32(1.0) + _CONTRAST * (grain - np.float32(1.0)))[..., None]
    return out


def tone_of(size_m: tuple[float, float], shape: tuple[int, int]) -> F32:
    """(h, w): the tone at each texel of a picture of the whole terrain. size_m: along x and z."""
    rows, columns = (
        ((np.arange(n) + 0.5) / n - 0.5) * size for n, size in zip(shape, size_m[::-1], strict=True)
    )
    return value_noise(columns * 0.11, rows * 0.11) + np.float32(0.5) * value_noise(
        columns * 0.37 + 19.0, rows * 0.37 + 19.0
    )


def toned(light: F32, tone: F32) -> F32:
    """Colours (h, w, 3) with broad, faint changes, which hide the sand's repeats."""
    return light * (np.float32(0.93) + np.float32(0.09) * tone)[..., None]


def wetted(light: F32, tone: F32, heights: F32, terrain: dict[str, Any], level_m: float) -> F32:
    """Colours (h, w, 3) of ground that is darker where it is wet: above the water, and just below it."""
    high = terrain["wet_high_m"]
    above = heights - np.float32(level_m) + np.float32(0.25 * high) * (tone - np.float32(0.75))
    wet = terrain["wet_darkness"] * (1.0 - smoothstep(above, 0.35 * high, high))
    wet = wet * (1.0 - smoothstep(np.float32(level_m) - heights, 0.0, _SHORE_M))
    out: F32 = light * (np.float32(1.0) - wet[..., None].astype(np.float32) * _WET_TINT)
    return out


def value_noise(x: F64, y: F64) -> F32:
    """(len(y), len(x)), 0..1: random values at whole numbers, between them by a polynomial of degree 5: K.
    Perlin, "Improving Noise", SIGGRAPH 2002. As value_noise of shaders/lib/hash.glsl."""
    cells, weights = [], []
    for places in (x, y):
        base = np.floor(places)
        f = places - base
        cells.append(base.astype(np.int64))
        weights.append(f * f * f * (f * (f * 6.0 - 15.0) + 10.0))
    (column, row), (across, down) = cells, weights
    low, high = (
        _hash(column, row + k) * (1.0 - across) + _hash(column + 1, row + k) * across for k in (0, 1)
    )
    noise: F32 = (low * (1.0 - down[:, None]) + high * down[:, None]).astype(np.float32)
    return noise


def _hash(column: npt.NDArray[np.int64], row: npt.NDArray[np.int64]) -> F64:
    """(rows, columns), 0..1: PCG2D of M. Jarzynski, M. Olano, "Hash Functions for GPU Rendering", JCGT 9(3),
    2020, of 32-bit cells. Each cell is hashed once."""
    (left, from_left), (top, from_top) = (
        np.unique(cell.astype(np.uint32), return_inverse=True) for cell in (column, row)
    )
    x, y = np.broadcast_arrays(left[None, :] * _FACTOR + _STEP, top[:, None] * _FACTOR + _STEP)
    for _ in range(2):
        x = x + y * _FACTOR
        y = y + x * _FACTOR
        x, y = x ^ (x >> _HALF), y ^ (y >> _HALF)
    values = (x >> np.uint32(8)).astype(np.float64) / float(1 << 24)
    found: F64 = values[from_top[:, None], from_left[None, :]]
    return found

"""Painting for the models' atlases: smooth noise on arrays of points, blending, and filling around islands.

The noise is value noise on a hashed lattice with Ken Perlin's quintic (Improving Noise, 2002). Unlike that of
noise.py it can repeat and is defined at any points. Colours are sRGB-encoded, 0..1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from noise import hash_u32
from picture import hex_color

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


def hash01(x: NDArray[np.int64], y: NDArray[np.int64], seed: int) -> Floats:
    """Uniform numbers in [0, 1) that depend only on the integers x, y and the seed."""
    return np.asarray(hash_u32(x, y, seed) / np.float64(2**32))


def rand(index: int, seed: int) -> float:
    """One uniform number in [0, 1): the `index`-th of the stream `seed`."""
    return float(hash01(np.array([index]), np.array([7919]), seed)[0])


def noise(x: Floats, y: Floats, seed: int, period_x: int = 0, period_y: int = 0) -> Floats:
    """Value noise in [-1, 1] at points x, y, with cells of width 1. It repeats after `period` cells, if
    given."""
    ix, iy = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    fx, fy = x - ix, y - iy
    fx = fx * fx * fx * (fx * (fx * 6.0 - 15.0) + 10.0)
    fy = fy * fy * fy * (fy * (fy * 6.0 - 15.0) + 10.0)

    def at(i: NDArray[np.int64], j: NDArray[np.int64]) -> Floats:
        return hash01(i % period_x if period_x else i, j % period_y if period_y else j, seed)

    top = at(ix, iy) * (1.0 - fx) + at(ix + 1, iy) * fx
    bottom = at(ix, iy + 1) * (1.0 - fx) + at(ix + 1, iy + 1) * fx
    return 2.0 * (top * (1.0 - fy) + bottom * fy) - 1.0


def fbm(
    x: Floats, y: Floats, seed: int, octaves: int, period_x: int = 0, period_y: int = 0, gain: float = 0.5
) -> Floats:
    """Sum of octaves, each with twice the frequency and `gain` times the amplitude; about [-1, 1]."""
    total, weight, scale, amount = np.zeros_like(x), 0.0, 1, 1.0
    for octave in range(octaves):
        total += amount * noise(x * scale, y * scale, seed + 101 * octave, period_x * scale, period_y * scale)
        weight += amount
        scale, amount = scale * 2, amount * gain
    return total / weight


def mix(a: Floats, b: Floats, amount: Floats | float) -> Floats:
    """Blends colours (..., 3) by `amount` (...), 0: a, 1: b."""
    t = np.asarray(amount)[..., None]
    return a * (1.0 - t) + b * t


def ramp(colors: list[str], t: Floats) -> Floats:
    """A gradient through evenly spaced colours; t is clamped to 0..1."""
    table = np.array([hex_color(code) for code in colors])
    s = np.clip(t, 0.0, 1.0) * (len(colors) - 1)
    i = np.minimum(s.astype(np.int64), len(colors) - 2)
    f = (s - i)[..., None]
    return table[i] * (1.0 - f) + table[i + 1] * f


def halve(image: Floats) -> Floats:
    """(2h, 2w, ...) -> (h, w, ...): the mean of each 2 x 2 block."""
    return (image[0::2, 0::2] + image[1::2, 0::2] + image[0::2, 1::2] + image[1::2, 1::2]) * 0.25


def dilate(image: Floats, known: Mask) -> Floats:
    """Fills unknown pixels of (h, w, c) from the known pixels around them, smoother with distance.

    Pull-push: averages known pixels into ever coarser levels, then fills unknown pixels from the coarser
    level (Gortler et al., The Lumigraph, 1996, section 3.4.1).
    """
    height, width = known.shape
    if known.all() or min(height, width) < 2 or height % 2 or width % 2:
        fallback = image[known].mean(axis=0) if known.any() else np.zeros(image.shape[2])
        return np.where(known[..., None], image, fallback)
    weight = halve(known.astype(np.float64)[..., None])
    coarse = halve(image * known[..., None]) / np.maximum(weight, 1e-9)
    filled = dilate(coarse, weight[..., 0] > 0.0)
    fine = filled.repeat(2, axis=0).repeat(2, axis=1)
    return np.where(known[..., None], image, fine)

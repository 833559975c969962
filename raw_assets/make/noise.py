"""Deterministic noise for the island's sources: integer hashes, lattices, spectra. It uses no clock and no
global random state.

All functions are pure. The same call gives the same numbers on every machine, up to the last bits of sin, exp
and the FFT, which are far below one step of an 8 or 16 bit image.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def hash_u32(
    x: NDArray[np.integer] | int, y: NDArray[np.integer] | int = 0, seed: int = 0
) -> NDArray[np.uint32]:
    """A well-mixed 32-bit hash of integer coordinates.

    x, y : integers of any shape that broadcast together; negative ones wrap modulo 2**32
    Mixer: C. Wellons, "Prospecting for Hash Functions", 2018 (the two-round multiply-xorshift with low bias).
    """
    h = np.asarray(x).astype(np.int64).astype(np.uint32)
    v = np.asarray(y).astype(np.int64).astype(np.uint32)
    h = h * np.uint32(0x9E3779B1) + v * np.uint32(0x85EBCA77) + np.uint32((seed * 0xC2B2AE3D) & 0xFFFFFFFF)
    for _ in range(2):
        h = h ^ (h >> np.uint32(16))
        h = h * np.uint32(0x7FEB352D)
        h = h ^ (h >> np.uint32(15))
        h = h * np.uint32(0x846CA68B)
        h = h ^ (h >> np.uint32(16))
    return h


def uniform(shape: tuple[int, ...], seed: int) -> Array:
    """White noise, float64 in [0, 1), of the shape given."""
    count = 1
    for n in shape:
        count *= n
    return (hash_u32(np.arange(count), 0, seed) / np.float64(2**32)).reshape(shape)


def normal(shape: tuple[int, ...], seed: int) -> Array:
    """White noise, mean 0, variance 1, nearly normal: a sum of four uniforms (Irwin-Hall), float64."""
    total = sum((uniform(shape, seed * 4 + i) for i in range(4)), np.zeros(shape))
    return np.asarray((total - 2.0) * np.sqrt(3.0))


def gradient_noise(x: Array, y: Array, seed: int) -> Array:
    """Gradient noise at any point, about [-1, 1], lattice spacing 1, twice differentiable.

    x, y : arrays of one shape. Source: K. Perlin, "Improving Noise", 2002; here with hashed gradients on a
    circle.
    """
    ix, iy = np.floor(x), np.floor(y)
    fx, fy = x - ix, y - iy
    ix, iy = ix.astype(np.int64), iy.astype(np.int64)
    corners = []
    for dy in (0, 1):
        for dx in (0, 1):
            angle = hash_u32(ix + dx, iy + dy, seed) * (2.0 * np.pi / 2**32)
            corners.append(np.cos(angle) * (fx - dx) + np.sin(angle) * (fy - dy))
    wx, wy = fx * fx * fx * (fx * (fx * 6 - 15) + 10), fy * fy * fy * (fy * (fy * 6 - 15) + 10)
    low = corners[0] + (corners[1] - corners[0]) * wx
    high = corners[2] + (corners[3] - corners[2]) * wx
    return np.asarray((low + (high - low) * wy) * 1.5)


def fbm(x: Array, y: Array, seed: int, octaves: int, gain: float = 0.5) -> Array:
    """Fractal sum of gradient noise, about [-1, 1]. Each octave is rotated, so that the lattices do not
    align."""
    total, amplitude, norm = np.zeros(np.broadcast(x, y).shape), 1.0, 0.0
    for octave in range(octaves):
        total += amplitude * gradient_noise(x + 17.3 * octave, y - 9.1 * octave, seed + 101 * octave)
        norm += amplitude
        x, y = 1.62 * x - 1.19 * y, 1.19 * x + 1.62 * y  # rotation by 36 degrees and scale by 2.01
        amplitude *= gain
    return np.asarray(total / norm)


def spline_weights(points: int, cells: int, *, wrap: bool) -> Array:
    """Cubic B-spline weights from a lattice to a row of pixels: (points, cells or cells + 3)."""
    position = np.arange(points) * (cells / points if wrap else cells / max(points - 1, 1))
    first = np.minimum(np.floor(position).astype(np.int64), cells - 1)
    t = position - first
    taps = ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3)
    weights = np.zeros((points, cells if wrap else cells + 3))
    for i, tap in enumerate(taps):
        column = (first + i - 1) % cells if wrap else first + i
        np.add.at(weights, (np.arange(points), column), tap / 6.0)
    return weights


def lattice_noise(shape: tuple[int, ...], cells: tuple[int, ...], seed: int, *, wrap: bool = True) -> Array:
    """Smooth noise on a grid of 2 or 3 axes, mean about 0, deviation about 1; periodic when wrap is set.

    shape : pixels per axis; cells : lattice cells per axis. Interpolates a random lattice by cubic B-splines.
    """
    field = normal(tuple(c if wrap else c + 3 for c in cells), seed)
    for axis, (points, count) in enumerate(zip(shape, cells, strict=True)):
        field = np.moveaxis(np.tensordot(spline_weights(points, count, wrap=wrap), field, (1, axis)), 0, axis)
    return np.asarray(field * (1.43 ** len(shape)))


def lattice_fbm(
    shape: tuple[int, ...], cells: tuple[int, ...], seed: int, octaves: int, gain: float
) -> Array:
    """Periodic fractal sum of lattice_noise, deviation about 1; lacunarity 2."""
    total, amplitude, power = np.zeros(shape), 1.0, 0.0
    for octave in range(octaves):
        finer = tuple(c * 2**octave for c in cells)
        total += amplitude * lattice_noise(shape, finer, seed + 31 * octave)
        power += amplitude * amplitude
        amplitude *= gain
    return np.asarray(total / np.sqrt(power))


def spectral_noise(
    size: int, weight: Callable[[Array, Array], Array], seed: int
) -> NDArray[np.complexfloating]:
    """Periodic complex noise with a given spectrum: (size, size) complex64, standard deviation 1.

    weight : amplitude for wave numbers (kx, ky) in cycles per tile, integers from -size/2 to size/2 - 1.
    If the weight is zero on one half plane, the argument of the result is the phase of the waves.
    """
    k = np.fft.fftfreq(size, 1.0 / size)
    kx, ky = k[None, :], k[:, None]
    white = (normal((size, size), seed) + 1j * normal((size, size), seed + 1)).astype(np.complex64)
    field = np.fft.ifft2(white * weight(kx, ky).astype(np.float32))
    return np.asarray(field / np.sqrt(np.mean(np.square(field.real))))


def smoothstep(low: float, high: float, x: Array) -> Array:
    """0 below low, 1 above high, smooth between them. low > high gives a falling edge."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def blur(field: Array, radius: float, *, wrap: bool = True) -> Array:
    """Gaussian blur of a 2D field. radius is the standard deviation in pixels; borders wrap or are
    clamped."""
    reach = max(1, int(np.ceil(3.0 * radius)))
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / radius) ** 2)
    taps /= taps.sum()
    for axis in (0, 1):
        pad = [(reach, reach) if a == axis else (0, 0) for a in (0, 1)]
        wide = np.pad(field, pad, mode="wrap" if wrap else "edge")
        length = field.shape[axis]
        parts = [tap * np.take(wide, range(i, i + length), axis) for i, tap in enumerate(taps)]
        field = np.sum(parts, axis=0)
    return np.asarray(field)

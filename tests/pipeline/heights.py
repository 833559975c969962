"""Heights, normals and picture files that tests of maps share."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from paradize.data import HeightMap
from paradize.kernels.normals import THREADS
from paradize.stages.normal import normal_rows

FILTERS = ("central", "scharr", "fourth")


def normals(
    heights: np.ndarray,
    *,
    scale: tuple[float, float] = (1.0, 1.0),
    filter_name: str = "fourth",
    wrap: tuple[bool, bool] = (False, False),
    green_down: bool = False,
    islands: np.ndarray | None = None,
) -> np.ndarray:
    rows = np.ascontiguousarray(heights, np.float32)
    ground = HeightMap(rows, scale, wrap, filter_name, green_down, islands)
    return normal_rows(ground, 0, len(rows), threads=THREADS)


def waves(rows: int, columns: int, seed: int, wavelength: float = 12.0) -> np.ndarray:
    """Smooth periodic heights of a few sinusoids whose wavelengths are whole parts of the size, not below
    `wavelength`."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:rows, 0:columns]
    heights = np.zeros((rows, columns))
    for _ in range(6):
        kx = rng.integers(-columns // wavelength, columns // wavelength + 1)
        ky = rng.integers(-rows // wavelength, rows // wavelength + 1)
        heights += np.sin(2 * np.pi * (kx * x / columns + ky * y / rows) + rng.random() * 6)
    return heights.astype(np.float32)


def sinusoids(
    size: int, shortest: float, longest: float, seed: int, *, rms_slope: float = 1.0, count: int = 40
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heights (size, size) of `count` periodic sinusoids of such wavelengths in texels, and their true slopes
    along x and down y, float64. Every sinusoid is as steep; together they have the slope given."""
    rng = np.random.default_rng(seed)
    spectrum = np.zeros((size, size), np.complex128)
    for _ in range(count):
        wavelength, angle = rng.uniform(shortest, longest), rng.uniform(0, 2 * np.pi)
        kx, ky = (int(np.rint(size / wavelength * f(angle))) for f in (np.cos, np.sin))
        kx = kx or int(ky == 0)
        amplitude = rms_slope / (np.hypot(kx, ky) * 2 * np.pi / size * np.sqrt(count / 2))
        spectrum[ky % size, kx % size] += size * size * amplitude * np.exp(1j * rng.uniform(0, 2 * np.pi))
    k = np.fft.fftfreq(size) * 2 * np.pi
    parts = (spectrum, 1j * k[None, :] * spectrum, 1j * k[:, None] * spectrum)
    heights, dx, dy = (np.fft.ifft2(part).real for part in parts)
    return heights, dx, dy


def rounded(heights: np.ndarray, bits: int) -> tuple[np.ndarray, float]:
    """Heights as a file of so many bits holds them, 0..1 float32, and how high 1 stands."""
    low, span = heights.min(), heights.max() - heights.min()
    unit = (heights - low) / span
    top = 2.0**bits - 1
    return (unit if bits == 32 else np.rint(unit * top) / top).astype(np.float32), float(span)


def up(dx: np.ndarray, dy: np.ndarray) -> np.ndarray:
    """Unit normals (h, w, 3) float64, green up, of slopes along x and down y."""
    vectors = np.dstack([-dx, dy, np.ones_like(dx)])
    return vectors / np.sqrt((vectors * vectors).sum(axis=2, keepdims=True))


def angles_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Degrees between unit vectors (..., 3), right for small ones too."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    apart, together = (np.sqrt(np.einsum("...k,...k", v, v)) for v in (a - b, a + b))
    return np.degrees(2 * np.arctan2(apart, together))


def save(path: Path, pixels: np.ndarray, kind: object = oiio.UINT8) -> Path:
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    assert target.write_image(np.ascontiguousarray(pixels))
    assert target.close()
    return path

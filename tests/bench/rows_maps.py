"""Normals and mips beside numpy and OpenImageIO."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from paradize.kernels import maps
from paradize.stages.mips import color_mips
from row import Row, median_ms


def waves(size: int) -> tuple[np.ndarray, np.ndarray]:
    """A periodic field of 40 sinusoids of 8 to 64 texels, and its exact unit normals in float64."""
    rng = np.random.default_rng(7)
    x = np.arange(size) / size * 2 * np.pi
    heights = np.zeros((size, size))
    slope_x, slope_y = np.zeros_like(heights), np.zeros_like(heights)
    for _ in range(40):
        wavelength = 2 ** rng.uniform(3, 6)
        angle, phase = rng.uniform(0, 2 * np.pi, 2)
        kx, ky = np.round(size / wavelength * np.array([np.cos(angle), np.sin(angle)]))
        amplitude = wavelength / (2 * np.pi) / np.sqrt(20)
        inside = kx * x[None, :] + ky * x[:, None] + phase
        heights += amplitude * np.sin(inside)
        slope_x += amplitude * kx * 2 * np.pi / size * np.cos(inside)
        slope_y += amplitude * ky * 2 * np.pi / size * np.cos(inside)
    normals = np.stack([-slope_x, slope_y, np.ones_like(heights)], axis=2)
    return heights.astype(np.float32), normals / np.linalg.norm(normals, axis=2, keepdims=True)


def degrees(a: np.ndarray, b: np.ndarray) -> str:
    cross = np.linalg.norm(np.cross(a.astype(np.float64), b), axis=2)
    angle = np.degrees(np.arctan2(cross, (a * b).sum(axis=2)))
    return f"mean {angle.mean():.3f}, p99 {np.percentile(angle, 99):.3f} deg"


def bench_normals(runs: int) -> Row:
    size = 2048
    heights, exact = waves(size)

    def numpy_central() -> np.ndarray:
        dx = (np.roll(heights, -1, 1) - np.roll(heights, 1, 1)) * 0.5
        dy = (np.roll(heights, -1, 0) - np.roll(heights, 1, 0)) * 0.5
        normals = np.stack([-dx, dy, np.ones_like(heights)], axis=2)
        return normals / np.sqrt((normals * normals).sum(axis=2, keepdims=True))

    def ours() -> np.ndarray:
        return maps.normals_from_heights(heights, scale=(1.0, 1.0), filter_name="fourth", wrap=(True, True))

    times = median_ms(ours, runs), median_ms(numpy_central, runs)
    return Row(
        f"normals from heights, {size}^2 float", times[0], "numpy, central differences", times[1],
        degrees(ours(), exact), degrees(numpy_central(), exact),
    )  # fmt: skip


def bench_mips(runs: int) -> Row:
    size = 2048
    rng = np.random.default_rng(3)
    linear = rng.random((size, size, 3), dtype=np.float32)
    image = oiio.ImageBuf(linear)

    def peer() -> oiio.ImageBuf:
        level, side = image, size
        while side > 1:
            side //= 2
            level = oiio.ImageBufAlgo.resize(level, filtername="box", roi=oiio.ROI(0, side, 0, side))
        return level

    exact = linear.astype(np.float64).mean(axis=(0, 1))
    ours_error = np.abs(color_mips(linear)[-1].reshape(-1)[:3] - exact).max()
    peer_error = np.abs(peer().get_pixels(oiio.FLOAT).reshape(-1)[:3] - exact).max()
    times = median_ms(lambda: color_mips(linear), runs), median_ms(peer, max(1, runs // 3))
    return Row(
        f"linear mip chain, {size}^2 RGB float", times[0], "OpenImageIO resize, box", times[1],
        f"last level off by {ours_error:.1e}", f"{peer_error:.1e}",
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    yield bench_normals(runs)
    yield bench_mips(runs)

"""Normals of heights in memory, as `paradize maps` makes them: beside OpenCV, numpy and a plain copy.

Both sides write a fresh array of float32: its pages cost as much as the work.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from paradize.kernels.normals import normals_from_heights
from paradize.stages.filters import choose_filter, taps_of
from paradize.tiers import TIERS
from row import CORES, Row, Trade, on, pair_ms

SIZE = 4096
CENTRAL, FOURTH = [1 / 2], [2 / 3, -1 / 12]


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
        along, down = np.exp(1j * (kx * x + phase)), np.exp(1j * ky * x)
        wave = np.multiply.outer(down, amplitude * along)  # its imaginary part is the sine
        heights += wave.imag
        slope_x += wave.real * (kx * 2 * np.pi / size)
        slope_y += wave.real * (ky * 2 * np.pi / size)
    normals = np.stack([-slope_x, slope_y, np.ones_like(heights)], axis=2)
    return heights.astype(np.float32), normals / np.linalg.norm(normals, axis=2, keepdims=True)


def degrees(normals: np.ndarray, exact: np.ndarray) -> tuple[float, str]:
    """The mean angle, and what is told."""
    a = normals.astype(np.float64)
    cross = np.linalg.norm(np.cross(a, exact), axis=2)
    angle = np.degrees(np.arctan2(cross, (a * exact).sum(axis=2)))
    return angle.mean(), f"mean {angle.mean():.4f}, p99 {np.percentile(angle, 99):.3f} deg"


def slopes(heights: np.ndarray, taps: list[float], out: tuple[np.ndarray, np.ndarray]) -> None:
    """Differences along x and down y by OpenCV: of one pair of taps as its Sobel filter, which smooths across
    them, of two pairs as a row and a column of taps."""
    edge = cv2.BORDER_REFLECT_101
    for axis, (into, sign) in enumerate(zip(out, (-1, 1), strict=True)):
        if taps == CENTRAL:
            cv2.Sobel(heights, cv2.CV_32F, 1 - axis, axis, dst=into, ksize=3, scale=sign / 8, borderType=edge)
        else:
            row = np.array([*(-tap for tap in reversed(taps)), 0, *taps], np.float32) * sign
            one = np.ones(1, np.float32)
            pair = (one, row) if axis else (row, one)
            cv2.sepFilter2D(heights, cv2.CV_32F, *pair, dst=into, borderType=edge)


class OpenCv:
    """Unit normals with OpenCV's own operations alone: the planes between are made beforehand."""

    def __init__(self, heights: np.ndarray, taps: list[float]) -> None:
        self.heights, self.taps = heights, taps
        self.x, self.y, self.z, self.one = (np.empty(heights.shape, np.float32) for _ in range(4))
        self.one[:] = 1

    def __call__(self) -> np.ndarray:
        slopes(self.heights, self.taps, (self.x, self.y))
        cv2.multiply(self.x, self.x, dst=self.z)
        cv2.accumulateSquare(self.y, self.z)
        cv2.add(self.z, 1.0, dst=self.z)
        cv2.sqrt(self.z, dst=self.z)
        cv2.divide(self.x, self.z, dst=self.x)
        cv2.divide(self.y, self.z, dst=self.y)
        cv2.divide(self.one, self.z, dst=self.z)
        return cv2.merge([self.x, self.y, self.z])


def bench_heights(runs: int, heights: np.ndarray, exact: np.ndarray) -> Iterator[Row]:
    cv2.setNumThreads(2)
    wrap = (True, True)

    def ours(tier: str = "balanced") -> np.ndarray:
        taps = taps_of(choose_filter(heights, 32, wrap, tier))
        given = {"derivative": taps.derivative, "smooth": taps.smooth, "scale": (1.0, 1.0), "wrap": wrap}
        return normals_from_heights(heights, **given, threads=2)

    work = f"normals, {SIZE}^2 float -> float, 2 threads"
    features = cv2.getCPUFeaturesLine().split()[-1].strip("*?")
    for taps, name in ((FOURTH, "fourth-order taps"), (CENTRAL, "Sobel")):
        peer = OpenCv(heights, taps)
        theirs, their_error = degrees(peer(), exact)
        for tier in TIERS:
            times = pair_ms(partial(ours, tier), peer, runs)
            mean, error = degrees(ours(tier), exact)
            yield Row(
                work, times[0], f"OpenCV's own operations, {name}", times[1], f"{tier}, {error}",
                their_error, inside="heights in memory to a fresh array of float32", ours_on=on(2),
                peer_on=on(2, f"OpenCV's choice up to {features}"),
                trade=Trade("Normal maps: 4096 x 4096 float heights, mean angle", tier,
                            f"OpenCV, {name.removesuffix(' taps')}", mean, theirs),
            )  # fmt: skip

    error = degrees(ours(), exact)[1]
    times = pair_ms(ours, lambda: np.stack([heights] * 3, axis=2), runs)
    yield Row(
        work, times[0], "numpy, the heights three times, interleaved", times[1], error, "-",
        inside="as many bytes written", ours_on=on(2), peer_on=on(1),
    )  # fmt: skip


def bench_numpy(runs: int) -> Row:
    size = 2048
    heights, exact = waves(size)

    def numpy_central() -> np.ndarray:
        dx = (np.roll(heights, -1, 1) - np.roll(heights, 1, 1)) * 0.5
        dy = (np.roll(heights, -1, 0) - np.roll(heights, 1, 0)) * 0.5
        normals = np.stack([-dx, dy, np.ones_like(heights)], axis=2)
        return normals / np.sqrt((normals * normals).sum(axis=2, keepdims=True))

    def ours() -> np.ndarray:
        return normals_from_heights(heights, derivative=CENTRAL, scale=(1.0, 1.0), wrap=(True, True))

    times = pair_ms(ours, numpy_central, runs)
    return Row(
        f"normals, {size}^2 float -> float, fresh arrays", times[0], "numpy, central differences", times[1],
        f"central, {degrees(ours(), exact)[1]}", degrees(numpy_central(), exact)[1],
        inside="heights in memory to fresh arrays of float32", ours_on=on(CORES), peer_on=on(1),
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    heights, exact = waves(SIZE)
    yield from bench_heights(runs, heights, exact)
    del exact
    yield bench_numpy(runs)

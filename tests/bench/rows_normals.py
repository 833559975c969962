"""Normals of heights, and the maps of a picture, in memory: beside OpenCV, numpy and a plain copy.

Where the peer writes into arrays that it is given, so do we, and the other way round: the pages of fresh ones
cost as much as the work.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from paradize.kernels.normals import empty_maps, material_maps, normals_from_heights
from row import CORES, Row, on, pair_ms

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


def degrees(normals: np.ndarray, exact: np.ndarray) -> str:
    """Of floats, or of codes c read as 2c / 255 - 1 with 127 and 128 as zero."""
    a = normals.astype(np.float64)
    if normals.dtype == np.uint8:
        a = np.where((normals == 127) | (normals == 128), 0.0, a * (2 / 255) - 1)
    cross = np.linalg.norm(np.cross(a, exact), axis=2)
    angle = np.degrees(np.arctan2(cross, (a * exact).sum(axis=2)))
    return f"mean {angle.mean():.3f}, p99 {np.percentile(angle, 99):.3f} deg"


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
    """Height -> RGB8 with OpenCV's own operations alone, every array made beforehand."""

    def __init__(self, heights: np.ndarray, taps: list[float]) -> None:
        self.heights, self.taps = heights, taps
        shape = heights.shape
        self.x, self.y, self.z = (np.empty(shape, np.float32) for _ in range(3))
        self.codes = [np.empty(shape, np.uint8) for _ in range(3)]
        self.out = np.empty((*shape, 3), np.uint8)

    def __call__(self) -> np.ndarray:
        slopes(self.heights, self.taps, (self.x, self.y))
        cv2.magnitude(self.x, self.y, magnitude=self.z)  # then 1 / sqrt(magnitude^2 + 1)
        cv2.multiply(self.z, self.z, dst=self.z)
        cv2.add(self.z, 1.0, dst=self.z)
        cv2.pow(self.z, -0.5, dst=self.z)
        cv2.multiply(self.x, self.z, dst=self.x, scale=127.5)
        cv2.multiply(self.y, self.z, dst=self.y, scale=127.5)
        for plane, codes, scale in zip((self.x, self.y, self.z), self.codes, (1.0, 1.0, 127.5), strict=True):
            cv2.add(cv2.multiply(plane, scale, dst=plane), 127.5, dst=codes, dtype=cv2.CV_8U)
        return cv2.merge(self.codes, dst=self.out)


class OpenCvPacked:
    """The same by fewer, wider operations: merged floats, one conversion for all."""

    def __init__(self, heights: np.ndarray, taps: list[float]) -> None:
        self.heights, self.taps = heights, taps
        shape = heights.shape
        self.x, self.y, self.z, self.one = (np.empty(shape, np.float32) for _ in range(4))
        self.one[:] = 1
        self.vectors = np.empty((*shape, 3), np.float32)
        self.out = np.empty((*shape, 3), np.uint8)

    def __call__(self) -> np.ndarray:
        slopes(self.heights, self.taps, (self.x, self.y))
        cv2.multiply(self.x, self.x, dst=self.z)
        cv2.accumulateSquare(self.y, self.z)
        cv2.add(self.z, 1.0, dst=self.z)
        cv2.sqrt(self.z, dst=self.z)
        cv2.divide(self.x, self.z, dst=self.x)
        cv2.divide(self.y, self.z, dst=self.y)
        cv2.divide(self.one, self.z, dst=self.z)
        cv2.merge([self.x, self.y, self.z], dst=self.vectors)
        return cv2.add(
            cv2.multiply(self.vectors, (127.5,) * 4, dst=self.vectors),
            (127.5,) * 4,
            dst=self.out,
            dtype=cv2.CV_8U,
        )


def bench_heights(runs: int, heights: np.ndarray, exact: np.ndarray) -> Iterator[Row]:
    cv2.setNumThreads(2)
    out = np.empty((SIZE, SIZE, 3), np.uint8)
    shared = {"scale": (1.0, 1.0), "encoding": "rgb8", "threads": 2}

    def ours() -> np.ndarray:
        return normals_from_heights(heights, derivative=FOURTH, wrap=(True, True), out=out, **shared)

    error = degrees(ours(), exact)
    work = f"normals, {SIZE}^2 float -> RGB8, arrays reused, 2 threads"
    features = cv2.getCPUFeaturesLine().split()[-1].strip("*?")
    for taps, name, limit in ((FOURTH, "fourth-order taps", 8.0), (CENTRAL, "Sobel, less exact", None)):
        for peer, of in ((OpenCv(heights, taps), "planes"), (OpenCvPacked(heights, taps), "merged floats")):
            times = pair_ms(ours, peer, runs)
            yield Row(
                work, times[0], f"OpenCV's own operations on {of}, {name}", times[1],
                f"fourth order, {error}", degrees(peer(), exact), limit=limit,
                inside="heights in memory to codes in memory, no allocation", ours_on=on(2),
                peer_on=on(2, f"OpenCV's choice up to {features}"),
            )  # fmt: skip

    there = np.empty(heights.nbytes + out.nbytes, np.uint8)  # as many bytes read and written in all
    here = np.full(there.size // 2, 7, np.uint8)
    times = pair_ms(ours, lambda: np.copyto(there[: here.size], here), runs)
    yield Row(
        work, times[0], "numpy copy of as many bytes, in and out", times[1], error, "-", limit=1 / 5,
        inside="as many bytes read and written", ours_on=on(2), peer_on=on(1),
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
        f"central, {degrees(ours(), exact)}", degrees(numpy_central(), exact),
        inside="heights in memory to fresh arrays of float32", ours_on=on(CORES), peer_on=on(1),
    )  # fmt: skip


def bench_maps(runs: int, heights: np.ndarray) -> Row:
    """How many times the normals alone the four maps of a colour picture take: at most 3."""
    grey = (heights - heights.min()) / np.ptp(heights)
    color = np.stack([grey, 1 - grey, grey * grey], axis=2)
    color = (color * 255 + 0.5).astype(np.uint8)
    room, out = empty_maps(SIZE, SIZE), np.empty((SIZE, SIZE, 3), np.uint8)
    shared = {"derivative": FOURTH, "scale": (40.0, 40.0), "wrap": (True, True), "threads": 2}

    def ours() -> object:
        return material_maps(color, out=room, **shared)

    def alone() -> np.ndarray:
        return normals_from_heights(heights, encoding="rgb8", out=out, **shared)

    times = pair_ms(ours, alone, runs)
    sums = room.dudv.sum(axis=(0, 1), dtype=np.int64)
    return Row(
        f"height, normal, gloss, du/dv of {SIZE}^2 RGB8, arrays reused, 2 threads", times[0],
        "our normals alone", times[1], f"as the stages make them; du/dv sums to {sums[0]}, {sums[1]}", "-",
        limit=1 / 3, inside="arrays in memory to arrays in memory", ours_on=on(2), peer_on=on(2),
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    heights, exact = waves(SIZE)
    yield from bench_heights(runs, heights, exact)
    del exact
    yield bench_maps(runs, heights)
    yield bench_numpy(runs)

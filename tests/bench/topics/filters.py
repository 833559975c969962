"""Cost and gain of choosing a derivative filter, and of de-stepping."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from paradize.kernels.normals import normals_from_heights
from paradize.stages.destep import destep
from paradize.stages.filters import TAPS, choose_filter
from row import CORES, Row, on, pair_ms
from tests.pipeline.heights import angles_between, normals, rounded, sinusoids, up

SIZE = 1024
OPENCV = f"{cv2.getNumThreads()} threads, OpenCV's own choice"
BOTH = (True, True)


def field(wavelengths: tuple[float, float], bits: int) -> tuple[np.ndarray, float, np.ndarray]:
    """Heights 0..1 as a file of so many bits holds them, how high 1 stands, and the true normals."""
    heights, dx, dy = sinusoids(SIZE, *wavelengths, seed=1)
    return *rounded(heights, bits), up(dx, dy)


def mean_deg(normals: np.ndarray, truth: np.ndarray) -> float:
    return float(angles_between(normals, truth).mean())


def sobel_5(heights: np.ndarray, span: float) -> np.ndarray:
    """Normals by OpenCV's 5 x 5 Sobel, the best plain filter on coarse heights; the map repeats."""
    wide = np.pad(heights, 4, mode="wrap")
    dx, dy = (cv2.Sobel(wide, cv2.CV_32F, *axes, ksize=5, scale=span / 128) for axes in ((1, 0), (0, 1)))
    return up(dx[4:-4, 4:-4], dy[4:-4, 4:-4])


def bench_auto(runs: int) -> Iterator[Row]:
    """Whole: the look and the normals. The bars on the mean error before storage: 1.5 and 0.1 degrees."""
    cases = ((8, (32, 256), "1.5"), (32, (8, 64), "0.1"))
    for bits, wavelengths, bar in cases:
        heights, span, truth = field(wavelengths, bits)
        name = choose_filter(heights, bits, BOTH)

        def ours(heights: np.ndarray = heights, bits: int = bits, span: float = span) -> np.ndarray:
            name = choose_filter(heights, bits, BOTH)
            return normals(heights, scale=(span, span), wrap=BOTH, filter_name=name)

        def peer(heights: np.ndarray = heights, span: float = span) -> np.ndarray:
            return sobel_5(heights, span)

        times = pair_ms(ours, peer, runs)
        means = [mean_deg(found(), truth) for found in (ours, peer)]
        low, high = wavelengths
        yield Row(
            f"normals by auto, {SIZE}^2 heights of {low} to {high} texels, {bits} bits", times[0],
            "OpenCV, Sobel 5 x 5, and numpy", times[1],
            f"{name}, mean {means[0]:.4f} deg before storage (promised: {bar})", f"mean {means[1]:.4f} deg",
            inside="heights in memory to normals in float32", ours_on=on(CORES), peer_on=OPENCV,
        )  # fmt: skip


def bench_look(runs: int) -> Row:
    size = 4096
    heights = np.tile(field((8, 64), 8)[0], (4, 4))
    taps = TAPS["fourth"]

    def normals() -> np.ndarray:
        return normals_from_heights(heights, derivative=taps.derivative, scale=(1.0, 1.0), wrap=BOTH)

    times = pair_ms(lambda: choose_filter(heights, 8, BOTH), normals, runs)
    return Row(
        f"auto's look at {size}^2 heights",
        times[0],
        "the normals themselves",
        times[1],
        "",
        "",
        inside="ours: which filter to take; the peer's: normals by one",
        ours_on=on(CORES),
        peer_on=on(CORES),
    )


def bench_destep(runs: int) -> Row:
    steps, span, truth = field((32, 256), 8)

    def error(values: np.ndarray) -> str:
        found = normals(values, scale=(span, span), wrap=BOTH)
        return f"fourth order then errs by {mean_deg(found, truth):.2f} deg"

    def peer() -> np.ndarray:
        return cv2.bilateralFilter(steps, 9, 2 / 255, 3)

    times = pair_ms(lambda: destep(steps, wrap=BOTH), peer, runs)
    most = float(np.abs(destep(steps, wrap=BOTH).astype(np.float64) - steps).max() * 255)
    return Row(
        f"de-stepping {SIZE}^2 heights of 8 bits", times[0], "OpenCV, bilateral filter of 9 texels", times[1],
        f"{error(destep(steps, wrap=BOTH))}, at most {most:.3f} steps off", error(peer()),
        inside="heights in memory to heights in memory", ours_on=on(CORES), peer_on=OPENCV,
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    yield from bench_auto(runs)
    yield bench_look(runs)
    yield bench_destep(max(1, runs // 3))

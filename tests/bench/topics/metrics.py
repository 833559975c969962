"""The cost of measuring maps: beside baking them, and beside the same in numpy float64."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from paradize.bakers.maps.bake import bake_maps
from paradize.bakers.product import MapProduct
from paradize.data import HeightMap, Texture
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.png import encode_png
from paradize.kernels import bcn
from paradize.metrics.levels import color_levels, normal_levels
from row import CORES, Row, on, pair_ms
from tests.pipeline import map_truth

SIZE = 2048


def field() -> np.ndarray:
    """16-bit heights of a periodic field of waves of 8 to 64 texels."""
    rng = np.random.default_rng(7)
    heights = np.zeros((SIZE, SIZE), np.float32)
    x = np.arange(SIZE) * (2 * np.pi / SIZE)
    for _ in range(12):
        wavelength, angle, phase = 2 ** rng.uniform(3, 6), *rng.uniform(0, 2 * np.pi, 2)
        kx, ky = np.rint(SIZE / wavelength * np.array([np.cos(angle), np.sin(angle)]))
        wave = np.sin((kx * x + phase)[None, :] + (ky * x)[:, None])
        heights += (wavelength / 20 * wave).astype(np.float32)
    low, high = heights.min(), heights.max()
    return ((heights - low) / (high - low) * 65535).astype(np.uint16)


def in_numpy(texture: Texture, heights: np.ndarray, scale: float) -> list[dict[str, float]]:
    """The same in float64 arrays: central differences of fourth order, means of four, angles, percentiles."""
    wide = heights.astype(np.float64) * scale

    def apart(axis: int, k: int) -> np.ndarray:
        return np.roll(wide, -k, axis) - np.roll(wide, k, axis)

    slopes = [(8 * apart(axis, 1) - apart(axis, 2)) / 12 for axis in (1, 0)]
    normals = np.dstack([-slopes[0], slopes[1], np.ones_like(wide)])
    normals /= np.sqrt((normals * normals).sum(axis=2, keepdims=True))
    chain = [normals]
    for _ in texture.levels[1:]:
        n = chain[-1]
        chain.append((n[0::2, 0::2] + n[1::2, 0::2] + n[0::2, 1::2] + n[1::2, 1::2]) / 4)
    return map_truth.angles(texture, [map_truth.normalised(level) for level in chain])


def error_text(levels: list[dict[str, float]]) -> str:
    return f"level 0: mean {levels[0]['mean_deg']:.4f}, p99 {levels[0]['p99_deg']:.3f} deg"


def bench_normals(runs: int, folder: Path) -> Iterator[Row]:
    codes = field()
    heights = codes.astype(np.float32) / np.float32(65535)
    path = folder / "heights.png"
    path.write_bytes(encode_png(codes[:, :, None]))

    def bake() -> MapProduct:
        made = bake_maps(
            path, only=("normal",), source="height", filter="fourth", wrap="repeat", measure=False
        )
        return made["normal"]

    texture = decode_ktx2(bake().data)
    ground = HeightMap(heights, (SIZE / 100, SIZE / 100), (True, True), "fourth")

    def measure() -> list[dict[str, float]]:
        return normal_levels(texture, ground)

    def peer() -> list[dict[str, float]]:
        return in_numpy(texture, heights, SIZE / 100)

    work = f"measuring every level of {SIZE}^2 normals"
    ours, theirs = pair_ms(measure, bake, runs)
    yield Row(
        work,
        ours,
        "baking them, PNG to KTX2",
        theirs,
        error_text(measure()),
        "",
        limit=1.0,
        inside="ours: measuring; the peer's: decoding and baking, both all levels",
        ours_on=on(CORES),
        peer_on=on(CORES),
    )
    ours, theirs = pair_ms(measure, peer, max(1, runs // 3))
    yield Row(
        work,
        ours,
        "numpy, float64",
        theirs,
        error_text(measure()),
        error_text(peer()),
        limit=8.0,
        inside="a texture and heights in memory to the errors of every level",
        ours_on=on(CORES),
        peer_on=on(1),
    )


def bench_colors(runs: int) -> Iterator[Row]:
    pixels = np.random.default_rng(3).integers(0, 256, (SIZE, SIZE, 4), np.uint8)
    pixels[:, :, 3] = 255
    texture = Texture("BC1_RGB_SRGB", SIZE, SIZE, (bcn.encode_bc1(pixels),))
    colors = np.ascontiguousarray(pixels[:, :, :3])

    def measure() -> dict[str, float]:
        return color_levels(texture, colors, encoded=True, alpha_cutoff=None)[0]

    ours, theirs = pair_ms(measure, lambda: bcn.encode_bc1(pixels), runs)
    yield Row(
        f"measuring {SIZE}^2 colours of one level", ours, "encoding them as BC1", theirs,
        f"{measure()['psnr_db']:.2f} dB of noise", "",
        inside="texels and blocks in memory", ours_on=on(CORES), peer_on=on(CORES),
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    yield from bench_normals(runs, folder)
    yield from bench_colors(runs)

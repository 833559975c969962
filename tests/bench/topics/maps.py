"""Mip chains and whole bakes of pictures beside OpenImageIO."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from paradize.bakers.color import bake_color, color_texture
from paradize.bakers.maps.bake import bake_maps
from paradize.metrics.levels import color_levels
from paradize.stages.mips import color_rows
from row import CORES, Row, on, pair_ms

SIZE = 4096
SETS = oiio.get_string_attribute("oiio:simd").rpartition(",")[2]
DECODING = {"peer": "OpenImageIO decodes it alone", "peer_on": on(1, SETS)}


def picture(size: int) -> np.ndarray:
    """A periodic colour picture of waves and grain, (size, size, 3) sRGB codes."""
    rng = np.random.default_rng(5)
    x = np.arange(size) / size * 2 * np.pi
    values = np.zeros((size, size, 3), np.float32)
    for channel in range(3):
        for _ in range(5):
            kx, ky = rng.integers(-size // 16, size // 16, 2)
            phase = rng.uniform(0, 2 * np.pi)
            wave = np.sin(kx * x[None, :] + phase), np.cos(kx * x[None, :] + phase)
            values[:, :, channel] += wave[0] * np.cos(ky * x[:, None]) + wave[1] * np.sin(ky * x[:, None])
    values = 128 + 20 * values + rng.integers(-12, 13, values.shape)
    return values.clip(0, 255).astype(np.uint8)


def save(path: Path, values: np.ndarray) -> Path:
    height, width, channels = values.shape
    kind = oiio.UINT16 if values.dtype == np.uint16 else oiio.UINT8
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), oiio.ImageSpec(width, height, channels, kind))
    assert target.write_image(values)
    assert target.close()
    return path


def decoded(path: Path) -> None:
    """The time that OpenImageIO alone takes to decode a file, in the file's own type."""
    source = oiio.ImageInput.open(str(path))
    spec = source.spec()
    assert source.read_image(0, 0, 0, spec.nchannels, spec.format) is not None
    source.close()


def encoded(light: np.ndarray) -> np.ndarray:
    """sRGB values 0..1 of linear light."""
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)


def chain_errors(codes: np.ndarray, levels: list[np.ndarray]) -> str:
    """How far the levels' sRGB codes are from those of the mean light in float64, in codes: mean and max."""
    share = codes.astype(np.float64) / 255
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    mean, worst, count, largest = light, 0.0, 0, 0.0
    for level in levels:
        height, width = level.shape[:2]
        mean = mean.reshape(height, 2, width, 2, 3).mean(axis=(1, 3))
        off = np.abs(level[:, :, :3].astype(np.float64) - encoded(mean) * 255)
        worst, count, largest = worst + float(off.sum()), count + off.size, max(largest, float(off.max()))
    return f"mean {worst / count:.3f}, max {largest:.2f} codes"


def bench_mips(runs: int, codes: np.ndarray) -> Row:
    image = oiio.ImageBuf(codes).copy(oiio.FLOAT)
    oiio.attribute("threads", CORES)

    def ours() -> list[np.ndarray]:
        levels = [np.empty((SIZE >> k, SIZE >> k, 4), np.uint8) for k in range(SIZE.bit_length())]

        def ignore_rows(level: int, first: int, rows: np.ndarray) -> None:
            levels[level][first : first + len(rows)] = rows

        color_rows(codes, ignore_rows, encoded=True)
        return levels[1:]

    def peer() -> list[np.ndarray]:
        """Codes to linear light, halved, and back to codes."""
        light, levels, side = oiio.ImageBufAlgo.colorconvert(image, "sRGB", "linear"), [], SIZE
        while side > 1:
            side //= 2
            light = oiio.ImageBufAlgo.resize(light, filtername="box", roi=oiio.ROI(0, side, 0, side))
            levels.append(oiio.ImageBufAlgo.colorconvert(light, "linear", "sRGB").get_pixels(oiio.UINT8))
        return levels

    ours_ms, peer_ms = pair_ms(ours, peer, runs)
    return Row(
        f"sRGB codes -> mip chain in linear light, {SIZE}^2", ours_ms,
        "OpenImageIO: colorconvert, resize by box, colorconvert", peer_ms,
        chain_errors(codes, ours()), chain_errors(codes, peer()), 10.0,
        inside="codes in memory to the codes of every level", ours_on=on(CORES), peer_on=on(CORES, SETS),
    )  # fmt: skip


def bench_png(runs: int, path: Path, codes: np.ndarray) -> Iterator[Row]:
    error = f"{bake_color(path).levels[0]['psnr_db']:.2f} dB"
    for clock, limit, more in ((time.perf_counter, 0.5, ""), (time.process_time, None, ", processor time")):
        ours, peer = pair_ms(lambda: bake_color(path, measure=False), lambda: decoded(path), runs, clock)
        yield Row(
            f"PNG of {SIZE}^2 on disk -> BC1 KTX2 with all mips{more}", ours,
            peer_ms=peer, ours_error=error, peer_error="", limit=limit,
            inside="decoding; for us mips and blocks too", ours_on=on(CORES), **DECODING,
        )  # fmt: skip
    texture = color_texture(codes, "BC1_RGB_SRGB", encoded=True, alpha_cutoff=None, tier="balanced")
    ours, peer = pair_ms(
        lambda: color_levels(texture, codes, encoded=True, alpha_cutoff=None), lambda: decoded(path), runs
    )
    yield Row(
        "  the errors of all its levels, beside that", ours, peer_ms=peer, ours_error="", peer_error="",
        inside="ours: measuring alone; the peer's: decoding alone", ours_on=on(CORES), **DECODING,
    )  # fmt: skip


def bench_maps(runs: int, path: Path, what: str, source: str) -> Iterator[Row]:
    """Whole bakes as `paradize maps` makes them, with and without errors, in processor time."""
    work = f"{what} -> normal, height, gloss, du/dv KTX2, processor time"
    for measure, more in ((False, ""), (True, ", every level measured")):
        ours, peer = pair_ms(
            lambda measure=measure: bake_maps(path, source=source, wrap="repeat", measure=measure),
            lambda: decoded(path),
            runs,
            time.process_time,
        )
        yield Row(
            work + more, ours, peer_ms=peer, ours_error="", peer_error="",
            inside="decoding; for us the maps, their mips and blocks too", ours_on=on(CORES), **DECODING,
        )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    codes = picture(SIZE)
    yield bench_mips(runs, codes)
    color = save(folder / "color.png", codes)
    yield from bench_png(runs, color, codes)
    yield from bench_maps(max(1, runs // 3), color, f"PNG of {SIZE}^2, 8-bit colour", "color")
    heights = codes[: SIZE // 2, : SIZE // 2, :1].astype(np.uint16) * 256
    height = save(folder / "height.png", heights)
    yield from bench_maps(max(1, runs // 3), height, f"PNG of {SIZE // 2}^2, 16-bit heights", "height")

"""BC7 beside PyPI's etcpak, one thread each; PSNR of both by the decoder of metrics/texels.py."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from time import thread_time

import numpy as np
import OpenImageIO as oiio

from paradize.data import Texture
from paradize.kernels.bc7 import QUALITIES, encode_bc7
from paradize.metrics.texels import decode_texels
from peer_etcpak import BUILD, etcpak
from row import Row, on, pair_ms
from tests.pipeline.map_truth import differences
from tests.places import CORPUS, ROOT

PHOTOGRAPHS = (
    "images/png-image-rs/kodim02.png",
    "textures/BeachStones.jpg",
    "textures/coast_sand_rocks_02_diff_1k.jpg",
    "textures/rocky_trail_diff_1k.jpg",
    "images/astc-encoder/ldr-rgb-00.png",
    "images/astc-encoder/ldr-rgb-03.png",
)
CUT_OUTS = (
    "images/astc-encoder/ldr-rgba-00.png",
    "textures/leaf.png",
    "textures/grass_billboard.png",
    "textures/panda3d/oakleaf.png",
)
PROMISED = {"fast": 10.0, "balanced": None, "exact": 2.0}  # times etcpak's speed
SIDES = {"inside": "texels in memory to blocks in memory", "ours_on": on(1), "peer_on": on(1, BUILD)}
TILE = 256


def tiles(names: tuple[str, ...], fallback: str, count: int) -> np.ndarray:
    """A strip of `count` squares of 256 texels from the corpus's images, or from one of the island's own."""
    paths = [CORPUS / name for name in names if (CORPUS / name).exists()] or [ROOT / fallback]
    hint = oiio.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)
    found: list[list[np.ndarray]] = []
    for path in paths:
        source = oiio.ImageInput.open(str(path), hint)
        pixels = np.asarray(source.read_image(oiio.UINT8))
        if pixels.shape[2] == 3:
            pixels = np.dstack([pixels, np.full_like(pixels[:, :, :1], 255)])
        height, width = pixels.shape[:2]
        found.append(
            [
                pixels[y : y + TILE, x : x + TILE]
                for y in range(0, height - TILE + 1, TILE)
                for x in range(0, width - TILE + 1, TILE)
            ]
        )
    turns = [column[i] for i in range(count) for column in found if i < len(column)]
    return np.ascontiguousarray(np.concatenate([turns[i % len(turns)] for i in range(count)], axis=1))


def decibels(blocks: bytes, rgba: np.ndarray) -> str:
    """PSNR of the sRGB codes of colour, and over all channels where there is alpha."""
    shown = decode_texels(Texture("BC7_SRGB", rgba.shape[1], rgba.shape[0], (blocks,)))
    truth = rgba / np.float64(255)
    text = f"{differences(shown[:, :, :3], truth[:, :, :3])['psnr_db']:.2f} dB"
    if (rgba[:, :, 3] < 255).any():
        text += f" of colour, {differences(shown, truth)['psnr_db']:.2f} dB with alpha"
    return text


def bench(name: str, rgba: np.ndarray, runs: int) -> Iterator[Row]:
    height, width = rgba.shape[:2]
    data = rgba.tobytes()
    settings = etcpak.BC7CompressBlockParams()
    settings.init_linear_weights()  # its own default weighs luminance and is slower and 1 dB worse

    def peer() -> bytes:
        return etcpak.compress_bc7(data, width, height, settings)

    peer_error = decibels(peer(), rgba)
    for quality in QUALITIES:
        blocks = encode_bc7(rgba, quality=quality, threads=1)
        ours, theirs = pair_ms(
            lambda q=quality: encode_bc7(rgba, quality=q, threads=1), peer, max(1, runs // 2), thread_time
        )
        speed = height * width / ours * 1e-3
        yield Row(
            f"BC7 {quality}, {name}, {width} x {height}", ours,
            "etcpak of PyPI, linear weights", theirs,
            f"{decibels(blocks, rgba)}, {speed:.0f} MPix/s", peer_error, PROMISED[quality], **SIDES,
        )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    yield from bench("photographs", tiles(PHOTOGRAPHS, "raw_assets/jetty/jetty.png", 16), runs)
    yield from bench("cut-outs with alpha", tiles(CUT_OUTS, "raw_assets/jetty/jetty.png", 8), runs)

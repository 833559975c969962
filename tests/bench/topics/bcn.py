"""BC1, BC4 and BC5 beside etcpak and quicktex from PyPI: 4096^2, ours and theirs on one thread each.

Colours: a mosaic of 256 x 256 tiles of every colour picture of the corpus and of raw_assets. Normals: waves
of 8 to 64 texels, so steep that etcpak's BC5 leaves 1.27 degrees. Errors are those of our decoder in numpy,
which rounds nothing in between; they are not inside the times. etcpak reads RGBA bytes, as ours do here; BC5
of the bake's float normals, read where they lie, has rows of its own. Each row says the threads and the
instruction sets of both sides; times of one thread are that thread's own, without other programs' share.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from time import thread_time

import numpy as np
import OpenImageIO as oiio
import quicktex
from quicktex.s3tc.bc1 import BC1Encoder

from paradize.data import Texture
from paradize.kernels import bcn
from paradize.metrics.texels import decode_texels
from peer_etcpak import BUILD, etcpak
from row import CORES, Row, Trade, on, pair_ms
from tests.places import CORPUS, ROOT

SIZE = 4096
SIDES = {"inside": "texels in memory to blocks in memory", "ours_on": on(1), "peer_on": on(1, BUILD)}
TILE = 256
ERROR_ROWS = 1024  # of the map that errors are taken of
NOT_SLOWER = 1.0  # what the fast tiers are to be beside etcpak
STEEPNESS = 0.41  # of the waves


def colour_pictures() -> Iterator[tuple[str, np.ndarray]]:
    """Name and (h, w, 3) uint8 of every colour picture of at least 64 x 64 texels, cut to whole blocks."""
    folders = [CORPUS / name for name in ("images", "textures", "pbr-pairs", "water", "sky")]
    for folder in [ROOT / "raw_assets", *folders]:
        for path in sorted(folder.rglob("*")):
            if path.suffix.lower() not in {".png", ".jpg", ".jpeg", ".tga"} or path.parent.name == "pngsuite":
                continue  # PngSuite is of 32 x 32, some of it broken on purpose
            if path.suffix == ".png" and path.read_bytes()[12:16] != b"IHDR":
                continue  # a dialect, of which libpng would complain aloud
            source = oiio.ImageInput.open(str(path))
            if source is None:
                oiio.geterror()  # the corpus holds broken files too
                continue
            spec = source.spec()
            if spec.nchannels < 3 or min(spec.width, spec.height) < 64:
                continue
            pixels = source.read_image(0, 0, 0, 3, oiio.UINT8)
            if pixels is None:
                source.geterror()
                continue
            whole = pixels[: spec.height // 4 * 4, : spec.width // 4 * 4]
            yield path.name, np.ascontiguousarray(whole)


def mosaic() -> np.ndarray:
    """(SIZE, SIZE, 4) uint8: a tile of each picture in turn, then another of each, until it is full."""
    pictures = [pixels for _, pixels in colour_pictures() if min(pixels.shape[:2]) >= TILE]
    out = np.full((SIZE, SIZE, 4), 255, np.uint8)
    for index in range((SIZE // TILE) ** 2):
        pixels = pictures[index % len(pictures)]
        down, across = pixels.shape[0] // TILE, pixels.shape[1] // TILE
        y, x = divmod(index // len(pictures) * 7 % (down * across), across)
        row, column = divmod(index, SIZE // TILE)
        to = out[row * TILE :, column * TILE :][:TILE, :TILE, :3]
        to[:] = pixels[y * TILE :, x * TILE :][:TILE, :TILE]
    return out


def wave_normals() -> np.ndarray:
    """(SIZE, SIZE, 3) float32 unit normals of 40 periodic waves of 8 to 64 texels."""
    rng = np.random.default_rng(7)
    x = (np.arange(SIZE) / SIZE * 2 * np.pi).astype(np.float32)
    slopes = np.zeros((2, SIZE, SIZE), np.float32)
    for _ in range(40):
        wavelength = 2 ** rng.uniform(3, 6)
        angle, phase = rng.uniform(0, 2 * np.pi, 2)
        steps = np.round(SIZE / wavelength * np.array([np.cos(angle), np.sin(angle)])).astype(np.float32)
        # cos(a + b) of the two axes' own cosines and sines: a 4096^2 map in two products
        across, down = steps[0] * x + np.float32(phase), steps[1] * x
        wave = np.outer(np.cos(down), np.cos(across)) - np.outer(np.sin(down), np.sin(across))
        for axis in (0, 1):
            slopes[axis] += wave * np.float32(STEEPNESS * steps[axis] * wavelength / SIZE / np.sqrt(20))
    normals = np.stack([-slopes[0], slopes[1], np.ones_like(slopes[0])], axis=2)
    return normals / np.linalg.norm(normals, axis=2, keepdims=True)


def psnr(name: str, blocks: bytes, truth: np.ndarray) -> float:
    """dB over the channels of `truth` (h, w, c) uint8."""
    height, width, channels = truth.shape
    found = decode_texels(Texture(name, width, height, (blocks,)))[:, :, :channels] * np.float32(255)
    error = np.square(found - truth, dtype=np.float64).mean()
    return float(99 if error == 0 else 10 * np.log10(255**2 / error))


def degrees(name: str, blocks: bytes, truth: np.ndarray) -> str:
    """Angle between the decoded normals and `truth` (h, w, 3)."""
    height, width = truth.shape[:2]
    found = decode_texels(Texture(name, width, height, (blocks,)))[:, :, :2].astype(np.float64)
    found = found if name.endswith("SNORM") else found * 2 - 1
    z = np.sqrt(np.maximum(0, 1 - np.square(found).sum(axis=2)))
    cross = np.cross(np.dstack([found, z]), truth)
    dot = found[:, :, 0] * truth[:, :, 0] + found[:, :, 1] * truth[:, :, 1] + z * truth[:, :, 2]
    angle = np.degrees(np.arctan2(np.linalg.norm(cross, axis=2), dot))
    return f"mean {angle.mean():.3f}, p99 {np.percentile(angle, 99):.2f} deg"


def quicktex_bc1(rgba: np.ndarray) -> bytes:
    texture = quicktex.RawTexture.frombytes(rgba.tobytes(), rgba.shape[1], rgba.shape[0])
    return bytes(BC1Encoder(5).encode(texture).tobytes())


def bc1_trade(tier: str, peer: str, ours_db: float, peer_db: float, share: float = 1.0) -> Trade:
    errors = (10 ** (-db / 20) for db in (ours_db, peer_db))
    return Trade("BC1: 4096 x 4096 colours, RMS error", tier, peer, *errors, share=share)


def bc1_rows(rgba: np.ndarray, runs: int) -> Iterator[Row]:
    texels = rgba.tobytes()
    truth = rgba[:ERROR_ROWS, :, :3]
    size = ERROR_ROWS * SIZE // 2
    theirs = psnr("BC1_RGB_UNORM", etcpak.compress_bc1(texels, SIZE, SIZE)[:size], truth)
    small = rgba[: SIZE // 8]
    quick = psnr("BC1_RGB_UNORM", quicktex_bc1(rgba[:ERROR_ROWS]), truth)
    for quality in bcn.QUALITIES:
        ours = psnr("BC1_RGB_UNORM", bcn.encode_bc1(rgba[:ERROR_ROWS], quality=quality), truth)
        times = pair_ms(
            lambda quality=quality: bcn.encode_bc1(rgba, quality=quality, threads=1),
            lambda: etcpak.compress_bc1(texels, SIZE, SIZE),
            runs if quality != "exact" else 1,
            thread_time,
        )
        limit = NOT_SLOWER if quality == "fast" else None
        yield Row(
            f"BC1 {quality}, {SIZE}^2 mosaic", times[0], "etcpak of PyPI", times[1],
            f"{ours:.2f} dB", f"{theirs:.2f} dB", limit, **SIDES,
            trade=bc1_trade(quality, "etcpak", ours, theirs),
        )  # fmt: skip
        times = pair_ms(
            lambda quality=quality: bcn.encode_bc1(small, quality=quality, threads=1),
            lambda: quicktex_bc1(small),
            max(1, runs // 3),
        )
        yield Row(
            f"BC1 {quality}, {SIZE} x {SIZE // 8} mosaic", times[0],
            "quicktex of PyPI, level 5", times[1], f"{ours:.2f} dB", f"{quick:.2f} dB",
            inside=SIDES["inside"], ours_on=on(1), peer_on=on(CORES, "as its wheel was built"),
            trade=bc1_trade(quality, f"quicktex, {CORES} threads", ours, quick, share=1 / 8),
        )  # fmt: skip


def per_picture_row(runs: int) -> Row:
    """The lowest of the fast tier's gains over the pictures, which is what the table promises."""
    over_etcpak, over_quicktex = [], []
    times = [0.0, 0.0]
    for name, pixels in colour_pictures():
        rgba = np.dstack([pixels, np.full_like(pixels[:, :, :1], 255)])[:1024, :1024].copy()
        texels, (height, width) = rgba.tobytes(), rgba.shape[:2]
        encoders = (
            lambda rgba=rgba: bcn.encode_bc1(rgba, quality="fast", threads=1),
            lambda size=(texels, width, height): etcpak.compress_bc1(*size),
        )
        ours, theirs = (psnr("BC1_RGB_UNORM", encode(), rgba[:, :, :3]) for encode in encoders)
        quick = psnr("BC1_RGB_UNORM", quicktex_bc1(rgba), rgba[:, :, :3])
        if theirs >= 99:  # nothing is left to gain
            assert ours >= 99, name
            continue
        over_etcpak.append(ours - theirs)
        over_quicktex.append(ours - quick)
        took = pair_ms(*encoders, max(1, runs // 3), thread_time)
        times = [times[0] + took[0], times[1] + took[1]]
    return Row(
        f"BC1 fast, {len(over_etcpak)} colour pictures one by one", times[0], "etcpak of PyPI", times[1],
        f"at least {min(over_etcpak):+.2f} dB beside etcpak, {min(over_quicktex):+.2f} dB beside quicktex",
        "promised: +1 dB beside etcpak", NOT_SLOWER, **SIDES,
    )  # fmt: skip


def bc4_rows(rgba: np.ndarray, runs: int) -> Iterator[Row]:
    green = np.ascontiguousarray(rgba[:, :, 1:2])
    texels = np.repeat(green, 4, axis=2).tobytes()
    truth = green[:ERROR_ROWS]
    theirs = psnr("BC4_UNORM", etcpak.compress_bc4(texels, SIZE, SIZE)[: ERROR_ROWS * SIZE // 2], truth)
    for quality in bcn.QUALITIES:
        ours = psnr("BC4_UNORM", bcn.encode_values(truth, signed=False, quality=quality), truth)
        times = pair_ms(
            lambda quality=quality: bcn.encode_values(green, signed=False, quality=quality, threads=1),
            lambda: etcpak.compress_bc4(texels, SIZE, SIZE),
            runs if quality != "exact" else 1,
            thread_time,
        )
        yield Row(
            f"BC4 {quality}, {SIZE}^2 mosaic's green", times[0], "etcpak of PyPI", times[1],
            f"{ours:.2f} dB", f"{theirs:.2f} dB", NOT_SLOWER if quality == "fast" else None,
            **SIDES,
        )  # fmt: skip


def bc5_rows(runs: int) -> Iterator[Row]:
    normals = wave_normals()
    codes = np.full((SIZE, SIZE, 4), 255, np.uint8)
    codes[:, :, :2] = np.rint((normals[:, :, :2] + 1) * np.float32(127.5))
    texels = codes.tobytes()
    truth = normals[:ERROR_ROWS].astype(np.float64)
    theirs = degrees("BC5_UNORM", etcpak.compress_bc5(texels, SIZE, SIZE)[: ERROR_ROWS * SIZE], truth)
    for quality in bcn.QUALITIES:
        for name, values, signed in (
            ("BC5_UNORM", codes[:, :, :2], False),
            ("BC5_SNORM", normals[:, :, :2], True),
        ):
            if quality == "exact" and not signed:
                continue

            def ours(
                values: np.ndarray = values, signed: bool = signed, quality: str = quality, threads: int = 1
            ) -> bytes:
                return bcn.encode_values(values, signed=signed, quality=quality, threads=threads)

            times = pair_ms(
                ours,
                lambda: etcpak.compress_bc5(texels, SIZE, SIZE),
                runs if quality != "exact" else 1,
                thread_time,
            )
            yield Row(
                f"BC5 {quality}, {SIZE}^2 normals, {'float' if signed else 'bytes'}", times[0],
                "etcpak of PyPI", times[1], degrees(name, ours(values[:ERROR_ROWS]), truth), theirs,
                NOT_SLOWER if quality == "fast" else None, **SIDES,
            )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    yield from bc5_rows(runs)
    rgba = mosaic()
    yield from bc1_rows(rgba, runs)
    yield from bc4_rows(rgba, runs)
    yield per_picture_row(runs)

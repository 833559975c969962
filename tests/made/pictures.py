"""Pictures drawn by arithmetic: photographs, cut-outs, heights, and files of every common kind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from tests.pipeline.heights import sinusoids
from tests.pipeline.scenes import write_image

Floats = NDArray[np.float64]


def field(rows: int, columns: int, seed: int, power: float = 1.0) -> Floats:
    """Noise in 0 to 1 whose amplitude falls with a power of its frequency: 1: photographs, 2: ground."""
    rng = np.random.default_rng(seed)
    f = np.hypot(np.fft.fftfreq(rows)[:, None], np.fft.fftfreq(columns)[None, :])
    f[0, 0] = np.inf
    noise = np.fft.ifft2(np.fft.fft2(rng.normal(size=(rows, columns))) / f**power).real
    low, high = np.percentile(noise, (0.5, 99.5))
    return np.clip((noise - low) / (high - low), 0.0, 1.0)


def photograph(rows: int, columns: int, seed: int) -> NDArray[np.uint8]:
    """(rows, columns, 3): fine detail of light, colours that change slowly, hard edges of pebbles."""
    light = field(rows, columns, seed)
    tint = np.stack([field(rows, columns, seed + 10 + c, 2.0) for c in range(3)], axis=2)
    y, x = np.mgrid[:rows, :columns]
    rng = np.random.default_rng(seed)
    shade = np.ones((rows, columns))
    for cy, cx, r in zip(
        rng.random(12) * rows, rng.random(12) * columns, rng.random(12) * 0.1 * rows + 3, strict=True
    ):
        shade[np.hypot(y - cy, x - cx) < r] = 0.6 + 0.4 * rng.random()
    values = (0.15 + 0.5 * light[:, :, None] + 0.3 * tint) * shade[:, :, None]
    return np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8)


def leaf(side: int) -> NDArray[np.uint8]:
    """(side, side, 4): green within a leaf's outline, whose edge is soft, and transparent black around."""
    y, x = np.mgrid[:side, :side] / side * 2 - 1
    inside = np.clip((0.55 * np.sqrt(np.maximum(0, 1 - y * y)) * (1.1 - y) / 2 - np.abs(x)) * side / 2, 0, 1)
    veins = 0.15 * np.sin(40 * (y + np.abs(x)))
    color = np.stack([0.25 + veins, 0.5 + veins + 0.1 * field(side, side, 5), 0.15 + 0 * x], axis=2)
    picture = np.dstack([color * (inside > 0)[:, :, None], inside])
    return np.rint(np.clip(picture, 0, 1) * 255).astype(np.uint8)


def islands(side: int) -> NDArray[np.uint16]:
    """(side, side, 1): ground of hills with a flat sea at code 0 below half of it."""
    ground = field(side, side, 11, 2.0)
    return np.rint(np.maximum(0.0, ground - 0.45) / 0.55 * 65535).astype(np.uint16)[:, :, None]


def write_heights(folder: Path) -> None:
    """Greys of 8 and 16 bits and floats, square and not; colours and text that encode heights."""
    folder.mkdir(parents=True)
    codes = np.rint(field(129, 129, 1, 2.0) * 65535).astype(np.uint16)
    write_image(folder / "hills_16.png", codes[:, :, None])
    write_image(
        folder / "ridge_16.png",
        np.rint(np.abs(field(97, 150, 2, 1.7) - 0.5) * 131070).astype(np.uint16)[:, :, None],
    )
    write_image(folder / "steps_8.png", np.rint(field(128, 96, 3, 2.0) * 255).astype(np.uint8)[:, :, None])
    write_image(folder / "islands_16.png", islands(257))
    write_image(folder / "metres.exr", (40 * field(64, 80, 4, 2.0)).astype(np.float32)[:, :, None])
    write_image(folder / "metres.tif", (900 + 300 * field(70, 70, 6, 2.0)).astype(np.float32)[:, :, None])
    tenths = np.rint(1e5 + 1e4 * field(64, 64, 7, 2.0)).astype(np.uint32)
    write_image(
        folder / "coded_rgb.png",
        np.stack([tenths >> 16, tenths >> 8 & 255, tenths & 255], axis=2).astype(np.uint8),
    )
    rows = "\n".join(" ".join(map(str, row)) for row in codes[:5, :5].tolist())
    (folder / "text.asc").write_text(f"ncols 5\nnrows 5\nxllcorner 0\nyllcorner 0\ncellsize 1\n{rows}\n")


def write_textures(folder: Path) -> None:
    folder.mkdir(parents=True)
    write_image(folder / "photo.png", photograph(256, 384, 1))
    Image.fromarray(photograph(300, 260, 2)).save(folder / "beach.jpg", quality=92)
    write_image(folder / "leaf.png", leaf(256))
    y, x = np.mgrid[:256, :256]
    planks = 0.45 + 0.2 * field(256, 256, 8)[:, :1] + 0.1 * field(256, 256, 9) - 0.3 * (x % 64 < 2)
    Image.fromarray(np.rint(np.clip(planks, 0, 1)[:, :, None] * [200, 150, 100]).astype(np.uint8)).save(
        folder / "planks.jpg"
    )
    waves = (
        0.5 + 0.2 * np.sin(2 * np.pi * (x + 2 * y) / 256) + 0.1 * np.cos(2 * np.pi * (5 * x - 3 * y) / 256)
    )
    Image.fromarray(np.rint(waves * 255).astype(np.uint8)).save(folder / "waves.jpg")


def write_sky(folder: Path) -> None:
    """Six faces: brighter towards the horizon, with a sun at +X."""
    folder.mkdir(parents=True)
    b, a = np.mgrid[31.5:-32:-1, -31.5:32] / 32
    one = np.ones_like(a)
    directions = {"px": (one, b, -a), "nx": (-one, b, a), "py": (a, one, -b), "ny": (a, -one, b)}
    directions |= {"pz": (a, b, one), "nz": (-a, b, -one)}
    for name, (x, y, z) in directions.items():
        length = np.sqrt(x * x + y * y + z * z)
        glow = 0.9 - 0.5 * np.abs(y / length) + 0.1 * (x / length > 0.95)
        color = glow[:, :, None] * [0.75, 0.85, 1.0]
        Image.fromarray(np.rint(color * 255).astype(np.uint8)).save(folder / f"{name}.jpg", quality=95)


def write_images(folder: Path) -> None:
    """One picture as every kind of file that is common, and at sizes that blocks do not divide."""
    folder.mkdir(parents=True)
    picture = Image.fromarray(photograph(45, 61, 3))
    cut = Image.fromarray(leaf(50))
    for name in ("a.png", "a.jpg", "a.tga", "a.bmp", "a.ppm", "a.tif", "a.gif"):
        picture.save(folder / name)
    for mode in ("1", "L", "P"):
        picture.convert(mode).save(folder / f"mode_{mode}.png")
    for mode in ("LA", "RGBA"):
        cut.convert(mode).save(folder / f"cut_{mode}.png")
    cut.save(folder / "cut.tga")
    picture.convert("CMYK").save(folder / "inks.jpg")
    picture.save(folder / "late.jpg", progressive=True)
    for size in ((1, 1), (1, 7), (5, 1), (3, 3), (64, 64), (65, 63)):
        picture.resize(size).save(folder / f"size_{size[0]}x{size[1]}.png")
    light = 4.0 * field(32, 64, 4)[:, :, None] * np.array([1.0, 0.8, 0.5])
    write_image(folder / "light.exr", light.astype(np.float32))
    write_image(folder / "light.hdr", light.astype(np.float32))
    write_image(folder / "deep.png", np.rint(light / 4 * 65535).astype(np.uint16))


def write_pairs(folder: Path) -> None:
    """Heights of 8 bits, also white where deep and as a colour's alpha, and their true normals, green up and
    down."""
    folder.mkdir(parents=True)
    side = 256
    heights, dx, dy = sinusoids(side, 16.0, 64.0, 9, rms_slope=0.3)
    reach = np.ptp(heights)
    codes = np.rint((heights - heights.min()) / reach * 255).astype(np.uint8)
    for name, image in (("height", codes), ("depth", 255 - codes)):
        write_image(folder / f"{name}.png", image[:, :, None])
    write_image(folder / "beside.png", np.dstack([photograph(side, side, 4), codes]))
    up = np.dstack([-dx, dy, np.ones_like(dx)])
    up /= np.linalg.norm(up, axis=2, keepdims=True)
    for name, sign in (("up", 1.0), ("down", -1.0)):
        write_image(folder / f"normal_{name}.png", np.rint((up * [1, sign, 1] + 1) * 127.5).astype(np.uint8))

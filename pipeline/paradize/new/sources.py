"""Makes the sources of a new scene: sky, terrain, sand, and a vase if no model is given.

Every picture is computed. The files are the same on every machine up to the rounding of sines.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import OpenImageIO as oiio

from paradize.errors import BakeError
from paradize.formats.png import encode_png

if TYPE_CHECKING:
    import numpy.typing as npt

    F64 = npt.NDArray[np.float64]

FACES = ("px", "nx", "py", "ny", "pz", "nz")
SKY_TEXELS = 128
GROUND_PIXELS = 129
SAND_TEXELS = 256


def write_sky(folder: Path, sun: tuple[float, float, float]) -> None:
    """Writes six faces <FACES>.exr, linear light: a clear sky, brighter towards the horizon and the sun
    (`sun`: unit vector to it), above pale ground."""
    zenith, horizon = np.array([0.14, 0.3, 0.62]), np.array([0.74, 0.84, 0.93])
    ground, glow = np.array([0.5, 0.44, 0.35]), np.array([1.0, 0.85, 0.6])
    for name, way in zip(FACES, face_directions(), strict=True):
        up = way[:, :, 1:2]
        sky = horizon + (zenith - horizon) * np.sqrt(np.maximum(up, 0.0))
        below = horizon + (ground - horizon) * np.minimum(1.0, np.maximum(-up, 0.0) * 12.0)
        near = np.maximum((way * np.array(sun)).sum(axis=2, keepdims=True), 0.0)
        light = np.where(up >= 0.0, sky, below) + glow * (0.25 * near**8 + 6.0 * near**2048)
        write_exr(folder / f"{name}.exr", light.astype(np.float32))


def face_directions() -> list[F64]:
    """The direction to each texel of the six faces, (SKY_TEXELS, SKY_TEXELS, 3), unit."""
    line = (np.arange(SKY_TEXELS) + 0.5) / SKY_TEXELS * 2.0 - 1.0
    s, t = np.meshgrid(line, line)
    one = np.ones_like(s)
    axes = ((one, -t, -s), (-one, -t, s), (s, one, t), (s, -one, -t), (s, -t, one), (-s, -t, -one))
    ways = [np.stack(axis, axis=2) for axis in axes]
    return [way / np.sqrt((way * way).sum(axis=2, keepdims=True)) for way in ways]


def write_exr(path: Path, pixels: npt.NDArray[np.float32]) -> None:
    """Writes a picture of half floats. pixels: (height, width, 3), linear."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, oiio.HALF)
    target = oiio.ImageOutput.create(str(path))
    written = target and target.open(str(path), spec) and target.write_image(pixels) and target.close()
    if not written:
        raise BakeError(f"cannot be written: {oiio.geterror()}", file=path)


def write_heightmap(path: Path) -> None:
    """Writes a 16-bit heightmap over the full range: flat in the middle, dunes towards the rim."""
    z, x = np.mgrid[0:GROUND_PIXELS, 0:GROUND_PIXELS] / (GROUND_PIXELS - 1.0) * 2.0 - 1.0
    away = np.clip((np.sqrt(x * x + z * z) - 0.45) / 0.4, 0.0, 1.0)
    dunes = 0.5 + 0.27 * np.sin(5.1 * x + 2.3 * z) + 0.23 * np.sin(4.2 * z - 3.1 * x + 1.0)
    height = away * away * (3.0 - 2.0 * away) * dunes
    path.write_bytes(encode_png(np.rint(height * 65535.0).astype(np.uint16)[:, :, None]))


def write_sand(path: Path) -> None:
    """Writes a tileable picture of pale sand with wind ripples and grains."""
    v, u = np.mgrid[0:SAND_TEXELS, 0:SAND_TEXELS] / float(SAND_TEXELS) * (2.0 * np.pi)
    ripples = np.sin(9.0 * v + 0.9 * np.sin(2.0 * u) + 0.6 * np.sin(3.0 * u + v))
    cell = np.arange(SAND_TEXELS * SAND_TEXELS, dtype=np.uint64)
    cell = (cell ^ (cell >> np.uint64(7))) * np.uint64(0x9E3779B97F4A7C15)
    cell = (cell ^ (cell >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
    grain = (cell >> np.uint64(40)).reshape(SAND_TEXELS, SAND_TEXELS) / float(1 << 24) - 0.5
    tone = 1.0 + 0.035 * ripples + 0.10 * grain
    color = np.array([226.0, 205.0, 160.0]) * tone[:, :, None]
    path.write_bytes(encode_png(np.rint(color.clip(0.0, 255.0)).astype(np.uint8)))


_PROFILE = (  # radius, height; metres
    (0.0, 0.0), (0.20, 0.0), (0.22, 0.02), (0.21, 0.05), (0.30, 0.25), (0.36, 0.45), (0.37, 0.58),
    (0.33, 0.74), (0.24, 0.86), (0.17, 0.93), (0.155, 1.0), (0.18, 1.07), (0.22, 1.11), (0.225, 1.12),
    (0.215, 1.125), (0.17, 1.07), (0.14, 1.0), (0.15, 0.93), (0.21, 0.85),
)  # fmt: skip
_AROUND = 64


def write_vase(folder: Path) -> Path:
    """Writes vase.obj, vase.mtl and vase.png: a surface of revolution with painted bands. Returns the OBJ."""
    points = np.array(_PROFILE)
    fine = _rounded(points, 6)
    step = np.sqrt((np.diff(fine, axis=0) ** 2).sum(axis=1))
    along = np.concatenate([[0.0], np.cumsum(step)]) / step.sum()
    lines = ["mtllib vase.mtl", "usemtl clay", "s 1"]
    for (radius, height), v in zip(fine, along, strict=True):
        for i in range(_AROUND + (radius > 0.0)):  # the middle of the foot has no seam
            angle = 2.0 * np.pi * i / _AROUND
            lines.append(f"v {radius * np.cos(angle):.6f} {height:.6f} {radius * np.sin(angle):.6f}")
            lines.append(f"vt {1.0 - i / _AROUND:.6f} {v:.6f}")
    first = [1, *(1 + _AROUND + j * (_AROUND + 1) for j in range(len(fine) - 1))]  # vertex of each ring
    for j in range(len(fine) - 1):
        for i in range(_AROUND):
            low, high = first[j] + i, first[j + 1] + i
            corners = [low, high, high + 1, low + 1][: 4 if j else 3]
            lines.append("f " + " ".join(f"{k}/{k}" for k in corners))
    (folder / "vase.obj").write_text("\n".join(lines) + "\n")
    (folder / "vase.mtl").write_text("newmtl clay\nmap_Kd vase.png\n")
    (folder / "vase.png").write_bytes(encode_png(_bands()))
    return folder / "vase.obj"


def _rounded(points: F64, parts: int) -> F64:
    """Points on the Catmull-Rom curve through points (n, 2); E. Catmull and R. Rom, "A Class of Local
    Interpolating Splines", 1974."""
    before = np.concatenate([points[:1], points[:-1]])
    after = np.concatenate([points[1:], points[-1:]])
    slope = 0.5 * (after - before)
    t = (np.arange(parts) / parts)[None, :, None]
    a, b = points[:-1, None], points[1:, None]
    ta, tb = slope[:-1, None], slope[1:, None]
    curve = (
        (2 * t**3 - 3 * t**2 + 1) * a + (t**3 - 2 * t**2 + t) * ta
        + (3 * t**2 - 2 * t**3) * b + (t**3 - t**2) * tb
    )  # fmt: skip
    whole = np.concatenate([curve.reshape(-1, 2), points[-1:]])
    whole[:, 0] = np.maximum(whole[:, 0], 0.0)
    return np.asarray(whole)


def _bands() -> npt.NDArray[np.uint8]:
    """Terracotta with dark bands and a wave, (512, 1024, 3)."""
    v, u = np.mgrid[0:512, 0:1024] / np.array([512.0, 1024.0])[:, None, None]
    v = 1.0 - v
    clay, dark, pale = (
        np.array([186.0, 98.0, 58.0]),
        np.array([58.0, 34.0, 28.0]),
        np.array([232.0, 200.0, 150.0]),
    )
    throw = 1.0 + 0.035 * np.sin(240.0 * v) + 0.02 * np.sin(2.0 * np.pi * 3.0 * u + 40.0 * v)
    color = clay * throw[:, :, None]
    wave = 0.36 + 0.018 * np.sin(2.0 * np.pi * 16.0 * u)
    for low, high, paint in (
        (0.20, 0.215, dark),
        (0.29, 0.43, pale),
        (0.52, 0.535, dark),
        (0.56, 0.565, dark),
    ):
        color = np.where(((v > low) & (v < high))[:, :, None], paint * throw[:, :, None], color)
    color = np.where((np.abs(v - wave) < 0.014)[:, :, None], dark, color)
    return np.asarray(np.rint(color.clip(0.0, 255.0)), dtype=np.uint8)

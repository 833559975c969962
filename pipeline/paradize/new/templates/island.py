"""Makes the sources of the templates `island` and `night`: ground, waves, palm, lantern, where they stand,
and a sky at night. Every file is computed; it is the same on every machine up to the rounding of sines.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from paradize.formats.png import encode_png
from paradize.new.sources import FACES, face_directions, write_exr

if TYPE_CHECKING:
    import numpy.typing as npt

    F64 = npt.NDArray[np.float64]

SIZE_M, HEIGHT_M, BASE_M = 120.0, 14.0, -10.0  # as island.toml has them
PALMS = (  # x, z, yaw in degrees, scale
    (-3.0, 1.5, 20.0, 1.0), (1.8, -2.2, 150.0, 1.15), (5.2, 2.4, 265.0, 0.85), (-6.5, -3.4, 80.0, 0.9),
    (0.6, 5.0, 330.0, 0.7),
)  # fmt: skip
LANTERNS = ((-0.6, 1.2), (4.2, -1.4), (-8.0, 7.0), (9.5, 6.5))
_GROUND_PIXELS, _WAVE_TEXELS = 257, 128
_TRUNK, _SIDES, _FRONDS, _PARTS = 10, 8, 13, 8  # rings, sides of a ring, fronds, pieces of a frond


def ground_m(x: F64, z: F64) -> F64:
    """The height of the ground, metres: a dome with a bay in the south, dunes, and a floor that falls off."""
    away = np.sqrt(x * x + (1.25 * z) ** 2) / 22.0
    bay = np.exp(-((x - 2.0) ** 2 + (z - 17.0) ** 2) / 60.0)
    dunes = 0.35 * np.sin(0.31 * x + 0.17 * z) + 0.25 * np.sin(0.26 * z - 0.19 * x + 1.0)
    height = 3.0 * (1.0 - away * away) / (1.0 + 0.25 * away * away) - 1.6 * bay
    return np.asarray(np.clip(height + dunes * np.exp(-away), BASE_M, BASE_M + HEIGHT_M))


def write_sources(folder: Path) -> None:
    """Writes ground.png, waves.png, palm.obj, palm.mtl and palms.csv."""
    line = (np.arange(_GROUND_PIXELS) / (_GROUND_PIXELS - 1.0) - 0.5) * SIZE_M
    x, z = np.meshgrid(line, line)
    code = np.rint((ground_m(x, z) - BASE_M) / HEIGHT_M * 65535.0).astype(np.uint16)
    (folder / "ground.png").write_bytes(encode_png(code[:, :, None]))
    v, u = np.mgrid[0:_WAVE_TEXELS, 0:_WAVE_TEXELS] / float(_WAVE_TEXELS) * (2.0 * np.pi)
    waves = sum(np.sin(kx * u + kz * v + 1.7 * kx * kz) / (abs(kx) + abs(kz)) for kx, kz in _WAVE_NUMBERS)
    waves = (waves - waves.min()) / (waves.max() - waves.min())
    (folder / "waves.png").write_bytes(encode_png(np.rint(waves * 65535.0).astype(np.uint16)[:, :, None]))
    (folder / "palm.obj").write_text(_palm(), encoding="utf-8")
    (folder / "palm.mtl").write_text("newmtl trunk\nKd 1 1 1\nnewmtl leaves\nKd 1 1 1\n", encoding="utf-8")
    rows = [(x, _foot(x, z), z, yaw, scale) for x, z, yaw, scale in PALMS]
    (folder / "palms.csv").write_text(_table("x,y,z,yaw_deg,scale", rows), encoding="utf-8")


_WAVE_NUMBERS = ((1, 2), (2, -1), (3, 1), (-2, 4), (5, 2), (4, -5), (7, 3), (-3, 8), (9, -4), (6, 10))


def write_lanterns(folder: Path) -> None:
    """Writes lantern.obj, lantern.mtl and lanterns.csv: a post with a lamp, its lit part emits."""
    lines, count = ["mtllib lantern.mtl", "s off"], 0
    for material, half, low, high in (
        ("wood", 0.05, -0.4, 1.4), ("lamp", 0.10, 1.4, 1.7), ("wood", 0.14, 1.7, 1.76),
    ):  # fmt: skip
        lines.append(f"usemtl {material}")
        for y in (low, high):
            lines += [
                f"v {a * half:.3f} {y:.3f} {b * half:.3f}" for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
        for face in ((1, 2, 3, 4), (8, 7, 6, 5), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1)):
            lines.append("f " + " ".join(str(count + k) for k in face))
        count += 8
    (folder / "lantern.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    material = "newmtl wood\nKd 0.25 0.18 0.12\nnewmtl lamp\nKd 0.9 0.7 0.4\nKe 4.0 2.4 1.0\n"
    (folder / "lantern.mtl").write_text(material, encoding="utf-8")
    rows = [(x, _foot(x, z), z) for x, z in LANTERNS]
    (folder / "lanterns.csv").write_text(_table("x,y,z", rows), encoding="utf-8")


def write_night_sky(folder: Path) -> None:
    """Writes six faces <FACES>.exr, linear light: a clear night, a little brighter at the horizon. The player
    adds stars and moon."""
    for name, way in zip(FACES, face_directions(), strict=True):
        near_horizon = np.exp(-6.0 * np.abs(way[:, :, 1:2]))
        light = np.array([0.006, 0.011, 0.026]) + np.array([0.012, 0.018, 0.030]) * near_horizon
        write_exr(folder / f"{name}.exr", light.astype(np.float32))


def flight_text() -> str:
    """The waypoints: once round the island, 2 to 5 m above the water."""
    lines = []
    for k in range(8):
        turn = 2.0 * np.pi * k / 8.0
        x, z = 33.0 * np.sin(turn), 30.0 * np.cos(turn)
        height = 2.2 + 1.4 * (1.0 - np.cos(turn))
        lines += ["", "[[flight.eye]]", f"position = [{x + 0.0:.2f}, {height:.2f}, {z + 0.0:.2f}]"]
    for _ in range(8):
        lines += ["", "[[flight.target]]", "position = [0.0, 4.0, 0.0]"]
    return "\n".join(lines) + "\n"


def _foot(x: float, z: float) -> float:
    return float(ground_m(np.array(x), np.array(z)))


def _table(head: str, rows: Sequence[tuple[float, ...]]) -> str:
    return "\n".join([head, *(",".join(f"{value:.3f}" for value in row) for row in rows)]) + "\n"


def _palm() -> str:
    """An OBJ of a palm, 7 m, foot at the origin, coloured by vertex: trunk and leaves."""
    points: list[str] = []
    lines = ["usemtl trunk"]
    t = np.arange(_TRUNK) / (_TRUNK - 1.0)
    middle = np.stack([1.6 * t * t, 7.2 * t - 0.5, 0.3 * t * t], axis=1)
    for k, (x, y, z) in enumerate(middle):
        radius = 0.24 - 0.13 * t[k] + (0.10 if k == 0 else 0.0)
        shade = 0.85 + 0.15 * (k % 2)
        for i in range(_SIDES):
            a = 2.0 * np.pi * i / _SIDES
            points.append(
                f"v {x + radius * np.cos(a):.4f} {y:.4f} {z + radius * np.sin(a):.4f} "
                f"{0.50 * shade:.3f} {0.42 * shade:.3f} {0.34 * shade:.3f}"
            )
    for k in range(_TRUNK - 1):
        for i in range(_SIDES):
            a, b = k * _SIDES + i + 1, k * _SIDES + (i + 1) % _SIDES + 1
            lines.append(f"f {a} {a + _SIDES} {b + _SIDES} {b}")
    lines.append("usemtl leaves")
    top = middle[-1]
    for k in range(_FRONDS):
        turn, rise = 2.0 * np.pi * (k * 0.618034 % 1.0), 0.75 - 1.0 * k / _FRONDS
        out, across = (
            np.array([np.cos(turn), 0.0, np.sin(turn)]),
            np.array([-np.sin(turn), 0.0, np.cos(turn)]),
        )
        first = len(points) + 1
        for j in range(_PARTS + 1):
            s = j / _PARTS
            spine = top + out * (3.1 * s) + np.array([0.0, (1.5 * rise + 0.5) * s - 2.6 * s * s, 0.0])
            width = 0.62 * np.sin(np.pi * min(0.12 + 0.88 * s, 1.0)) ** 0.8 * (1.0 - 0.2 * (j % 2)) + 0.01
            color = f"{0.24 + 0.26 * s:.3f} {0.38 + 0.20 * s:.3f} {0.10 + 0.05 * s:.3f}"
            for side in (-1.0, 0.0, 1.0):
                x, y, z = spine + side * width * across - np.array([0.0, 0.35 * width * abs(side), 0.0])
                points.append(f"v {x:.4f} {y:.4f} {z:.4f} {color}")
        for j in range(_PARTS):
            a = first + 3 * j
            lines += [f"f {a} {a + 1} {a + 4} {a + 3}", f"f {a + 1} {a + 2} {a + 5} {a + 4}"]
    return "\n".join(["mtllib palm.mtl", "s 1", *points, *lines]) + "\n"

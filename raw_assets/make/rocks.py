"""Granite boulders in islets off the south-eastern coast and at the tips of the lagoon.

Usage: python rocks.py RAW_ASSETS
Writes the models rocks/boulder.obj and slab.obj, their common atlas rocks.png, and where each stands,
boulder.csv and slab.csv. A boulder's middle lies near the sea's level, so the tide's dark band on the atlas
meets the water.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from noise import fbm, smoothstep
from objfile import Model, grid_triangles, write_mtl
from paint import mix, rand
from picture import hex_color, write_image

Floats = NDArray[np.float64]

FACE_PX = 256  # of one side of the cube that a boulder is made of
GUTTER_PX = 10
CELLS = 11  # quads along a side
# name: planes that cut it, radius along y as a share, seed
SHAPES = {"boulder": (13, 0.9, 5), "slab": (10, 0.55, 8)}
ROUNDING = 22.0  # exponent of the mean that rounds the edges between planes
# x, z, radius of the group, boulders, radius of the largest, metres
ISLETS = (
    (90.0, 103.0, 8.0, 12, 3.4),
    (118.0, 84.0, 11.0, 15, 4.6),
    (104.0, 58.0, 7.0, 10, 2.6),
    (92.0, 30.0, 9.0, 12, 3.6),
    (-52.0, 46.0, 7.0, 11, 2.1),
)
# right, up and outwards of each side of the cube, the three of a row side by side in the atlas
SIDES = (
    ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
    ((-1, 0, 0), (0, 1, 0), (0, 0, -1)),
    ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
)


def side_directions(side: int, across: Floats, up: Floats) -> Floats:
    """Unit directions (..., 3) through points of a side of the cube; across, up: -1..1, and beyond for the
    gutter."""
    right, upwards, out = (np.array(axis, dtype=np.float64) for axis in SIDES[side])
    # Equal angles, so that cells of the middle and of the corners differ less in size.
    a, b = np.tan(across * math.pi / 4.0)[..., None], np.tan(up * math.pi / 4.0)[..., None]
    point = a * right + b * upwards + out
    return np.asarray(point / np.sqrt((point * point).sum(axis=-1, keepdims=True)))


def solid_noise(directions: Floats, scale: float, seed: int, octaves: int) -> Floats:
    """Noise on the sphere, about [-1, 1], without a seam: the mean of noise on three planes through it."""
    x, y, z = np.moveaxis(directions * scale, -1, 0)
    planes = ((x + 0.3 * z, y - 0.4 * z), (y + 0.35 * x, z + 0.3 * x), (z - 0.4 * y, x + 0.3 * y))
    return np.asarray(
        sum(fbm(u + 7.7 * k, v - 3.1 * k, seed + 13 * k, octaves) for k, (u, v) in enumerate(planes)) / 1.8
    )


def radii(directions: Floats, planes: int, seed: int) -> Floats:
    """Distance from a boulder's middle to its surface, (...): planes at random, with rounded edges."""
    total = np.zeros(directions.shape[:-1])
    for k in range(planes):
        y = 1.0 - 2.0 * (k + 0.5) / planes  # a spiral from pole to pole, disturbed
        turn = 2.39996 * k + 0.9 * rand(3 * k, seed)
        flat = math.sqrt(1.0 - y * y)
        normal = np.array([flat * math.cos(turn), y, flat * math.sin(turn)])
        away = 0.78 + 0.42 * rand(3 * k + 1, seed)
        total += (np.maximum(directions @ normal, 0.0) / away) ** ROUNDING
    rounded = np.maximum(total, 1e-9) ** (-1.0 / ROUNDING)
    return np.asarray(np.minimum(rounded, 1.35) * (1.0 + 0.09 * solid_noise(directions, 2.6, seed, 3)))


def build(planes: int, flatness: float, seed: int) -> Model:
    """A boulder of radius 1 as a model."""
    model = Model(3 * FACE_PX, 2 * FACE_PX)
    line = np.linspace(-1.0, 1.0, CELLS + 1)
    across, up = (grid.reshape(-1) for grid in np.meshgrid(line, line))
    points, pixels, faces = [], [], []
    inner = FACE_PX / 2 - GUTTER_PX
    for side in range(len(SIDES)):
        directions = side_directions(side, across, up)
        points.append(directions * radii(directions, planes, seed)[:, None] * [1.0, flatness, 1.0])
        middle = np.array([(side % 3 + 0.5) * FACE_PX, (side // 3 + 0.5) * FACE_PX])
        pixels.append(middle + inner * np.stack([across, -up], axis=1))
        faces.append(grid_triangles(CELLS + 1, CELLS + 1) + side * len(across))
    model.add("rock", "rock", np.concatenate(points), np.concatenate(pixels), np.concatenate(faces))
    return model


def paint() -> Floats:
    """The atlas (h, w, 3), sRGB: granite with speckles and cracks, dark and green where the tide reaches,
    washed lighter from above."""
    sheet = np.zeros((2 * FACE_PX, 3 * FACE_PX, 3))
    reach = (np.arange(FACE_PX) + 0.5 - FACE_PX / 2) / (FACE_PX / 2 - GUTTER_PX)
    across, down = np.meshgrid(reach, reach)
    for side in range(len(SIDES)):
        direction = side_directions(side, across, -down)
        height = direction[..., 1]
        broad, grain = solid_noise(direction, 2.2, 21, 4), solid_noise(direction, 30.0, 25, 2)
        color = mix(hex_color("#8f8377"), hex_color("#b9aa97"), smoothstep(-0.5, 0.6, broad))
        rust = smoothstep(0.15, 0.7, solid_noise(direction, 1.7, 33, 3))
        color = mix(color, hex_color("#a5815f"), 0.55 * rust)
        cracks = smoothstep(0.06, 0.0, np.abs(solid_noise(direction, 2.9, 41, 4)))
        color = color * (1.0 + 0.22 * grain - 0.34 * cracks)[..., None]
        streaks = solid_noise(direction * [1.0, 0.15, 1.0], 9.0, 51, 3)
        washed = smoothstep(0.1, 0.6, streaks) * smoothstep(-0.2, 0.5, height)
        color = color * (1.0 - 0.25 * washed)[..., None]
        color = mix(color, hex_color("#cfc5b4"), 0.35 * smoothstep(0.55, 1.0, height + 0.2 * broad))
        tide = smoothstep(0.26, 0.14, height + 0.09 * broad)
        color = mix(color, hex_color("#3d3b33"), 0.72 * tide)
        color = mix(color, hex_color("#4c5a34"), 0.4 * smoothstep(0.10, -0.02, height + 0.12 * broad))
        top, left = side // 3 * FACE_PX, side % 3 * FACE_PX
        sheet[top : top + FACE_PX, left : left + FACE_PX] = color
    return np.clip(sheet, 0.02, 1.0)


def places() -> dict[str, list[str]]:
    """Rows of the files of instances, by shape: in each group the largest in the middle."""
    names = list(SHAPES)
    rows: dict[str, list[str]] = {name: [] for name in names}
    at = 0
    for x, z, reach, count, largest in ISLETS:
        for k in range(count):
            r = [rand(8 * at + i, 83) for i in range(7)]
            share = math.sqrt((k + 0.3 * r[0]) / count)
            turn = 2.39996 * k + 0.8 * r[1]
            size = largest * (1.0 - 0.72 * share) * (0.75 + 0.5 * r[2])
            name = names[int(r[3] > 0.7)]
            place = (x + reach * share * math.cos(turn), 0.12 * size, z + reach * share * math.sin(turn))
            turns = f"{360.0 * r[4]:.1f},{16.0 * r[5] - 8.0:.1f},{16.0 * r[6] - 8.0:.1f}"
            rows[name].append(",".join(f"{v:.2f}" for v in place) + f",{turns},{size:.3f}")
            at += 1
    return rows


def make(out: Path) -> None:
    """Writes the folder rocks under out."""
    folder = out / "rocks"
    folder.mkdir(parents=True, exist_ok=True)
    note = "A granite boulder, made by raw_assets/make/rocks.py; metres, Y up"
    for name, (planes, flatness, seed) in SHAPES.items():
        build(planes, flatness, seed).write(folder / f"{name}.obj", "rocks.mtl", note)
    plain = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1", "map_Kd rocks.png"]
    write_mtl(folder / "rocks.mtl", note, {"rock": plain})
    for name, rows in places().items():
        text = "\n".join(["x,y,z,yaw_deg,pitch_deg,roll_deg,scale", *rows]) + "\n"
        (folder / f"{name}.csv").write_text(text, encoding="ascii", newline="\n")
    write_image(folder / "rocks.png", paint(), "uint8")


if __name__ == "__main__":
    make(Path(sys.argv[1]))

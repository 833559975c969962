"""Shells where the highest waves left them: shore/shell.obj, coloured by vertex, and shells.csv.

Usage: python shells.py RAW_ASSETS
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

from grove import write_places
from objfile import grid_triangles, write_colored, write_mtl
from paint import rand
from terrain import height_at

COUNT = 900
BAND_M = (0.13, 0.42)  # above the sea
PALM_FOOT, FOOT_M = (-25.0, 3.0), 0.8  # where island.toml has the palm: none lies in its foot
RIBS = 9
ROWS = 4  # from the hinge to the rim
RADIUS_M = 0.055
HINGE_COLOR = (0.90, 0.74, 0.62)  # sRGB
RIM_COLOR = (0.93, 0.86, 0.74)


def write_shell(folder: Path) -> None:
    """Writes shell.obj and shell.mtl: a scallop that lies on its open side, hinge at the origin's edge."""
    columns = 2 * RIBS + 1
    points, colors = [], []
    for i in range(ROWS):
        s = 0.12 + 0.88 * i / (ROWS - 1)
        for k in range(columns):
            angle = math.radians(66.0) * (2.0 * k / (columns - 1) - 1.0)
            rib = 1.0 if k % 2 else -1.0
            reach = RADIUS_M * 1.5 * s * (1.0 + 0.025 * rib * s) * (1.0 - 0.10 * (angle / 1.15) ** 2)
            rise = 0.62 * math.sin(math.pi * min(1.0, 0.25 + 0.75 * s)) + 0.05 * rib * s
            rise *= math.cos(0.9 * angle)
            points.append(
                [
                    reach * math.sin(angle),
                    RADIUS_M * max(rise, -0.1),
                    reach * math.cos(angle) - 0.75 * RADIUS_M,
                ]
            )
            shade = 1.0 + 0.06 * rib
            colors.append(
                [min(1.0, (a + (b - a) * s) * shade) for a, b in zip(HINGE_COLOR, RIM_COLOR, strict=True)]
            )
    faces = grid_triangles(ROWS, columns)[:, ::-1]
    note = "A scallop, made by raw_assets/make/shells.py; metres, Y up"
    write_colored(folder / "shell.obj", "shell.mtl", note, "shell", np.array(points), faces, np.array(colors))
    write_mtl(folder / "shell.mtl", note, {"shell": ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]})


def make(out: Path) -> None:
    """Writes the folder shore under out."""
    folder = out / "shore"
    folder.mkdir(parents=True, exist_ok=True)
    found: list[tuple[float, float, float]] = []
    for k in range(120 * COUNT):
        x, z = 130.0 * rand(2 * k, 61) - 65.0, 130.0 * rand(2 * k + 1, 61) - 65.0
        y = height_at(x, z)
        in_foot = math.hypot(x - PALM_FOOT[0], z - PALM_FOOT[1]) < FOOT_M
        if BAND_M[0] < y < BAND_M[1] and not in_foot and len(found) < COUNT:
            found.append((x, y, z))
    write_places(folder / "shells.csv", np.array(found), 62, scale=(0.8, 1.6), lean_deg=9.0)
    write_shell(folder)


if __name__ == "__main__":
    make(Path(sys.argv[1]))

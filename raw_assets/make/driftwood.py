"""Driftwood on the beach: two bleached branches, coloured by vertex, and where a dozen of each lie.

Usage: python driftwood.py RAW_ASSETS, after palm.py
Writes the folder driftwood: log.obj, branch.obj, driftwood.mtl, log.csv, branch.csv.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from grove import distance_to_way, flight_way
from objfile import grid_triangles, write_colored, write_mtl
from paint import rand
from terrain import height_at

Floats = NDArray[np.float64]

AROUND, RINGS = 10, 16
BAND_M = (0.32, 0.85)  # above the sea: where storms leave it
CLEAR_M = 1.6  # from the camera's way
COUNT = 12
LIGHT, DARK = np.array([0.88, 0.84, 0.77]), np.array([0.56, 0.51, 0.45])  # sRGB
# name: length and radius at the foot in metres, bend, boughs, seed
SHAPES = {"log": (2.6, 0.13, 0.35, 2, 5), "branch": (1.5, 0.055, 0.8, 4, 9)}


class Wood:
    """Collects tapered, bent tubes as one mesh."""

    def __init__(self) -> None:
        self.points: list[Floats] = []
        self.colors: list[Floats] = []
        self.faces: list[NDArray[np.int64]] = []
        self.count = 0

    def tube(self, spine: Floats, radii: Floats, seed: int) -> None:
        """Adds a tube round a spine (n, 3), closed at both ends, with grooves along it."""
        along = np.gradient(spine, axis=0)
        along /= np.sqrt((along * along).sum(axis=1, keepdims=True))
        side = np.cross(along, [0.13, 1.0, 0.21])
        side /= np.sqrt((side * side).sum(axis=1, keepdims=True))
        top = np.cross(side, along)
        rows, shades = [], []
        for i in range(len(spine)):
            for k in range(AROUND + 1):
                groove = rand(k % AROUND, seed)
                knot = rand(i * AROUND + k % AROUND, seed + 1)
                turn = 2.0 * math.pi * k / AROUND
                reach = radii[i] * (0.86 + 0.2 * groove + 0.12 * (knot - 0.5))
                rows.append(spine[i] + reach * (math.cos(turn) * side[i] + math.sin(turn) * top[i]))
                under = 0.5 - 0.5 * math.sin(turn)
                light = min(1.0, max(0.0, 0.95 * groove + 0.35 * knot - 0.45 * under))
                shades.append(DARK + (LIGHT - DARK) * light)
        self.points.append(np.array(rows))
        self.colors.append(np.array(shades))
        self.faces.append(grid_triangles(len(spine), AROUND + 1)[:, ::-1] + self.count)
        self.count += len(rows)


def build(length: float, radius: float, bend: float, boughs: int, seed: int) -> Wood:
    """A piece that lies along x, its middle at the origin, a third of its thickness in the sand."""
    wood = Wood()
    s = np.linspace(0.0, 1.0, RINGS)
    taper = radius * (1.0 - 0.55 * s)
    ends = np.clip(np.minimum(s / 0.03, (1.0 - s) / 0.05), 0.06, 1.0)
    across = bend * length * (0.25 * s * s + 0.05 * np.sin(5.0 * s + seed))
    rise = 0.35 * radius + 0.5 * bend * radius * np.sin(2.4 * s + seed)
    spine = np.stack([length * (s - 0.5), rise, across - across.mean()], axis=1)
    wood.tube(spine, taper * ends, seed)
    for k in range(boughs):
        at = int((0.3 + 0.6 * (k + rand(k, seed)) / boughs) * (RINGS - 1))
        turn = 0.5 + 0.9 * rand(k, seed + 2)
        out = np.array([math.cos(turn), 0.15 + 0.45 * rand(k, seed + 3), (-1.0) ** k * math.sin(turn)])
        reach = length * (0.10 + 0.16 * rand(k, seed + 4))
        t = np.linspace(0.0, 1.0, 7)[:, None]
        curve = spine[at] + reach * t * out + 0.12 * reach * t * t * np.array([0.6, 0.5, 0.0])
        end = np.clip((1.0 - t[:, 0]) / 0.12, 0.06, 1.0)
        wood.tube(curve, taper[at] * (0.62 - 0.3 * t[:, 0]) * end, seed + 10 + k)
    return wood


def write_wood(path: Path, wood: Wood) -> None:
    """Writes an OBJ with a colour for each vertex."""
    note = "Driftwood, made by raw_assets/make/driftwood.py; metres, Y up"
    points, faces, colors = (np.concatenate(part) for part in (wood.points, wood.faces, wood.colors))
    write_colored(path, "driftwood.mtl", note, "wood", points, faces, colors)


def places(way: Floats, seed: int) -> list[str]:
    """Rows of a file of instances: on the upper beach, beside the camera's way, along the slope."""
    rows: list[str] = []
    for k in range(4000 * COUNT):
        x, z = 130.0 * rand(2 * k, seed) - 65.0, 130.0 * rand(2 * k + 1, seed) - 65.0
        y = height_at(x, z)
        if not BAND_M[0] < y < BAND_M[1] or distance_to_way(way, x, z) < CLEAR_M:
            continue
        slope_x = (height_at(x + 0.5, z) - height_at(x - 0.5, z)) / 1.0
        slope_z = (height_at(x, z + 0.5) - height_at(x, z - 0.5)) / 1.0
        # The waves lay it along the shore: across the slope, turned a little by chance.
        yaw = math.degrees(math.atan2(slope_x, slope_z)) + 70.0 * (rand(k, seed + 1) - 0.5)
        rows.append(f"{x:.2f},{y:.2f},{z:.2f},{yaw % 360.0:.1f},{0.7 + 0.7 * rand(k, seed + 2):.3f}")
        if len(rows) == COUNT:
            break
    return rows


def make(out: Path) -> None:
    """Writes the folder driftwood under out."""
    folder = out / "driftwood"
    folder.mkdir(parents=True, exist_ok=True)
    way = flight_way(Path(__file__).resolve().parents[1] / "island.toml")
    for name, shape in SHAPES.items():
        write_wood(folder / f"{name}.obj", build(*shape))
        text = "\n".join(["x,y,z,yaw_deg,scale", *places(way, 91 + shape[-1])]) + "\n"
        (folder / f"{name}.csv").write_text(text, encoding="ascii", newline="\n")
    note = "Driftwood, made by raw_assets/make/driftwood.py; coloured by vertex"
    write_mtl(
        folder / "driftwood.mtl", note, {"wood": ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]}
    )


if __name__ == "__main__":
    make(Path(sys.argv[1]))

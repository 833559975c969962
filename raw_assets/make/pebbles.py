"""Pebbles that waves washed together on the beach: shore/pebbles.obj, coloured by vertex, and pebbles.csv.

Usage: python pebbles.py RAW_ASSETS
The model is a handful of them; they lie near the camera's way alone.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from grove import distance_to_way, flight_way, write_places
from noise import fbm
from objfile import write_colored, write_mtl
from paint import rand
from picture import hex_color
from terrain import height_at

Floats = NDArray[np.float64]

COUNT = 220
BAND_M = (0.12, 0.75)  # above the sea
AWAY_M = (0.8, 12.0)  # from the camera's way
EACH, REACH_M, GAP_M = 9, 0.26, 0.01  # pebbles of a handful, where they lie, and between two
RADIUS_M = (0.010, 0.042)
SIDES = 7
RINGS = ((1.0, -0.35), (0.93, 0.32), (0.52, 0.86))  # reach and height as shares, from below the sand upwards
COLORS = ("#a39a8e", "#c2b49c", "#857d74", "#ded3c0", "#b08d6e", "#96958f")


def stones() -> list[tuple[float, float, float]]:
    """x, z and radius of each pebble of a handful, metres; none touches another."""
    found: list[tuple[float, float, float]] = []
    for k in range(400):
        r = [rand(4 * k + i, 171) for i in range(4)]
        turn, away, radius = 2.0 * math.pi * r[0], REACH_M * r[1] ** 0.8, RADIUS_M[0]
        radius += (RADIUS_M[1] - RADIUS_M[0]) * r[2] ** 2.0
        x, z = away * math.cos(turn), away * math.sin(turn)
        if all(math.hypot(x - a, z - c) > 1.3 * (radius + other) + GAP_M for a, c, other in found):
            found.append((x, z, radius))
        if len(found) == EACH:
            break
    return found


def write_pebbles(folder: Path) -> None:
    """Writes pebbles.obj and pebbles.mtl: worn stones, flat and open below, where the sand hides them."""
    points, faces, colors = [], [], []
    for k, (x, z, radius) in enumerate(stones()):
        r = [rand(16 * k + i, 172) for i in range(16)]
        turn, long, flat = 2.0 * math.pi * r[0], 1.0 + 0.3 * r[1], 0.45 + 0.3 * r[2]
        color, first = hex_color(COLORS[k % len(COLORS)]), len(points)
        for ring, (reach, height) in enumerate(RINGS):
            for i in range(SIDES):
                angle = 2.0 * math.pi * (i + 0.5 * ring) / SIDES
                uneven = 1.0 + 0.16 * (r[3 + i] - 0.5)
                u, v = long * reach * uneven * math.cos(angle), reach * uneven * math.sin(angle) / long
                points.append(
                    [
                        x + radius * (math.cos(turn) * u - math.sin(turn) * v),
                        radius * flat * height,
                        z + radius * (math.sin(turn) * u + math.cos(turn) * v),
                    ]
                )
                colors.append(np.clip(color * (0.82 + 0.2 * (height + 0.35) + 0.1 * (r[9] - 0.5)), 0.0, 1.0))
                a, b = first + ring * SIDES + i, first + ring * SIDES + (i + 1) % SIDES
                c, d = a + SIDES, b + SIDES
                if ring < len(RINGS) - 1:
                    faces += [(a, c, b), (b, c, d)]
                else:
                    faces.append((a, first + len(RINGS) * SIDES, b))
        points.append([x, radius * flat, z])
        colors.append(np.clip(1.06 * color, 0.0, 1.0))
    note = "A handful of pebbles, made by raw_assets/make/pebbles.py; metres, Y up"
    shape = np.array(points), np.array(faces), np.array(colors)
    write_colored(folder / "pebbles.obj", "pebbles.mtl", note, "pebbles", *shape)
    plain = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]
    write_mtl(folder / "pebbles.mtl", note, {"pebbles": plain})


def places(way: Floats) -> Floats:
    """Where handfuls lie, (n, 3) metres: in drifts, on the beach beside the camera's way."""
    found: list[tuple[float, float, float]] = []
    for k in range(200 * COUNT):
        x, z = 130.0 * rand(2 * k, 173) - 65.0, 130.0 * rand(2 * k + 1, 173) - 65.0
        y = height_at(x, z)
        drift = float(fbm(np.array([x / 3.5]), np.array([z / 3.5]), 174, 2)[0])
        if BAND_M[0] < y < BAND_M[1] and drift > 0.12 and AWAY_M[0] < distance_to_way(way, x, z) < AWAY_M[1]:
            found.append((x, y, z))
        if len(found) == COUNT:
            break
    return np.array(found)


def make(out: Path) -> None:
    """Writes the folder shore under out."""
    folder = out / "shore"
    folder.mkdir(parents=True, exist_ok=True)
    way = flight_way(Path(__file__).resolve().parents[1] / "island.toml")
    write_places(folder / "pebbles.csv", places(way), 175, scale=(0.55, 1.15), lean_deg=2.0)
    write_pebbles(folder)


if __name__ == "__main__":
    make(Path(sys.argv[1]))

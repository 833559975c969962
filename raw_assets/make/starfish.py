"""Starfish on the floor of the lagoon: shore/starfish.obj, coloured by vertex, and starfish.csv.

effect.py says where most of them lie, and paints those that the flight does not see from near by.

Usage: python starfish.py RAW_ASSETS
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

import effect
import terrain
from objfile import write_colored, write_mtl
from terrain import height_at

ARMS, RINGS, AROUND = 5, 6, 8  # points along an arm's length, and from its one side to the other
RIDGE_COLOR, RIM_COLOR, TIP_COLOR = (1.0, 0.88, 0.62), (0.76, 0.20, 0.09), (1.0, 0.80, 0.50)  # sRGB
# Of the rim above the sand, whose triangles are up to 1.5 cm wrong, and lifted to where water shows them at
# their corners alone (shaders/lib/position.glsl).
LIFT_M = 0.03
# x, z, turn in radians, radius: where the flight looks down as night falls, and effect.py leaves bare sand
MORE = (
    (6.5, 18.3, 0.4, 0.30),
    (3.2, 20.4, 1.3, 0.38),
    (7.4, 22.4, 2.2, 0.42),
    (4.6, 25.6, 0.9, 0.34),
    (10.6, 27.6, 1.8, 0.40),
)


def arm(number: int) -> tuple[list[list[float]], list[list[float]]]:
    """The points and colours of an arm of a starfish of radius 1, rows from its root to its tip."""
    points, colors = [], []
    middle = 2.0 * math.pi * (number + 0.5) / ARMS
    for ring in range(RINGS):
        s = ring / (RINGS - 1)
        along = 0.10 + 0.90 * s
        width = 0.27 * (1.0 - s) ** 0.8 + 0.045 * (1.0 - s * s)
        for k in range(AROUND + 1):
            across = 2.0 * k / AROUND - 1.0
            dome = math.sqrt(max(1.0 - across * across, 0.0))
            x = along * math.cos(middle) - across * width * math.sin(middle)
            z = along * math.sin(middle) + across * width * math.cos(middle)
            points.append([x, 0.17 * dome * (1.0 - 0.75 * s), z])
            knobs = 1.0 - 0.16 * ((ring + k) % 2)
            ridge = dome**3
            color = [
                (rim + (mid - rim) * ridge) * (1.0 - 0.5 * s) + 0.5 * s * tip
                for rim, mid, tip in zip(RIM_COLOR, RIDGE_COLOR, TIP_COLOR, strict=True)
            ]
            colors.append([min(1.0, c * knobs) for c in color])
    return points, colors


def write_starfish(folder: Path) -> None:
    """Writes starfish.obj and starfish.mtl: five arms that meet under a dome, 1 m from middle to tip."""
    points: list[list[float]] = [[0.0, 0.2, 0.0]]
    colors: list[list[float]] = [list(RIDGE_COLOR)]
    faces = []
    for number in range(ARMS):
        first = len(points)
        more, shades = arm(number)
        points += more
        colors += shades
        row = AROUND + 1
        for k in range(AROUND):
            faces.append([0, first + k + 1, first + k])
            for ring in range(RINGS - 1):
                a = first + ring * row + k
                faces += [[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]
    note = "A starfish, made by raw_assets/make/starfish.py; metres, Y up"
    out = folder / "starfish.obj"
    write_colored(out, "starfish.mtl", note, "starfish", np.array(points), np.array(faces), np.array(colors))
    write_mtl(
        folder / "starfish.mtl", note, {"starfish": ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]}
    )


def places() -> list[tuple[float, float, float, float, float]]:
    """x, y, z, yaw in degrees, and radius of those on the lagoon's floor."""
    found = []
    for star in effect.stars(effect.spread(terrain.heights_m())):
        x, z = effect.place_m(star)
        if effect.is_near(star):
            found.append((x, height_at(x, z) + LIFT_M, z, math.degrees(star.turn), star.radius_m))
    found += [(x, height_at(x, z) + LIFT_M, z, math.degrees(turn), radius) for x, z, turn, radius in MORE]
    return found


def make(out: Path) -> None:
    """Writes the starfish into the folder shore under out."""
    folder = out / "shore"
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["x,y,z,yaw_deg,scale"]
    lines += [f"{x:.2f},{y:.3f},{z:.2f},{yaw:.1f},{radius:.3f}" for x, y, z, yaw, radius in places()]
    (folder / "starfish.csv").write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")
    write_starfish(folder)


if __name__ == "__main__":
    make(Path(sys.argv[1]))

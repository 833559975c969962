"""Models a gull, a crab and a fish, and says where gulls circle, crabs walk and fish swim.

Usage: python animals.py RAW_ASSETS
Writes the folder animals: gull.obj, crab.obj, fish.obj, animals.mtl, the atlases gull.png and crab.png
(animals_paint.py), gull.csv, crab.csv, fish.csv; the fish is coloured by vertex. Local axes, metres: all look
along +Z. The gull's wings lie beyond 6 cm from x = 0 and the crab's legs beyond 5.5 cm, where the scene lets
them beat. A crab's place is a piece of the beach that is flat along its way.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import animals_paint as atlas
from grove import distance_to_way, flight_way
from objfile import Model, grid_triangles, write_mtl
from paint import rand
from picture import hex_color, write_image
from terrain import height_at

Floats = NDArray[np.float64]

SIDES = 7
# z, half width, half height, height of the middle
GULL = (
    (0.335, 0.004, 0.004, 0.005),
    (0.290, 0.013, 0.014, 0.010),
    (0.285, 0.026, 0.028, 0.016),
    (0.235, 0.040, 0.042, 0.022),
    (0.165, 0.046, 0.046, 0.010),
    (0.040, 0.070, 0.066, -0.004),
    (-0.120, 0.055, 0.050, 0.000),
    (-0.230, 0.034, 0.020, 0.008),
    (-0.330, 0.075, 0.005, 0.010),
)
# of a wing: x, z of the leading and of the trailing edge, height
WING = (
    (0.045, 0.105, -0.110, 0.018),
    (0.220, 0.165, -0.085, 0.052),
    (0.420, 0.135, -0.085, 0.068),
    (0.600, 0.020, -0.120, 0.058),
    (0.720, -0.105, -0.165, 0.044),
)
# of a fish: z, half width, half height, colours of back, side and belly
FISH = (
    (0.150, 0.003, 0.004, "#3f5f7a", "#b9c9cc", "#e9ece6"),
    (0.110, 0.017, 0.026, "#3f6f96", "#c9d8da", "#f1f3ee"),
    (0.050, 0.026, 0.042, "#35689a", "#d6e2e2", "#f4f5f0"),
    (-0.030, 0.022, 0.037, "#35689a", "#e8c34a", "#f4f5f0"),
    (-0.100, 0.009, 0.014, "#3f6f96", "#e8c34a", "#e9ece6"),
    (-0.125, 0.004, 0.020, "#d9a62c", "#e8b93a", "#d9a62c"),
    (-0.175, 0.001, 0.052, "#d9a62c", "#f0cf5a", "#d9a62c"),
)
# x, y, z of the middles of their rounds, spread, fish: where the flight looks down at dusk and by night
SHOALS = ((5.4, -0.62, 12.6, 1.5, 10), (5.6, -1.0, 19.5, 2.2, 10), (9.0, -0.9, 28.5, 2.2, 8))
CRABS, WALK_M, FLATNESS_M = 8, (1.3, 0.12), 0.010
WET_M = (0.05, 0.34)  # height of the sand that crabs walk on
CLEAR_M, NEAR_M = 1.3, 4.2  # of the middle of a walk from the camera's way
# x, y, z of the middle, turn of the ellipse, size
GULLS = (
    (4.0, 8.0, 17.0, 20.0, 1.0),
    (0.0, 10.5, 20.0, 75.0, 1.1),
    (-6.0, 7.0, 24.0, 130.0, 0.95),
    (10.0, 9.2, 26.0, 160.0, 1.05),
    (34.0, 11.0, 50.0, 45.0, 1.0),
    (40.0, 9.0, 60.0, 110.0, 1.1),
    (96.0, 10.0, 68.0, 10.0, 1.1),
    (100.0, 13.0, 80.0, 80.0, 1.0),
)


def tube(model: Model, material: str, rings: list[Floats], pixels: list[Floats]) -> None:
    """Rings of points, each closed by its first point, from front to back, and their pixels of the atlas."""
    faces = grid_triangles(len(rings), len(rings[0]))
    model.add(material, material, np.concatenate(rings), np.concatenate(pixels), faces)


def gull() -> Model:
    """A gull with spread wings."""
    model = Model(atlas.WIDTH, atlas.HEIGHT)
    turn = 2.0 * math.pi * np.arange(SIDES + 1) / SIDES
    rings, pixels = [], []
    for z, wide, high, middle in GULL:
        circle = [wide * np.cos(turn), middle + high * np.sin(turn), np.full(SIDES + 1, z)]
        rings.append(np.stack(circle, axis=1)[::-1])
        pixels.append(
            atlas.BODY.pixels(np.full(SIDES + 1, (GULL[0][0] - z) / atlas.GULL_M), turn / math.tau)[::-1]
        )
    tube(model, "gull", rings, pixels)
    for side in (-1.0, 1.0):
        for lower, sheet in ((False, atlas.WING), (True, atlas.UNDERWING)):
            rows, places = [], []
            for edge in (1, 2):
                for station in WING:
                    x, y = station[0], station[3] - (0.012 if lower else 0.0) * (1.0 - station[0])
                    rows.append((side * x, y, station[edge]))
                    places.append(
                        sheet.pixels(np.array((x - WING[0][0]) / atlas.WING_M), np.array(edge - 1.0))
                    )
            faces = grid_triangles(2, len(WING))
            faces = faces[:, ::-1] if (side > 0) == lower else faces
            model.add("gull", "gull", np.array(rows), np.array(places), faces)
    return model


def limb(
    model: Model, joints: list[tuple[float, float, float]], radii: list[float], sheet: atlas.Sheet
) -> None:
    """A leg or claw: a three-sided tube through joints."""
    spine = np.array(joints)
    along = np.gradient(spine, axis=0)
    side = np.cross(along, [0.0, 1.0, 0.001])
    side /= np.sqrt((side * side).sum(axis=1, keepdims=True))
    top = np.cross(side, along)
    top /= np.sqrt((top * top).sum(axis=1, keepdims=True))
    turn = 2.0 * math.pi * np.arange(4) / 3.0
    rings, pixels = [], []
    for i in range(len(spine)):
        ring = np.cos(turn)[:, None] * side[i] + np.sin(turn)[:, None] * top[i]
        rings.append((spine[i] + radii[i] * ring)[::-1])
        pixels.append(sheet.pixels(np.full(4, i / (len(spine) - 1)), turn / math.tau)[::-1])
    tube(model, "crab", rings, pixels)


def crab() -> Model:
    """A crab whose shell is 14 cm wide, its legs on the ground at y = 0."""
    model = Model(atlas.WIDTH, atlas.HEIGHT)
    turn = -2.0 * math.pi * np.arange(10) / 9
    rings, pixels = [], []
    for share in (-1.0, -0.45, 0.1, 0.6, 1.0):
        reach = atlas.shell_reach(share)
        x, z = 0.070 * reach * np.cos(turn), 0.050 * reach * np.sin(turn)
        rings.append(np.stack([x, np.full(10, 0.048 + 0.022 * share), z], axis=1))
        pixels.append(atlas.shell_pixels(share, turn))
    tube(model, "crab", rings, pixels)
    for side in (-1.0, 1.0):
        for k, z in enumerate((-0.036, -0.014, 0.008, 0.030)):
            out = 0.150 + 0.016 * (1.5 - abs(k - 1.5))
            fan = 1.6 * z
            joints = [
                (side * 0.055, 0.046, z),
                (side * 0.104, 0.066, z + 0.4 * fan),
                (side * out, 0.0, z + fan),
            ]
            limb(model, joints, [0.010, 0.008, 0.002], atlas.LEG)
        claw = [
            (side * 0.046, 0.048, 0.034),
            (side * 0.052, 0.050, 0.066),
            (side * 0.046, 0.056, 0.088),
            (side * 0.022, 0.052, 0.112),
        ]
        limb(model, claw, [0.009, 0.011, 0.019, 0.003], atlas.CLAW)
        eye = [(side * 0.018, 0.062, 0.036), (side * 0.020, 0.078, 0.042), (side * 0.020, 0.086, 0.043)]
        limb(model, eye, [0.004, 0.004, 0.006], atlas.EYE)
    return model


def fish() -> Model:
    """A fish, 33 cm long, its tail upright."""
    model = Model()
    turn = 2.0 * math.pi * np.arange(9) / 8
    rings, colors = [], []
    for z, wide, high, back, side, belly in FISH:
        ring = np.stack([wide * np.cos(turn), high * np.sin(turn), np.full(9, z)], axis=1)
        codes = (side, side, back, side, side, side, belly, side, side)  # from the left over the back
        rings.append(ring[::-1])
        colors.append(np.array([hex_color(code) for code in codes])[::-1])
    faces = grid_triangles(len(rings), 9)
    model.add("fish", "fish", np.concatenate(rings), None, faces, colors=np.concatenate(colors))
    return model


def fish_places() -> list[str]:
    """Rows of the file of fish: the middles of their rounds."""
    rows = []
    for shoal, (x, y, z, spread, count) in enumerate(SHOALS):
        for k in range(count):
            r = [2.0 * rand(8 * k + i, 310 + shoal) - 1.0 for i in range(5)]
            place = (x + spread * r[0], y + 0.14 * r[1], z + spread * r[2])
            rows.append(
                ",".join(f"{v:.2f}" for v in place) + f",{180.0 + 180.0 * r[3]:.1f},{1.0 + 0.3 * r[4]:.2f}"
            )
    return rows


def beach(x: float, z: float) -> tuple[float, float, float] | None:
    """Height, turn and pitch, degrees, of an ellipse that lies on the beach with its long axis along the
    shore; None where the beach is not flat enough."""
    slope_x = 0.5 * (height_at(x + 1.0, z) - height_at(x - 1.0, z))
    slope_z = 0.5 * (height_at(x, z + 1.0) - height_at(x, z - 1.0))
    yaw = math.atan2(-slope_x, -slope_z)  # it looks down to the sea
    along, down = (math.cos(yaw), -math.sin(yaw)), (math.sin(yaw), math.cos(yaw))
    fall = -math.hypot(slope_x, slope_z)
    turn = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
    a, b = WALK_M[0] * np.cos(turn), WALK_M[1] * np.sin(turn)
    places = [
        (x + u * along[0] + v * down[0], z + u * along[1] + v * down[1]) for u, v in zip(a, b, strict=True)
    ]
    heights = np.array([height_at(*place) for place in places])
    rest = heights - fall * b
    middle = float(rest.mean())
    if np.abs(rest - middle).max() > FLATNESS_M or not WET_M[0] < heights.min() <= heights.max() < WET_M[1]:
        return None
    return middle, math.degrees(yaw), math.degrees(math.atan(-fall))


def crab_places(way: Floats) -> list[str]:
    """Rows of the file of crabs: on wet sand, near the camera's way and apart from one another."""
    rows: list[str] = []
    taken: list[tuple[float, float]] = []
    for k in range(60000):
        x, z = 80.0 * rand(2 * k, 301) - 36.0, 40.0 * rand(2 * k + 1, 301) - 12.0
        if not CLEAR_M < distance_to_way(way, x, z) < NEAR_M or any(
            math.hypot(x - a, z - c) < 3.6 for a, c in taken
        ):
            continue
        found = beach(x, z)
        if found is None:
            continue
        y, yaw_deg, pitch_deg = found
        taken.append((x, z))
        rows.append(
            f"{x:.2f},{y:.3f},{z:.2f},{yaw_deg % 360.0:.2f},{pitch_deg:.3f},{1.2 + 0.5 * rand(k, 302):.3f}"
        )
        if len(rows) == CRABS:
            break
    return rows


def make(out: Path) -> None:
    """Writes the folder animals under out."""
    folder = out / "animals"
    folder.mkdir(parents=True, exist_ok=True)
    note = "Made by raw_assets/make/animals.py; metres, Y up"
    plain = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]
    materials = {name: [*plain, f"map_Kd {name}.png"] for name in ("gull", "crab")}
    write_mtl(folder / "animals.mtl", note, materials | {"fish": plain})
    fish().write(folder / "fish.obj", "animals.mtl", note)
    for name, model, picture in (("gull", gull(), atlas.gull()), ("crab", crab(), atlas.crab())):
        model.write(folder / f"{name}.obj", "animals.mtl", note)
        write_image(folder / f"{name}.png", picture, "uint8")
    rows = [f"{x:.2f},{y:.2f},{z:.2f},{yaw:.1f},{size:.2f}" for x, y, z, yaw, size in GULLS]
    for name, lines in (("gull", rows), ("fish", fish_places())):
        text = "\n".join(["x,y,z,yaw_deg,scale", *lines]) + "\n"
        (folder / f"{name}.csv").write_text(text, encoding="ascii", newline="\n")
    way = flight_way(Path(__file__).resolve().parents[1] / "island.toml")
    text = "\n".join(["x,y,z,yaw_deg,pitch_deg,scale", *crab_places(way)]) + "\n"
    (folder / "crab.csv").write_text(text, encoding="ascii", newline="\n")


if __name__ == "__main__":
    make(Path(sys.argv[1]))

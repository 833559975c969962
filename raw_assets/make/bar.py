"""Models a beach bar: a deck on posts, a counter with stools, a shelf, and a hipped roof of palm leaves.

Usage: python bar.py RAW_ASSETS
Writes bar/bar.obj, things.obj, bar.mtl, thatch.png and thatch_alpha.png; the wood is the jetty's map. Local
axes, metres: the deck is at y = 0, its middle at the origin; guests come from +Z.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import bar_paint
import jetty_paint as atlas
from jetty import add_cap, add_timber
from objfile import Model, grid_triangles, write_mtl
from paint import rand
from picture import hex_color, write_image

Floats = NDArray[np.float64]

HALF_X, HALF_Z = 2.5, 1.6  # of the deck
FOOT_Y = -1.7  # of the posts, below the sand
POST_X, POST_Z = 2.25, 1.4
BEAM_Y = 2.12
BOARD_M, GAP_M, THICK_M = 0.142, 0.008, 0.03
COUNTER_Y, COUNTER_Z = 1.06, 0.62
SHELF_Y = 1.32
# half extents along x and z and height, at the eave and at the ridge
EAVE, RIDGE = (3.15, 2.30, 1.98), (1.05, 0.04, 3.72)
COURSES = 7  # of leaves, from the eave to the ridge
COLUMNS = 10  # of a course, along each side
SIDES = 8  # of a pole
X, Y, Z = np.eye(3)


def board(
    model: Model, start: Floats, stop: Floats, side: Floats, number: int, wide: float = BOARD_M
) -> None:
    """A board `wide` across and as thick as all, of the jetty's planks; `side`: along its width."""
    add_timber(model, start, stop, side, (wide, THICK_M), number)


def pole(model: Model, number: int, top: Floats, foot: Floats, radius: float, *, capped: bool = True) -> None:
    """A round pole between two points. The dry part of a pole's pattern goes to and fro along it."""
    along = foot - top
    length = math.sqrt(float((along**2).sum()))
    along /= length
    side = np.cross(along, Z if abs(along[2]) < 0.9 else X)
    side /= math.sqrt(float((side**2).sum()))
    front = np.cross(along, side)
    stops = [0.0, *np.arange(1.95, length - 0.2, 1.95), length]
    x0, y0 = atlas.pole_corner(number % atlas.POLES)
    rows, pixels = [], []
    for k, reach in enumerate(stops):
        folded = reach % 3.9
        height = 1.0 - min(folded, 3.9 - folded)
        wide = radius * (0.93 + 0.14 * rand(7 * number + k, 41))
        for j in range(SIDES + 1):
            turn = 2.0 * math.pi * (j % SIDES) / SIDES
            lump = wide * (1.0 + 0.10 * (rand(j % SIDES, 43 + number) - 0.5))
            rows.append(top + reach * along + lump * (math.cos(turn) * side + math.sin(turn) * front))
            pixels.append((x0 + atlas.pole_pixel(height), y0 + atlas.POLE_BAND * j / SIDES))
    points = np.array(rows)
    model.add("poles", "poles", points, np.array(pixels), grid_triangles(len(stops), SIDES + 1))
    if capped:
        add_cap(model, points[:SIDES], number % atlas.POLES, rand(number, 47))


def add_deck(model: Model) -> None:
    """Posts, joists, the deck's boards in two rows, and steps."""
    for k, x in enumerate((-POST_X, 0.0, POST_X)):
        for z in (-POST_Z, POST_Z):
            top = BEAM_Y + 0.16 if x else -THICK_M
            pole(model, 2 * k + int(z > 0), np.array([x, top, z]), np.array([x, FOOT_Y, z]), 0.085)
    for k, z in enumerate((-POST_Z + 0.14, -0.5, 0.5, POST_Z - 0.14)):
        y = -THICK_M - 0.075
        for a, b in ((-HALF_X, 0.02), (-0.02, HALF_X)):
            add_timber(model, np.array([a, y, z]), np.array([b, y, z]), Z, (0.08, 0.14), k)
    step = BOARD_M + GAP_M
    for k in range(round(2 * HALF_X / step)):
        x = -HALF_X + (k + 0.5) * step
        for half, (a, b) in enumerate(((-HALF_Z, 0.0), (0.006, HALF_Z))):
            r = [rand(5 * (2 * k + half) + i, 53) - 0.5 for i in range(4)]
            y = -THICK_M / 2 + 0.006 * r[0]
            start, stop = (
                np.array([x, y, a + 0.04 * r[1] * (1 - half)]),
                np.array([x, y, b + 0.05 * r[2] * half]),
            )
            board(model, start, stop, X, 7 * k + 4 * half)
    for k in range(3):
        y, z = -0.26 - 0.26 * k, HALF_Z + 0.16 + 0.26 * k
        for row in range(2):
            start = np.array([-0.62, y, z + (BOARD_M + GAP_M) * (row - 0.5)])
            board(model, start, start + 1.24 * X, Z, 5 * k + row)
    for x in (-0.5, 0.5):
        low = np.array([x, -0.99, HALF_Z + 0.89])
        add_timber(model, np.array([x, -0.07, HALF_Z - 0.03]), low, X, (0.05, 0.15), 4)


def add_counter(model: Model) -> None:
    """The counter, boarded upright, with a return on the left; a half wall and a shelf at the back."""
    step = BOARD_M + GAP_M
    count = 24
    left = -count * step / 2
    for k in range(count):
        x, z = left + (k + 0.5) * step, COUNTER_Z + 0.012 * (rand(k, 59) - 0.5)
        top = COUNTER_Y - 0.03
        board(model, np.array([x, 0.0, z]), np.array([x, top, z]), X, 5 * k + 1)
    for k in range(8):
        z = COUNTER_Z - (k + 0.6) * step
        start = np.array([left, 0.0, z])
        board(model, start, start + (COUNTER_Y - 0.03) * Y, Z, 3 * k + 2)
    for k in range(4):
        z = COUNTER_Z + 0.20 - k * step
        for a, b in ((left - 0.1, 0.03), (0.035, -left + 0.14)):
            y = COUNTER_Y + 0.004 * rand(k, 61)
            board(model, np.array([a, y, z]), np.array([b, y, z]), Z, 2 * k + int(a > 0))
    for k in range(3):
        x = left + (k - 0.4) * step
        start = np.array([x, COUNTER_Y + 0.002, COUNTER_Z - 8.8 * step])
        board(model, start, np.array([x, COUNTER_Y + 0.002, COUNTER_Z - 0.32]), X, 4 * k + 3)
    for k in range(6):
        y = 0.14 + k * step
        for a, b in ((-POST_X, 0.03), (0.035, POST_X)):
            start = np.array([a, y, -POST_Z + 0.1])
            board(
                model, start, np.array([b, y + 0.01 * (rand(k, 67) - 0.5), start[2]]), Y, 7 * k + int(a > 0)
            )
    for k in range(2):
        start = np.array([-1.5, SHELF_Y, -POST_Z + 0.02 + k * step])
        board(model, start, start + 1.5 * X, Z, k)
        board(model, start + 1.51 * X, start + 3.0 * X, Z, k + 4)
    for x in (-1.4, 0.0, 1.4):
        start = np.array([x, SHELF_Y - 0.04, -POST_Z + 0.1])
        add_timber(model, start - 0.32 * Y, start, X, (0.05, 0.05), 3)


def add_stool(model: Model, x: float, z: float, turn: float) -> None:
    """A stool: the slice of a trunk on three legs."""
    number = round(10 * turn)
    for k in range(3):
        a = turn + 2.0 * math.pi * k / 3.0
        out = np.array([math.cos(a), 0.0, math.sin(a)])
        foot = np.array([x, 0.0, z]) + 0.21 * out
        pole(model, number + k, np.array([x, 0.66, z]) + 0.10 * out, foot, 0.024, capped=False)
    pole(model, number, np.array([x, 0.71, z]), np.array([x, 0.645, z]), 0.19)


def slope(s: float, lift: float) -> tuple[float, float, float]:
    """Half extents of the roof along x and z, and its height, at a share of the way from eave to ridge.
    lift: metres above the slope."""
    wide, deep, high = (a + (b - a) * s for a, b in zip(EAVE, RIDGE, strict=True))
    sag = 0.10 * math.sin(math.pi * min(max(s, 0.0), 1.0))
    return wide + 0.6 * lift, deep + 0.6 * lift, high - sag + 0.8 * lift


def course(model: Model, number: int, low: float, high: float, lift: tuple[float, float]) -> None:
    """A course of leaves round the roof: from a share of the slope down to another, lifted at both edges."""
    for side in range(4):
        rows = []
        for edge, (s, up) in enumerate(((low, lift[0]), (high, lift[1]))):
            for k in range(COLUMNS + 1):
                r = [rand(4 * k + i, 71 + 10 * number + side) - 0.5 for i in range(2)]
                loose = float(0 < k < COLUMNS) * (1.0 - edge)  # sides meet at the corners
                wide, deep, y = slope(s + 0.035 * r[0] * loose, up + 0.05 * r[1] * loose)
                share = 1.0 - 2.0 * k / COLUMNS
                corner = (share * wide, deep) if side % 2 == 0 else (share * deep, wide)
                turn = (1.0, 1.0, -1.0, -1.0)[side]
                rows.append(
                    (turn * corner[0], y, turn * corner[1])
                    if side % 2 == 0
                    else (turn * corner[1], y, -turn * corner[0])
                )
        points = np.array(rows)
        metres = np.abs(points[:, (0, 2)[side % 2]] - points[0, (0, 2)[side % 2]])
        shift = rand(4 * number + side, 73)
        u = (metres / bar_paint.REACH_M + shift) * atlas.WIDTH
        v = np.repeat([0.985, 0.015], COLUMNS + 1) * atlas.HEIGHT
        pixels = np.stack([u, v], axis=1)
        model.add("thatch", "thatch", points, pixels, grid_triangles(2, COLUMNS + 1)[:, ::-1])


def add_roof(model: Model) -> None:
    """Beams, rafters, courses of leaves, and crossed sticks that hold down the ridge."""
    for k, z in enumerate((-POST_Z, POST_Z)):
        for a, b in ((-HALF_X - 0.25, 0.0), (0.002, HALF_X + 0.25)):
            add_timber(model, np.array([a, BEAM_Y, z]), np.array([b, BEAM_Y, z]), Z, (0.09, 0.12), k + 2)
    for k, x in enumerate((-POST_X, POST_X)):
        for a, b in ((-HALF_Z - 0.25, 0.0), (0.002, HALF_Z + 0.25)):
            add_timber(
                model, np.array([x, BEAM_Y + 0.1, a]), np.array([x, BEAM_Y + 0.1, b]), X, (0.08, 0.08), k
            )
    number = 60
    for sx in (-1.0, 1.0):
        for sz in (-1.0, 1.0):
            wide, deep, y = slope(0.0, -0.16)
            top = slope(1.0, -0.16)
            eave = np.array([sx * wide, y, sz * deep])
            pole(model, number, np.array([sx * top[0], top[2], 0.0]), eave, 0.045, capped=False)
            number += 1
    for x in (-0.9, 0.0, 0.9):
        for sz in (-1.0, 1.0):
            _, deep, y = slope(-0.02, -0.14)
            top = slope(1.0, -0.14)
            pole(model, number, np.array([x, top[2], 0.0]), np.array([x, y, sz * deep]), 0.035, capped=False)
            number += 1
    course(model, 90, -0.04, 1.0, (-0.06, -0.06))  # seen from below
    for k in range(COURSES):
        step = 1.0 / COURSES
        course(model, k, (k - 0.62) * step, min(1.0, (k + 1.15) * step), (0.10, 0.015))
    course(model, COURSES, 0.80, 1.0, (0.16, 0.09))
    for k in range(5):
        x = -1.0 + 0.5 * k + 0.08 * (rand(k, 79) - 0.5)
        for sign in (-1.0, 1.0):
            _, deep, y = slope(0.70, 0.15)
            top = np.array([x + 0.05 * sign, RIDGE[2] + 0.42 + 0.05 * rand(k, 83), -0.24 * sign])
            pole(model, 20 + k, top, np.array([x + 0.05 * sign, y + 0.07, deep * sign]), 0.026)


def lathe(model: Model, foot: Floats, profile: Floats, colors: list[str], sides: int = 8) -> None:
    """A turned thing, coloured by vertex: `profile` (n, 2), radius and height from the foot up."""
    ring = 2.0 * math.pi * np.arange(sides + 1) / sides
    circle = np.stack([np.cos(ring), 0.0 * ring, -np.sin(ring)], axis=1)
    points = np.concatenate([foot + height * Y + max(radius, 1e-3) * circle for radius, height in profile])
    paint = np.repeat([hex_color(code) for code in colors], sides + 1, axis=0)
    model.add("things", "things", points, None, grid_triangles(len(profile), sides + 1), colors=paint)


def things() -> Model:
    """The things on the bar, coloured by vertex: bottles, coconuts, and a surfboard that leans on a post."""
    model = Model()
    bottle = np.array([(0.0, 0.0), (0.036, 0.0), (0.036, 0.17), (0.013, 0.23), (0.013, 0.29), (0.0, 0.29)])
    glass = ("#2f6b4a", "#8a4b1f", "#c9d8cf", "#7a1f24", "#2c4f7c", "#b58a2c")
    for k in range(11):
        x = -1.35 + 0.25 * k + 0.08 * (rand(k, 87) - 0.5)
        foot = np.array([x, SHELF_Y + 0.018, -POST_Z + 0.09 + 0.05 * rand(k, 89)])
        size = np.array([1.0, 0.85 + 0.3 * rand(k, 91)])
        body = glass[int(rand(k, 97) * len(glass))]
        lathe(model, foot, bottle * size, [body, body, body, body, body, "#d9c9a0"])
    nut = np.array([(0.0, 0.0), (0.05, 0.01), (0.075, 0.06), (0.07, 0.10), (0.052, 0.125), (0.0, 0.105)])
    for x, z in ((-0.85, 0.72), (0.05, 0.78), (1.15, 0.66)):
        colors = ["#4e3822", "#5b4128", "#6d5032", "#6a4d2f", "#efe6d2", "#f5efe0"]
        lathe(model, np.array([x, COUNTER_Y + 0.02, z]), nut, colors)
    # The surfboard: rings along its length, flat across.
    s = np.linspace(0.0, 1.0, 19)
    half = 0.27 * np.maximum(np.sin(math.pi * s**0.85), 0.02) ** 0.62
    foot, top = (
        np.array([-POST_X - 0.62, -0.62, POST_Z + 0.10]),
        np.array([-POST_X - 0.02, 1.62, POST_Z + 0.13]),
    )
    along = top - foot
    across = np.cross(along, Z)
    across /= math.sqrt(float((across**2).sum()))
    out = np.cross(across, along)
    out /= math.sqrt(float((out**2).sum()))
    ring = 2.0 * math.pi * np.arange(11) / 10
    rows, paint = [], []
    for k, at in enumerate(s):
        rocker = 0.09 * (2.0 * at - 1.0) ** 2
        for a in ring:
            rows.append(
                foot
                + at * along
                + half[k] * math.cos(a) * across
                + (0.032 * min(1.0, half[k] / 0.12) * math.sin(a) + rocker) * out
            )
            band = (
                "#2fa7a4" if at < 0.22 or 0.62 < at < 0.68 else "#e4593f" if 0.72 < at < 0.94 else "#f2ead8"
            )
            paint.append(hex_color(band))
    faces = grid_triangles(len(s), len(ring))[:, ::-1]
    model.add("things", "things", np.array(rows), None, faces, colors=np.array(paint))
    return model


def build() -> Model:
    """The bar as a model."""
    model = Model(atlas.WIDTH, atlas.HEIGHT)
    add_deck(model)
    add_counter(model)
    for x, z, turn in ((-1.05, 1.16, 0.4), (-0.1, 1.22, 1.3), (0.95, 1.12, 2.3)):
        add_stool(model, x, z, turn)
    add_roof(model)
    return model


def write_model(out: Path) -> None:
    """Writes bar.obj, things.obj and bar.mtl under out/bar."""
    (out / "bar").mkdir(parents=True, exist_ok=True)
    note = "A beach bar, made by raw_assets/make/bar.py; metres, Y up"
    build().write(out / "bar/bar.obj", "bar.mtl", note)
    things().write(out / "bar/things.obj", "bar.mtl", note)
    plain = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]
    thatch = [*plain, "map_Kd thatch.png", "map_d thatch_alpha.png"]
    write_mtl(out / "bar/bar.mtl", note, {"planks": plain, "poles": plain, "thatch": thatch, "things": plain})


def make(out: Path) -> None:
    """Writes the folder bar under out."""
    write_model(out)
    color, alpha = bar_paint.thatch()
    write_image(out / "bar/thatch.png", color, "uint8")
    write_image(out / "bar/thatch_alpha.png", alpha, "uint8")


if __name__ == "__main__":
    make(Path(sys.argv[1]))

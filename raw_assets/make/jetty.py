"""Models the jetty: planks on stringers and cross beams, on pairs of poles that end below the sea floor.

Usage: python jetty.py RAW_ASSETS
Local axes, metres: the jetty starts at the origin on the beach, runs 25 m along +Z into the sea and is 2 m
wide along X. The deck is at y = 0, except for the first metres, which descend to the sand. The poles are
weathered for a sea level 1.2 m below the deck.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import jetty_paint as atlas
from noise import smoothstep
from objfile import Model, grid_triangles, write_mtl
from paint import rand
from picture import write_image

Floats = NDArray[np.float64]

LENGTH_M = 25.0
HALF_WIDTH_M = 1.0
THICK_M = 0.042
RAMP_M, RAMP_DROP_M = 4.2, 0.82  # the deck rises from the sand over this length
FRAMES = 11  # pairs of poles
FRAME_M = 2.4
POLE_X_M = 1.14
POLE_SIDES = 10


@dataclass(frozen=True)
class Plank:
    """One plank: pattern and orientation, centre, sizes (m), small angles (rad)."""

    pattern: int
    turned: bool  # end for end
    mirrored: bool  # side for side
    x: float
    z: float
    width: float
    left: float  # length to the left of the middle
    right: float
    lift: float
    yaw: float
    roll: float
    bow: float  # height of the middle above the ends
    twist: float


def deck_y(z: float) -> float:
    """Height of the deck at a position along the jetty."""
    return -RAMP_DROP_M * (1.0 - float(smoothstep(0.0, 1.0, np.array(z / RAMP_M))))


def deck_slope(z: float) -> float:
    """Slope of the deck along +Z."""
    return (deck_y(z + 0.05) - deck_y(z - 0.05)) / 0.1


def planks() -> list[Plank]:
    """The planks from the beach outwards, with uneven gaps, ends and tilt. Two are missing, one is broken,
    some are warped."""
    laid: list[Plank] = []
    z, k = 0.10, 0
    gone, broken = (61, 104), 83
    while True:
        r = [rand(16 * k + i, 11) for i in range(14)]
        width = 0.148 + 0.022 * (r[0] - 0.5)
        if z + width > LENGTH_M:
            return laid
        style = int(r[1] * atlas.PLANKS * 4)
        while any(style // 4 == p.pattern for p in laid[-3:]) or any(
            (style // 4, bool(style & 1), bool(style & 2)) == (p.pattern, p.turned, p.mirrored)
            for p in laid[-14:]
        ):
            style = (style + 5) % (atlas.PLANKS * 4)
        warped = r[2] > 0.72
        if k not in gone:
            laid.append(
                Plank(
                    pattern=style // 4,
                    turned=bool(style & 1),
                    mirrored=bool(style & 2),
                    x=0.05 * (r[3] - 0.5),
                    z=z + width / 2.0,
                    width=width,
                    left=HALF_WIDTH_M + 0.07 * (r[4] - 0.5),
                    right=HALF_WIDTH_M + 0.07 * (r[5] - 0.5) if k != broken else 0.18,
                    lift=0.007 * (r[6] - 0.5),
                    yaw=math.radians(1.1) * (r[7] - 0.5),
                    roll=math.radians(2.4) * (r[8] - 0.5),
                    bow=(0.030 * (r[9] - 0.35)) if warped else 0.0,
                    twist=math.radians(5.0) * (r[10] - 0.5) if warped else 0.0,
                )
            )
        z += width + 0.008 + 0.022 * r[11] * r[11] + (0.02 if r[12] > 0.93 else 0.0)
        k += 1


# the outline of a plank's cross-section, from the bottom left over the top to the bottom right: share of the
# half width, share of the thickness below the top, pixel row within its pattern
PROFILE = ((-1, 1.0, 0), (-1, 0.16, 20), (-0.9, 0.0, 24), (0.9, 0.0, 92), (1, 0.16, 96), (1, 1.0, 116))


def add_plank(model: Model, plank: Plank) -> None:
    """Adds a plank: top, chamfers and sides as one smooth patch, bottom and ends as separate patches."""
    sections = 5 if plank.bow or plank.twist else 2
    x0, y0 = atlas.plank_corner(plank.pattern)
    slope = math.atan(deck_slope(plank.z))
    rows, pixels = [], []
    for i in range(sections):
        t = i / (sections - 1)
        x = -plank.left + t * (plank.left + plank.right)
        roll = slope - plank.roll - plank.twist * (t - 0.5)
        rise = plank.lift + plank.bow * (1.0 - (2.0 * t - 1.0) ** 2)
        u = (x / atlas.PLANK_LENGTH_M + 0.5) * 0.93 + 0.035
        u = 1.0 - u if plank.turned else u
        for across, down, row in PROFILE:
            w, h = across * plank.width / 2.0, -down * THICK_M
            skew = (
                (0.10 * across * (rand(int(plank.z * 50) + i, 13) - 0.5)) * plank.width
                if i in (0, sections - 1)
                else 0.0
            )
            px = x + skew
            dz, dy = w * math.cos(roll) - h * math.sin(roll), w * math.sin(roll) + h * math.cos(roll)
            rows.append(
                (plank.x + px - plank.yaw * dz, deck_y(plank.z) + rise + dy, plank.z + dz + plank.yaw * px)
            )
            v = atlas.BAND - row if plank.mirrored else row
            pixels.append((x0 + u * atlas.LENGTH, y0 + v))
    points, flat = np.array(rows), np.array(pixels)
    n = len(PROFILE)
    model.add("planks", "planks", points, flat, grid_triangles(sections, n))
    # bottom: the pattern's top, on the other face
    under = np.array([i * n + j for i in range(sections) for j in (n - 1, 0)])
    low = flat[under].copy()
    low[0::2, 1], low[1::2, 1] = y0 + atlas.SIDE, y0 + atlas.SIDE + atlas.TOP
    model.add("planks", "planks", points[under], low, grid_triangles(sections, 2))
    # ends
    ex, ey = atlas.end_corner(plank.pattern)
    fan = np.array([(0, 1, 5), (1, 4, 5), (1, 2, 4), (2, 3, 4)])
    for first, faces in ((0, fan[:, ::-1]), ((sections - 1) * n, fan)):
        ring = points[first : first + n]
        grain = np.array([(ex + (a + 1.0) / 2.0 * atlas.TOP, ey + d * atlas.SIDE) for a, d, _ in PROFILE])
        model.add("planks", "planks", ring, grain, faces)


def add_timber(
    model: Model, start: Floats, stop: Floats, side: Floats, size: tuple[float, float], pattern: int
) -> None:
    """A squared timber between the middles of its ends; `side` is its first cross axis, `size` its widths."""
    along = stop - start
    length = math.sqrt(float((along**2).sum()))
    other = np.cross(along / length, side)
    x0, y0 = atlas.plank_corner(pattern % atlas.PLANKS)
    ex, ey = atlas.end_corner(pattern % atlas.PLANKS)
    reach = min(1.0, length / atlas.PLANK_LENGTH_M) * atlas.LENGTH
    a, b = side * (size[0] / 2.0), other * (size[1] / 2.0)
    corners = (a + b, b - a, -a - b, a - b)
    for j in range(4):
        p, q = corners[j], corners[(j + 1) % 4]
        points = np.array([start + p, stop + p, start + q, stop + q])
        height = min(1.0, size[j % 2] / 0.15) * atlas.TOP
        top = y0 + atlas.SIDE + (atlas.TOP - height) * (0.0, 1.0, 0.5, 0.3)[j]
        pixels = np.array([(x0, top), (x0 + reach, top), (x0, top + height), (x0 + reach, top + height)])
        model.add("beams", "planks", points, pixels, np.array([(0, 2, 1), (1, 2, 3)]))
    grain = np.array(
        [(ex + atlas.TOP, ey), (ex, ey), (ex, ey + atlas.SIDE), (ex + atlas.TOP, ey + atlas.SIDE)]
    )
    square = np.array([(0, 1, 2), (0, 2, 3)])
    model.add("beams", "planks", np.array([start + c for c in corners]), grain, square[:, ::-1])
    model.add("beams", "planks", np.array([stop + c for c in corners]), grain, square)


def foot_y(z: float) -> float:
    """Height of the poles' lower ends, below the sea floor, which descends with z."""
    return -2.5 - 4.3 * (z / LENGTH_M) ** 2


def add_pole(model: Model, number: int, x: float, z: float, top: float) -> None:
    """Adds a pole: a leaning, uneven, tapering cylinder with a slanted, worn top."""
    r = [rand(32 * number + i, 23) for i in range(32)]
    pattern = (number * 3 + int(r[0] * 2.0)) % atlas.POLES
    x0, y0 = atlas.pole_corner(pattern)
    radius = 0.098 + 0.034 * r[1]
    turn0 = r[2]
    foot = foot_y(z)
    heights = [
        top,
        top - 0.025,
        *(h for h in (0.10, -0.75, -1.35, atlas.POLE_BEND_M, -3.6) if foot + 0.3 < h < top - 0.1),
        foot,
    ]
    rows, pixels = [], []
    slant = (0.16 * (r[3] - 0.5), 0.16 * (r[4] - 0.5))
    for i, h in enumerate(heights):
        wide = (
            radius
            * (1.0 + 0.05 * (top - h) / 3.0)
            * (0.86 if i == 0 else 1.0)
            * (1.0 + 0.05 * (rand(i, 70 + number) - 0.5))
        )
        mx = x + math.radians(2.6) * (r[5] - 0.5) * h * 1.5 + 0.012 * (rand(i, 80 + number) - 0.5)
        mz = z + math.radians(2.6) * (r[6] - 0.5) * h * 1.5 + 0.012 * (rand(i, 90 + number) - 0.5)
        for j in range(POLE_SIDES + 1):
            a = 2.0 * math.pi * (j % POLE_SIDES) / POLE_SIDES + 2.0 * math.pi * turn0
            lump = 1.0 + 0.06 * (rand(j % POLE_SIDES, 60 + number) - 0.5)
            dx, dz = wide * lump * math.cos(a), wide * lump * math.sin(a)
            dy = 3.0 * (slant[0] * dx + slant[1] * dz) if i < 2 else 0.0
            rows.append((mx + dx, h + dy, mz + dz))
            v = j / POLE_SIDES
            pixels.append((x0 + atlas.pole_pixel(h), y0 + atlas.POLE_BAND * (1.0 - v if r[7] > 0.5 else v)))
    points = np.array(rows)
    n = POLE_SIDES + 1
    model.add("poles", "poles", points, np.array(pixels), grid_triangles(len(heights), n))
    add_cap(model, points[:POLE_SIDES], (pattern + int(r[8] * 4.0)) % atlas.POLES, r[9])


def add_cap(model: Model, rim: Floats, pattern: int, turn: float) -> None:
    """Closes the top of a pole: `rim` (n, 3), the ring of its upper end; `turn`: of the annual rings, in
    turns."""
    sides = len(rim)
    cx, cy = atlas.cap_center(pattern)
    middle = np.array([rim.mean(axis=0) + np.array([0.0, 0.004, 0.0])])
    spin = 2.0 * math.pi * turn
    disc = [(cx, cy)] + [
        (
            cx + 0.97 * atlas.CAP_RADIUS * math.cos(2.0 * math.pi * j / sides + spin),
            cy + 0.97 * atlas.CAP_RADIUS * math.sin(2.0 * math.pi * j / sides + spin),
        )
        for j in range(sides)
    ]
    fan = np.array([(0, 1 + (j + 1) % sides, 1 + j) for j in range(sides)])
    model.add("poles", "poles", np.concatenate([middle, rim]), np.array(disc), fan)


def frames() -> list[float]:
    """Positions of the pairs of poles along the jetty."""
    return [0.7 + FRAME_M * k for k in range(FRAMES)]


def add_poles(model: Model) -> None:
    """Adds the pairs of poles. Some rise above the deck, some end below it; the last pair is tall."""
    for number in range(2 * FRAMES):
        k, sign = number // 2, 1.0 if number % 2 else -1.0
        chance = rand(number, 31)
        tall = k == FRAMES - 1 or chance > 0.30
        top = deck_y(frames()[k]) + (0.32 + 0.66 * rand(number, 32) if tall else -0.03 - 0.05 * chance)
        x = sign * (POLE_X_M + 0.03 * rand(number, 33))
        add_pole(model, number, x, frames()[k] + 0.06 * (rand(number, 34) - 0.5), top)


def add_beams(model: Model) -> None:
    """Adds cross beams between poles, braces in deep water, and stringers between frames."""
    under = -THICK_M - 0.004
    forward, aside = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    for k, z in enumerate(frames()):
        y = deck_y(z) + under - 0.15 - 0.08
        left = np.array([-1.30 - 0.08 * rand(k, 35), y, z + 0.10])
        right = np.array([1.30 + 0.08 * rand(k, 36), y, z + 0.10])
        add_timber(model, left, right, forward, (0.11, 0.16), 2 * k + 1)
        if k >= 4:
            flip = 1.16 if k % 2 else -1.16
            low, high = np.array([-flip, y - 0.95, z - 0.13]), np.array([flip, y - 0.06, z - 0.13])
            add_timber(model, low, high, forward, (0.05, 0.13), 2 * k + 4)
    ends = [0.06, *frames()[1:-1], LENGTH_M - 0.03]
    for k, (a, b) in enumerate(pairwise(ends)):
        steps = 4 if b < RAMP_M + FRAME_M else 1  # short ones where the deck bends
        over = 0.12 if steps == 1 else 0.003
        shift = 0.045 if k % 2 else -0.045  # neighbours lie side by side where they meet
        for x in (-0.76 + shift, 0.76 + shift):
            for i in range(steps):
                za = max(a + (b - a) * i / steps - over, 0.03)
                zb = min(a + (b - a) * (i + 1) / steps + over, LENGTH_M)
                start = np.array([x, deck_y(za) + under - 0.075, za])
                stop = np.array([x, deck_y(zb) + under - 0.075, zb])
                add_timber(model, start, stop, aside, (0.075, 0.15), 3 * k + 5 + i)


def build() -> Model:
    """The jetty as a model."""
    model = Model(atlas.WIDTH, atlas.HEIGHT)
    for plank in planks():
        add_plank(model, plank)
    add_beams(model)
    add_poles(model)
    return model


def write_model(out: Path) -> None:
    """Writes jetty.obj and jetty.mtl under out/jetty."""
    (out / "jetty").mkdir(parents=True, exist_ok=True)
    note = "A jetty of weathered wood, made by raw_assets/make/jetty.py; metres, Y up"
    build().write(out / "jetty/jetty.obj", "jetty.mtl", note)
    wood = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0.05 0.05 0.05", "Ns 15", "d 1", "illum 2", "map_Kd jetty.png"]
    write_mtl(out / "jetty/jetty.mtl", note, {"planks": wood, "poles": wood})


def make(out: Path) -> None:
    """Writes jetty.obj, jetty.mtl and jetty.png (colour) under out/jetty."""
    write_model(out)
    write_image(out / "jetty/jetty.png", atlas.atlas(), "uint8")


if __name__ == "__main__":
    make(Path(sys.argv[1]))

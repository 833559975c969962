"""Paints the jetty's atlas: nine planks (top and sides), their end grain, four poles, and the poles' tops.

Painted at twice the atlas's size and downsampled. Lightness is also used as height.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from noise import smoothstep as step
from paint import dilate, fbm, halve, hash01, mix, noise, ramp, rand
from picture import hex_color as rgb
from wood import WOOD, around, cracks, knots_of

Floats = NDArray[np.float64]

WIDTH, HEIGHT = 2048, 1024
GUTTER = 16

PLANKS = 9
LENGTH = 968  # pixels of a plank's 2 m, and of a pole's height
TOP, SIDE = 76, 20  # pixels across a plank: top with chamfers, and each side
BAND = TOP + 2 * SIDE
COLUMN_X = (24, 1040)
PLANK_LENGTH_M = 2.0
PX_PER_M = TOP / 0.15

POLES = 4
POLE_BAND = 128  # circumference of a pole
POLE_Y = 424
POLE_TOP_M, POLE_BEND_M, POLE_FOOT_M = 1.1, -1.7, -6.9  # range of heights along a pole
POLE_BEND = 700  # pixels from the top to POLE_BEND_M; the rest is under water
WATERLINE_M = -1.2  # sea level in the jetty's local axes

END_Y = 832
CAP_RADIUS, CAP_Y = 42, 924


def plank_corner(k: int) -> tuple[int, int]:
    """Top left pixel of plank k's island."""
    return (COLUMN_X[0], 16 + 134 * k) if k < 6 else (COLUMN_X[1], 16 + 134 * (k - 6))


def end_corner(k: int) -> tuple[int, int]:
    """Top left pixel of plank k's end grain, TOP x SIDE pixels."""
    return COLUMN_X[0] + 94 * k, END_Y


def pole_corner(k: int) -> tuple[int, int]:
    """Top left pixel of pole k's island; the pole's top is at the left, its foot at the right."""
    return COLUMN_X[1], POLE_Y + 148 * k


def cap_center(k: int) -> tuple[int, int]:
    """Centre of the disc of pole k's top."""
    return COLUMN_X[0] + 66 + 106 * k, CAP_Y


def pole_pixel(height_m: float) -> float:
    """Pixels from the pole's top to a height above the deck."""
    if height_m >= POLE_BEND_M:
        return (POLE_TOP_M - height_m) / (POLE_TOP_M - POLE_BEND_M) * POLE_BEND
    return POLE_BEND + (POLE_BEND_M - height_m) / (POLE_BEND_M - POLE_FOOT_M) * (LENGTH - POLE_BEND)


def pole_height(pixel: Floats) -> Floats:
    """The inverse of pole_pixel."""
    above = POLE_TOP_M - pixel / POLE_BEND * (POLE_TOP_M - POLE_BEND_M)
    below = POLE_BEND_M - (pixel - POLE_BEND) / (LENGTH - POLE_BEND) * (POLE_BEND_M - POLE_FOOT_M)
    return np.where(pixel <= POLE_BEND, above, below)


def paint_plank(k: int) -> Floats:
    """One unfolded plank with gutters: side, top, side; (BAND + 16, LENGTH + 16, 3)."""
    seed = 1000 + 37 * k
    g = GUTTER // 2
    rows, columns = 2 * (BAND + 2 * g), 2 * (LENGTH + 2 * g)
    py, px = np.meshgrid(np.arange(rows) / 2.0 + 0.25 - g, np.arange(columns) / 2.0 + 0.25 - g, indexing="ij")
    x, q = px / LENGTH * PLANK_LENGTH_M, (py - SIDE) / PX_PER_M
    r = [rand(i, seed) for i in range(16)]
    bent, knot, knot_rings = around(x, q, knots_of(seed + 1, int(0.4 + 4.2 * r[0]), 2.0, 0.15))
    bent += 0.0040 * fbm(x * 1.3, q * 5.0, seed + 2, 3)
    # annual rings: arches where the cut is tangential, straight lines elsewhere
    heart = 0.15 * (0.15 + 0.7 * r[1])
    far = 0.012 + 0.10 * r[2] * r[2]
    depth = far + (r[3] - 0.5) * 0.045 * x + 0.006 * noise(x * 1.6, x * 0.0, seed + 3)
    ring = np.sqrt((bent - heart) ** 2 + depth * depth) * (75.0 + 75.0 * r[4])
    ring = np.where(knot > 0.5, knot_rings, ring)
    year = np.floor(ring).astype(np.int64)
    phase = ring - np.floor(ring)
    late = step(0.45, 0.85, phase) * (1.0 - step(0.90, 1.0, phase))
    strong = 0.55 + 0.9 * hash01(year, year * 0, seed + 4)
    fibre = fbm(x * 9.0, bent * 700.0, seed + 5, 3)
    pores = step(0.30, 0.75, noise(x * 34.0, bent * 1500.0, seed + 6))
    cloud = fbm(x * 2.2, q * 14.0, seed + 7, 4)
    wear = step(-0.2, 0.5, fbm(x * 3.1, q * 9.0, seed + 8, 3))
    light = 0.54 + (0.12 + 0.16 * wear) * (late * strong - 0.35) + 0.20 * fibre - 0.14 * pores + 0.15 * cloud
    light += 0.10 * (r[5] - 0.5)
    color = ramp(WOOD, light)
    # a tint per plank: grey, brown or reddish
    tint = (
        rgb("#f6f4f0"), rgb("#fbeeda"), rgb("#f8e6d4"), rgb("#ebecea"), rgb("#fff7ea"),
    )[int(r[6] * 5.0)]  # fmt: skip
    color = color * tint * (0.90 + 0.20 * r[7])
    color = mix(color, color * rgb("#dcbd9a"), 0.45 * step(0.15, 0.7, fbm(x * 1.5, q * 8.0, seed + 9, 4)))
    dark_knot = ramp(["#1f1711", "#4b3826", "#7d6347", "#9a8468"], 0.55 + 0.35 * (phase - 0.5) + 0.2 * fibre)
    color = mix(color, dark_knot, 0.85 * knot)
    halo = 1.0 - step(0.0, 1.0, np.abs(knot - 0.5) * 2.0)
    color *= (1.0 - 0.35 * halo)[..., None]
    # nails above the stringers, with rust along the grain
    for i, (nx, nq) in enumerate(((0.25, 0.036), (0.25, 0.112), (1.75, 0.036), (1.75, 0.112))):
        nx, nq = nx + 0.03 * (rand(40 + i, seed) - 0.5), nq + 0.02 * (rand(50 + i, seed) - 0.5)
        away = np.sqrt((x - nx) ** 2 + (q - nq) ** 2)
        streak = np.sqrt(((x - nx) / 5.0) ** 2 + (q - nq + 0.002 * fibre) ** 2)
        color = mix(color, color * rgb("#8a5a38"), 0.75 * (1.0 - step(0.002, 0.016, streak)))
        color = mix(color, rgb("#1d1916"), 1.0 - step(0.0052, 0.0068, away))
        shine = np.sqrt((x - nx + 0.0012) ** 2 + (q - nq + 0.0012) ** 2)
        head = ramp(["#6b5a4c", "#3d332c"], 0.5 + 0.5 * noise(x * 300.0, q * 300.0, seed + 60 + i))
        color = mix(color, head, 1.0 - step(0.0042, 0.0054, away))
        color = mix(color, rgb("#a08f80"), 0.5 * (1.0 - step(0.0, 0.0030, shine)))
    split = cracks(x, bent, seed + 10, 5 + int(6.0 * r[8]), 2.0, 0.15)
    color = mix(color, rgb("#17120e"), 0.88 * split)
    # ends are darker and slightly green, edges light and worn, sides shaded by the next plank
    end = np.minimum(x, 2.0 - x)
    soak = 1.0 - step(0.0, 0.07 + 0.06 * cloud + 0.03 * fibre, end)
    color = mix(color, color * rgb("#a39a86"), 0.6 * soak)
    top = np.minimum(py - SIDE, SIDE + TOP - py)  # pixels from the top's edge
    color *= (1.0 + 0.16 * (1.0 - step(0.0, 5.0, np.abs(top - 2.0 - 1.5 * fibre))))[..., None]
    shade = 1.0 - step(-4.0, 0.0, top)
    color = mix(color, color * rgb("#8d8578"), 0.7 * shade)
    moss = step(0.25, 0.6, fbm(x * 5.0, q * 30.0, seed + 11, 4) + 0.25 * soak) * (1.0 - step(-2.0, 14.0, top))
    color = mix(color, rgb("#5f6440") * (0.7 + 0.5 * light[..., None]), 0.45 * moss)
    return halve(np.clip(color, 0.0, 1.0))


def paint_end(k: int) -> Floats:
    """End grain of plank k: dark arcs of annual rings; (SIDE + 16, TOP + 16, 3)."""
    seed = 2000 + 41 * k
    g = GUTTER // 2
    rows, columns = 2 * (SIDE + 2 * g), 2 * (TOP + 2 * g)
    py, px = np.meshgrid(np.arange(rows) / 2.0 - g, np.arange(columns) / 2.0 - g, indexing="ij")
    hx, hy = TOP * (0.2 + 0.6 * rand(0, seed)), SIDE * (1.8 + 3.0 * rand(1, seed))
    ring = np.sqrt((px - hx) ** 2 + (py - hy) ** 2) * (0.22 + 0.12 * rand(2, seed)) + 0.4 * fbm(
        px / 9, py / 9, seed, 3
    )
    phase = ring - np.floor(ring)
    light = (
        0.34
        + 0.20 * step(0.3, 0.8, phase) * (1.0 - step(0.85, 1.0, phase))
        + 0.20 * fbm(px / 2, py / 2, seed + 1, 3)
    )
    color = ramp(WOOD, light)
    along = np.arctan2(px - hx, hy - py)
    check = np.abs(noise(along * 9.0, along * 0.0, seed + 2))
    color = mix(color, rgb("#17120e"), 0.8 * (1.0 - step(0.0, 0.05, check)))
    return halve(color)


def paint_pole(k: int) -> Floats:
    """One unrolled pole without bark: (POLE_BAND + 16, LENGTH + 16, 3); the top and bottom edges join."""
    seed = 3000 + 43 * k
    g = GUTTER // 2
    rows, columns = 2 * (POLE_BAND + 2 * g), 2 * (LENGTH + 2 * g)
    py, px = np.meshgrid(np.arange(rows) / 2.0 + 0.25 - g, np.arange(columns) / 2.0 + 0.25 - g, indexing="ij")
    y = pole_height(np.clip(px, 0.0, LENGTH))
    a = py / POLE_BAND  # once round: 0..1
    drift = 0.05 * fbm(a * 3.0, y * 0.7, seed, 3, period_x=3)
    t = a + drift
    fibre = fbm(t * 64.0, y * 5.0, seed + 1, 4, period_x=64)
    bands = fbm(t * 14.0, y * 0.9, seed + 2, 3, period_x=14)
    cloud = fbm(a * 4.0, y * 2.6, seed + 3, 4, period_x=4)
    light = 0.46 + 0.22 * fibre + 0.20 * bands + 0.14 * cloud
    # drying cracks of varying width along the pole
    line = np.abs(noise(t * 9.0, y * 0.35, seed + 4, period_x=9))
    gape = step(0.0, 0.5, fbm(a * 5.0, y * 1.3, seed + 5, 2, period_x=5) + (0.25, 0.45, 0.1, 0.3)[k])
    check = (1.0 - step(0.015, 0.06, line)) * gape
    light -= 0.45 * check
    color = ramp(WOOD, light) * (rgb("#f6eada"), rgb("#ebe9e4"), rgb("#f2e0ca"), rgb("#fff6e8"))[k]
    for i in range(6):
        ka, ky, size = (
            rand(30 + 3 * i, seed),
            0.9 - 2.6 * rand(31 + 3 * i, seed),
            0.026 + 0.03 * rand(32 + 3 * i, seed),
        )
        da = np.abs(a - ka)
        da = np.minimum(da, 1.0 - da)
        away = np.sqrt((da / size) ** 2 + ((y - ky) / (size * 0.9)) ** 2) + 0.12 * fibre
        eye = ramp(["#211812", "#5f4a35", "#8d7557", "#4b3a2a"], np.abs(2.0 * ((away * 3.0) % 1.0) - 1.0))
        color = mix(color, eye, 0.8 * (1.0 - step(0.85, 1.1, away)))
    # the top is weathered and grey
    color = mix(color, color * 0.6 + rgb("#b9b3a6") * 0.4, 0.5 * step(-0.4, 0.8, y + 0.3 * cloud))
    if k == 2:  # a rope, wound four times
        winding = (y - 0.16) / 0.034 + a
        inside = step(0.160, 0.166, y) * (1.0 - step(0.294, 0.300, y))
        body = np.sqrt(np.clip(1.0 - (2.0 * (winding - np.floor(winding)) - 1.0) ** 2, 0.0, 1.0))
        strand = 0.5 + 0.5 * np.cos(2.0 * math.pi * (a * 26.0 - winding * 1.5))
        rope = ramp(
            ["#2e2418", "#7d6a4a", "#b8a37b", "#d8c7a0"],
            0.15 + 0.55 * body * (0.55 + 0.45 * strand) + 0.18 * fibre,
        )
        color = mix(color, rope, inside)
    # tidal zone: a dark wet band, barnacles, weed below
    tide = y - WATERLINE_M + 0.10 * cloud + 0.03 * fibre
    wet = 1.0 - step(0.10, 0.34, tide)
    color = mix(color, color * rgb("#6a6152"), 0.85 * wet)
    shell = noise(a * 46.0, y * 46.0, seed + 6, period_x=46)
    crowd = step(-0.1, 0.4, fbm(a * 6.0, y * 5.0, seed + 7, 3, period_x=6)) * (
        1.0 - step(0.03, 0.12, np.abs(tide + 0.02))
    )
    barnacle = step(0.36, 0.62, shell) * crowd
    color = mix(color, ramp(["#6f675a", "#cfc6b2", "#8a8274"], step(0.36, 0.95, shell)), 0.9 * barnacle)
    weed = step(0.0, 0.16, -tide) * step(-0.55, 0.15, fbm(a * 9.0, y * 4.0, seed + 8, 4, period_x=9))
    green = ramp(["#1c2413", "#38451f", "#5f6b2f", "#7d8746"], 0.45 + 0.30 * fibre + 0.30 * cloud)
    color = mix(color, green, 0.8 * weed)
    return halve(np.clip(color, 0.0, 1.0))


def paint_cap(k: int) -> Floats:
    """The top of pole k with annual rings and radial cracks; a square of 2 * (CAP_RADIUS + 8) pixels."""
    seed = 4000 + 47 * k
    side = 4 * (CAP_RADIUS + GUTTER // 2)
    py, px = np.meshgrid(
        np.arange(side) / 2.0 - side / 4.0, np.arange(side) / 2.0 - side / 4.0, indexing="ij"
    )
    hx, hy = 8.0 * (rand(0, seed) - 0.5), 8.0 * (rand(1, seed) - 0.5)
    dx, dy = px - hx, py - hy
    away = np.sqrt(dx * dx + dy * dy)
    ring = away * 0.26 + 0.7 * fbm(px / 22, py / 22, seed, 3)
    phase = ring - np.floor(ring)
    light = 0.50 + 0.16 * (step(0.3, 0.8, phase) * (1.0 - step(0.85, 1.0, phase)) - 0.3)
    light += 0.16 * fbm(px / 3, py / 3, seed + 1, 3) + 0.15 * fbm(px / 16, py / 16, seed + 2, 3)
    color = ramp(WOOD, light) * rgb("#f1e6d4")
    for i in range(7):
        turn = 2.0 * math.pi * (i + 0.8 * rand(10 + i, seed)) / 7.0
        c, s = math.cos(turn), math.sin(turn)
        along, off = dx * c + dy * s, dy * c - dx * s + 1.2 * noise(away / 9.0, away * 0.0, seed + 20 + i)
        reach = CAP_RADIUS * (0.4 + 0.8 * rand(20 + i, seed))
        half = 1.5 * np.clip(1.0 - np.abs(along - CAP_RADIUS) / reach, 0.0, 1.0)
        color = mix(color, rgb("#17120e"), 0.85 * np.clip(half - np.abs(off) + 0.4, 0.0, 1.0) * (along > 0.0))
    color = mix(
        color, color * rgb("#8d8578"), step(CAP_RADIUS * 0.8, CAP_RADIUS * 1.02, np.sqrt(px * px + py * py))
    )
    return halve(color)


def atlas() -> Floats:
    """The atlas, (1024, 2048, 3) sRGB."""
    color = np.zeros((HEIGHT, WIDTH, 3))
    known = np.zeros((HEIGHT, WIDTH), dtype=bool)
    g = GUTTER // 2

    def put(image: Floats, corner: tuple[int, int]) -> None:
        x, y = corner[0] - g, corner[1] - g
        color[y : y + image.shape[0], x : x + image.shape[1]] = image
        known[y : y + image.shape[0], x : x + image.shape[1]] = True

    for k in range(PLANKS):
        put(paint_plank(k), plank_corner(k))
        put(paint_end(k), end_corner(k))
    for k in range(POLES):
        put(paint_pole(k), pole_corner(k))
        x, y = cap_center(k)
        put(paint_cap(k), (x - CAP_RADIUS, y - CAP_RADIUS))
    return dilate(color, known)

"""Paints the palm's atlas: two lengths of bark, three fronds (fresh, grown, old) and three coconuts.

Painted at twice the atlas's size and downsampled, so that thin leaflets have soft edges. Lightness is also
used as height: midribs, ring ridges and fibres are lighter than deeper parts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from noise import smoothstep as step
from paint import dilate, fbm, halve, hash01, mix, noise, ramp, rand
from picture import hex_color as rgb

Floats = NDArray[np.float64]

SIZE = 1024
GUTTER = 16
BARK_WIDTH = 160  # circumference of the trunk
BARK_HEIGHT = 976  # half of the trunk's length
BARK_X = (24, 216)  # left edges: the lower and the upper half of the trunk
BARK_Y = 24
FROND_WIDTH = 184
FROND_HEIGHT = 872  # tip at the top, foot at the bottom
FROND_X = (408, 616, 824)
FROND_Y = 24
NUT_RADIUS = 42
NUT_Y = 956
NUT_X = (452, 554, 656, 758, 860, 962)  # pairs: upper and lower half of each nut


@dataclass(frozen=True)
class Frond:
    """Parameters of a frond. Colours run from the dark base to a leaflet's light edge."""

    seed: int
    colors: list[str]
    tip: str
    rib: str
    leaflets: int  # on each side
    missing: float  # share of missing leaflets
    tatter: float  # variation of their lengths


FRONDS = (
    Frond(11, ["#31510f", "#4d7318", "#6f9428", "#93b244"], "#b6b65a", "#c3c46c", 54, 0.00, 0.08),
    Frond(23, ["#27430f", "#3d6118", "#5a7d24", "#7b9a3a"], "#a8a04c", "#b3ad62", 50, 0.05, 0.16),
    Frond(37, ["#4c4029", "#6f6040", "#8f7d58", "#b09c76"], "#7d6448", "#b8a684", 44, 0.16, 0.34),
)


def outline(s: Floats) -> Floats:
    """Half width of a frond, 0..1, at position s (0: base, 1: tip)."""
    rise = step(0.10, 0.34, s)
    fall = 1.0 - np.clip((s - 0.42) / 0.58, 0.0, 1.0) ** 2 * 0.86
    return np.clip(0.05 + 0.95 * rise * fall, 0.0, 1.0)


def paint_frond(frond: Frond) -> tuple[Floats, Floats]:
    """One frond at twice the size, with gutters: colour (h, w, 3) and opacity (h, w)."""
    scale, gutter = 2, GUTTER // 2
    width, height = (FROND_WIDTH + 2 * gutter) * scale, (FROND_HEIGHT + 2 * gutter) * scale
    half = FROND_WIDTH * scale / 2.0
    length = FROND_HEIGHT * scale
    py, px = np.meshgrid(np.arange(height) + 0.5, np.arange(width) + 0.5, indexing="ij")
    across = px - width / 2.0
    along = length - (py - gutter * scale)  # pixels from the foot
    color = np.empty((height, width, 3))
    color[:] = rgb(frond.colors[1])
    alpha = np.zeros((height, width))
    for side in (-1, 1):
        # from the tip to the base, so that each leaflet covers the previous one, as on a real frond
        for k in range(frond.leaflets - 1, -1, -1):
            seed = frond.seed * 1000 + (side + 1) * 200
            r = [rand(k * 8 + i, seed) for i in range(8)]
            if r[0] < frond.missing:
                continue
            s = 0.13 + 0.86 * (k + 0.5 + 0.5 * (r[1] - 0.5)) / frond.leaflets
            start = s * length
            reach = float(outline(np.array([s]))[0]) * half * (0.97 - frond.tatter * r[2] * (0.35 + r[3]))
            reach = max(reach, 0.06 * half)
            # leaflets point outwards in the middle and forwards at the tip
            slope = 0.62 + 1.9 * s * s * s + 0.35 * (r[4] - 0.5)
            bend = (0.25 + 0.5 * r[5]) * slope
            rise = (slope + bend) * reach
            limit = (length - start) * (0.90 - 0.1 * r[3])  # so that the tips form a point
            if rise > limit:
                reach *= limit / rise
                if reach < 3.0:
                    continue
                rise = limit
            thick = (4.5 + 2.0 * r[6]) * scale * (1.0 - 0.42 * s)
            low = max(0, int(gutter * scale + length - start - rise - thick * 2))
            high = min(height, int(gutter * scale + length - start + thick * 2) + 1)
            columns = slice(width // 2, width) if side > 0 else slice(0, width // 2)
            x = np.abs(across[low:high, columns])
            y = along[low:high, columns]
            t = x / reach
            center = start + x * (slope + bend * t)
            steep = slope + 2.0 * bend * t
            distance = (y - center) / np.sqrt(1.0 + steep * steep)
            body = (
                thick
                * np.minimum(1.0, 0.45 + 3.5 * t)
                * np.sqrt(np.clip(1.0 - t, 0.0, 1.0))
                * (1.0 - 0.35 * t)
            )
            cover = np.clip(body - np.abs(distance) + 0.5, 0.0, 1.0) * (t < 1.0)
            edge = np.abs(distance) / np.maximum(body, 0.5)
            vein = noise(distance * 0.8, y * 0.02, seed + k) * 0.10
            shade = 0.48 + 0.34 * (r[7] - 0.5) + vein + 0.20 * t - 0.22 * step(0.75, 1.0, edge)
            shade += 0.34 * (1.0 - step(0.05, 0.26, edge)) - 0.32 * (1.0 - step(0.0, 0.16, t))
            shade -= (
                0.10 * np.sign(distance) * np.minimum(1.0, edge)
            )  # one half of the folded leaflet faces away
            leaf = ramp(frond.colors, shade)
            dry = step(0.72 + 0.2 * r[3], 1.0, t) * (0.35 + 0.65 * frond.tatter * 2.0)
            blotch = step(0.25, 0.7, fbm(x * 0.03 + k, y * 0.03, seed + 5, 3)) * frond.tatter
            leaf = mix(leaf, rgb(frond.tip), np.clip(dry + blotch, 0.0, 0.9))
            block = color[low:high, columns]
            block[:] = mix(block, leaf, cover)
            alpha[low:high, columns] = np.maximum(alpha[low:high, columns], cover)
    s = along / length
    rib = (7.5 * (1.0 - np.clip(s, 0.0, 1.0)) ** 0.8 + 1.4 + 9.0 * (1.0 - step(0.0, 0.14, s))) * scale * 0.5
    cover = np.clip(rib - np.abs(across) + 0.5, 0.0, 1.0) * (s < 0.985)
    round_ = np.sqrt(np.clip(1.0 - (across / np.maximum(rib, 0.5)) ** 2, 0.0, 1.0))
    fibre = 0.12 * noise(across * 0.5, along * 0.02, frond.seed + 9)
    stem = mix(rgb(frond.colors[1]), rgb(frond.rib), np.clip(0.25 + 0.75 * round_ + fibre, 0.0, 1.0))
    stem = mix(stem, rgb("#7a6238"), (1.0 - step(-0.02, 0.12, s)) * 0.7)
    color = mix(color, stem, cover)
    alpha = np.maximum(alpha, cover)
    return color, alpha


def paint_bark() -> Floats:
    """The whole trunk at twice the size, foot at the bottom: both parts in one picture, with gutters.

    It repeats around the trunk, and the gutters continue it.
    """
    gutter = GUTTER // 2
    rows, columns = 2 * (2 * BARK_HEIGHT + 2 * gutter), 2 * (BARK_WIDTH + 2 * gutter)
    py, px = np.meshgrid(np.arange(rows) + 0.5, np.arange(columns) + 0.5, indexing="ij")
    u = (px / 2.0 - gutter) / BARK_WIDTH
    v = (2 * BARK_HEIGHT + gutter - py / 2.0) / (2 * BARK_HEIGHT)  # 0 foot, 1 crown
    # leaf scars: 74 uneven rings, denser towards the crown
    waver = 0.42 * fbm(u * 4.0, v * 34.0, 3, 3, period_x=4) + 0.16 * fbm(
        u * 16.0, v * 120.0, 4, 2, period_x=16
    )
    ring = 62.0 * v + 12.0 * v * v + waver
    index = np.floor(ring).astype(np.int64)
    phase = ring - index
    tone = hash01(index, index * 0 + 5, 8) - 0.5
    scar = step(0.0, 0.07, phase) * (1.0 - step(0.12, 0.34, phase))
    groove = 1.0 - step(0.0, 0.05, np.minimum(phase, 1.0 - phase))
    fibre = fbm(u * 40.0, v * 60.0, 12, 3, period_x=40)
    coarse = fbm(u * 5.0, v * 22.0, 14, 4, period_x=5)
    light = 0.47 + 0.13 * tone + 0.21 * fibre + 0.22 * coarse + 0.26 * scar - 0.34 * groove
    light -= 0.10 * step(0.5, 1.0, phase)
    # cracks that run up the trunk
    crack = np.abs(noise(u * 13.0 + 0.15 * coarse, v * 46.0, 17, period_x=13))
    depth = 1.0 - step(0.0, 0.09, crack)
    open_ = step(0.05, 0.35, fbm(u * 4.0, v * 16.0, 18, 3, period_x=4))
    light -= 0.30 * depth * open_
    color = ramp(["#2f2720", "#5d5145", "#8b7d6b", "#b1a28b", "#cfc1a8"], light)
    # lichen, salt at the foot, green towards the crown, and brown fibres below the fronds
    lichen = step(0.30, 0.62, fbm(u * 6.0, v * 44.0, 21, 4, period_x=6)) * step(0.05, 0.3, v)
    color = mix(color, color * 0.4 + rgb("#b9bd9b") * 0.6, 0.55 * lichen)
    color = mix(color, color * rgb("#c9a77c"), 0.55 * (1.0 - step(0.0, 0.10, v + 0.03 * coarse)))
    color = mix(color, color * 0.5 + rgb("#6f7a3d") * 0.5, 0.6 * step(0.82, 0.95, v + 0.03 * coarse))
    weave = (
        0.5
        + 0.30 * noise(u * 44.0 + v * 60.0, v * 90.0, 31)
        + 0.30 * noise(u * 40.0, v * 260.0, 32, period_x=40)
    )
    sheath = ramp(["#33230f", "#694a22", "#97713a", "#b99a5c"], weave + 0.25 * coarse)
    return mix(color, sheath, step(0.945, 0.965, v + 0.012 * fibre))


def paint_nut(kind: int, top: bool) -> Floats:
    """Half a coconut seen along its axis, at twice the size: a square of 4 * (NUT_RADIUS + 8) pixels."""
    side = 4 * (NUT_RADIUS + GUTTER // 2)
    py, px = np.meshgrid(np.arange(side) + 0.5 - side / 2, np.arange(side) + 0.5 - side / 2, indexing="ij")
    radius = np.sqrt(px * px + py * py) / (2.0 * NUT_RADIUS)
    colors = (
        ["#4f5c14", "#7d8b22", "#a3ac3a", "#c3c460"],
        ["#8a5a16", "#b9852a", "#d8a845", "#e9c877"],
        ["#3b2412", "#5f3f20", "#83603a", "#a98558"],
    )[kind]
    seed = 60 + kind
    # fibres from pole to pole: noise over the angle, stretched along the radius
    ux, uy = px / np.maximum(radius, 1e-6) / 90.0, py / np.maximum(radius, 1e-6) / 90.0
    fibre = 0.5 * noise(ux * 14.0, uy * 14.0, seed) + 0.5 * noise(ux * 31.0, uy * 31.0, seed + 1)
    spots = fbm(px * 0.03, py * 0.03, seed + 2, 4)
    light = 0.56 + 0.16 * fibre + 0.30 * spots - 0.16 * radius
    color = ramp(colors, light)
    color = mix(color, rgb("#5a4020"), 0.7 * step(0.28, 0.62, fbm(px * 0.02, py * 0.02, seed + 3, 4)))
    if top:  # the cap at the stalk
        cap = 1.0 - step(0.16, 0.34, radius + 0.05 * fibre)
        color = mix(color, rgb("#8c7443") * (0.8 + 0.25 * fibre[..., None]), 0.9 * cap)
    return color


def atlas() -> tuple[Floats, Floats]:
    """The atlas: colour (1024, 1024, 3) sRGB, and opacity (1024, 1024), 1 where there is no frond."""
    gutter = GUTTER // 2
    color = np.zeros((SIZE, SIZE, 3))
    known = np.zeros((SIZE, SIZE), dtype=bool)
    alpha = np.ones((SIZE, SIZE))

    def put(image: Floats, x: int, y: int) -> None:
        h, w = image.shape[:2]
        color[y : y + h, x : x + w] = image
        known[y : y + h, x : x + w] = True

    bark = halve(paint_bark())
    tall = BARK_HEIGHT + 2 * gutter
    put(bark[-tall:], BARK_X[0] - gutter, BARK_Y - gutter)
    put(bark[:tall], BARK_X[1] - gutter, BARK_Y - gutter)
    for x, frond in zip(FROND_X, FRONDS, strict=True):
        leaf, cover = paint_frond(frond)
        seen = halve(cover[..., None])
        # colour weighted by opacity, then extended into the gaps, so that leaf edges filter no foreign colour
        leaf = halve(leaf * cover[..., None]) / np.maximum(seen, 1e-6)
        leaf = dilate(leaf, seen[..., 0] > 0.02)
        put(leaf, x - gutter, FROND_Y - gutter)
        h, w = seen.shape[:2]
        alpha[FROND_Y - gutter : FROND_Y - gutter + h, x - gutter : x - gutter + w] = seen[..., 0]
    for i, x in enumerate(NUT_X):
        corner = NUT_RADIUS + gutter
        put(halve(paint_nut(i // 2, i % 2 == 0)), x - corner, NUT_Y - corner)
    return dilate(color, known), alpha


def frond_half_width(s: float) -> float:
    """Half width in atlas pixels of a frond's strip of geometry at position s."""
    reach = float(outline(np.array([s]))[0])
    spread = max(float(outline(np.array([max(0.0, s - k * 0.02)]))[0]) for k in range(7))
    room = max(reach, spread, 0.1)
    if s < 0.16:
        room = max(0.1, room * s / 0.16)
    return min(1.0, math.sqrt(room) if room > 0.5 else room * 1.2) * FROND_WIDTH / 2.0

"""terrain/effect.png and terrain/effect_height.png: details of the whole terrain.

Placed by the terrain's heightmap: wind ripples on the dunes, a wet band on the beach, wave ripples,
starfish, sea grass and corals on the sea floor. The first file is the colour. The second is the relief,
from which the terrain's normal map is baked. Row 0 at -Z, column 0 at -X; a texel is a square of 0.098 m.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import strokes
import terrain
from noise import Array, blur, fbm, normal, smoothstep, spectral_noise, uniform
from picture import hex_color, write_image

PIXELS = 2048
TEXEL_M = terrain.SIZE_M / PIXELS
RELIEF_LOW_M, RELIEF_HIGH_M = -0.12, 0.28  # relief of grey levels 0 and 65535
RELIEF_STEP = 16  # grey levels are multiples of this, because finer noise does not compress

DRY, WET, FLOOR, DEEP = (hex_color(c) for c in ("#E8D3A2", "#C3A676", "#E4DAB9", "#BFC0A8"))
HOLLOW, GRASS, RUBBLE = (hex_color(c) for c in ("#8F7A58", "#66845A", "#77705A"))
FIBRE = hex_color("#7C6646")
STARS = ("#DB7440", "#CC5546", "#E5A050", "#BC5C74", "#DE9272")
LAGOON_M = ((-12.0, 22.0), (-4.0, 34.0))  # x and z of the floor that the flight passes over
CORALS = ("#C98F86", "#DDAF8E", "#B98A9C", "#D6BA92", "#C77F6E")


def spread(field: Array) -> Array:
    """Samples a vertex grid at texel centres, bilinear: (2048, 2048)."""
    position = (np.arange(PIXELS) + 0.5) / PIXELS * (field.shape[0] - 1)
    first = np.minimum(np.floor(position).astype(np.int64), field.shape[0] - 2)
    part = position - first
    rows = field[first] * (1 - part)[:, None] + field[first + 1] * part[:, None]
    return np.asarray(rows[:, first] * (1 - part) + rows[:, first + 1] * part)


def broad(cell_m: float, seed: int, octaves: int = 3) -> Array:
    """Smooth noise with the given cell size, standard deviation about 1: (2048, 2048)."""
    x, z = terrain.grid_m(513)
    return spread(3.0 * fbm(x / cell_m, z / cell_m, seed, octaves))


def ripples(length_m: float, toward: tuple[float, float], fan: float, seed: int) -> Array:
    """Ripples in -1..1 across a direction (x, z): a narrow band of waves, whose crests fork."""
    count = terrain.SIZE_M / 2 / length_m  # waves per tile; the tile repeats twice along each side

    def weight(kx: Array, ky: Array) -> Array:
        k = np.hypot(kx, ky)
        facing = (kx * toward[0] + ky * toward[1]) / np.maximum(k, 1e-9)
        turn = np.sqrt(np.maximum(2.0 - 2.0 * facing, 0.0))
        return np.asarray(np.exp(-(((k - count) / (0.16 * count)) ** 2) - (turn / fan) ** 2))

    field = spectral_noise(PIXELS // 2, weight, seed)
    size = np.abs(field)
    crest = field.real / (size + 0.35 * np.mean(size))
    return np.tile((0.75 * crest + 0.25 * crest * np.abs(crest)).astype(np.float64), (2, 2))


def scatter(spacing_m: float, seed: int, wanted: Array) -> list[tuple[tuple[float, float], Array]]:
    """Random points, at most one per cell of the spacing, kept with the probability `wanted` at the point.

    Each is ((column, row) in texels, eight random numbers in 0..1).
    """
    cells = int(terrain.SIZE_M / spacing_m)
    pick = uniform((cells, cells, 11), seed)
    column = (np.arange(cells)[None, :] + pick[:, :, 0]) / cells * PIXELS
    row = (np.arange(cells)[:, None] + pick[:, :, 1]) / cells * PIXELS
    chance = wanted[np.minimum(row.astype(int), PIXELS - 1), np.minimum(column.astype(int), PIXELS - 1)]
    kept = np.argwhere(pick[:, :, 2] < chance)
    return [((float(column[i, j]), float(row[i, j])), pick[i, j, 3:]) for i, j in kept]


class Ground:
    """The picture: color (2048, 2048, 3) sRGB, relief (2048, 2048) in metres above the terrain."""

    def __init__(self, color: Array, relief: Array) -> None:
        self.color = color
        self.relief = relief

    def stamp(
        self, point: tuple[float, float], reach: float, shade: Array, rise_m: float, draw: strokes.Stroke
    ) -> None:
        """Blends the colour and height of a shape at a point (column, row)."""
        column, row = point
        x0, x1 = max(0, int(column - reach)), min(PIXELS, int(column + reach) + 2)
        y0, y1 = max(0, int(row - reach)), min(PIXELS, int(row + reach) + 2)
        dx, dy = np.meshgrid(np.arange(x0, x1) + 0.5 - column, np.arange(y0, y1) + 0.5 - row)
        cover, tone, rise = draw(dx, dy)
        part = self.color[y0:y1, x0:x1]
        part += (shade * tone[:, :, None] - part) * cover[:, :, None]
        self.relief[y0:y1, x0:x1] += (
            rise_m * rise * (cover > 0.0) * np.minimum(1.0, 1.1 * cover + (rise < 0.0))
        )


def bare_ground(height: Array) -> Ground:
    """Dry, wet and submerged sand with ripples; height : (2048, 2048) metres."""
    tone, hue, patch = broad(14.0, 11, 4), broad(9.0, 17), broad(4.0, 23)
    # height of the last waves on the beach
    line = height - 0.05 - 0.045 * broad(9.0, 29, 2) - 0.02 * broad(2.6, 31, 2)
    wet = smoothstep(0.10, -0.08, line)
    under = smoothstep(0.06, -0.40, height)
    color = DRY + (WET - DRY) * wet[:, :, None]
    color = color + (FLOOR - color) * under[:, :, None]
    color = color + (DEEP - color) * smoothstep(-2.5, -9.0, height)[:, :, None]
    # relief: wind ripples on dry sand, wave ripples under water, grains
    calm = 0.65 + 0.35 * np.clip(broad(11.0, 37, 2), -1.0, 1.0)
    wind = calm * ripples(0.62, terrain.WIND, 0.16, 41) * smoothstep(0.6, 1.7, height + 0.12 * tone)
    turn = smoothstep(-0.7, 0.7, broad(26.0, 53, 2))
    swash = smoothstep(-0.10, -0.5, height) * smoothstep(-7.5, -1.5, height)
    shore, cross = ripples(0.85, (0.25, 0.97), 0.34, 43), ripples(0.95, (0.85, -0.52), 0.34, 47)
    waves = calm * (shore * np.sqrt(turn) + cross * np.sqrt(1.0 - turn)) * swash
    grain = blur(normal(height.shape, 61), 0.6) * 2.0 * smoothstep(-8.0, -3.0, height)
    value = 1.0 + 0.012 * tone + 0.010 * patch + 0.050 * wind + 0.052 * waves + 0.010 * grain
    color = color * value[:, :, None] + hue[:, :, None] * np.array([0.004, 0.0, -0.006])
    return Ground(color, 0.017 * wind + 0.020 * waves + 0.0012 * grain + 0.006 * patch)


def grow(ground: Ground, height: Array) -> None:
    """Sea grass meadows and corals on the outer shelf."""
    shelf = smoothstep(-1.9, -3.0, height) * smoothstep(-8.5, -5.5, height)
    meadow = smoothstep(0.55, 1.35, broad(19.0, 71, 3) + 0.4 * broad(3.0, 73, 3)) * shelf
    blades = 0.5 + 0.5 * ripples(0.42, (0.3, 0.95), 0.9, 79)
    tuft = smoothstep(-0.6, 0.9, broad(1.6, 75, 3))
    grass = GRASS * (0.70 + 0.25 * blades + 0.30 * tuft)[:, :, None]
    ground.color += (grass - ground.color) * (0.66 * meadow * (0.55 + 0.45 * tuft))[:, :, None]
    ground.relief += meadow * (0.05 * tuft + 0.02 * blades)
    reef = (
        smoothstep(0.75, 1.5, broad(23.0, 83, 2))
        * smoothstep(-1.6, -2.4, height)
        * smoothstep(-8.0, -5.0, height)
    )
    rubble = reef * smoothstep(-0.3, 1.0, broad(3.4, 85, 3))
    ground.color += (RUBBLE * (0.9 + 0.2 * blades)[:, :, None] - ground.color) * (0.55 * rubble)[:, :, None]
    ground.relief += 0.05 * rubble
    for point, pick in scatter(1.1, 87, 0.65 * rubble + 0.10 * reef):
        radius = (0.22 + 0.80 * pick[0] ** 2.5) / TEXEL_M
        shade = hex_color(CORALS[int(pick[1] * len(CORALS))])
        ground.stamp(point, 2.6 * radius, RUBBLE * 0.8, 0.03, strokes.hollow(1.2 * radius, 0.5))
        ground.stamp(point, 1.2 * radius, shade, 0.10 + 0.10 * pick[0], strokes.coral(radius, 6.28 * pick[2]))


@dataclass(frozen=True)
class Star:
    """A starfish. point: column and row of its middle; turn, bend: see strokes.starfish."""

    point: tuple[float, float]
    radius_m: float
    turn: float
    bend: float
    shade: str


def stars(height: Array) -> list[Star]:
    """All starfish, in shallow water."""
    sea = smoothstep(-0.25, -0.6, height) * smoothstep(-4.2, -2.4, height)
    return [
        Star(
            point,
            0.27 + 0.24 * pick[0],
            6.28 * pick[2],
            0.9 * (pick[3] - 0.5),
            STARS[int(pick[1] * len(STARS))],
        )
        for point, pick in scatter(4.4, 97, 0.26 * sea)
    ]


def place_m(star: Star) -> tuple[float, float]:
    """Its x and z."""
    return (star.point[0] / PIXELS - 0.5) * terrain.SIZE_M, (star.point[1] / PIXELS - 0.5) * terrain.SIZE_M


def is_near(star: Star) -> bool:
    """Whether the flight looks at it from near by, over the lagoon: too near for texels of 10 cm."""
    return all(low < v < high for v, (low, high) in zip(place_m(star), LAGOON_M, strict=True))


def strew(ground: Ground, height: Array) -> None:
    """Starfish but for near ones, which are meshes (starfish.py), as shells on the beach are (shells.py)."""
    for star in stars(height):
        if is_near(star):
            continue
        radius = star.radius_m / TEXEL_M
        ground.stamp(star.point, 2.6 * radius, HOLLOW, 0.025, strokes.hollow(0.9 * radius, 0.32))
        draw = strokes.starfish(radius, star.turn, star.bend)
        ground.stamp(star.point, 1.1 * radius + 1, hex_color(star.shade), 0.065, draw)


def litter(ground: Ground) -> None:
    """The sand around the palm: darkened by fallen fibres, piled up by the wind."""
    point = tuple((v / terrain.SIZE_M + 0.5) * PIXELS for v in terrain.PALM)
    ground.stamp(point, 2.6 / TEXEL_M, FIBRE, -0.05, strokes.hollow(0.62 / TEXEL_M, 0.62))


@cache
def painted() -> Ground:
    """The complete picture."""
    height = spread(terrain.heights_m())
    ground = bare_ground(height)
    grow(ground, height)
    strew(ground, height)
    litter(ground)
    return ground


def make(out: Path) -> None:
    """Writes terrain/effect.png and terrain/effect_height.png under out."""
    ground = painted()
    write_image(out / "terrain/effect.png", ground.color, "uint8")
    level = np.clip((ground.relief - RELIEF_LOW_M) / (RELIEF_HIGH_M - RELIEF_LOW_M), 0.0, 1.0) * (
        65535 // RELIEF_STEP
    )
    write_image(out / "terrain/effect_height.png", np.floor(level + 0.5) * RELIEF_STEP / 65535, "uint16")

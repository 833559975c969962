"""terrain/height.png: a crescent island around a shallow lagoon that opens to the south (+Z).

The land is a chain of discs along a bent spine with domain warping. Its signed distance gives beach, berm and
sea floor. Dunes shaped by one wind direction are added far enough inland. Metres, Y up; row 0 at
-Z, column 0 at -X.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from noise import Array, fbm, gradient_noise, smoothstep
from picture import write_image

SIZE_M = 200.0  # from the first to the last pixel, on X and on Z
PIXELS = 1025
BLACK_M, WHITE_M = -16.0, 8.0  # heights of grey levels 0 and 65535
SEA_FLOOR_M = -15.0
DUNE_TOP_M = 6.0
WIND = (0.88, -0.475)  # direction that the wind blows to, X and Z; it comes from the south-west

# x, z and half width of the land along its spine, from the tip of the western horn round the north to the
# eastern one
SPINE = np.array(
    [
        (-24.0, 44.0, 3.0),
        (-33.0, 37.0, 6.5),
        (-41.0, 24.0, 9.5),
        (-43.0, 8.0, 15.0),
        (-36.0, -10.0, 17.0),
        (-20.0, -24.0, 25.0),
        (4.0, -29.0, 21.0),
        (24.0, -23.0, 24.0),
        (38.0, -8.0, 17.0),
        (44.0, 7.0, 11.0),
        (40.0, 18.0, 7.0),
    ]
)
LAGOON = (1.0, 14.0, 29.0)  # x, z, radius of the basin between the horns
LAGOON_DEPTH_M = 1.9
PALM = (-25.0, 3.0)  # x, z of its foot


def grid_m(pixels: int = PIXELS) -> tuple[Array, Array]:
    """x and z of every pixel in metres, each (pixels, pixels)."""
    line = np.linspace(-SIZE_M / 2, SIZE_M / 2, pixels)
    x, z = np.meshgrid(line, line)
    return x, z


def spine_points(per_span: int = 14) -> Array:
    """The spine refined by a Catmull-Rom spline: (n, 3) x, z, half width."""
    p = np.vstack([2 * SPINE[0] - SPINE[1], SPINE, 2 * SPINE[-1] - SPINE[-2]])
    t = (np.arange(per_span) / per_span)[:, None]
    spans = []
    for a, b, c, d in zip(p, p[1:], p[2:], p[3:], strict=False):
        spans.append(
            0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
        )
    return np.vstack([*spans, SPINE[-1:]])


def shore_distance(x: Array, z: Array) -> tuple[Array, Array]:
    """Distance to the shore in metres, negative on land: for the island, and for the island with a filled
    lagoon."""
    warp_x = 8.0 * fbm(x / 42, z / 42, 1, 4) + 1.2 * gradient_noise(x / 11, z / 11, 5)
    warp_z = 8.0 * fbm(x / 42, z / 42, 2, 4) + 1.2 * gradient_noise(x / 11, z / 11, 6)
    px, pz = x + warp_x, z + warp_z
    soft = 2.2
    single_x, single_z = px.astype(np.float32), pz.astype(np.float32)  # the sum takes most of the time
    total = np.zeros(px.shape, np.float32)
    for cx, cz, radius in spine_points().astype(np.float32):
        away = np.sqrt(np.square(single_x - cx) + np.square(single_z - cz) + np.float32(9.0))
        total += np.exp((radius + np.float32(1.0) - away) * np.float32(1.0 / soft))
    land = -soft * np.log(np.maximum(total.astype(np.float64), 1e-30)) + 3.8
    basin = np.hypot(px - LAGOON[0], pz - LAGOON[1]) - LAGOON[2]
    near = 6.0
    hull = -near * np.log(np.exp(-np.minimum(land, 300.0) / near) + np.exp(-basin / near))
    return land, hull


def dune_ridges(x: Array, z: Array, length_m: float, seed: int) -> Array:
    """Transverse dunes, 0..1, with long windward flanks, sharp crests, short lee flanks, and crests that
    fork.

    The wave's phase runs along the wind and is warped; shape after the transverse and barchanoid dunes of R.
    A. Bagnold, "The Physics of Blown Sand and Desert Dunes", 1941.
    """
    along, across = x * WIND[0] + z * WIND[1], -x * WIND[1] + z * WIND[0]
    bend = 0.62 * fbm(along / (2.2 * length_m), across / (2.2 * length_m), seed, 3)
    bend = bend + 0.10 * gradient_noise(along / (0.7 * length_m), across / (0.9 * length_m), seed + 7)
    phase = (along / length_m + bend) % 1.0
    crest = 0.60
    rise = phase / crest
    fall = (phase - crest) / (1.0 - crest)
    windward = rise * rise * (2.2 - 1.2 * rise)
    lee = 1.0 - fall * fall * (3.0 - 2.0 * fall)
    lee = 0.55 * lee + 0.45 * (1.0 - fall) ** 1.6
    return np.where(phase < crest, windward, lee)


@cache
def heights_m() -> Array:
    """The terrain: (1025, 1025) float64 metres above the sea."""
    x, z = grid_m()
    land, hull = shore_distance(x, z)
    inland = -land
    # under water: a beach and a wide shelf; beyond the hull the floor descends
    out = np.maximum(land, 0.0)
    shelf = -LAGOON_DEPTH_M * (1.0 - np.exp(-0.045 * out / LAGOON_DEPTH_M - (out / 15.0) ** 2))
    beyond = np.maximum(hull - 1.0, 0.0)
    fall = (SEA_FLOOR_M + LAGOON_DEPTH_M) * (1.0 - np.exp(-((beyond / 27.0) ** 2.0)))
    bars = 0.16 * fbm(x / 13, z / 9, 21, 3) * smoothstep(2.0, 12.0, out) * smoothstep(30.0, 14.0, out)
    sea = shelf + fall + bars + 0.35 * fbm(x / 22, z / 22, 23, 3) * smoothstep(10.0, 30.0, out)
    # on land: beach face, berm, back beach
    up = np.maximum(inland, 0.0)
    beach = 1.25 * (1.0 - np.exp(-0.045 * up / 1.25 - (up / 13.0) ** 2))
    beach = beach + 0.10 * fbm(x / 16, z / 16, 31, 3) * smoothstep(3.0, 9.0, up)
    # dunes
    room = smoothstep(5.0, 21.0, up + 2.2 * fbm(x / 17, z / 17, 41, 3))
    swell = 0.5 + 0.5 * fbm(x / 34, z / 34, 43, 2)
    ridges = dune_ridges(x, z, 19.0, 51)
    strength = 0.35 + 0.65 * smoothstep(-0.45, 0.5, fbm(x / 24, z / 24, 53, 2))
    small = dune_ridges(x + 31.0, z + 12.0, 7.0, 57) * smoothstep(-0.2, 0.5, fbm(x / 15, z / 15, 59, 2))
    dunes = room * (0.4 + 1.5 * swell + 2.9 * ridges * strength + 0.32 * small)
    hummocks = 0.22 * smoothstep(6.0, 11.0, up) * (0.5 + 0.5 * fbm(x / 6, z / 6, 61, 3))
    low = beach + hummocks
    scale = np.min(
        (DUNE_TOP_M - low) / np.maximum(dunes, 1e-9)
    )  # scaled so that the highest crest has the dunes' height
    ground = low + scale * dunes
    height = np.where(land > 0.0, sea, ground)
    # the floor is level at the border, so that the sea floor can continue beyond it
    edge = np.minimum(SIZE_M / 2 - np.abs(x), SIZE_M / 2 - np.abs(z))
    return np.asarray(SEA_FLOOR_M + (height - SEA_FLOOR_M) * smoothstep(0.0, 24.0, edge))


def height_at(x: float, z: float) -> float:
    """Height of the terrain at a point, metres; bilinear between pixels."""
    field = heights_m()
    column, row = (np.array([x, z]) / SIZE_M + 0.5) * (PIXELS - 1)
    i, j = int(row), int(column)
    a, b = row - i, column - j
    top = field[i, j] * (1 - b) + field[i, j + 1] * b
    low = field[i + 1, j] * (1 - b) + field[i + 1, j + 1] * b
    return float(top * (1 - a) + low * a)


def make(out: Path) -> None:
    """Writes terrain/height.png under out."""
    write_image(out / "terrain/height.png", (heights_m() - BLACK_M) / (WHITE_M - BLACK_M), "uint16")

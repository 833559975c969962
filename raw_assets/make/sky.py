"""sky/<name>/{px,nx,py,ny,pz,nz}.exr: clear skies from noon to night, six half float faces in linear light.

The sky is single scattering in a curved atmosphere of air and haze, after T. Nishita, T. Sirai, K. Tadamura
and E. Nakamae, "Display of the Earth Taking into Account Atmospheric Scattering", 1993, plus a constant for
multiple scattering. Its light, the sun or at night the moon, stands in the north (-Z); the scene turns the
sky to where it is. Disc, stars and clouds are no part of it. Faces follow the cube maps of OpenGL 3.3,
section 3.8.10: order +X -X +Y -Y +Z -Z, row 0 at the top.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from noise import Array, smoothstep
from picture import write_image

PIXELS = 128
FACES = ("px", "nx", "py", "ny", "pz", "nz")

GROUND_M, TOP_M = 6_360_000.0, 6_420_000.0
AIR_PER_M = np.array([5.8e-6, 13.5e-6, 33.1e-6])  # Rayleigh scattering at the ground, red green blue
HAZE_PER_M = 4.5e-6  # Mie scattering at the ground
OZONE_PER_M = np.array(
    [0.65e-6, 1.88e-6, 0.085e-6]
)  # absorption, distributed like the air; makes the blue deeper
AIR_SCALE_M, HAZE_SCALE_M = 8000.0, 1200.0
SUN_LIGHT = 11.0  # irradiance above the atmosphere, in the scene's units


@dataclass(frozen=True)
class Sky:
    """A clear sky. Colours are linear radiances: haze over the sea, away from the light, and what is added
    towards it; the sea far below the horizon. haze_share: of the sky at the horizon; belt: sine of the
    elevation at which a third of it is left. base: of the whole sky, air that glows by itself. light:
    irradiance above the atmosphere."""

    name: str
    elevation_deg: float
    haze: tuple[float, float, float]
    haze_glow: tuple[float, float, float]
    haze_share: float
    sea: tuple[float, float, float]
    belt: float = 0.05
    base: tuple[float, float, float] = (0.0, 0.0, 0.0)
    light: float = SUN_LIGHT


SKIES = (
    Sky("noon", 56.0, (0.72, 0.80, 0.86), (0.30, 0.24, 0.16), 0.88, sea=(0.10, 0.28, 0.38)),
    Sky("afternoon", 33.0, (0.76, 0.661, 0.57), (0.54, 0.356, 0.155), 0.90, sea=(0.10, 0.26, 0.34)),
    Sky("golden", 12.0, (0.56, 0.46, 0.42), (0.90, 0.50, 0.16), 0.80, sea=(0.09, 0.17, 0.22)),
    Sky(
        "sunset", 3.0, (0.30, 0.23, 0.27), (1.25, 0.47, 0.06), 0.90,
        belt=0.07, sea=(0.06, 0.08, 0.12), base=(0.026, 0.044, 0.110),
    ),
    Sky(
        "afterglow", -2.5, (0.13, 0.12, 0.20), (0.85, 0.27, 0.05), 0.92,
        belt=0.13, sea=(0.02, 0.03, 0.06), base=(0.030, 0.046, 0.110),
    ),
    Sky(
        "dusk", -7.0, (0.030, 0.038, 0.085), (0.16, 0.055, 0.030), 0.90,
        belt=0.13, sea=(0.004, 0.008, 0.020), base=(0.008, 0.014, 0.042),
    ),
    Sky(
        "night", 20.0, (0.012, 0.019, 0.040), (0.010, 0.014, 0.022), 0.80,
        belt=0.10, sea=(0.002, 0.004, 0.010), base=(0.0022, 0.0042, 0.0115), light=0.16,
    ),
)  # fmt: skip


def light_direction(sky: Sky) -> Array:
    """Unit vector from the ground to the sky's light."""
    elevation = np.radians(sky.elevation_deg)
    return np.array([0.0, np.sin(elevation), -np.cos(elevation)])


def face_directions(face: int, pixels: int = PIXELS) -> Array:
    """Unit directions through the texel centres of a face: (pixels, pixels, 3)."""
    line = (np.arange(pixels) + 0.5) / pixels * 2.0 - 1.0
    s, t = np.meshgrid(line, line)
    one = np.ones_like(s)
    x, y, z = (
        (one, -t, -s),
        (-one, -t, s),
        (s, one, t),
        (s, -one, -t),
        (s, -t, one),
        (-s, -t, -one),
    )[face]
    direction = np.stack([x, y, z], -1)
    return np.asarray(direction / np.sqrt((direction * direction).sum(-1, keepdims=True)))


def _column(radius: Array, cosine: Array, steps: int = 48) -> tuple[Array, Array]:
    """Metres of ground-level air and haze between a point and the top of the atmosphere. Through the ground
    there is more than any light passes."""
    reach = -radius * cosine + np.sqrt(np.maximum((radius * cosine) ** 2 - radius**2 + TOP_M**2, 0.0))
    air, haze = np.zeros_like(radius), np.zeros_like(radius)
    for i in range(steps):
        low, high = (i / steps) ** 2, ((i + 1) / steps) ** 2
        t = reach * (0.5 * (low + high))
        altitude = np.sqrt(radius**2 + t * t + 2.0 * radius * t * cosine) - GROUND_M
        air = air + np.exp(-altitude / AIR_SCALE_M) * reach * (high - low)
        haze = haze + np.exp(-altitude / HAZE_SCALE_M) * reach * (high - low)
    return air, haze


def _transmission(air: Array, haze: Array) -> Array:
    return np.exp(-(AIR_PER_M + OZONE_PER_M) * air[..., None] - 1.1 * HAZE_PER_M * haze[..., None])


_ALTITUDES, _COSINES = 96, 192
_LOWEST_COSINE = -0.35


@cache
def _light_table() -> Array:
    """Share of the light that reaches a point, by the root of its altitude and by the cosine of the light's
    zenith angle there, finest about the horizon: (_ALTITUDES, _COSINES, 3)."""
    altitude = np.linspace(0.0, 1.0, _ALTITUDES) ** 2 * (TOP_M - GROUND_M)
    line = np.linspace(-np.sqrt(-_LOWEST_COSINE), 1.0, _COSINES)
    cosine = np.sign(line) * line * line
    radius, cosines = np.meshgrid(GROUND_M + altitude, cosine, indexing="ij")
    return _transmission(*_column(radius, cosines))


def _lit(altitude: Array, cosine: Array) -> Array:
    """The share of the light that reaches points: (..., 3)."""
    table = _light_table()
    row = np.sqrt(np.clip(altitude / (TOP_M - GROUND_M), 0.0, 1.0)) * (_ALTITUDES - 1)
    lowest = -np.sqrt(-_LOWEST_COSINE)
    line = np.sign(cosine) * np.sqrt(np.abs(cosine))
    column = np.clip((line - lowest) / (1.0 - lowest), 0.0, 1.0) * (_COSINES - 1)
    i = np.minimum(row.astype(np.int64), _ALTITUDES - 2)
    j = np.minimum(column.astype(np.int64), _COSINES - 2)
    a, b = (row - i)[..., None], (column - j)[..., None]
    low = table[i, j] * (1.0 - b) + table[i, j + 1] * b
    high = table[i + 1, j] * (1.0 - b) + table[i + 1, j + 1] * b
    return np.asarray(low * (1.0 - a) + high * a)


def _phase_haze(cosine: Array, g: float) -> Array:
    """L. G. Henyey and J. L. Greenstein, "Diffuse radiation in the galaxy", 1941."""
    return np.asarray((1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5))


def _scattered(sky: Sky, height: Array, cosine: Array, steps: int = 28) -> Array:
    """Light that the air scatters; height = sine of the elevation (above 0), cosine to the light."""
    ground = GROUND_M + 20.0
    radius = np.full_like(height, ground)
    reach = -radius * height + np.sqrt((radius * height) ** 2 - radius**2 + TOP_M**2)
    up_to_light = np.sin(np.radians(sky.elevation_deg))
    phase_air = (3 / (16 * np.pi) * (1 + cosine**2))[..., None]
    phase_haze = (0.8 * _phase_haze(cosine, 0.72) + 0.2 * _phase_haze(cosine, 0.2))[..., None]
    air, haze = np.zeros_like(height), np.zeros_like(height)
    total = np.zeros((*height.shape, 3))
    for i in range(steps):
        low, high = (i / steps) ** 2.2, ((i + 1) / steps) ** 2.2
        t, length = reach * 0.5 * (low + high), reach * (high - low)
        here = np.sqrt(radius**2 + t * t + 2.0 * radius * t * height)
        altitude = here - GROUND_M
        air_here, haze_here = (
            np.exp(-altitude / AIR_SCALE_M) * length,
            np.exp(-altitude / HAZE_SCALE_M) * length,
        )
        seen = _transmission(air + 0.5 * air_here, haze + 0.5 * haze_here)
        air, haze = air + air_here, haze + haze_here
        light = _lit(altitude, (ground * up_to_light + t * cosine) / here)
        single = AIR_PER_M * air_here[..., None] * phase_air + HAZE_PER_M * haze_here[..., None] * phase_haze
        again = 0.036 * (AIR_PER_M * air_here[..., None] + HAZE_PER_M * haze_here[..., None])
        total += seen * light * (single + again * np.array([0.46, 0.72, 1.0]))
    return total * sky.light


def radiance(sky: Sky, direction: Array) -> Array:
    """Radiance of the sky: (..., 3). Below the horizon: the haze of the sea."""
    up = direction[..., 1]
    cosine = np.clip(direction @ light_direction(sky), -1.0, 1.0)
    above = np.maximum(up, 0.0)
    flat = above + 0.012 * np.exp(-above / 0.012)  # no hard edge where the air is densest
    color = np.zeros((*up.shape, 3))
    high = up > 0.0
    color[high] = _scattered(sky, flat[high], cosine[high])
    line = np.linspace(-1.0, 1.0, 513)  # below the horizon only the angle to the light matters
    low = _scattered(sky, np.full_like(line, 0.012), line)
    for channel in range(3):
        color[~high, channel] = np.interp(cosine[~high], line, low[:, channel])
    color += np.array(sky.base) * (1.0 + 1.5 * np.exp(-above / 0.2))[..., None]
    # haze over the sea: pale, warm towards the light
    toward = (0.5 + 0.5 * cosine[..., None]) ** 3
    haze = np.array(sky.haze) + np.array(sky.haze_glow) * toward
    band = (sky.haze_share * np.exp(-above / sky.belt))[..., None]
    color = color + (haze - color) * band
    below = smoothstep(0.0, 0.40, -up)[..., None]
    return np.asarray(color + (np.array(sky.sea) - color) * below * 0.85)


def make(out: Path) -> None:
    """Writes the six faces of each sky under out/sky."""
    for sky in SKIES:
        for face, name in enumerate(FACES):
            write_image(out / f"sky/{sky.name}/{name}.exr", radiance(sky, face_directions(face)), "half")

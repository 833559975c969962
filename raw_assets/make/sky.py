"""sky/{px,nx,py,ny,pz,nz}.exr: a late afternoon sky, six half float faces in linear light.

The clear sky is single scattering in a curved atmosphere of air and haze, after T. Nishita, T. Sirai, K.
Tadamura and E. Nakamae, "Display of the Earth Taking into Account Atmospheric Scattering", 1993, plus a
constant for multiple scattering. clouds.py adds the cumulus. Faces follow the cube maps of
OpenGL 3.3, section 3.8.10: order +X -X +Y -Y +Z -Z, row 0 at the top.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

import clouds
from noise import Array, smoothstep
from picture import write_image

PIXELS = 512
FACES = ("px", "nx", "py", "ny", "pz", "nz")
SUN_AZIMUTH_DEG = 233.0  # from -Z (0) over +X (90)
SUN_ELEVATION_DEG = 33.0
SUN_RADIUS_DEG = 0.6  # larger than the real sun, so that the disc covers a few texels
SUN_DISC = np.array(
    [60.0, 50.0, 36.0]
)  # radiance of the disc; moderate, because the player adds its own highlights

GROUND_M, TOP_M = 6_360_000.0, 6_420_000.0
AIR_PER_M = np.array([5.8e-6, 13.5e-6, 33.1e-6])  # Rayleigh scattering at the ground, red green blue
HAZE_PER_M = 4.5e-6  # Mie scattering at the ground
OZONE_PER_M = np.array(
    [0.65e-6, 1.88e-6, 0.085e-6]
)  # absorption, distributed like the air; makes the blue deeper
AIR_SCALE_M, HAZE_SCALE_M = 8000.0, 1200.0
SUN_LIGHT = 11.0  # irradiance above the atmosphere, in the scene's units
SKY_WEIGHT = 1.0


def sun_direction(azimuth_deg: float = SUN_AZIMUTH_DEG, elevation_deg: float = SUN_ELEVATION_DEG) -> Array:
    """Unit vector from the ground to the sun: (cos el sin az, sin el, -cos el cos az)."""
    az, el = np.radians(azimuth_deg), np.radians(elevation_deg)
    return np.array([np.cos(el) * np.sin(az), np.sin(el), -np.cos(el) * np.cos(az)])


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
    """Metres of ground-level air and haze between a point and the top of the atmosphere."""
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


@cache
def _sun_table() -> tuple[Array, Array]:
    """Altitudes in metres and the share of sunlight that reaches them: (n,), (n, 3)."""
    altitude = np.linspace(0.0, 1.0, 128) ** 2 * (TOP_M - GROUND_M)
    cosine = np.full_like(altitude, np.sin(np.radians(SUN_ELEVATION_DEG)))
    return altitude, _transmission(*_column(GROUND_M + altitude, cosine))


def sunlight() -> Array:
    """Colour of the sun's light at the ground, in the sky's units: (3,)."""
    return np.asarray(_sun_table()[1][0] * SUN_LIGHT)


def _phase_haze(cosine: Array, g: float) -> Array:
    """L. G. Henyey and J. L. Greenstein, "Diffuse radiation in the galaxy", 1941."""
    return np.asarray((1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5))


def _clear_sky_of(height: Array, cosine: Array, steps: int = 28) -> Array:
    """Radiance of the clear sky; height = sine of the elevation (above 0), cosine to the sun; (..., 3)."""
    radius = np.full_like(height, GROUND_M + 20.0)
    reach = -radius * height + np.sqrt((radius * height) ** 2 - radius**2 + TOP_M**2)
    altitudes, lit = _sun_table()
    phase_air = (3 / (16 * np.pi) * (1 + cosine**2))[..., None]
    phase_haze = (0.8 * _phase_haze(cosine, 0.72) + 0.2 * _phase_haze(cosine, 0.2))[..., None]
    air, haze = np.zeros_like(height), np.zeros_like(height)
    total = np.zeros((*height.shape, 3))
    for i in range(steps):
        low, high = (i / steps) ** 2.2, ((i + 1) / steps) ** 2.2
        t, length = reach * 0.5 * (low + high), reach * (high - low)
        altitude = np.sqrt(radius**2 + t * t + 2.0 * radius * t * height) - GROUND_M
        air_here, haze_here = (
            np.exp(-altitude / AIR_SCALE_M) * length,
            np.exp(-altitude / HAZE_SCALE_M) * length,
        )
        seen = _transmission(air + 0.5 * air_here, haze + 0.5 * haze_here)
        air, haze = air + air_here, haze + haze_here
        sun = np.stack([np.interp(altitude, altitudes, lit[:, c]) for c in range(3)], -1)
        single = AIR_PER_M * air_here[..., None] * phase_air + HAZE_PER_M * haze_here[..., None] * phase_haze
        again = 0.036 * (AIR_PER_M * air_here[..., None] + HAZE_PER_M * haze_here[..., None])
        total += seen * (sun * single + again * np.array([0.46, 0.72, 1.0]))
    return total * SUN_LIGHT * SKY_WEIGHT


def clear_sky(direction: Array) -> Array:
    """Radiance of the sky without clouds or disc: (..., 3). Below the horizon: the haze of the sea."""
    up = direction[..., 1]
    cosine = np.clip(direction @ sun_direction(), -1.0, 1.0)
    flat = np.maximum(up, 0.0) + 0.012 * np.exp(
        -np.maximum(up, 0.0) / 0.012
    )  # no hard edge where the air is densest
    sky = np.zeros((*up.shape, 3))
    high = up > 0.0
    sky[high] = _clear_sky_of(flat[high], cosine[high])
    line = np.linspace(-1.0, 1.0, 513)  # below the horizon only the angle to the sun matters
    low = _clear_sky_of(np.full_like(line, 0.012), line)
    for channel in range(3):
        sky[~high, channel] = np.interp(cosine[~high], line, low[:, channel])
    # haze over the sea: pale, warm towards the sun
    toward = 0.5 + 0.5 * cosine[..., None]
    haze = np.array([1.0, 0.87, 0.75]) * (0.76 + 0.26 * toward) + np.array([0.28, 0.13, -0.04]) * toward**3
    band = (0.90 * np.exp(-np.maximum(up, 0.0) / 0.05))[..., None]
    sky = sky + (haze - sky) * band
    sea = np.array([0.10, 0.26, 0.34])
    below = smoothstep(0.0, 0.40, -up)[..., None]
    return np.asarray(sky + (sea - sky) * below * 0.85)


def radiance(direction: Array) -> Array:
    """Radiance of the whole sky with clouds and sun disc: (..., 3)."""
    sky = clear_sky(direction)
    angle = np.degrees(np.arccos(np.clip(direction @ sun_direction(), -1.0, 1.0)))
    glow = 1.6 * np.exp(-angle / 1.5) + 0.30 * np.exp(-angle / 5.0)
    sky = sky + glow[..., None] * np.array([1.0, 0.90, 0.74])
    sky = clouds.over(direction, sky, sun_direction())
    disc = smoothstep(SUN_RADIUS_DEG + 0.12, SUN_RADIUS_DEG - 0.12, angle)
    return np.asarray(sky + disc[..., None] * SUN_DISC)


def make(out: Path) -> None:
    """Writes the six faces under out/sky."""
    for face, name in enumerate(FACES):
        write_image(out / f"sky/{name}.exr", radiance(face_directions(face)), "half")

"""terrain/sand.png and terrain/sand_height.png: one tile of pale sand, as colour and height.

Both come from the same periodic noise, so that shading and relief agree. Coarse octaves are faint and no
single feature stands out, so that the repetition is not visible.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from noise import Array, blur, lattice_fbm, normal, spectral_noise, uniform
from picture import hex_color, write_image

PIXELS = 1024
SAND = hex_color("#E8D3A2")


@cache
def relief() -> Array:
    """Height of the tile, (1024, 1024), standard deviation about 1: grains and faint dimples."""
    grain = normal((PIXELS, PIXELS), 11)
    fine = blur(grain, 0.6) * 2.0
    coarse = blur(normal((PIXELS, PIXELS), 13), 1.5) * 4.8
    clumps = spectral_noise(PIXELS, lambda x, y: np.exp(-(((np.hypot(x, y) - 46.0) / 22.0) ** 2)), 15).real
    return np.asarray(0.68 * fine + 0.42 * coarse + 0.22 * clumps)


def color() -> Array:
    """The tile in sRGB, (1024, 1024, 3)."""
    shape = (PIXELS, PIXELS)
    height = relief()
    # light from the upper left, so that slopes look like grains
    lit = 0.5 * (height - np.roll(height, (2, 2), (0, 1)))
    tone = lattice_fbm(shape, (12, 12), 21, 4, 0.8)
    hue = lattice_fbm(shape, (14, 14), 27, 4, 0.85)
    pick = uniform(shape, 31)
    mineral = uniform(shape, 33)
    value = 1.0 + 0.030 * height + 0.024 * lit + 0.006 * tone
    picture = SAND * value[:, :, None]
    picture = picture + hue[:, :, None] * np.array([0.0020, -0.0006, -0.0050])
    # single grains: pale quartz, amber, and a few dark ones
    for low, high, shade in ((0.0, 0.055, "#FBF1D6"), (0.055, 0.11, "#D2A867"), (0.11, 0.119, "#8D7350")):
        chosen = ((pick >= low) & (pick < high)) * (0.18 + 0.32 * mineral)
        cover = blur(chosen, 0.6)[:, :, None] * 1.5
        picture = picture + (hex_color(shade) - picture) * cover
    mean = picture.mean((0, 1))
    return np.asarray(picture + (SAND - mean))


def make(out: Path) -> None:
    """Writes terrain/sand.png and terrain/sand_height.png under out."""
    write_image(out / "terrain/sand.png", color(), "uint8")
    height = relief()
    write_image(out / "terrain/sand_height.png", 0.5 + height * 0.11, "uint16")

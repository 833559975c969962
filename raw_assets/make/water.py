"""water/waves.png: one tile of sea surface, exactly periodic, 16 bit.

A sum of waves with integer wave numbers, so that the tile repeats. The spectrum is defined by slopes: a broad
peak at the waves of a breeze, with weak long waves, which would reveal the repetition. Directions spread
around the wind by a power of the cosine that widens towards small waves, after M. S. Longuet-Higgins, D. E.
Cartwright and N. D. Smith, "Observations of the directional spectrum of sea waves", 1963.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from noise import Array, smoothstep, spectral_noise
from picture import write_image

PIXELS = 512
WIND = (0.88, 0.475)  # direction of the waves: to the right and upwards
MOST_SLOPE = 13.0  # waves per tile
SHORTEST = 96.0  # waves per tile at which the spectrum has faded out


def spectrum(kx: Array, ky: Array) -> Array:
    """Amplitude of each wave by its wave numbers per tile: slope density / k**4, times the directional
    spread."""
    k = np.maximum(np.hypot(kx, ky), 1e-9)
    slope = np.exp(-((np.log(k / MOST_SLOPE) / 0.55) ** 2)) + 0.05 * np.exp(-((np.log(k / 40.0) / 0.5) ** 2))
    facing = (kx * WIND[0] - ky * WIND[1]) / k
    narrow = np.clip(k / 30.0, 0.0, 1.0)
    ahead = 0.5 + 0.5 * facing
    spread = ahead**6 + (ahead**2 - ahead**6) * narrow
    band = smoothstep(2.5, 5.0, k) * smoothstep(SHORTEST, 0.5 * SHORTEST, k)
    return np.asarray(np.sqrt(slope) / k**2 * spread * band)


def surface() -> Array:
    """The tile, (512, 512), 0..1, mean about 0.5, with crests sharper than troughs."""
    waves = spectral_noise(PIXELS, spectrum, 118).real.astype(np.float64)
    peaked = waves + 0.09 * (waves * waves - 1.0)
    low, high = peaked.min(), peaked.max()
    return np.asarray((peaked - low) / (high - low))


def make(out: Path) -> None:
    """Writes water/waves.png under out."""
    write_image(out / "water/waves.png", surface(), "uint16")

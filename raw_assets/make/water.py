"""water/waves.png: one tile of sea surface, exactly periodic, 16 bit.

A sum of waves with whole wave numbers, so that the tile meets itself; amplitudes after the spectrum of O. M. Phillips,
"The equilibrium range in the spectrum of wind-generated waves", 1958, in the form of J. Tessendorf, "Simulating Ocean
Water", 2001, with the longest waves held down (they would show the repeat) and a steeper tail.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from noise import Array, smoothstep, spectral_noise
from picture import write_image

PIXELS = 512
WIND = (0.88, 0.475)  # where the waves run to: right and up the picture
LONGEST, SHORTEST = 5.0, 84.0  # waves per tile at which the spectrum is fully in, and out
PEAK = 6.0  # waves per tile with the most energy


def spectrum(kx: Array, ky: Array) -> Array:
    """Amplitude of each wave: a power law with its peak at PEAK waves per tile, spread about the wind."""
    k = np.maximum(np.hypot(kx, ky), 1e-9)
    facing = (kx * WIND[0] - ky * WIND[1]) / k
    spread = 0.22 + 0.78 * np.maximum(facing, 0.0) ** 2 + 0.15 * np.maximum(-facing, 0.0) ** 2
    power = np.exp(-((PEAK / k) ** 2)) / k**5
    band = smoothstep(1.5, LONGEST, k) * smoothstep(SHORTEST, 0.4 * SHORTEST, k)
    return np.asarray(np.sqrt(power) * spread * band)


def surface() -> Array:
    """The tile, (512, 512), 0..1, mean about a half: crests sharper than troughs, as gravity makes them."""
    waves = spectral_noise(PIXELS, spectrum, 71).real.astype(np.float64)
    peaked = waves + 0.10 * (waves * waves - 1.0)
    low, high = peaked.min(), peaked.max()
    return np.asarray((peaked - low) / (high - low))


def make(out: Path) -> None:
    """Writes water/waves.png under out."""
    write_image(out / "water/waves.png", surface(), "uint16")

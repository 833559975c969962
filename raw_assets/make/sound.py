"""sound/ocean.ogg: small waves on a sand beach, a stereo loop of 24 s without a seam.

The spectrum follows the wave: a constant low rumble, a broad hiss when it breaks, a thin fizz when it drains
back through the sand.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from loop import Loop, to_peak, write_ogg
from noise import Array, uniform

LOOP = Loop(24.0, 44100)
VORBIS_QUALITY = 0.4
WAVES = 4  # swells in the loop
PEAK = 0.5


@cache
def loop() -> Array:
    """The loop: (1058400, 2) float64, within -0.5..0.5."""
    seconds, bump = LOOP.seconds, LOOP.bump
    channels = []
    pick = uniform((WAVES, 6), 501)
    far = sum(
        (bump(i * seconds / 6 + 1.3 * uniform((6,), 507)[i], 1.5, 1.9) for i in range(6)),
        np.zeros(LOOP.samples),
    )
    for side in (0, 1):
        seed = 520 + 40 * side
        rumble = LOOP.noise(seed, 40.0, 160.0, 0.6)
        body = LOOP.noise(seed + 3, 140.0, 900.0, 1.0)
        wash = LOOP.noise(seed + 7, 350.0, 3200.0, 0.9)
        hiss = LOOP.noise(seed + 11, 1800.0, 9000.0, 0.5)
        air = LOOP.noise(seed + 17, 250.0, 2200.0, 1.2)
        signal = 0.10 * rumble + 0.055 * air + 0.06 * far * body
        for i, (a, b, c, d, e, f) in enumerate(pick):
            time = (i + 0.15 + 0.55 * a) * seconds / WAVES
            lag = (0.10 + 0.20 * b) * (side if f < 0.5 else 1 - side)  # the wave runs along the beach
            pan = 0.80 + 0.35 * abs(side - e)
            loud = (0.65 + 0.5 * c) * pan
            signal = signal + loud * 0.16 * bump(time + lag, 1.7, 0.9) * rumble
            signal = signal + loud * 0.17 * bump(time + lag, 1.1, 0.8) * body
            signal = signal + loud * 0.16 * bump(time + 0.25 + lag, 0.75, 0.9) * wash
            signal = signal + loud * 0.068 * bump(time + 0.6 + lag, 0.7, 1.2 + 0.5 * d) * hiss
            signal = signal + loud * 0.026 * bump(time + 2.4 + lag, 1.1, 1.3) * hiss  # draining back
        channels.append(signal)
    return to_peak(LOOP.from_the_quietest(np.stack(channels, -1)), PEAK)


def make(out: Path) -> None:
    """Writes sound/ocean.ogg under out."""
    write_ogg(out / "sound/ocean.ogg", loop(), LOOP.rate_hz, VORBIS_QUALITY)

"""sound/surf_a.ogg, surf_b.ogg, fronds.ogg, crickets.ogg, hum.ogg: what is heard near its place. Mono loops.

Surf: waves that break and run out on the sand, two loops of different lengths for two shores. Fronds: palm
leaflets that rustle in gusts. Crickets: seven insects, each with a pitch and a pace of its own. Hum: a lamp.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from loop import Loop, to_peak, write_ogg
from noise import Array, uniform

VORBIS_QUALITY = 0.2


def surf(loop: Loop, waves: int, seed: int) -> Array:
    """Waves at the foot of the listener: each swells, breaks, runs up the sand and drains back."""
    pick = uniform((waves, 5), seed)
    rumble = loop.noise(seed + 1, 50.0, 180.0, 0.6)
    body = loop.noise(seed + 2, 160.0, 1100.0, 1.0)
    wash = loop.noise(seed + 3, 450.0, 3600.0, 0.8)
    hiss = loop.noise(seed + 4, 2200.0, 9500.0, 0.4)
    signal = 0.03 * rumble + 0.02 * body
    for i, (a, b, c, d, e) in enumerate(pick):
        time = (i + 0.2 + 0.45 * a) * loop.seconds / waves
        loud = 0.55 + 0.45 * b
        signal = signal + loud * (
            0.08 * loop.bump(time, 1.3, 0.7) * rumble
            + 0.15 * loop.bump(time + 0.1, 0.8, 0.6) * body
            + 0.21 * loop.bump(time + 0.35, 0.5, 0.8 + 0.4 * c) * wash
            + 0.10 * loop.bump(time + 0.7, 0.55, 1.1 + 0.6 * d) * hiss
            + 0.030 * loop.bump(time + 2.6 + 0.5 * e, 0.9, 1.1) * hiss
        )
    return to_peak(loop.from_the_quietest(signal), 0.6)


def fronds(loop: Loop, seed: int) -> Array:
    """Leaflets brush each other: the stronger the gust, the more and the brighter."""
    breath = loop.noise(seed, 0.05, 0.22, 0.0)
    gust = np.exp(0.55 * breath)
    flutter = np.exp(0.45 * loop.noise(seed + 1, 2.0, 9.0, 0.5))
    flutter_high = np.exp(0.4 * loop.noise(seed + 2, 6.0, 22.0, 0.5))
    sigh = loop.noise(seed + 3, 250.0, 1300.0, 1.0)
    rustle = loop.noise(seed + 4, 1400.0, 5200.0, 0.3)
    crisp = loop.noise(seed + 5, 4000.0, 11000.0, 0.2)
    signal = gust * (0.05 * sigh + 0.05 * flutter * rustle) + 0.022 * gust**1.3 * flutter_high * crisp
    for k, (a, b, c, d) in enumerate(uniform((90, 4), seed + 6)):  # single leaflets that slap
        length = round(0.05 * loop.rate_hz)
        t = np.arange(length) / loop.rate_hz
        burst = np.sin(2.0 * np.pi * (900.0 + 2600.0 * b) * t + 6.0 * c)
        burst *= np.exp(-t / (0.004 + 0.008 * d)) * np.minimum(t / 0.0015, 1.0)
        at_s = (k + a) * loop.seconds / 90
        strength = gust[round(at_s * loop.rate_hz) % loop.samples] ** 2
        loop.add(signal, 0.008 * strength * burst, at_s)
    return to_peak(loop.from_the_quietest(signal), 0.5)


def crickets(loop: Loop, seed: int) -> Array:
    """Chirps of a few pulses each; the times of an insect are even, those of all together are not."""
    signal = 0.0015 * loop.noise(seed, 3000.0, 7000.0, 0.0)
    for k, (a, b, c, d, e) in enumerate(uniform((7, 5), seed + 1)):
        chirps = round(loop.seconds * (1.5 + 1.3 * b))  # a whole number in the loop
        pitch_hz, pulses, loud = 3900.0 + 1500.0 * a, 3 + int(2.0 * c), 0.25 + 0.75 * d**2
        jitter = uniform((chirps, 2), seed + 10 + k)
        for i in range(chirps):
            at_s = (i + e + 0.06 * jitter[i, 0]) * loop.seconds / chirps
            for pulse in range(pulses):
                t = np.arange(round(0.022 * loop.rate_hz)) / loop.rate_hz
                shape = np.sin(np.pi * t / 0.022) ** 2 * (0.6 + 0.4 * pulse / pulses)
                tone = np.sin(2.0 * np.pi * (pitch_hz - 900.0 * t) * t)
                loop.add(
                    signal, 0.08 * loud * (0.8 + 0.2 * jitter[i, 1]) * shape * tone, at_s + 0.036 * pulse
                )
    t = loop.times_s  # a tree cricket, far off: a steady trill
    trill = np.sin(2.0 * np.pi * round(2850 * loop.seconds) / loop.seconds * t)
    beat = 0.5 - 0.5 * np.cos(2.0 * np.pi * round(38 * loop.seconds) / loop.seconds * t)
    signal = signal + 0.012 * beat * (0.7 + 0.3 * np.sin(2.0 * np.pi * t / loop.seconds)) * trill
    return to_peak(signal, 0.5)


def hum(loop: Loop, seed: int) -> Array:
    """The hum of a mains transformer, 100 Hz and its harmonics, with a faint sizzle."""
    t = loop.times_s
    signal = np.zeros(loop.samples)
    for k, size in ((1, 1.0), (2, 0.55), (3, 0.22), (4, 0.30), (6, 0.16), (9, 0.05), (12, 0.04)):
        phase = 2.0 * np.pi * uniform((1,), seed + k)[0]
        swell = 1.0 + 0.15 * np.sin(2.0 * np.pi * (k % 3 + 1) * t / loop.seconds + phase)
        signal += size * swell * np.sin(2.0 * np.pi * 100.0 * k * t + phase)
    sizzle = loop.noise(seed + 20, 3000.0, 9000.0, 0.5) * np.exp(0.5 * loop.noise(seed + 21, 1.0, 8.0, 0.5))
    return to_peak(signal + 0.02 * sizzle, 0.4)


@cache
def loops() -> dict[str, tuple[Loop, Array]]:
    """By file name: the loop, and its samples."""
    makers: dict[str, tuple[Loop, Callable[[Loop], Array]]] = {
        "surf_a": (Loop(20.0), lambda loop: surf(loop, 4, 610)),
        "surf_b": (Loop(16.0), lambda loop: surf(loop, 3, 640)),
        "fronds": (Loop(15.0), lambda loop: fronds(loop, 660)),
        "crickets": (Loop(12.0), lambda loop: crickets(loop, 700)),
        "hum": (Loop(4.0), lambda loop: hum(loop, 740)),
    }
    return {name: (loop, maker(loop)) for name, (loop, maker) in makers.items()}


def make(out: Path) -> None:
    """Writes the five files under out/sound."""
    for name, (loop, signal) in loops().items():
        write_ogg(out / f"sound/{name}.ogg", signal, loop.rate_hz, VORBIS_QUALITY)

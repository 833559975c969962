"""Paints thatch: a course of dry palm leaves, which hang down and end raggedly. It repeats along the eave."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from noise import smoothstep as step
from paint import fbm, halve, mix, noise, ramp
from picture import hex_color as rgb

Floats = NDArray[np.float64]

WIDTH, HEIGHT = 512, 256
REACH_M = 1.7  # along the eave
STRAW = ["#4a3720", "#80653c", "#b0935c", "#d3b97f", "#ecd9a8"]
LEAVES = 96  # side by side


def thatch() -> tuple[Floats, Floats]:
    """Colour (HEIGHT, WIDTH, 3) sRGB and opacity (HEIGHT, WIDTH); row 0 lies under the course above."""
    y, x = np.meshgrid(
        (np.arange(2 * HEIGHT) + 0.5) / (2 * HEIGHT),
        (np.arange(2 * WIDTH) + 0.5) / (2 * WIDTH),
        indexing="ij",
    )
    # Leaves lie askew; where they lie is bent by noise that repeats as the picture does.
    lean = 0.016 * fbm(x * 6.0, y * 2.5, 3, 3, period_x=6)
    t = x + lean
    blade = t * LEAVES
    number = np.floor(blade).astype(np.int64) % LEAVES
    across = np.abs(2.0 * (blade - np.floor(blade)) - 1.0)  # 0 on the midrib, 1 between leaves
    own = noise(number + 0.5, number * 0.0, 5, period_x=LEAVES)
    fibre = fbm(t * 256.0, y * 6.0, 7, 3, period_x=256)
    bundle = fbm(t * 12.0, y * 1.2, 11, 3, period_x=12)
    light = 0.52 + 0.22 * own + 0.16 * fibre + 0.26 * bundle - 0.28 * step(0.55, 1.0, across)
    light += 0.10 * (1.0 - step(0.0, 0.18, across))
    light *= 0.42 + 0.58 * step(0.0, 0.45, y)  # in the shade of the course above
    color = ramp(STRAW, light)
    grey = step(-0.1, 0.5, fbm(t * 9.0, y * 2.0, 13, 3, period_x=9))
    color = mix(color, color.mean(axis=2, keepdims=True) * rgb("#f7f1e6"), 0.45 * grey)
    green = step(0.62, 0.85, noise(number + 0.5, number * 0.0, 17, period_x=LEAVES))
    color = mix(color, color * rgb("#b9bd7d"), 0.6 * green)
    # Each leaf ends at a length of its own, in a point.
    end = 0.80 + 0.11 * own + 0.07 * bundle - 0.16 * across**2
    alpha = 1.0 - step(-0.012, 0.012, y - end)
    torn = step(0.55, 0.75, noise(t * 160.0, y * 3.0, 19, period_x=160)) * step(0.5, 0.75, y)
    alpha *= 1.0 - torn
    return halve(np.clip(color, 0.02, 1.0)), halve(alpha)

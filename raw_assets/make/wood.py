"""Weathered wood: colours, grain around knots, cracks.

The soft early wood of each annual ring is worn and dark; the hard late wood is raised and grey.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from noise import smoothstep as step
from paint import noise, rand

Floats = NDArray[np.float64]

WOOD = ["#332a22", "#65594c", "#998d7d", "#beb3a3", "#e0d9cb"]


def knots_of(seed: int, count: int, length: float, breadth: float) -> list[tuple[float, float, float]]:
    """Knots: position along and across the grain (metres), and radius across it."""
    return [
        (
            length * (0.08 + 0.84 * rand(3 * i, seed)),
            breadth * (0.12 + 0.76 * rand(3 * i + 1, seed)),
            0.006 + 0.010 * rand(3 * i + 2, seed),
        )
        for i in range(count)
    ]


def around(x: Floats, q: Floats, knots: list[tuple[float, float, float]]) -> tuple[Floats, Floats, Floats]:
    """Bends the grain around knots.

    Returns the bent coordinate across the grain, the opacity of the knots 0..1 and the rings inside them. The
    bending is the stream function of a flow around a cylinder, y (1 - r^2 / d^2) (Lamb, Hydrodynamics, 1932,
    art. 68).
    """
    bent, cover, rings = q.copy(), np.zeros_like(q), np.zeros_like(q)
    for kx, kq, radius in knots:
        dx, dq = (x - kx) / (2.3 * radius), (q - kq) / radius
        d2 = dx * dx + dq * dq
        bent -= (q - kq) / np.maximum(d2, 1.0)
        near = 1.0 - step(0.62, 1.05, np.sqrt(d2))
        cover = np.maximum(cover, near)
        rings = np.where(d2 < 1.3, np.sqrt(d2) * radius * 520.0, rings)
    return bent, cover, rings


def cracks(x: Floats, bent: Floats, seed: int, count: int, length: float, breadth: float) -> Floats:
    """Drying cracks along the grain, mostly starting at an end: depth 0..1."""
    depth = np.zeros_like(x)
    for i in range(count):
        r = [rand(6 * i + j, seed) for j in range(6)]
        reach = length * (0.10 + 0.32 * r[0])
        begin = (0.0, length, length * (0.2 + 0.6 * r[5]))[int(r[1] * 2.6)]
        t = np.abs(x - begin) / reach
        line = breadth * (0.06 + 0.88 * r[2]) + 0.0035 * noise(x * 5.0 + 9.0 * i, x * 0.0, seed + i)
        half = (0.0006 + 0.0014 * r[3]) * np.clip(1.0 - t, 0.0, 1.0) ** 0.6
        depth = np.maximum(depth, np.clip((half - np.abs(bent - line)) / 0.0009 + 0.5, 0.0, 1.0) * (t < 1.0))
    return depth

"""Small shapes with relief that effect.py places on the terrain: starfish, shells, corals.

A stroke takes offsets dx, dy in texels from its centre. It returns three arrays of the same shape: opacity
0..1, tone (a factor of the colour) and rise (a share of the shape's height).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from noise import Array

Stroke = Callable[[Array, Array], tuple[Array, Array, Array]]


def hollow(radius: float, depth: float = 0.30) -> Stroke:
    """A soft dark hollow around an object in the sand, with negative relief."""

    def draw(dx: Array, dy: Array) -> tuple[Array, Array, Array]:
        soft = np.exp(-(dx * dx + dy * dy) / (radius * radius))
        return depth * soft, np.ones_like(dx), -soft

    return draw


def starfish(radius: float, turn: float, bend: float) -> Stroke:
    """Five tapering, slightly bent arms, brightest along their ridges."""

    def draw(dx: Array, dy: Array) -> tuple[Array, Array, Array]:
        r = np.hypot(dx, dy) / radius
        angle = np.arctan2(dy, dx) + turn + bend * r
        arm = np.abs((angle / (2 * np.pi) * 5.0) % 1.0 - 0.5) * 2.0  # 1 on an arm's ridge, 0 between two
        off = (1.0 - arm) * np.pi / 5.0 * r  # distance from the ridge
        width = 0.27 * (1.0 - r) + 0.045
        cover = np.clip((width - off) * radius + 0.5, 0.0, 1.0) * np.clip((1.0 - r) * radius + 0.5, 0.0, 1.0)
        ridge = np.clip(1.0 - off / np.maximum(width, 1e-3), 0.0, 1.0)
        return cover * 0.95, 0.82 + 0.34 * ridge * (1.0 - 0.4 * r), (0.35 + 0.65 * ridge) * (1.0 - 0.5 * r)

    return draw


def coral(radius: float, phase: float) -> Stroke:
    """A rounded head with lobes, bright on top and dark between them."""

    def draw(dx: Array, dy: Array) -> tuple[Array, Array, Array]:
        r, angle = np.hypot(dx, dy) / radius, np.arctan2(dy, dx)
        rim = 0.80 + 0.10 * np.cos(3 * angle + phase) + 0.08 * np.cos(5 * angle - 2.3 * phase)
        cover = np.clip((rim - r) * radius * 0.6 + 0.5, 0.0, 1.0)
        dome = np.clip(1.0 - (r / rim) ** 2, 0.0, 1.0)
        swirl = 1.1 * np.sin(0.55 * dx + 2.0 * phase) - 0.9 * np.cos(0.47 * dy - phase)
        lobes = 0.5 + 0.5 * np.cos(0.9 * dx + 0.7 * dy + phase + swirl)
        return cover * 0.92, 0.66 + 0.36 * dome + 0.13 * lobes, np.sqrt(dome) * (0.8 + 0.2 * lobes)

    return draw

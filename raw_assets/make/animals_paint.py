"""Paints the atlases of animals.py: a gull's feathers, a crab's shell and legs.

Colours are sRGB, 0..1. Each part has a sheet of the atlas, painted on beyond its border into the gutter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from noise import fbm, smoothstep
from paint import mix
from picture import hex_color

Floats = NDArray[np.float64]

WIDTH, HEIGHT = 256, 128
GULL_M = 0.665  # from beak to tail
WING_M = 0.675  # of one wing, from root to tip
ORANGE, YELLOW, RED, WHITE, GREY, BLACK = "#d9822b", "#e8b23c", "#c8321e", "#f7f6f2", "#9aa4ae", "#24282c"
SHELL, DARK, SPOT, LIMB, CLAW_RED, PALE, EYE_BLACK = (
    "#a5482f",
    "#6e2c1c",
    "#dca06c",
    "#bd6440",
    "#cc7a52",
    "#e0c4a0",
    "#1c1714",
)


@dataclass(frozen=True)
class Sheet:
    """A part's rectangle of the atlas, pixels."""

    left: float
    top: float
    width: float
    height: float

    def pixels(self, along: Floats | float, across: Floats | float) -> Floats:
        """Pixels (..., 2) of shares of the rectangle, 0..1 from its left and from its top."""
        return np.stack([self.left + self.width * along, self.top + self.height * across], axis=-1)

    def shares(self) -> tuple[Floats, Floats]:
        """Shares along and across at each pixel of the atlas, (h, w); beyond 0..1 outside the rectangle."""
        y, x = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
        return (x - self.left) / self.width, (y - self.top) / self.height


BODY = Sheet(10.0, 10.0, 108.0, 108.0)  # from beak to tail, and once round from the left side over the back
WING = Sheet(138.0, 10.0, 108.0, 44.0)  # from root to tip, and from the leading to the trailing edge
UNDERWING = Sheet(138.0, 74.0, 108.0, 44.0)
LEG = Sheet(138.0, 10.0, 108.0, 26.0)  # from root to tip, and once round
CLAW = Sheet(138.0, 52.0, 108.0, 28.0)
EYE = Sheet(138.0, 96.0, 40.0, 22.0)
SHELL_MIDDLE, SHELL_RADIUS = (64.0, 64.0), 54.0
RIM = 0.8  # of the radius, where the shell's upper side ends


def shell_reach(share: float) -> float:
    """Reach of a crab's shell at the height `share`, -1 below to 1 on top: a share of its half width."""
    return math.sqrt(max(1.0 - share * share, 0.0004))


def shell_pixels(share: float, turn: Floats) -> Floats:
    """Pixels (n, 2) of the ring of a crab's shell at the height `share`, -1 below to 1 on top: the upper side
    as seen from above, the belly around it."""
    reach = RIM * shell_reach(share) if share > 0.0 else RIM + (1.0 - RIM) * -share
    at = SHELL_RADIUS * reach * np.stack([np.cos(turn), -np.sin(turn)], axis=1)
    return np.asarray(at + SHELL_MIDDLE)


def band(value: Floats, low: float, high: float, soft: float) -> Floats:
    """1 between low and high, 0 beyond, with soft edges."""
    return smoothstep(low - soft, low + soft, value) * smoothstep(high + soft, high - soft, value)


def flat(code: str) -> Floats:
    return np.broadcast_to(hex_color(code), (HEIGHT, WIDTH, 3))


def feathers(along: Floats, across: Floats, rows: float, each: float) -> Floats:
    """Rows of rounded feathers: 0 on a shaft to 1 at an edge."""
    row = np.floor(across * rows)
    column = along * each + 0.5 * (row % 2)
    u, v = 2.0 * (column - np.floor(column)) - 1.0, across * rows - row
    return smoothstep(0.55, 1.0, np.sqrt(u * u * 0.8 + v * v * 0.6))


def body() -> Floats:
    """White, with a yellow beak, a dark eye on both sides, and a grey mantle."""
    along, around = BODY.shares()
    z, height = GULL_M * along, np.sin(math.tau * around)
    color = mix(flat(WHITE), flat("#dcdbd6"), 0.7 * smoothstep(0.0, -0.9, height))
    mantle = smoothstep(0.25, 0.6, height) * band(z, 0.15, 0.50, 0.03)
    scales = feathers(2.0 * around, along, 13.0, 9.0)
    color = mix(color, flat(GREY), mantle)
    color = color * (1.0 - (0.05 + 0.10 * mantle) * scales * smoothstep(0.11, 0.16, z))[..., None]
    tail = smoothstep(0.56, 0.60, z)
    color = color * (1.0 - 0.10 * tail * (0.5 + 0.5 * np.cos(math.tau * 12.0 * around)))[..., None]
    beak = smoothstep(0.052, 0.045, z)
    color = mix(color, mix(flat(YELLOW), flat(ORANGE), smoothstep(0.02, 0.0, z)), beak)
    color = mix(color, flat(RED), band(z, 0.012, 0.03, 0.004) * smoothstep(-0.3, -0.6, height))
    for side in (0.09, 0.41):
        away = np.hypot((z - 0.082) / 0.013, (around - side) / 0.035)
        color = mix(color, flat(BLACK), smoothstep(1.15, 0.75, away))
    return color


def wing(sheet: Sheet, *, lower: bool) -> Floats:
    """Grey above with rows of coverts, paler below; a white hind edge, and black tips with a white spot."""
    along, across = sheet.shares()
    color = mix(flat("#aab3bb"), flat("#7d8893"), smoothstep(0.0, 0.9, along))
    if lower:
        color = mix(flat("#eceae4"), color, 0.12 + 0.25 * smoothstep(0.5, 0.9, along))
    coverts = feathers(along, across, 7.0, 14.0) * smoothstep(0.60, 0.52, across)
    quills = np.abs(np.sin(math.pi * (along * 24.0 - 2.0 * across))) ** 6 * smoothstep(0.48, 0.56, across)
    color = color * (1.0 - (0.07 if lower else 0.17) * np.maximum(coverts, quills))[..., None]
    color = mix(color, flat(WHITE), 0.9 * smoothstep(0.84, 0.92, across))
    color = mix(color, flat("#e3e6e8"), 0.7 * smoothstep(0.09, 0.03, across))
    color = mix(color, flat(BLACK), smoothstep(0.80, 0.86, along + 0.07 * across))
    mirror = np.hypot((along - 0.95) / 0.03, (across - 0.55) / 0.2)
    return mix(color, flat(WHITE), smoothstep(1.1, 0.7, mirror))


def shell() -> Floats:
    """Red-brown with pale spots, a dark middle with grooves, a light rim, and a pale belly in segments."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    u, v = (x - SHELL_MIDDLE[0]) / SHELL_RADIUS, (y - SHELL_MIDDLE[1]) / SHELL_RADIUS
    r = np.hypot(u, v) / RIM
    color = mix(flat(SHELL), flat(DARK), smoothstep(-0.4, 0.8, fbm(5.0 * u, 5.0 * v, 501, 3) + 0.5 - r))
    spots = smoothstep(0.12, 0.42, fbm(11.0 * u, 11.0 * v, 503, 2)) * smoothstep(0.1, 0.3, r)
    color = mix(color, flat(SPOT), 0.6 * spots)
    sides = np.abs(np.abs(u) - 0.17 - 0.10 * np.cos(4.5 * v))
    groove = np.minimum(sides, np.hypot(v + 0.05, 0.6 * np.maximum(np.abs(u) - 0.25, 0.0)))
    color = mix(color, flat(DARK), 0.8 * smoothstep(0.045, 0.015, groove) * smoothstep(0.85, 0.7, r))
    color = mix(color, flat("#d2703f"), 0.8 * band(r, 0.90, 1.0, 0.03))
    belly = mix(flat(PALE), flat("#b98f68"), 0.6 * smoothstep(0.4, 0.9, np.abs(np.sin(11.0 * r))))
    return mix(color, belly, smoothstep(1.0, 1.06, r))


def leg(sheet: Sheet, code: str) -> Floats:
    """Bands, speckles, and a pale tip."""
    along, around = sheet.shares()
    speckles = fbm(24.0 * along, 5.0 * around, 511, 2)
    color = mix(flat(code), flat(DARK), 0.6 * band(np.abs(np.sin(3.0 * math.pi * along)), -0.1, 0.28, 0.1))
    color = mix(color, flat(SPOT), 0.55 * smoothstep(0.1, 0.4, speckles))
    return mix(color, flat(PALE), smoothstep(0.82, 0.97, along))


def eye() -> Floats:
    """A stalk, and a black end; beyond it the legs' colour, which bleeds less into coarse mips."""
    along, _ = EYE.shares()
    return mix(flat(LIMB), flat(EYE_BLACK), band(along, 0.55, 1.3, 0.06))


def gull() -> Floats:
    """The gull's atlas, (h, w, 3)."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    wings = np.where((y < HEIGHT // 2)[..., None], wing(WING, lower=False), wing(UNDERWING, lower=True))
    return np.clip(np.where((x < WIDTH // 2)[..., None], body(), wings), 0.0, 1.0)


def crab() -> Floats:
    """The crab's atlas, (h, w, 3)."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    limbs = np.where((y < 44)[..., None], leg(LEG, LIMB), leg(CLAW, CLAW_RED))
    limbs = np.where((y < 88)[..., None], limbs, eye())
    return np.clip(np.where((x < WIDTH // 2)[..., None], shell(), limbs), 0.0, 1.0)

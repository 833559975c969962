"""Two shrubs at the grove's edge and beside the bar: a bush of broad leaves, and a fan of long ones.

Usage: python shrubs.py RAW_ASSETS, after palm.py and bar.py
Writes the folder shrubs: bush.obj, fan.obj, shrubs.mtl, bush.csv, fan.csv. Coloured by vertex; what stands
low and inside is darker, as less light reaches it.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from grove import flight_way, in_grove, scattered, write_places
from objfile import Model, grid_triangles, write_mtl
from paint import rand
from picture import hex_color

Floats = NDArray[np.float64]

BAR = (33.0, -1.0)  # x, z of its middle
KEEP_M, BESIDE_M = 3.6, 6.5  # from it
DARK, LEAF, TIP = "#2f4a1d", "#5c8a34", "#a9c25c"


def leaf(
    model: Model,
    foot: Floats,
    out: Floats,
    length: float,
    width: float,
    seed: int,
    light: float,
    *,
    segments: int,
    across: tuple[float, ...],
) -> None:
    """A leaf that rises, arches over and ends in a point. across: places of a row's vertices in shares of its
    half width, from -1 to 1; where 0 is among them there is a fold along the midrib."""
    side = np.cross(out, [0.0, 1.0, 0.0])
    side /= math.sqrt(float((side**2).sum()))
    rise = math.asin(max(-1.0, min(1.0, float(out[1]))))
    flat = np.array([out[0], 0.0, out[2]])
    flat /= max(math.sqrt(float((flat**2).sum())), 1e-9)
    spine, rows, colors, normals = foot.copy(), [], [], []
    for i in range(segments + 1):
        s = i / segments
        half = width * (math.sin(math.pi * (0.12 + 0.86 * s)) ** 0.8) + 0.001
        pitch = rise - (0.9 + 0.5 * rand(seed, 411)) * s
        over = np.array([-flat[0] * math.sin(pitch), math.cos(pitch), -flat[2] * math.sin(pitch)])
        shade = light * (0.55 + 0.45 * s)
        base = hex_color(DARK) + (hex_color(LEAF) - hex_color(DARK)) * shade
        color = base + (hex_color(TIP) - base) * 0.45 * s * light * rand(seed, 413)
        for a in across if i < segments else (0.0,):
            rows.append(spine + a * half * side + abs(a) * 0.28 * half * over)
            colors.append(color * (1.0 if a else 1.12))
            normals.append(0.75 * over + 0.25 * out + 0.35 * a * side)
        spine = spine + length / segments * (
            math.cos(pitch) * flat + math.sin(pitch) * np.array([0.0, 1.0, 0.0])
        )
    lit = np.array(normals)
    lit /= np.sqrt((lit**2).sum(axis=1, keepdims=True))
    tip = len(across) * segments
    point = [(k, k + 1, tip) for k in range(tip - len(across), tip - 1)]
    faces = np.concatenate([grid_triangles(segments, len(across)), point])
    model.add("leaves", "leaves", np.array(rows), None, faces, lit, np.clip(np.array(colors), 0.0, 1.0))


def bush() -> Model:
    """A bush 1 m wide: leaves on a dome, the lower ones darker."""
    model = Model()
    count = 46
    for k in range(count):
        up = 0.08 + 0.92 * (k + 0.5) / count
        turn = 2.39996 * k + 0.6 * rand(k, 401)
        flat = math.sqrt(1.0 - up * up)
        out = np.array([flat * math.cos(turn), up, flat * math.sin(turn)])
        foot = out * np.array([0.26, 0.30, 0.26]) * (0.8 + 0.5 * rand(k, 403)) - np.array([0.0, 0.04, 0.0])
        size = 0.24 + 0.12 * rand(k, 405)
        leaf(model, foot, out, size, 0.255 * size, k, 0.35 + 0.65 * up, segments=3, across=(-1.0, 0.0, 1.0))
    return model


def fan() -> Model:
    """A fan of long leaves from one foot, as of a young screw pine."""
    model = Model()
    count = 22
    for k in range(count):
        age = k / (count - 1)
        turn = 2.39996 * k + 0.4 * rand(k, 407)
        rise = math.radians(80.0 - 58.0 * age + 8.0 * (rand(k, 409) - 0.5))
        out = np.array([math.cos(rise) * math.cos(turn), math.sin(rise), math.cos(rise) * math.sin(turn)])
        foot = np.array([0.05 * out[0], -0.05, 0.05 * out[2]])
        length, light = 0.75 + 0.35 * rand(k, 415), 0.9 - 0.35 * age
        leaf(model, foot, out, length, 0.036, 100 + k, light, segments=4, across=(-1.0, 1.0))
    return model


def growing(x: float, z: float) -> float:
    """Where shrubs grow: at the edge of the grove, and in a ring round the bar but for its front."""
    edge = in_grove(x, z)
    away = math.hypot(x - BAR[0], z - BAR[1])
    if away < KEEP_M:
        return 0.0
    behind = 0.6 * (x - BAR[0]) - 0.8 * (z - BAR[1]) > -0.6
    return max(0.5 * float(0.0 < edge < 0.35), float(away < BESIDE_M and behind))


def make(out: Path) -> None:
    """Writes the folder shrubs under out."""
    folder = out / "shrubs"
    folder.mkdir(parents=True, exist_ok=True)
    note = "A shrub, made by raw_assets/make/shrubs.py; coloured by vertex; metres, Y up"
    bush().write(folder / "bush.obj", "shrubs.mtl", note)
    fan().write(folder / "fan.obj", "shrubs.mtl", note)
    write_mtl(folder / "shrubs.mtl", note, {"leaves": ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]})
    way = flight_way(Path(__file__).resolve().parents[1] / "island.toml")
    for name, count, seed, scale in (("bush", 26, 421, (0.8, 1.5)), ("fan", 22, 431, (0.7, 1.25))):
        places = scattered(count, 1.5, 2.5, seed, way, growing)
        write_places(folder / f"{name}.csv", places, seed + 1, scale=scale, lean_deg=6.0)


if __name__ == "__main__":
    make(Path(sys.argv[1]))

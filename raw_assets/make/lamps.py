"""Lamps of the jetty and of the way to the beach bar: a lantern on a post, and the lantern alone.

Usage: python lamps.py RAW_ASSETS, after terrain.py
Writes the folder lamps: post.obj, lantern.obj, lamps.mtl, posts.csv. Both are coloured by vertex; the
material `flame`, behind the panes, gives off light. The lantern's middle is the origin of lantern.obj, and
LANTERN in post.obj, whose foot stands at the origin and whose arm points along +X.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from objfile import Model, grid_triangles, write_mtl
from paint import rand
from terrain import height_at

Floats = NDArray[np.float64]

HEIGHT_M = 2.35
LANTERN = (0.30, 1.97, 0.0)  # of a post; `offset` of its light in island.toml
SIDES = 8
WOOD, DARK_WOOD = np.array([0.50, 0.42, 0.33]), np.array([0.30, 0.24, 0.18])  # sRGB
IRON, FLAME = np.array([0.13, 0.12, 0.12]), np.array([1.0, 0.86, 0.62])

JETTY = (38.0, 1.2, 16.8)  # as in island.toml
# On the jetty's edges from its head to the beach, between its pairs of poles: how far along it, which side. A
# post's foot is fixed to the stringers below the deck.
JETTY_POSTS = [(23.5, -1), (20.3, 1), (17.2, -1), (14.0, 1), (10.9, -1), (7.6, 1), (4.4, -1)]
EDGE_M, FOOT_M = 1.1, -0.35
# On the sand from the jetty to the bar's steps, beside the camera's way: x, z, where the arm points, degrees
BEACH_POSTS = [(39.6, 13.8, 180.0), (38.2, 9.2, 170.0), (36.6, 5.0, 160.0)]
SUNK_M = 0.15  # in the sand


def colored(
    model: Model, group: str, points: Floats, faces: NDArray[np.int64], color: Floats, seed: int
) -> None:
    """Adds a patch whose colour varies a little from vertex to vertex."""
    shade = np.array([0.82 + 0.36 * rand(i, seed) for i in range(len(points))])[:, None]
    model.add(group, group, points, None, faces, colors=np.clip(shade * color, 0.0, 1.0))


def tube(
    model: Model, group: str, spine: Floats, radii: Floats, color: Floats, seed: int, sides: int
) -> None:
    """Adds a tube round a spine (n, 3), closed by a flat cap at its end."""
    along = np.gradient(spine, axis=0)
    along /= np.sqrt((along * along).sum(axis=1, keepdims=True))
    side = np.cross(along, [0.0, 0.0, 1.0])
    side /= np.sqrt((side * side).sum(axis=1, keepdims=True))
    other = np.cross(along, side)
    turns = 2.0 * math.pi * np.arange(sides + 1) / sides
    rings = [
        spine[i] + radii[i] * (np.cos(turns)[:, None] * side[i] + np.sin(turns)[:, None] * other[i])
        for i in range(len(spine))
    ]
    colored(model, group, np.concatenate(rings), grid_triangles(len(spine), sides + 1), color, seed)
    fan = np.array([(0, 1 + j, 1 + (j + 1) % sides) for j in range(sides)])
    colored(model, group, np.concatenate([spine[-1:], rings[-1][:sides]]), fan, color, seed + 1)


def frustum(
    model: Model,
    group: str,
    at: Floats,
    heights: tuple[float, float],
    halves: tuple[float, float],
    color: Floats,
) -> None:
    """Adds a square frustum with flat sides, bottom and top, from heights[0] up to heights[1] above `at`."""
    ring = np.array([(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)])
    low, high = (
        at + np.stack([half * ring[:, 0], np.full(4, y), half * ring[:, 1]], axis=1)
        for y, half in zip(heights, halves, strict=True)
    )
    quad = np.array([(0, 1, 2), (0, 2, 3)])
    for k in range(4):
        n = (k + 1) % 4
        colored(model, group, np.array([low[k], low[n], high[n], high[k]]), quad, color, 40 + k)
    colored(model, group, low[::-1], quad, color, 45)
    colored(model, group, high, quad, color, 46)


def add_lantern(model: Model, at: Floats) -> None:
    """Adds a lantern: base, four bars, panes with the flame's glow behind them, and a roof with a ring."""
    frustum(model, "flame", at, (-0.095, 0.085), (0.052, 0.066), FLAME)
    frustum(model, "iron", at, (-0.125, -0.095), (0.070, 0.064), IRON)
    frustum(model, "iron", at, (0.085, 0.105), (0.092, 0.092), IRON)
    frustum(model, "iron", at, (0.105, 0.165), (0.086, 0.018), IRON)
    for x in (-1.0, 1.0):
        for z in (-1.0, 1.0):
            spine = at + np.array([[0.056 * x, -0.095, 0.056 * z], [0.070 * x, 0.086, 0.070 * z]])
            tube(model, "iron", spine, np.array([0.008, 0.008]), IRON, 50, 4)
    hook = at + np.array([[0.0, 0.16, 0.0], [0.0, 0.215, 0.0]])
    tube(model, "iron", hook, np.array([0.006, 0.006]), IRON, 51, 4)


def post() -> Model:
    """A leaning, tapering post with an arm that holds a lantern."""
    model = Model()
    share = np.array([0.0, 0.3, 0.65, 0.97, 1.0])
    lean = np.stack([0.02 * np.sin(2.6 * share), HEIGHT_M * share, 0.015 * share * share], axis=1)
    tube(model, "wood", lean, np.array([0.062, 0.057, 0.051, 0.046, 0.030]), WOOD, 3, SIDES)
    x, y, z = LANTERN
    top = y + 0.21
    arm = np.array([[-0.10, top + 0.02, z], [0.12, top + 0.015, z], [x + 0.06, top, z]])
    tube(model, "wood", arm, np.array([0.026, 0.024, 0.018]), DARK_WOOD, 5, 6)
    brace = np.array([[0.03, top - 0.26, z], [0.21, top - 0.01, z]])
    tube(model, "wood", brace, np.array([0.016, 0.014]), DARK_WOOD, 7, 5)
    add_lantern(model, np.array(LANTERN))
    return model


def lantern() -> Model:
    """The lantern alone."""
    model = Model()
    add_lantern(model, np.zeros(3))
    return model


def places() -> list[str]:
    """Rows of the file of instances, in the order in which the lamps go on."""
    y = JETTY[1] + FOOT_M
    rows = [
        # The arm, along +X, points outwards from the deck.
        f"{JETTY[0] + side * EDGE_M:.2f},{y:.2f},{JETTY[2] + along:.2f},{0 if side > 0 else 180}"
        for along, side in JETTY_POSTS
    ]
    return rows + [f"{x:.2f},{height_at(x, z) - SUNK_M:.2f},{z:.2f},{turn:g}" for x, z, turn in BEACH_POSTS]


def make(out: Path) -> None:
    """Writes the folder lamps under out."""
    folder = out / "lamps"
    folder.mkdir(parents=True, exist_ok=True)
    note = "Lamps, made by raw_assets/make/lamps.py; metres, Y up"
    post().write(folder / "post.obj", "lamps.mtl", note)
    lantern().write(folder / "lantern.obj", "lamps.mtl", note)
    text = "\n".join(["x,y,z,yaw_deg", *places()]) + "\n"
    (folder / "posts.csv").write_text(text, encoding="ascii", newline="\n")
    wood = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]
    iron = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0.5 0.5 0.5", "Ns 40", "d 1", "illum 2"]
    materials = {"wood": wood, "iron": iron, "flame": [*wood, "Ke 14 8.2 3.4"]}
    write_mtl(folder / "lamps.mtl", note, materials)


if __name__ == "__main__":
    make(Path(sys.argv[1]))

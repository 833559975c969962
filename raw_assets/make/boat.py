"""Models an outrigger canoe, pulled up on the sand: a planked hull with two thwarts, booms and a float.

Usage: python boat.py RAW_ASSETS
Writes boat/boat.obj and boat.mtl, coloured by vertex. Local axes, metres: the bow points to +Z, the keel is
at y = 0 amidships, the float lies at -X.
"""

from __future__ import annotations

import math
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from objfile import Model, grid_triangles, write_mtl
from paint import rand
from picture import hex_color

Floats = NDArray[np.float64]

LENGTH_M = 4.6
STATIONS = 19
STRAKES = 4  # planks from the keel to the gunwale, on each side
SHELL_M = 0.022
FLOAT_X = -1.55
BARE, WHITE, TEAL, RIM = "#8f7355", "#efe8d8", "#2f8f92", "#6d4f34"


def section(s: float) -> tuple[float, float, float]:
    """Half width at the gunwale, height of the gunwale and of the keel, at a share of the length from the
    stern."""
    t = 2.0 * s - 1.0
    wide = 0.36 * max(1.0 - abs(t) ** 2.6, 0.0) + 0.012
    return wide, 0.46 + 0.34 * abs(t) ** 3.0, 0.30 * abs(t) ** 3.2


def painted(points: Floats, code: str, seed: int) -> Floats:
    """The colour, worn a little from vertex to vertex."""
    wear = np.array([0.86 + 0.14 * rand(k, seed) for k in range(len(points))])
    return np.asarray(hex_color(code) * wear[:, None])


def add_strip(model: Model, points: Floats, number: int, code: str, *, turned: bool = False) -> None:
    """A strip of two rows of points, of one colour."""
    faces = grid_triangles(2, len(points) // 2)
    faces = faces[:, ::-1] if turned else faces
    model.add("boat", "wood", points, None, faces, colors=painted(points, code, number))


def hull_line(side: float, girth: float, inset: float) -> Floats:
    """Points along the hull from the stern to the bow: `girth` 0 at the keel, 1 at the gunwale; `inset`: of
    the inner skin."""
    rows = []
    for k in range(STATIONS):
        s = k / (STATIONS - 1)
        wide, high, low = section(s)
        bulge = math.sin(0.5 * math.pi * girth) ** 0.75
        x = max(wide * bulge - inset, 0.004 * girth)
        y = low + (high - low) * (0.18 * girth + 0.82 * girth * girth) + inset * (1.0 - girth)
        rake = 0.16 * (girth - 0.5) * (2.0 * s - 1.0) ** 3
        rows.append((side * x, y, LENGTH_M * (s - 0.5) + rake))
    return np.array(rows)


def add_hull(model: Model) -> None:
    """Both skins, strake by strake, and the gunwale between them."""
    girths = np.linspace(0.0, 1.0, STRAKES + 1)
    paint = (WHITE, WHITE, WHITE, TEAL)
    for side in (-1.0, 1.0):
        for k, (low, high) in enumerate(pairwise(girths)):
            a, b = hull_line(side, low, 0.0), hull_line(side, high, 0.0)
            add_strip(model, np.concatenate([a, b]), 3 * k + int(side > 0), paint[k], turned=side > 0)
            a, b = hull_line(side, low, SHELL_M), hull_line(side, high, SHELL_M)
            add_strip(model, np.concatenate([a, b]), 2 * k + 1, BARE, turned=side < 0)
        outer, inner = hull_line(side, 1.0, -0.012), hull_line(side, 1.0, SHELL_M + 0.01)
        lift = np.array([0.0, 0.012, 0.0])
        add_strip(model, np.concatenate([outer + lift, inner + lift]), 6, RIM, turned=side > 0)
        edge = np.concatenate([outer - 1.5 * lift, outer + lift])
        add_strip(model, edge, 6, RIM, turned=side > 0)


def add_tube(model: Model, spine: Floats, radii: Floats, number: int, code: str, sides: int = 7) -> None:
    """A round spar along a spine (n, 3), closed by its narrow ends."""
    along = np.gradient(spine, axis=0)
    along /= np.sqrt((along * along).sum(axis=1, keepdims=True))
    side = np.cross(along, [0.1, 1.0, 0.2])
    side /= np.sqrt((side * side).sum(axis=1, keepdims=True))
    top = np.cross(side, along)
    turn = 2.0 * math.pi * np.arange(sides + 1) / sides
    rows = [
        spine[i] + radii[i] * (math.cos(a) * side[i] + math.sin(a) * top[i])
        for i in range(len(spine))
        for a in turn
    ]
    points = np.array(rows)
    faces = grid_triangles(len(spine), sides + 1)[:, ::-1]
    model.add("boat", "wood", points, None, faces, colors=painted(points, code, number))


def add_thwart(model: Model, z: float, number: int) -> None:
    """A seat across the hull: top, underside and edges."""
    wide, high, _ = section(z / LENGTH_M + 0.5)
    x, y, half, thick = wide * 0.93, high - 0.13, 0.11, 0.02
    for up, turned in ((0.0, True), (-thick, False)):
        corners = [
            (-x, y + up, z - half),
            (x, y + up, z - half),
            (-x, y + up, z + half),
            (x, y + up, z + half),
        ]
        add_strip(model, np.array(corners), number, BARE, turned=turned)
    for dz, turned in ((-half, False), (half, True)):
        corners = [(-x, y - thick, z + dz), (x, y - thick, z + dz), (-x, y, z + dz), (x, y, z + dz)]
        add_strip(model, np.array(corners), number, BARE, turned=not turned)


def build() -> Model:
    """The canoe as a model."""
    model = Model()
    add_hull(model)
    for k, z in enumerate((-1.15, 0.95)):
        add_thwart(model, z, k + 2)
    for k, z in enumerate((-0.75, 0.65)):  # booms, which arch from the far gunwale to the float
        s = np.linspace(0.0, 1.0, 9)
        x = 0.42 + (FLOAT_X - 0.42) * s
        y = (
            0.55
            + 0.10 * np.sin(math.pi * np.minimum(1.3 * s, 1.0))
            - 0.47 * np.clip(s - 0.55, 0.0, 1.0) ** 1.6 / 0.28
        )
        add_tube(model, np.stack([x, y, z + 0.0 * s], axis=1), 0.026 - 0.006 * s, k, BARE)
    s = np.linspace(0.0, 1.0, 13)
    curve = 0.10 + 0.16 * np.abs(2.0 * s - 1.0) ** 2.5
    radii = 0.085 * np.clip(np.minimum(s, 1.0 - s) / 0.12, 0.03, 1.0) ** 0.6
    spine = np.stack([FLOAT_X + 0.0 * s, curve, 2.9 * (s - 0.5)], axis=1)
    add_tube(model, spine, radii, 5, WHITE)
    return model


def make(out: Path) -> None:
    """Writes boat.obj and boat.mtl under out/boat."""
    (out / "boat").mkdir(parents=True, exist_ok=True)
    note = "An outrigger canoe, made by raw_assets/make/boat.py; metres, Y up"
    build().write(out / "boat/boat.obj", "boat.mtl", note)
    wood = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]
    write_mtl(out / "boat/boat.mtl", note, {"wood": wood})


if __name__ == "__main__":
    make(Path(sys.argv[1]))

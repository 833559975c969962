"""Large hills: a scene of terrain alone, and a flight round it at 500 m/s.

build/venv/bin/python -m tests.made.hills FOLDER 4097 0.25
build/venv/bin/paradize bake FOLDER/scene.toml -o FOLDER/baked
"""

from __future__ import annotations

import sys
from math import cos, pi, sin
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from paradize.new.template import new_from_template

SPEED_M_S = 500.0
SCENE = """
[shadow]
extent_m = 400.0
center = [0.0, 0.0, 0.0]

[terrain]
heightmap = "hills.png"
size_m = [{side_m}, {side_m}]
height_m = {height_m}
max_error_m = {bound_m}
sand_color = "sand.png"
sand_repeat = {repeat}

[flight]
duration_s = {seconds}
fov_deg = 52.0
near_m = 1.0
far_m = {far_m}
"""
WAYPOINT = """
[[flight.eye]]
position = [{:.1f}, {:.1f}, {:.1f}]

[[flight.target]]
position = [{:.1f}, {:.1f}, {:.1f}]
"""
WAYPOINTS = 12


def hills_scene(folder: Path, side: int, bound_m: float) -> Path:
    """A scene of hills of `side` pixels, one a metre, up to a fifth of that high; returns its TOML. The
    flight is a circle, close above most hills, that looks ahead and down."""
    new_from_template(folder, "island")
    write_hills(folder / "hills.png", side)
    side_m = float(side - 1)
    height_m, radius_m = 0.2 * side_m, 0.3 * side_m
    head = (folder / "scene.toml").read_text().split("[wind]")[0].replace("0.002", "0.00005")
    text = head + SCENE.format(
        side_m=side_m, height_m=height_m, bound_m=bound_m, repeat=side_m / 4.0, shadow_m=0.5 * side_m,
        seconds=round(2.0 * pi * radius_m / SPEED_M_S, 1), far_m=2.0 * side_m,
    )  # fmt: skip

    def at(turn: float, up: float) -> tuple[float, float, float]:
        return radius_m * cos(turn), up * height_m, radius_m * sin(turn)

    for i in range(WAYPOINTS):
        turn = 2.0 * pi * i / WAYPOINTS
        text += WAYPOINT.format(*at(turn, 0.9), *at(turn + 0.6, 0.6))
    (folder / "scene.toml").write_text(text)
    return folder / "scene.toml"


def write_hills(path: Path, side: int) -> None:
    """A 16-bit picture of sums of smooth noise of many sizes, a band of rows at a time."""
    rng = np.random.default_rng(3)
    layers = []
    cells, share = 8, 1.0
    while cells <= side // 4:
        layers.append((cells, share, rng.standard_normal((cells + 2, cells + 2)).astype(np.float32)))
        cells, share = 2 * cells, 0.52 * share
    spec = oiio.ImageSpec(side, side, 1, "uint16")
    spec.attribute("png:compressionLevel", 1)
    out = oiio.ImageOutput.create(str(path))
    assert out and out.open(str(path), spec)
    for first in range(0, side, 256):
        last = min(first + 256, side)
        band = np.zeros((last - first, side), np.float32)
        for cells, share, noise in layers:
            (i, fi), (j, fj) = (
                _smooth(np.arange(*run) * cells / (side - 1), cells) for run in ((first, last), (0, side))
            )
            rows = noise[i] * (1 - fi[:, None]) + noise[i + 1] * fi[:, None]
            band += share * (rows[:, j] * (1 - fj) + rows[:, j + 1] * fj)
        codes = np.clip((band / 8 + 0.5) * 65535, 0, 65535).astype(np.uint16)
        assert out.write_scanlines(first, last, 0, np.ascontiguousarray(codes[:, :, None]))
    out.close()


def _smooth(at: np.ndarray, cells: int) -> tuple[np.ndarray, np.ndarray]:
    whole = np.minimum(at.astype(int), cells - 1)
    rest = (at - whole).astype(np.float32)
    return whole, rest * rest * (3 - 2 * rest)


if __name__ == "__main__":
    hills_scene(Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))

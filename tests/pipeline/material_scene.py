"""A scene of one object with three materials and five pictures, made in a folder."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from tests.pipeline.scenes import write_image

SCENE = """
[scene]
name = "panels"
[[object]]
name = "panel"
mesh = "panel.obj"
lods = 1
[object.material.metal]
occlusion = "orm.png"
roughness = "orm.png"
metalness = "orm.png"
[[object.instance]]
position = [0.0, 0.0, 0.0]
[flight]
duration_s = 4.0
eye = [{ position = [3, 1, 4] }, { position = [-3, 1, 4] }, { position = [0, 2, 5] }]
target = [{ position = [0, 0.5, 0] }, { position = [0, 0.5, 0] }, { position = [0, 0.5, 0] }]
"""
MTL = """
newmtl wood
map_Kd wood.png
norm wood_n.png
newmtl metal
map_Kd metal.png
newmtl leaf
map_Kd leaf.png
"""


def squares(materials: Iterable[str], library: str, *, low: float = 0.1, high: float = 0.9) -> str:
    """An OBJ of upright squares beside each other, a material each; UVs from `low` to `high`."""
    cells = 6
    lines, first = [f"mtllib {library}"], 1
    for k, material in enumerate(materials):
        lines.append(f"usemtl {material}")
        steps = [i / cells for i in range(cells + 1)]
        for y in steps:
            for x in steps:
                depth = 0.02 * np.sin(7.0 * x + 3.0 * y)
                lines.append(f"v {1.2 * k - 1.6 + x:.6f} {y:.6f} {depth:.6f}")
                lines.append(f"vt {low + (high - low) * x:.6f} {low + (high - low) * y:.6f}")
        for j in range(cells):
            for i in range(cells):
                a = first + j * (cells + 1) + i
                face = [a, a + 1, a + cells + 2, a + cells + 1]
                lines.append("f " + " ".join(f"{corner}/{corner}" for corner in face))
        first += (cells + 1) ** 2
    return "\n".join(lines) + "\n"


def noise(seed: int, channels: int = 3, size: int = 64) -> np.ndarray:
    """A smooth picture (size, size, channels), uint8."""
    generator = np.random.default_rng(seed)
    coarse = generator.uniform(40.0, 215.0, (9, 9, channels))
    at = np.linspace(0.0, 8.0, size)
    low = np.minimum(at.astype(int), 7)
    t = (at - low)[:, None]
    rows = coarse[low] * (1.0 - t[..., None]) + coarse[low + 1] * t[..., None]
    both = rows[:, low] * (1.0 - t[None]) + rows[:, low + 1] * t[None]
    return np.asarray(both + 0.5, np.uint8)


def make_panels(folder: Path, lods: int = 1) -> Path:
    """The scene's file. wood: colour and normals of the MTL; metal: occlusion, roughness and metalness packed
    in one picture; leaf: a colour map with holes, of which nobody says a word. lods: more than one are
    measured, which takes longer than all maps."""
    folder.mkdir(parents=True, exist_ok=True)
    write_image(folder / "wood.png", noise(1))
    tilt = (noise(2, 2).astype(np.float64) - 127.0) / 500.0
    up = np.sqrt(1.0 - (tilt**2).sum(axis=2, keepdims=True))
    normals = np.concatenate([tilt, up], axis=2)
    write_image(folder / "wood_n.png", np.asarray(np.round(127.5 * normals + 127.5), np.uint8))
    write_image(folder / "metal.png", noise(3))
    write_image(folder / "orm.png", noise(4))
    leaf = noise(5, 4)
    y, x = np.mgrid[0:64, 0:64]
    leaf[:, :, 3] = np.where((x - 32) ** 2 + (y - 32) ** 2 < 20**2, 255, 0)
    write_image(folder / "leaf.png", leaf)
    (folder / "panel.mtl").write_text(MTL)
    (folder / "panel.obj").write_text(squares(["wood", "metal", "leaf"], "panel.mtl"))
    scene = folder / "panels.toml"
    scene.write_text(SCENE.replace("lods = 1", f"lods = {lods}"))
    return scene

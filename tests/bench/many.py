"""A scene of many small objects, none like another: what the engine's rows bake."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.pipeline.scenes import write_image

SKY = ("px", "nx", "py", "ny", "pz", "nz")
HEAD = f"""
[scene]
name = "many"
[fog]
[sky]
faces = [{", ".join(f'"{face}.exr"' for face in SKY)}]
[flight]
duration_s = 8.0
eye = [{", ".join(f"{{ position = [{x}, 2, {z}] }}" for x, z in ((90, 0), (0, 90), (-90, 0), (0, -90)))}]
target = [{", ".join(["{ position = [0, 1, 0] }"] * 4)}]
"""
OBJECT = """
[[object]]
name = "thing_{i}"
mesh = "thing_{i}.obj"
color = "thing_{i}.png"
lods = 1
[object.material.default]
parallax_scale = 0.01
specular = 0.2
[[object.instance]]
position = [{x}.0, 0.0, {z}.0]
"""
SPIRE = """v 1 0 -1
v -1 0 -1
v 0 0 1
v 0 {height:.4f} 0
vt 0.1 0.1
vt 0.9 0.1
vt 0.5 0.9
f 1/1 2/2 3/3
f 2/1 1/2 4/3
f 3/1 2/2 4/3
f 1/1 3/2 4/3
"""
PER_OBJECT = 5  # artifacts: a mesh, its colour, normals, heights and gloss


def make_many(folder: Path, count: int, *, side: int = 4) -> Path:
    """Writes the scene of `count` objects, each a spire of its own height with a picture of its own, side x
    side texels; the path of its TOML."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(11)
    text = [HEAD]
    for k, face in enumerate(SKY):
        write_image(folder / f"{face}.exr", np.full((4, 4, 3), 0.1 * (k + 1), np.float32))
    for i in range(count):
        (folder / f"thing_{i}.obj").write_text(SPIRE.format(height=2 + i / 1e4))
        write_image(folder / f"thing_{i}.png", rng.integers(60, 200, (side, side, 3), np.uint8))
        text.append(OBJECT.format(i=i, x=i % 50 - 25, z=i // 50 - 20))
    path = folder / "many.toml"
    path.write_text("".join(text))
    return path

"""A small scene with every pass, made in a folder: what the tests of bake, command line and check share."""

from __future__ import annotations

import io
from functools import cache
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import soundfile

SCENE = """
[scene]
name = "cove"
poster_s = 2.0
[fog]
density_per_m = 0.01
[sky]
faces = ["px.exr", "nx.exr", "py.exr", "ny.exr", "pz.exr", "nz.exr"]
[shadow]
size = 256
extent_m = 20.0
[reflection]
[refraction]
[terrain]
heightmap = "height.png"
size_m = [20.0, 20.0]
height_m = 4.0
base_m = -2.0
max_error_m = 0.05
sand_color = "sand.png"
sand_strength = 0.5
sand_repeat = 8.0
effect_color = "sand.png"
[water]
waves = "waves.png"
[[object]]
name = "post"
mesh = "post.obj"
color = "wood.png"
lods = 3
[object.material.wood]
parallax_scale = 0.01
specular = 0.2
[[object.instance]]
position = [1.0, 0.0, 2.0]
yaw_deg = 90.0
[[object.instance]]
position = [-3.0, 0.0, 2.0]
scale = 2.0
[[particles]]
name = "glint"
center = [0.0, 1.0, 0.0]
[sound]
file = "sea.ogg"
[flight]
duration_s = 8.0
eye = [
    { position = [9, 2, 0] }, { position = [0, 2, 9], speed = 2.0 },
    { position = [-9, 2, 0] }, { position = [0, 2, -9] },
]
target = [
    { position = [0, 1, 0] }, { position = [0, 1, 0] }, { position = [0, 1, 0] }, { position = [0, 1, 0] },
]
"""


def write_image(path: Path, pixels: np.ndarray) -> None:
    """(h, w, c) uint8, uint16 or float32."""
    kind = {"uint8": "uint8", "uint16": "uint16", "float32": "float"}[pixels.dtype.name]
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    spec.attribute("DateTime", "2026:01:01 00:00:00")
    out = oiio.ImageOutput.create(str(path))
    assert out and out.open(str(path), spec) and out.write_image(np.ascontiguousarray(pixels))
    out.close()


def ball(segments: int = 12) -> str:
    """An OBJ of a sphere with texture coordinates, material `wood`."""
    lines = ["mtllib post.mtl", "usemtl wood"]
    for j in range(segments + 1):
        for i in range(segments + 1):
            a, b = 2.0 * np.pi * i / segments, np.pi * j / segments
            lines.append(f"v {np.sin(b) * np.cos(a):.6f} {np.cos(b) + 1:.6f} {np.sin(b) * np.sin(a):.6f}")
            lines.append(f"vt {1.0 - i / segments:.6f} {1.0 - j / segments:.6f}")
    for j in range(segments):
        for i in range(segments):
            a = j * (segments + 1) + i + 1
            b, c, d = a + 1, a + segments + 2, a + segments + 1
            lines.append("f " + " ".join(f"{k}/{k}" for k in (a, b, c, d)))
    return "\n".join(lines) + "\n"


@cache
def tone(hertz: float) -> bytes:
    """A second of a tone, as Ogg Vorbis. In a file of its own a stream gets a random number each time."""
    waves = 0.2 * np.sin(2 * np.pi * hertz * np.arange(8000) / 8000.0)
    file = io.BytesIO()
    soundfile.write(file, waves.astype(np.float32), 8000, format="OGG", subtype="VORBIS")
    return file.getvalue()


def make_cove(folder: Path) -> Path:
    """Writes the scene and its sources; returns the TOML's path."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(7)
    z, x = np.mgrid[0:33, 0:33] / 32.0
    hill = np.clip(1.2 - 2.0 * np.hypot(x - 0.5, z - 0.5), 0.0, 1.0)
    write_image(folder / "height.png", (hill * 65535).astype(np.uint16)[:, :, None])
    write_image(folder / "sand.png", rng.integers(180, 230, (32, 32, 3), np.uint8))
    write_image(folder / "wood.png", rng.integers(60, 120, (64, 64, 3), np.uint8))
    u, v = np.meshgrid(np.arange(32) / 32.0, np.arange(32) / 32.0)
    waves = 0.5 + 0.25 * np.sin(2 * np.pi * u) + 0.2 * np.cos(4 * np.pi * v)
    write_image(folder / "waves.png", (waves * 65535).astype(np.uint16)[:, :, None])
    for k, name in enumerate(("px", "nx", "py", "ny", "pz", "nz")):
        write_image(folder / f"{name}.exr", np.full((8, 8, 3), 0.1 * (k + 1), np.float32))
    (folder / "post.obj").write_text(ball())
    (folder / "post.mtl").write_text("newmtl wood\nmap_Kd wood.png\n")
    (folder / "sea.ogg").write_bytes(tone(110.0))
    path = folder / "cove.toml"
    path.write_text(SCENE)
    return path


def make_free_cove(folder: Path) -> Path:
    """The cove with a free camera, which may go far away: no coarse level of its meshes is left out."""
    scene = make_cove(folder)
    scene.write_text(scene.read_text() + "[free_camera]\nlow = [8, 3, 8]\nhigh = [9, 4, 9]\n")
    return scene

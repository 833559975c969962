"""The sources of a scene that bakes in little time: an upright square with a colour map."""

from __future__ import annotations

from pathlib import Path

from tests.pipeline.material_scene import noise, squares
from tests.pipeline.scenes import write_image

SCENE = """
[scene]
name = "panel"
[[object]]
name = "panel"
mesh = "panel.obj"
lods = 1
[[object.instance]]
position = [3.6, 0.0, 0.0]
scale = 3.0
[flight]
duration_s = 4.0
eye = [{ position = [3, 1, 4] }, { position = [-3, 1, 4] }, { position = [0, 2, 5] }]
target = [{ position = [0, 0.5, 0] }, { position = [0, 0.5, 0] }, { position = [0, 0.5, 0] }]
"""


def make_panel(folder: Path) -> Path:
    """The scene's file. wood.png beside it is the colour map. The square fills much of the first picture."""
    folder.mkdir(parents=True)
    write_image(folder / "wood.png", noise(1))
    (folder / "panel.mtl").write_text("newmtl wood\nmap_Kd wood.png\n")
    (folder / "panel.obj").write_text(squares(["wood"], "panel.mtl"))
    scene = folder / "panel.toml"
    scene.write_text(SCENE)
    return scene

"""Scenes with two states each: files of their sources that take turns."""

from __future__ import annotations

from pathlib import Path

from tests.made.gallery import MADE, make_gallery, write_models
from tests.pipeline.scenes import make_cove

Files = dict[str, bytes]
Changing = tuple[Path, tuple[Files, Files]]  # the scene, and its sources in either state by name


def put(folder: Path, files: Files) -> None:
    """Writes files below a scene's folder."""
    for name, data in files.items():
        (folder / name).write_bytes(data)


def cove(folder: Path) -> Changing:
    """A scene of our own sources; two pictures take turns as its sand."""
    scene = make_cove(folder)
    sand, wood = ((folder / name).read_bytes() for name in ("sand.png", "wood.png"))
    return scene, ({"sand.png": sand}, {"sand.png": wood})


def whole_gallery(folder: Path) -> Changing:
    """Models of others. A palette, a table of instances, an authored map and a glTF model change."""
    return _gallery(folder, [one.name for one in MADE])


def few_of_a_gallery(folder: Path) -> Changing:
    """The same with the models that change."""
    return _gallery(folder, ["tree", "vase", "fern"])


def _gallery(folder: Path, names: list[str]) -> Changing:
    write_models(folder)
    scene = make_gallery(folder, tuple(one for one in MADE if one.name in names))
    changed = ("kit/palette.png", "tree.csv", "vase/down.png", "fern.glb")
    before = {name: (folder / name).read_bytes() for name in changed}
    after = {
        "kit/palette.png": (folder / "panels/wood.png").read_bytes(),
        "tree.csv": before["tree.csv"] + b"0,0,4,90,-0.2,0.3,0.2\n",
        "vase/down.png": (folder / "panels/wood_n.png").read_bytes(),
        "fern.glb": (folder / "ball.glb").read_bytes(),
    }
    return scene, (before, after)

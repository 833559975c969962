"""The row of palettes: whether a model shows swatches of a picture, and how small that picture can be. The
truth follows from how each kit is made."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from paradize.build.materials.model_facts import read_model_facts
from paradize.errors import SourceError
from tests.extremes.table import Row
from tests.pipeline.scenes import write_image


@dataclass(frozen=True)
class Kit:
    """A picture of cells x cells swatches, and triangles that show them; is_palette and halvings are the
    truth.

    texels: of a swatch, (rows, columns). count: of triangles, which show the swatches in turn. spread: of a
    triangle's texture coordinates, of the swatch along u and v. tile: whole repeats of the picture that they
    are moved by. factor, offset: of its places."""

    is_palette: bool
    halvings: int
    cells: int = 8
    texels: tuple[int, int] = (8, 8)
    count: int = 64
    spread: tuple[float, float] = (0.0, 0.0)
    tile: int = 0
    factor: float = 1.0
    offset: float = 0.0
    colors: int = 1 << 24

    def picture(self) -> np.ndarray:
        rng = np.random.default_rng(self.cells)
        known = rng.integers(0, 256, (min(self.colors, self.cells**2), 3)).astype(np.uint8)
        at = np.arange(self.cells**2) % len(known)
        return (
            known[at].reshape(self.cells, self.cells, 3).repeat(self.texels[0], 0).repeat(self.texels[1], 1)
        )

    def text(self) -> str:
        lines = ["mtllib a.mtl", "usemtl skin"]
        for k in range(self.count):
            row, column = k // self.cells % self.cells, k % self.cells
            for x, y in ((0, 0), (1, 0), (0, 1)):
                places = (k + x, y, k % 7)
                lines.append("v " + " ".join(repr(self.factor * place + self.offset) for place in places))
                u, v = (
                    self.tile + (cell + 0.5 + wide * (at - 0.5)) / self.cells
                    for cell, at, wide in ((column, x, self.spread[0]), (row, y, self.spread[1]))
                )
                lines.append(f"vt {u!r} {1.0 - v!r}")
            lines.append("f " + " ".join(f"{3 * k + i}/{3 * k + i}" for i in (1, 2, 3)))
        return "\n".join(lines) + "\n"


def _found(kit: Kit) -> tuple[bool, int]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "a.obj").write_text(kit.text())
        (folder / "a.mtl").write_text("newmtl skin\nmap_Kd a.png\n")
        write_image(folder / "a.png", kit.picture())
        facts = read_model_facts(folder / "a.obj", folder, {}, {})
    if error := facts.get("error"):
        raise SourceError(error.what, place=error.place, mend=error.mend)
    one = facts["facts"].materials["skin"]
    return one.palette, one.shrink


def _wrong(kit: Kit, made: tuple[bool, int]) -> float:
    return float(made[0] != kit.is_palette) + abs(made[1] - kit.halvings)


INPUTS: dict[str, Callable[[], Kit]] = {
    "zero": lambda: Kit(False, 0, count=0),
    "one": lambda: Kit(False, 0, count=1),
    "many": lambda: Kit(True, 3, cells=16, count=3000),
    "constant": lambda: Kit(False, 0, colors=1),
    "tiny": lambda: Kit(True, 3, factor=1e-30),
    "huge": lambda: Kit(True, 3, factor=1e30),
    "far": lambda: Kit(True, 3, offset=1e6, tile=100),
    "denormal": lambda: Kit(True, 3, factor=1e-40),
    "nan": lambda: Kit(False, 0, factor=float("nan")),
    "inf": lambda: Kit(False, 0, offset=float("inf")),
    "parallel": lambda: Kit(True, 3, count=8),  # one row of swatches
    "opposite": lambda: Kit(True, 3, colors=2),
    "degenerate": lambda: Kit(True, 2, spread=(0.4, 0.0)),  # lines, which coarse texels mix with others
    "mirrored": lambda: Kit(True, 3, tile=-5),
    "sliver": lambda: Kit(True, 0, texels=(64, 1)),
    "largest": lambda: Kit(True, 6, cells=16, texels=(64, 64), count=57_000),
}
ROWS = [
    Row(
        "build.materials.model_facts",
        INPUTS,
        _found,
        _wrong,
        "halvings",
        0,
        part="palettes",
        refused={"zero": "no faces", "nan": "is not a finite number", "inf": "is not a finite number"},
    )
]

"""Wavefront OBJ and MTL writing for the island's models.

Texture coordinates are atlas pixels from the top-left corner and are written as OBJ's [0, 1] pair from the
bottom-left corner. Numbers have a fixed number of decimals, so that the same model gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def smooth_normals(points: Floats, triangles: Ints) -> Floats:
    """Area-weighted unit normals, (n, 3), of one smooth patch.

    Vertices at one position (within 10 micrometres) share a normal, so that texture seams do not show in the
    light.
    """
    corner = points[triangles]
    facet = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    _, place = np.unique(np.round(points * 1e5).astype(np.int64), axis=0, return_inverse=True)
    place = place.reshape(-1)
    total = np.zeros((int(place.max()) + 1, 3))
    for k in range(3):
        np.add.at(total, place[triangles[:, k]], facet)
    length = np.sqrt(total[:, 0] ** 2 + total[:, 1] ** 2 + total[:, 2] ** 2)
    return (total / np.maximum(length, 1e-30)[:, None])[place]


def grid_triangles(rows: int, columns: int) -> Ints:
    """Triangles of a rows x columns grid of vertices, row-major.

    Counter-clockwise as seen with rows upwards and columns to the left.
    """
    faces = []
    for i in range(rows - 1):
        for j in range(columns - 1):
            a, b = i * columns + j, i * columns + j + 1
            c, d = a + columns, b + columns
            faces += [(a, b, d), (a, d, c)]
    return np.array(faces, dtype=np.int64)


@dataclass
class Model:
    """Collects patches of triangles in groups and writes them as one OBJ."""

    atlas_width: int = 1
    atlas_height: int = 1
    _positions: dict[str, int] = field(default_factory=dict)
    _uvs: dict[str, int] = field(default_factory=dict)
    _normals: dict[str, int] = field(default_factory=dict)
    _groups: dict[tuple[str, str], list[str]] = field(default_factory=dict)

    def add(
        self,
        group: str,
        material: str,
        points: Floats,
        pixels: Floats | None,
        triangles: Ints,
        normals: Floats | None = None,
        colors: Floats | None = None,
    ) -> None:
        """Adds a patch: `points` (n, 3) metres, `pixels` (n, 2) of the atlas, `triangles` (m, 3), `colors`
        (n, 3) sRGB.

        Without `normals` the patch is smooth. All patches of a model have pixels, or none has; so it is with
        colours. Raises ValueError for triangles without area.
        """
        corner = points[triangles]
        facet = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        if float(np.min(np.sum(facet * facet, axis=1))) < 1e-18:
            raise ValueError(f"{group}: a triangle has no area")
        if normals is None:
            normals = smooth_normals(points, triangles)
        names = []
        for row, (p, n) in enumerate(zip(points, normals, strict=True)):
            place = _text("v", p, 5) + ("" if colors is None else _text("", colors[row], 3))
            i = _index(self._positions, place)
            j: int | str = ""
            if pixels is not None:
                u, v = pixels[row, 0] / self.atlas_width, 1.0 - pixels[row, 1] / self.atlas_height
                j = _index(self._uvs, _text("vt", (u, v), 6))
            k = _index(self._normals, _text("vn", n, 4))
            names.append(f"{i}/{j}/{k}")
        lines = self._groups.setdefault((group, material), [])
        lines += [f"f {names[a]} {names[b]} {names[c]}" for a, b, c in triangles]

    def write(self, path: Path, library: str, comment: str) -> None:
        """Writes the OBJ; `library` is the name of its MTL file."""
        text = [f"# {comment}", f"mtllib {library}", *self._positions, *self._uvs, *self._normals]
        for (group, material), faces in self._groups.items():
            text += [f"g {group}", f"usemtl {material}", *faces]
        path.write_text("\n".join(text) + "\n", encoding="ascii", newline="\n")


def write_colored(
    path: Path, library: str, comment: str, name: str, points: Floats, triangles: Ints, colors: Floats
) -> None:
    """Writes an OBJ of one smooth group and material, `name`, whose vertices are colored: `points` (n, 3)
    metres, `triangles` (m, 3), `colors` (n, 3) sRGB. library: the name of its MTL file."""
    text = [f"# {comment}", f"mtllib {library}"]
    text += [
        "v " + " ".join(f"{v:.5f}" for v in row) + " " + " ".join(f"{c:.3f}" for c in color)
        for row, color in zip(points, colors, strict=True)
    ]
    text += ["vn " + " ".join(f"{v + 0.0:.4f}" for v in row) for row in smooth_normals(points, triangles)]
    text += [f"g {name}", f"usemtl {name}"]
    text += ["f " + " ".join(f"{v + 1}//{v + 1}" for v in face) for face in triangles]
    path.write_text("\n".join(text) + "\n", encoding="ascii", newline="\n")


def write_mtl(path: Path, comment: str, materials: Mapping[str, Sequence[str]]) -> None:
    """Writes an MTL: material name -> its statements."""
    text = [f"# {comment}"]
    for name, statements in materials.items():
        text += ["", f"newmtl {name}", *statements]
    path.write_text("\n".join(text) + "\n", encoding="ascii", newline="\n")


def _text(keyword: str, numbers: Iterable[float], decimals: int) -> str:
    # + 0.0 turns the -0.0 of a rounded tiny negative into 0.0
    return " ".join([keyword, *(f"{round(float(x), decimals) + 0.0:.{decimals}f}" for x in numbers)])


def _index(table: dict[str, int], line: str) -> int:
    return table.setdefault(line, len(table) + 1)

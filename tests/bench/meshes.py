"""Dense, detailed, closed surfaces with texture seams, made by arithmetic: what large-mesh rows measure on.

`sphere`: a cube's six sides blown up, displaced by waves and ridges of many lengths; each side a chart of its
own in a 3 x 2 layout. `torus`: one chart, cut along two rings. Both are watertight: where charts meet, their
positions and normals are equal to the last bit.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from paradize.data import Group, Mesh

F64 = npt.NDArray[np.float64]

# Outward axis, then the axes of growing u and growing v seen from outside with v downwards: u x v = -outward.
_SIDES = [
    ((1, 0, 0), (0, 0, -1), (0, -1, 0)),
    ((-1, 0, 0), (0, 0, 1), (0, -1, 0)),
    ((0, 1, 0), (1, 0, 0), (0, 0, 1)),
    ((0, -1, 0), (1, 0, 0), (0, 0, -1)),
    ((0, 0, 1), (1, 0, 0), (0, -1, 0)),
    ((0, 0, -1), (-1, 0, 0), (0, -1, 0)),
]
_GUTTER = 0.01


def _waves(seed: int) -> list[tuple[F64, float, float, bool]]:
    """Wave vector, phase, height and whether it is a ridge: four octaves of six, lower where shorter."""
    random = np.random.default_rng(seed)
    found = []
    for octave in range(4):
        for k in range(6):
            direction = random.normal(size=3)
            direction *= 5.0 * 2.2**octave / np.linalg.norm(direction)
            found.append((direction, random.uniform(0, 2 * np.pi), 0.06 / 2.2**octave, k % 3 == 2))
    return found


def _relief(points: F64, seed: int) -> tuple[F64, F64]:
    """Height (...,) and its gradient (..., 3) at points (..., 3)."""
    height, slope = np.zeros(points.shape[:-1]), np.zeros(points.shape)
    for vector, phase, scale, ridge in _waves(seed):
        angle = points[..., 0] * vector[0] + points[..., 1] * vector[1] + points[..., 2] * vector[2] + phase
        wave, rate = np.sin(angle), np.cos(angle)
        if ridge:
            bent = np.sqrt(wave * wave + 0.01)
            wave, rate = 1 - bent, -wave * rate / bent
        height += scale * wave
        slope += (scale * rate)[..., None] * vector
    return height, slope


def _unit(vectors: F64) -> F64:
    squares = np.sort(vectors * vectors, axis=-1)  # the same sum whichever axis a point came from
    return vectors / np.sqrt(squares[..., 0] + squares[..., 1] + squares[..., 2])[..., None]


def _grid_faces(rows: int, columns: int) -> npt.NDArray[np.int64]:
    """Two triangles a quad, counter-clockwise where rows run down and columns to the right."""
    number = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def sphere(triangles: int = 870_000, *, mirrored: bool = False, seed: int = 1) -> Mesh:
    """About `triangles` of them. mirrored: every other chart's image is turned over."""
    side = max(1, round((triangles / 12) ** 0.5))
    steps = np.tan(np.pi / 4 * (np.arange(side + 1) * 2 - side) / side)
    v, u = np.meshgrid(steps, steps, indexing="ij")
    parts: tuple[list[F64], list[F64], list[F64], list[npt.NDArray[np.int64]]] = ([], [], [], [])
    for number, (out, along, down) in enumerate(_SIDES):
        axes = [np.array(axis, np.float64) for axis in (out, along, down)]
        places = _unit(steps[-1] * axes[0] + u[..., None] * axes[1] + v[..., None] * axes[2])
        height, slope = _relief(places, seed)
        radius = 1 + height
        across = slope - (slope * places).sum(-1, keepdims=True) * places
        row, column = divmod(number, 3)
        images = [(np.arange(side + 1) / side) * (1 - 2 * _GUTTER) + _GUTTER for _ in range(2)]
        if mirrored and number % 2:
            images[0] = images[0][::-1]
        image_v, image_u = np.meshgrid((images[1] + row) / 2, (images[0] + column) / 3, indexing="ij")
        parts[0].append((radius[..., None] * places).reshape(-1, 3))
        parts[1].append(_unit(radius[..., None] * places - across).reshape(-1, 3))
        parts[2].append(np.stack([image_u, image_v], -1).reshape(-1, 2))
        parts[3].append(_grid_faces(side, side) + number * (side + 1) ** 2)
    return _mesh(*(np.concatenate(part) for part in parts))


def torus(triangles: int = 870_000, *, mirrored: bool = False, seed: int = 2) -> Mesh:
    """About `triangles` of them. mirrored: the image runs to and fro around the large ring."""
    rings = max(3, round((triangles / 4) ** 0.5))
    columns = 2 * (max(3, round(triangles / 2 / rings)) // 2)
    a = np.arange(columns) * (2 * np.pi / columns)
    b = np.arange(rings) * (2 * np.pi / rings)
    small, large = np.meshgrid(b, a, indexing="ij")
    spoke = np.stack([np.cos(large), np.zeros_like(large), -np.sin(large)], axis=-1)
    tube = np.cos(small)[..., None] * spoke + np.sin(small)[..., None] * np.array([0.0, 1.0, 0.0])
    height, _ = _relief(spoke + 0.4 * tube, seed)
    points = spoke + (0.4 + height)[..., None] * tube
    along, up = (np.roll(points, -1, k) - np.roll(points, 1, k) for k in (1, 0))
    normals = _unit(np.cross(along, up))
    closed = [np.pad(part, ((0, 1), (0, 1), (0, 0)), mode="wrap")[::-1] for part in (points, normals)]
    u = np.arange(columns + 1) / columns
    if mirrored:
        u = np.abs(2 * u - 1)
    image_v, image_u = np.meshgrid(np.arange(rings + 1) / rings, u, indexing="ij")
    return _mesh(
        closed[0].reshape(-1, 3),
        closed[1].reshape(-1, 3),
        np.stack([image_u, image_v], -1).reshape(-1, 2),
        _grid_faces(rings, columns),
    )


def _mesh(points: F64, normals: F64, uvs: F64, faces: npt.NDArray[np.int64]) -> Mesh:
    return Mesh(
        points.astype(np.float32),
        faces.astype(np.uint32),
        normals=normals.astype(np.float32),
        uvs=uvs.astype(np.float32),
        groups=(Group("surface", "stone", 0, len(faces)),),
    )


def write_obj(mesh: Mesh, path: Path) -> None:
    """The mesh as OBJ with v, vt and vn; positions and normals that are equal are one, so that it is
    closed."""
    assert mesh.normals is not None and mesh.uvs is not None
    points, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    normals, turn = np.unique(mesh.normals, axis=0, return_inverse=True)
    uvs = mesh.uvs.astype(np.float64) * [1, -1] + [0, 1]
    corner = mesh.triangles.reshape(-1)
    names = np.stack([place.reshape(-1)[corner], corner, turn.reshape(-1)[corner]], axis=-1) + 1
    with path.open("w", encoding="ascii") as file:
        for text, rows in (
            ("v %.7g %.7g %.7g\n", points),
            ("vt %.7g %.7g\n", uvs),
            ("vn %.6f %.6f %.6f\n", normals),
            ("f %d/%d/%d %d/%d/%d %d/%d/%d\n", names.reshape(-1, 9)),
        ):
            for first in range(0, len(rows), 65536):
                chunk = rows[first : first + 65536]
                file.write(text * len(chunk) % tuple(chunk.reshape(-1).tolist()))


def write_torus(file: Path, columns: int, rows: int, *, lobes: int) -> int:
    """Writes an OBJ of a closed surface with one UV seam each way, as exporters do: six decimals, corners
    v/vt/vn. lobes: waves along it, five for every three round it. Returns how many triangles it has."""
    v, u = np.meshgrid(np.arange(rows + 1) / rows, np.arange(columns + 1) / columns, indexing="ij")
    along, around = 2 * np.pi * (u % 1), 2 * np.pi * (v % 1)
    tube = 0.35 + 0.02 * np.sin(lobes * along) * np.cos(lobes * 3 // 5 * around)
    out = np.stack([np.cos(around) * np.cos(along), np.sin(around), np.cos(around) * np.sin(along)], -1)
    ring = np.stack([np.cos(along), np.zeros_like(along), np.sin(along)], -1)
    index = np.arange(1, (rows + 1) * (columns + 1) + 1).reshape(rows + 1, columns + 1)
    a, b, c, d = (
        side.reshape(-1) for side in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])
    )
    faces = np.stack([a, b, c, a, c, d], 1).reshape(-1, 3)
    with file.open("w") as text:
        for word, values in (("v", ring + tube[..., None] * out), ("vt", np.stack([u, v], -1)), ("vn", out)):
            line = word + " %.6f" * values.shape[-1] + "\n"
            text.writelines(line % tuple(row) for row in values.reshape(-1, values.shape[-1]).tolist())
        text.writelines(f"f {i}/{i}/{i} {j}/{j}/{j} {k}/{k}/{k}\n" for i, j, k in faces.tolist())
    return len(faces)

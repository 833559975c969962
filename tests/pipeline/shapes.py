"""Meshes that tests share, made by arithmetic."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from paradize.data import Group, Mesh
from paradize.stages.tangents import tangent_frames


def soup(points: list[tuple[float, float, float]], faces: list[tuple[int, int, int]]) -> Mesh:
    """A mesh of positions and triangles alone."""
    return Mesh(np.array(points, np.float32), np.array(faces, np.uint32))


def corner_tangents(mesh: Mesh, method: str = "mikktspace") -> npt.NDArray[np.float32]:
    """The tangents (m, 3, 4) that a mesh's corners are given."""
    framed = tangent_frames(mesh, method)
    assert framed.tangents is not None
    return framed.tangents[framed.triangles]


def sphere(rings: int = 16, *, radius: float = 1.0, offset: tuple[float, float, float] = (0, 0, 0)) -> Mesh:
    """A closed sphere with unit normals and a latitude-longitude image that has one seam and two poles."""
    columns = 2 * rings
    v, u = np.meshgrid(np.arange(rings + 1) / rings, np.arange(columns + 1) / columns, indexing="ij")
    angle = 2 * np.pi * (u % 1.0)
    ring = np.where((v == 0) | (v == 1), 0.0, np.sin(np.pi * v))
    normals = np.stack([ring * np.cos(angle), np.cos(np.pi * v), -ring * np.sin(angle)], axis=-1)
    number = np.arange((rings + 1) * (columns + 1)).reshape(rings + 1, columns + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a[1:], b[1:], d[1:]), (b, c, d))])
    faces = faces[~((v.reshape(-1)[faces[:, 0]] == 1) & (v.reshape(-1)[faces[:, 1]] == 1))]
    used = np.unique(faces)
    unit = normals.reshape(-1, 3)[used]
    return Mesh(
        (unit * radius + np.array(offset)).astype(np.float32),
        np.searchsorted(used, faces).astype(np.uint32),
        normals=unit.astype(np.float32),
        uvs=np.stack([u, v], -1).reshape(-1, 2)[used].astype(np.float32),
        groups=(Group("ball", "skin", 0, len(faces)),),
    )


def grid(size: int, *, height: float = 0.0) -> Mesh:
    """A flat (or waved) open square of size x size quads in the ground plane, image upright."""
    z, x = np.meshgrid(np.arange(size + 1) / size, np.arange(size + 1) / size, indexing="ij")
    y = height * np.sin(7 * x) * np.cos(5 * z)
    number = np.arange((size + 1) ** 2).reshape(size + 1, size + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return Mesh(
        np.stack([x, y, z], -1).reshape(-1, 3).astype(np.float32),
        faces.astype(np.uint32),
        normals=np.tile(np.array([0, 1, 0], np.float32), ((size + 1) ** 2, 1)),
        uvs=np.stack([x, z], -1).reshape(-1, 2).astype(np.float32),
        groups=(Group("ground", "sand", 0, len(faces)),),
    )


def cube() -> Mesh:
    """Twelve triangles over eight positions, no attributes."""
    points = [(float(x), float(y), float(z)) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return soup(points, faces)


# A floor and a wall on its edge, beside each other on the map: what is dark lies where they meet.
CORNER_OBJ = """usemtl stone
v 0 0 0
v 0 0 1
v 1 0 1
v 1 0 0
v 0 1 0
v 0 1 1
vt 0.05 0.9
vt 0.05 0.1
vt 0.45 0.1
vt 0.45 0.9
vt 0.55 0.9
vt 0.55 0.1
vt 0.95 0.1
vt 0.95 0.9
f 1/1 2/2 3/3 4/4
f 1/5 5/8 6/7 2/6
"""

"""Meshes at the extremes: the inputs of mesh stages and metrics."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from paradize.data import Group, Mesh
from paradize.errors import SourceError
from paradize.readers.obj import read_obj
from paradize.readers.record import Model
from tests.pipeline.shapes import grid, sphere

Make = Callable[[], Mesh]


def text_of(mesh: Mesh, factor: float = 1.0, offset: tuple[float, float, float] = (0, 0, 0)) -> str:
    """An OBJ of the mesh with every length times the factor, then moved: in float64, all digits written."""
    lines = []
    with np.errstate(invalid="ignore"):
        places = mesh.positions.astype(np.float64) * factor + offset
    for word, values in (("v", places), ("vt", mesh.uvs), ("vn", mesh.normals)):
        assert values is not None
        wide = values.astype(np.float64)
        rows = np.stack([wide[:, 0], 1.0 - wide[:, 1]], axis=1) if word == "vt" else wide
        lines += [f"{word} {' '.join(map(repr, row))}" for row in rows.tolist()]
    lines += [f"f {' '.join(f'{k}/{k}/{k}' for k in face)}" for face in (mesh.triangles + 1).tolist()]
    return "\n".join(lines)


def read_text(text: str) -> Model:
    """As a bake reads it; messages name no folder, which is another each time."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.obj"
        path.write_text(text)
        try:
            return read_obj(path)
        except SourceError as error:
            raise SourceError(error.what, place=error.place, mend=error.mend) from None


def loaded(mesh: Mesh, factor: float = 1.0, offset: tuple[float, float, float] = (0, 0, 0)) -> Mesh:
    """The mesh that a bake reads from text_of."""
    return read_text(text_of(mesh, factor, offset)).mesh


def joined(*meshes: Mesh) -> Mesh:
    """One mesh of several with the same attributes."""
    firsts = np.cumsum([0, *[len(mesh.positions) for mesh in meshes]])
    faces = [mesh.triangles + np.uint32(first) for mesh, first in zip(meshes, firsts, strict=False)]
    return replace(
        meshes[0],
        positions=np.concatenate([mesh.positions for mesh in meshes]),
        normals=np.concatenate([mesh.normals for mesh in meshes if mesh.normals is not None]),
        uvs=np.concatenate([mesh.uvs for mesh in meshes if mesh.uvs is not None]),
        triangles=np.concatenate(faces).astype(np.uint32),
        groups=(Group("all", "all", 0, sum(map(len, faces))),),
    )


def turned_over(mesh: Mesh) -> Mesh:
    """The same surface seen from behind: at the same places, wound and lit the other way."""
    assert mesh.normals is not None
    return replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]), normals=-mesh.normals)


def mirrored(mesh: Mesh) -> Mesh:
    """Its image in a mirror across x, with the same picture on it: of the other hand."""
    assert mesh.normals is not None
    flip = np.array([-1, 1, 1], np.float32)
    return replace(
        mesh,
        positions=mesh.positions * flip - np.array([3, 0, 0], np.float32),
        normals=mesh.normals * flip,
        triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]),
    )


def with_value(mesh: Mesh, value: float) -> Mesh:
    """One coordinate replaced."""
    positions = mesh.positions.copy()
    positions[7, 1] = value
    return replace(mesh, positions=positions)


def _empty() -> Mesh:
    nothing = np.zeros((0, 3), np.float32)
    return Mesh(nothing, np.zeros((0, 3), np.uint32), nothing, None, np.zeros((0, 2), np.float32))


def _one() -> Mesh:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (3, 1))
    uvs = np.array([[0.1, 0.9], [0.9, 0.9], [0.1, 0.1]], np.float32)
    faces = np.array([[0, 1, 2]], np.uint32)
    return Mesh(positions, faces, normals, uvs=uvs, groups=(Group("a", "a", 0, 1),))


def _degenerate() -> Mesh:
    """A ball with a corner named twice, corners on a line, and a triangle that repeats another."""
    ball = sphere(12)
    count = len(ball.positions)
    line = np.array([[3, 0, 0], [4, 0, 0], [5, 0, 0]], np.float32)
    faces = [[0, 0, 1], [count, count + 1, count + 2], ball.triangles[5].tolist()]
    assert ball.normals is not None and ball.uvs is not None
    return replace(
        ball,
        positions=np.concatenate([ball.positions, line]),
        normals=np.concatenate([ball.normals, ball.normals[:3]]),
        uvs=np.concatenate([ball.uvs, ball.uvs[:3]]),
        triangles=np.concatenate([ball.triangles, np.array(faces, np.uint32)]),
        groups=(Group("ball", "skin", 0, len(ball.triangles) + 3),),
    )


@cache
def ball(rings: int = 12) -> Mesh:
    """The ordinary mesh that extremes are made of."""
    return sphere(rings)


@cache
def large() -> Mesh:
    """57,000 triangles: larger ones are those of `tests/pipeline/bakers/mesh/test_extremes.py`."""
    return sphere(120)


def sliver(cells: int = 12) -> Mesh:
    """A square of cells x cells quads, pressed to a strip a million times as long as wide."""
    plane = grid(cells)
    return replace(plane, positions=plane.positions * np.array([1, 1, 1e-6], np.float32))


MESHES: dict[str, Make] = {
    "zero": _empty,
    "one": _one,
    "many": lambda: ball(40),
    "constant": lambda: replace(ball(), positions=np.full_like(ball().positions, 2.5)),
    "tiny": cache(lambda: loaded(ball(), 1e-30)),
    "huge": cache(lambda: loaded(ball(), 1e30)),
    "far": cache(lambda: loaded(ball(), offset=(1e6, -1e6, 1e6))),
    "denormal": cache(lambda: loaded(ball(), 1e-40)),
    "nan": lambda: with_value(ball(), float("nan")),
    "inf": lambda: with_value(ball(), float("inf")),
    "parallel": lambda: grid(8),
    "opposite": lambda: joined(grid(8), turned_over(grid(8))),
    "degenerate": _degenerate,
    "mirrored": lambda: joined(ball(), mirrored(ball())),
    "sliver": sliver,
    "largest": large,
}


def unit(positions: np.ndarray) -> np.ndarray:
    """Float64 places about the origin with a longest side of 1, whatever they were."""
    wide = positions.astype(np.float64)
    low, high = wide.min(axis=0), wide.max(axis=0)
    side = float((high - low).max())
    return (wide - (low + high) / 2) / (side if side > 0 else 1.0)


def side_of(mesh: Mesh) -> float:
    """The longest side of the box, in the mesh's own unit; 1 where there is none."""
    if not len(mesh.positions) or not np.isfinite(mesh.positions).all():
        return 1.0
    wide = mesh.positions.astype(np.float64)
    return float((wide.max(axis=0) - wide.min(axis=0)).max()) or 1.0


def areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Vectors of twice each triangle's area, float64."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def angles_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Between rows, float64, exact near 0 and 180 too."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)))

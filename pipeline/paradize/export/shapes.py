"""Quads, the faces of the sky, mirrored meshes and joined patches of an exported scene."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import Mesh

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]

# Of each face of the sky: the directions of its image's right and bottom, and of the face itself.
SKY_FACES = {
    "+x": ((0.0, 0.0, -1.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0)),
    "-x": ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (-1.0, 0.0, 0.0)),
    "+y": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "-y": ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, -1.0, 0.0)),
    "+z": ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "-z": ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)),
}


def quad(middle: F32, right: F32, down: F32, tiles: float = 1.0) -> Mesh:
    """A parallelogram from middle - right - down to middle + right + down, whose front shows `right` to the
    right and `down` to the bottom; its image repeats `tiles` times."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float32)
    positions = (middle + corners[:, :1] * right + corners[:, 1:] * down).astype(np.float32)
    normal = np.cross(down.astype(np.float64), right.astype(np.float64))
    tangent = right.astype(np.float64) / np.linalg.norm(right)
    return Mesh(
        positions,
        np.array([[0, 3, 2], [0, 2, 1]], np.uint32),
        normals=np.tile((normal / np.linalg.norm(normal)).astype(np.float32), (4, 1)),
        tangents=np.tile(np.array([*tangent, 1.0], np.float32), (4, 1)),
        uvs=np.float32(tiles) * (0.5 * corners + 0.5).astype(np.float32),
    )


def level_quad(height_m: float, size_m: float, tiles: float = 1.0) -> Mesh:
    """A horizontal square that faces up; +X is the right of its image, +Z the bottom."""
    half = np.float32(0.5 * size_m)
    middle = np.array([0.0, height_m, 0.0], np.float32)
    return quad(middle, np.array([half, 0, 0], np.float32), np.array([0, 0, half], np.float32), tiles)


def mirrored(mesh: Mesh) -> Mesh:
    """The mesh with x negated, relative to its origin; its outside stays outside, its maps stay as they
    are."""
    turn = np.array([-1, 1, 1, -1], np.float32)  # w too: B = w * cross(N, T)
    return replace(
        mesh,
        positions=mesh.positions * turn[:3],
        triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]),
        normals=None if mesh.normals is None else mesh.normals * turn[:3],
        tangents=None if mesh.tangents is None else mesh.tangents * turn,
    )


def joined(meshes: list[Mesh]) -> Mesh:
    """Joins meshes with the same attributes into one; vertices are not shared."""
    starts = np.cumsum([0, *(len(mesh.positions) for mesh in meshes)])

    def all_of(attribute: str) -> Any:
        columns = [getattr(mesh, attribute) for mesh in meshes]
        return None if columns[0] is None else np.concatenate(columns)

    shifted = [mesh.triangles + np.uint32(start) for mesh, start in zip(meshes, starts, strict=False)]
    return Mesh(
        all_of("positions"),
        np.concatenate(shifted).astype(np.uint32),
        normals=all_of("normals"),
        tangents=all_of("tangents"),
        uvs=all_of("uvs"),
        uvs1=all_of("uvs1"),
    )

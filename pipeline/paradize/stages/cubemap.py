"""Cuts cube maps out of panoramas, makes their mips, filtered across the edges of the faces, and encodes
them as half floats.

A texel of a mip is the mean of 4 x 4 texels of the finer level, weighted 1 3 3 1 in both directions and by
the solid angle of each. Where they leave the face, the texels of the neighbouring face count. Edge geometry
as in the OpenGL 3.3 specification, chapter 3.8.6.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Texture
from paradize.kernels.maps import cut_face

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]

HALF_MAX = 65504.0
_SPOTS = 4  # places along a side of a texel, of which a panorama's light is the mean
# Per face +X -X +Y -Y +Z -Z: the axis of the face, of s (to the right) and of t (downwards), each with its
# sign.
_AXES = (
    ((0, 1), (2, -1), (1, -1)),
    ((0, -1), (2, 1), (1, -1)),
    ((1, 1), (0, 1), (2, 1)),
    ((1, -1), (0, 1), (2, -1)),
    ((2, 1), (0, 1), (1, -1)),
    ((2, -1), (0, -1), (1, -1)),
)


def directions(face: int, s: F64, t: F64) -> F64:
    """Directions (..., 3), not normalised, of places s, t in -1..1 (and beyond) on a face."""
    out = np.zeros((*np.broadcast_shapes(s.shape, t.shape), 3))
    (axis, sign), (s_axis, s_sign), (t_axis, t_sign) = _AXES[face]
    out[..., axis] = sign
    out[..., s_axis] = s_sign * s
    out[..., t_axis] = t_sign * t
    return out


def _texel_of(direction: F64, size: int) -> npt.NDArray[np.int64]:
    """Flat index into (6, size, size) of the texel that directions (n, 3) meet."""
    magnitude = np.abs(direction)
    axis = magnitude.argmax(axis=1)
    rows = np.arange(len(direction))
    face = 2 * axis + (direction[rows, axis] < 0)
    out = np.empty(len(direction), np.int64)
    for index in range(6):
        chosen = face == index
        (major, _), (s_axis, s_sign), (t_axis, t_sign) = _AXES[index]
        part = direction[chosen]
        depth = np.abs(part[:, major])
        column = ((s_sign * part[:, s_axis] / depth + 1) * 0.5 * size).astype(np.int64)
        row = ((t_sign * part[:, t_axis] / depth + 1) * 0.5 * size).astype(np.int64)
        flat = np.clip(row, 0, size - 1) * size + np.clip(column, 0, size - 1)
        out[chosen] = index * size * size + flat
    return out


def _bordered(faces: F32) -> F32:
    """(6, n, n, c) with one more texel on every side, taken from the neighbouring faces: (6, n + 2, n + 2,
    c)."""
    size = faces.shape[1]
    out = np.zeros((6, size + 2, size + 2, faces.shape[3]), np.float32)
    out[:, 1:-1, 1:-1] = faces
    flat = faces.reshape(-1, faces.shape[3])
    rows, columns = np.nonzero(np.pad(np.zeros((size, size), np.bool_), 1, constant_values=True))
    s, t = (columns - 0.5) * (2.0 / size) - 1.0, (rows - 0.5) * (2.0 / size) - 1.0
    for face in range(6):
        out[face, rows, columns] = flat[_texel_of(directions(face, s, t), size)]
    return out


def _solid_angles(size: int) -> F64:
    """Relative solid angle of the texels of a face of `size`, bordered: (size + 2, size + 2)."""
    place = np.minimum(np.abs((np.arange(size + 2) - 0.5) * (2.0 / size) - 1.0), 1.0)
    square = 1.0 + place[:, None] * place[:, None] + place[None, :] * place[None, :]
    return np.asarray(1.0 / (square * np.sqrt(square)), np.float64)


def _halved(faces: F32) -> F32:
    size = faces.shape[1]
    half = size // 2
    weight = _solid_angles(size)[None, :, :, None]
    weighted = _bordered(faces).astype(np.float64) * weight
    total = np.zeros((6, half, half, faces.shape[3]))
    norm = np.zeros((1, half, half, 1))
    for j, row_weight in enumerate((1.0, 3.0, 3.0, 1.0)):
        for i, column_weight in enumerate((1.0, 3.0, 3.0, 1.0)):
            at = (slice(None), slice(j, j + size - 1, 2), slice(i, i + size - 1, 2))
            total += (row_weight * column_weight) * weighted[at]
            norm += (row_weight * column_weight) * weight[at]
    return (total / norm).astype(np.float32)


def face_size(columns: int) -> int:
    """The side of the faces of a panorama: about a quarter of its width, a power of two."""
    return int(2 ** round(math.log2(max(columns / 4, 1))))


def cut_faces(panorama: F32) -> F32:
    """Faces (6, n, n, 3), n = face_size(w), of a panorama (h, w, 3), w = 2 h: north (-Z) is in its middle and
    east (+X) to the right of it. Each texel is the mean of the light that it covers, at _SPOTS^2 places.
    Raises ValueError for other shapes."""
    if not 0 < 2 * panorama.shape[0] == panorama.shape[1]:
        raise ValueError(f"{panorama.shape} is the shape of no panorama")
    size = face_size(panorama.shape[1])
    faces = []
    for face in range(6):
        middle, right, down = directions(face, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
        axes = np.stack([middle, right - middle, down - middle])
        faces.append(cut_face(panorama, axes, size=size, spots=_SPOTS))
    return np.stack(faces)


def cube_mips(faces: F32) -> list[F32]:
    """Levels (6, n, n, c) down to 1 x 1 of faces (6, n, n, c), n a power of two; linear light. Raises
    ValueError for other shapes."""
    count, size = faces.shape[:2]
    if count != 6 or faces.shape[2] != size or size < 1 or size & (size - 1):
        raise ValueError(f"a cube map has 6 square faces of a power of two, not {faces.shape}")
    levels = [faces]
    while levels[-1].shape[1] > 1:
        levels.append(_halved(levels[-1]))
    return levels


def encode_cube(levels: Sequence[F32]) -> Texture:
    """Levels (6, n, n, 3) -> RGBA16F, alpha 1; nearest half floats, at most 65504."""
    out = []
    for level in levels:
        half = np.ones((*level.shape[:3], 4), np.float16)
        half[..., :3] = np.clip(level, np.float32(-HALF_MAX), np.float32(HALF_MAX)).astype(np.float16)
        out.append(half.tobytes())
    size = levels[0].shape[1]
    return Texture("RGBA16F", size, size, tuple(out), 6)

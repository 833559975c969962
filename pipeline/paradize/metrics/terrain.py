"""The terrain's true error: the vertical distance of its triangles from every pixel of the height field.

Brute force and independent of the mesher: it sees only the float32 positions of the finished mesh, casts a
vertical line through every pixel and meets each triangle that covers it, in float64, borders included.
It also counts the pixels that no triangle covers, and the triangles that do not face up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from paradize.data import Heightfield, Mesh

_CHUNK_PAIRS = 500_000  # triangle x pixel pairs that are looked at together
_RIM = 1e-9  # of a triangle: how far outside its border a pixel still counts as on it


@dataclass(frozen=True)
class TerrainError:
    """max_m, rms_m: vertical metres over all pixels (the worst triangle at each). holes: pixels not covered.
    flipped: triangles that face down or have no area. worst: (row, column) of the largest error."""

    max_m: float
    rms_m: float
    holes: int
    flipped: int
    worst: tuple[int, int]


def terrain_error(mesh: Mesh, field: Heightfield) -> TerrainError:
    """Measures a terrain mesh against its height field (rows x columns pixels over the field's size)."""
    rows, columns = field.heights_m.shape
    corners = mesh.positions.astype(np.float64)[mesh.triangles]  # (m, 3, 3)
    # Into pixel units, so that a pixel's place is a whole number but for the rounding of float32 positions.
    x = (corners[:, :, 0] / field.size_x_m + 0.5) * (columns - 1)
    z = (corners[:, :, 2] / field.size_z_m + 0.5) * (rows - 1)
    y = corners[:, :, 1]
    slack = 1e-6 * max(rows, columns)
    for place, last in (
        (x, columns - 1.0),
        (z, rows - 1.0),
    ):  # the rim is where the first and last pixels are
        place[np.abs(place) <= slack] = 0.0
        place[np.abs(place - last) <= slack] = last
    area = (x[:, 2] - x[:, 0]) * (z[:, 1] - z[:, 0]) - (x[:, 1] - x[:, 0]) * (z[:, 2] - z[:, 0])
    left = np.clip(np.ceil(x.min(axis=1) - slack), 0, columns - 1).astype(np.int64)
    right = np.clip(np.floor(x.max(axis=1) + slack), 0, columns - 1).astype(np.int64)
    top = np.clip(np.ceil(z.min(axis=1) - slack), 0, rows - 1).astype(np.int64)
    bottom = np.clip(np.floor(z.max(axis=1) + slack), 0, rows - 1).astype(np.int64)
    wide, high = np.maximum(right - left + 1, 0), np.maximum(bottom - top + 1, 0)
    error = np.full(rows * columns, -1.0)
    faces = np.flatnonzero((area > 0.0) & (wide > 0) & (high > 0))
    pairs = wide[faces] * high[faces]
    ends = np.cumsum(pairs)
    start = 0
    heights = field.heights_m.astype(np.float64).ravel()
    while start < len(faces):
        before = int(ends[start - 1]) if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, before + _CHUNK_PAIRS, side="right")))
        _meet(faces[start:stop], x, y, z, area, left, top, wide, pairs[start:stop], columns, heights, error)
        start = stop
    holes = int((error < 0.0).sum())
    covered = error[error >= 0.0]
    worst = int(np.argmax(error))
    squares = math.fsum((covered * covered).tolist())
    return TerrainError(
        max_m=float(error[worst]) if len(covered) else math.inf,
        rms_m=math.sqrt(squares / max(1, len(covered))),
        holes=holes,
        flipped=int((~(area > 0.0)).sum()),
        worst=(worst // columns, worst % columns),
    )


def _meet(
    faces: npt.NDArray[np.int64],
    x: npt.NDArray[np.float64],
    y: npt.NDArray[np.float64],
    z: npt.NDArray[np.float64],
    area: npt.NDArray[np.float64],
    left: npt.NDArray[np.int64],
    top: npt.NDArray[np.int64],
    wide: npt.NDArray[np.int64],
    pairs: npt.NDArray[np.int64],
    columns: int,
    heights: npt.NDArray[np.float64],
    error: npt.NDArray[np.float64],
) -> None:
    """Raises `error` at each pixel that one of `faces` covers to the distance found there."""
    face = np.repeat(faces, pairs)
    step = np.arange(len(face), dtype=np.int64) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    column = left[face] + step % wide[face]
    row = top[face] + step // wide[face]
    px, pz = column.astype(np.float64), row.astype(np.float64)
    weights = []
    for k in range(3):  # barycentric weight of corner k: the area that the pixel spans with the other two
        a, b = (k + 1) % 3, (k + 2) % 3
        ax, az, bx, bz = x[face, a], z[face, a], x[face, b], z[face, b]
        weights.append(((bx - px) * (az - pz) - (ax - px) * (bz - pz)) / area[face])
    inside = (weights[0] >= -_RIM) & (weights[1] >= -_RIM) & (weights[2] >= -_RIM)
    plane = weights[0] * y[face, 0] + weights[1] * y[face, 1] + weights[2] * y[face, 2]
    pixel = (row * columns + column)[inside]
    np.maximum.at(error, pixel, np.abs(plane[inside] - heights[pixel]))

"""How large a model is, and where its lowest floor lies: triangles that stand at one place or at many."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from paradize.placement import IDENTITY

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import F64, Mesh

_SHARE = 0.05  # of the ground that the model covers: what faces up on less is a rim or a crease, no floor
_AT_ONCE = 1 << 20  # vertices
_MOST_VERTICES = 1 << 28  # over all copies; beyond, the box of a mesh stands for its vertices
_MOST_TRIANGLES = 1 << 24  # over all copies; beyond, a shape is not searched for a floor


@dataclass(frozen=True)
class Shape:
    """positions: (v, 3). triangles: (m, 3). matrices: (n, 12), 3 x 4 row by row, where the copies stand."""

    positions: F64
    triangles: npt.NDArray[np.uint32]
    matrices: F64

    @classmethod
    def of(cls, mesh: Mesh, matrices: Sequence[Sequence[float]] = (IDENTITY,)) -> Shape:
        return cls(mesh.absolute_positions.astype(np.float64), mesh.triangles, np.array(matrices, np.float64))

    def rows(self, positions: F64) -> Iterator[tuple[F64, F64]]:
        """Yields some matrices (k, 12) and where positions (v, 3) come to lie by them, (3, k, v)."""
        step = max(1, _AT_ONCE // max(1, len(positions)))
        x, y, z = (column[None, :] for column in positions.T)
        for first in range(0, len(self.matrices), step):
            m = self.matrices[first : first + step, :, None]
            yield (
                m[:, :, 0],
                np.stack([m[:, k] * x + m[:, k + 1] * y + m[:, k + 2] * z + m[:, k + 3] for k in (0, 4, 8)]),
            )


def bounds(shapes: Sequence[Shape]) -> tuple[F64, F64]:
    """Returns the least and the largest coordinates, (3,) each."""
    lows, highs = [], []
    for shape in shapes:
        places = shape.positions
        if len(places) * len(shape.matrices) > _MOST_VERTICES:
            ends = np.stack([places.min(axis=0), places.max(axis=0)])
            places = np.stack([ends[[k & 1, k >> 1 & 1, k >> 2], range(3)] for k in range(8)])
        for _, placed in shape.rows(places):
            lows.append(placed.min(axis=(1, 2)))
            highs.append(placed.max(axis=(1, 2)))
    return np.min(lows, axis=0), np.max(highs, axis=0)


def least_floor(shapes: Sequence[Shape]) -> float | None:
    """Returns how far above the lowest point the lowest floor lies; None where nothing faces up.

    Triangles that face up are taken from the lowest on, until they cover 5 % of the box seen from above."""
    low, high = bounds(shapes)
    tops, areas = [np.zeros(0)], [np.zeros(0)]
    for shape in shapes:
        if len(shape.triangles) * len(shape.matrices) > _MOST_TRIANGLES:
            continue
        for matrices, (x, y, z) in shape.rows(shape.positions):
            a, b, c = (shape.triangles[:, k] for k in range(3))
            covered = 0.5 * (
                (z[:, b] - z[:, a]) * (x[:, c] - x[:, a]) - (x[:, b] - x[:, a]) * (z[:, c] - z[:, a])
            )
            covered *= np.where(_mirrors(matrices), -1.0, 1.0)[:, None]
            top = np.maximum(np.maximum(y[:, a], y[:, b]), y[:, c])
            up = covered > 0.0
            tops.append(top[up] - low[1])
            areas.append(covered[up])
    top, covered = np.concatenate(tops), np.concatenate(areas)
    order = np.argsort(top, kind="stable")
    enough = np.cumsum(covered[order]) >= _SHARE * (high[0] - low[0]) * (high[2] - low[2])
    return float(top[order[np.argmax(enough)]]) if enough.any() else None


def _mirrors(matrices: F64) -> npt.NDArray[np.bool_]:
    """Whether each matrix turns the outside in; a reader has turned triangles back."""
    a, b, c, _, d, e, f, _, g, h, i, _ = matrices.T
    return np.asarray(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0)

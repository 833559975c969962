"""The tree of a terrain's patches: right triangles over the pixels, each half of its parent.

The root is a square of leaf_px * 2^depth pixels that contains the field; its corner is pixel (0, 0). Its two
halves are the patches of level 0. A split bisects the hypotenuse. A patch of level 2k is half a square of
depth k, one of level 2k + 1 a quarter. Patches outside the field do not exist. A diamond is the one or two
patches on one hypotenuse. They split together, so that neighbours share whole edges.

Source: Cignoni, Ganovelli, Gobbetti, Marton, Ponchio, Scopigno, "BDAM: Batched Dynamic Adaptive Meshes for
High Performance Terrain Visualization", 2003.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Point = tuple[int, int]  # row, column
Corners = tuple[Point, Point, Point]  # the right angle first, then the hypotenuse's ends
Range = tuple[float, float]


@dataclass(frozen=True)
class Shape:
    """The tree over a field of rows x columns pixels whose smallest cells have sides of leaf_px pixels."""

    rows: int
    columns: int
    leaf_px: int

    def __post_init__(self) -> None:
        if min(self.rows, self.columns) < 2 or self.leaf_px < 1:
            raise ValueError(
                f"a tree over {self.columns} x {self.rows} pixels in cells of {self.leaf_px}; limit 2 x 2"
            )

    @property
    def depth(self) -> int:
        """How often the root's square is quartered."""
        depth, side = 0, self.leaf_px
        while side < max(self.rows, self.columns) - 1:
            depth, side = depth + 1, 2 * side
        return depth

    @property
    def finest(self) -> int:
        """The finest level."""
        return 2 * self.depth

    def roots(self) -> list[Corners]:
        """The patches of level 0, those that exist."""
        side = self.leaf_px << self.depth
        halves: list[Corners] = [((side, 0), (0, 0), (side, side)), ((0, side), (side, side), (0, 0))]
        return [corners for corners in halves if self.exists(corners)]

    def halves(self, corners: Corners) -> list[Corners]:
        """The patches of the next level that a patch is split into, those that exist."""
        a, b, c = corners
        middle = ((b[0] + c[0]) // 2, (b[1] + c[1]) // 2)
        parts: list[Corners] = [(middle, a, b), (middle, c, a)]
        return [part for part in parts if self.exists(part)]

    def exists(self, corners: Corners) -> bool:
        """Whether the patch covers some area of the field (the axes that could separate them: Gottschalk,
        Lin, Manocha, 1996)."""
        rows, columns = self.rows - 1, self.columns - 1
        for k, last in ((0, rows), (1, columns)):
            line = [corner[k] for corner in corners]
            if min(line) >= last or max(line) <= 0:
                return False
        for i in range(3):
            (r0, c0), (r1, c1), inner = corners[i], corners[(i + 1) % 3], corners[(i + 2) % 3]
            normal_r, normal_c = c1 - c0, r0 - r1
            if normal_r * (inner[0] - r0) + normal_c * (inner[1] - c0) < 0:
                normal_r, normal_c = -normal_r, -normal_c
            top = max(normal_r * (r - r0) + normal_c * (c - c0) for r in (0, rows) for c in (0, columns))
            if top <= 0:
                return False
        return True

    def clipped(self, corners: Corners) -> list[tuple[float, float]]:
        """Returns the corners (row, column) of the part of a patch inside the field (Sutherland and Hodgman,
        1974)."""
        polygon = [(float(r), float(c)) for r, c in corners]
        for k, sign, bound in (
            (0, 1.0, 0.0),
            (0, -1.0, 1.0 - self.rows),
            (1, 1.0, 0.0),
            (1, -1.0, 1.0 - self.columns),
        ):
            kept: list[tuple[float, float]] = []
            for i, here in enumerate(polygon):
                there = polygon[(i + 1) % len(polygon)]
                a, b = sign * here[k] - bound, sign * there[k] - bound
                if a >= 0:
                    kept.append(here)
                if (a < 0 < b) or (b < 0 < a):
                    t = a / (a - b)
                    kept.append((here[0] + t * (there[0] - here[0]), here[1] + t * (there[1] - here[1])))
            polygon = kept
            if not polygon:
                break
        return polygon

    def count(self) -> list[int]:
        """How many patches the whole tree has at each level."""
        level = self.roots()
        counts = [len(level)]
        for _ in range(self.finest):
            level = [half for corners in level for half in self.halves(corners)]
            counts.append(len(level))
        return counts


def diamond_of(corners: Corners) -> Point:
    """Returns the key of a patch's diamond among those of its level: twice the middle of the hypotenuse."""
    return corners[1][0] + corners[2][0], corners[1][1] + corners[2][1]


def tolerance(level: int, finest: int, finest_m: float, least_m: float) -> float:
    """Returns the vertical tolerance of a level, metres: finest_m at the finest level, and twice as much at
    each coarser one. Sides grow by sqrt(2) alone: the coarser a patch is, the smaller it is beside the
    distance at which it is drawn, so that its far part is hardly finer than needed. least_m: used instead of
    finest_m for coarser levels, if it is larger."""
    up = finest - level
    return finest_m if up == 0 else max(finest_m, least_m) * float(1 << up)


@dataclass(frozen=True)
class Blocks:
    """The lowest and highest height of each square of `side` pixels, borders shared: (rows, columns) of
    blocks."""

    low: npt.NDArray[np.float32]
    high: npt.NDArray[np.float32]
    side: int

    @classmethod
    def of(cls, heights: npt.NDArray[np.float32], side: int) -> Blocks:
        """heights: (rows, columns) float32. side: pixels, >= 1."""
        rows, columns = heights.shape
        down, across = max(1, -(-(rows - 1) // side)), max(1, -(-(columns - 1) // side))
        low, high = np.empty((down, across), np.float32), np.empty((down, across), np.float32)
        starts = np.arange(across) * side
        for i in range(down):
            band = heights[i * side : (i + 1) * side + 1]
            for out, pick in ((low, np.minimum), (high, np.maximum)):
                line = pick.reduce(band, axis=0)
                out[i] = pick.reduceat(line, starts)
                out[i] = pick(out[i], line[np.minimum(starts + side, columns - 1)])
        return cls(low, high, side)

    def range(self, polygon: Sequence[tuple[float, float]]) -> Range:
        """The lowest and highest height in the blocks that a polygon of (row, column) may touch."""
        bounds = []
        for k in (0, 1):
            line = [point[k] for point in polygon]
            first = min(max(0, int(min(line) // self.side)), self.low.shape[k] - 1)
            last = min(max(first + 1, -int(-max(line) // self.side)), self.low.shape[k])
            bounds.append(slice(first, last))
        window = (bounds[0], bounds[1])
        return float(self.low[window].min()), float(self.high[window].max())

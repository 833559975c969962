"""Python interface of the gutter kernels: which UV islands touch, their distance, and how they bleed.

Maps are (h, w), row 0 at the top. Wrong shapes and types raise ValueError. Results do not depend on
`threads`. Method: gutter/walk.hpp.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from paradize.kernels.gutter import _gutter
from paradize.kernels.threads import default_threads

if TYPE_CHECKING:
    from collections.abc import Sequence

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]

KINDS = ("value", "color", "normal")
THREADS = default_threads(2)


@dataclass(frozen=True)
class Layout:
    """The texels of level 0. inside: (h, w) bool, whether a triangle touches the texel. source: (h, w) int32,
    flat index of the nearest inside texel. owner: (h, w) int32 >= 0, the island of that texel. repeat:
    whether samples beyond the edge wrap around."""

    inside: npt.NDArray[np.bool_]
    source: I32
    owner: I32
    repeat: bool

    def arrays(self) -> tuple[npt.NDArray[np.uint8], I32, I32, bool]:
        """The arrays for the kernels. Raises ValueError where their shapes differ."""
        shape = self.inside.shape
        if len(shape) != 2 or self.source.shape != shape or self.owner.shape != shape:
            raise ValueError(f"inside {shape}, source {self.source.shape}, owner {self.owner.shape}")
        return (
            np.ascontiguousarray(self.inside, np.uint8),
            np.ascontiguousarray(self.source, np.int32),
            np.ascontiguousarray(self.owner, np.int32),
            self.repeat,
        )

    @cached_property
    def borders(self) -> _gutter.Borders:
        """The borders of the islands, computed once for all walks."""
        return _gutter.Borders(*self.arrays())


@dataclass(frozen=True)
class Bleed:
    """The bleeding of a level, as shares of the range (0..1). worst: the worst sample, at the border texel
    (x, y) of level 0. p99, mean: of the worst island. all_p99: of all samples. own: the own island's share of
    the worst sample."""

    mean: float
    p99: float
    all_p99: float
    worst: float
    x: int
    y: int
    island: int
    samples: int
    own: float


def linear_light(values: F32) -> F32:
    """Encoded sRGB -> linear light, any shape, error below 1e-6; clamped to 0..1."""
    values = np.ascontiguousarray(values, np.float32)
    result = np.empty_like(values)
    _gutter.linear_light(values, result)
    return result


def touching(ids: I32, count: int, *, repeat: bool) -> I32:
    """Groups islands that touch. ids: (h, w) int32, -1 outside. Returns (count,) int32: equal values for
    islands without a whole texel between them, directly or through others."""
    if ids.ndim != 2 or ids.size == 0:
        raise ValueError(f"ids have shape {ids.shape}")
    names = np.empty((count,), np.int32)
    _gutter.touching(np.ascontiguousarray(ids, np.int32), count, repeat, names)
    return names


def smallest_gap(layout: Layout) -> tuple[float, int, int]:
    """(texels between the two nearest islands, flat indices of the two facing texels); (-1, -1, -1) for one
    island."""
    gap, a, b = _gutter.smallest_gap(*layout.arrays())
    return float(gap), int(a), int(b)


def walk(
    levels: Sequence[F32],
    kind: str,
    layout: Layout,
    reach: npt.NDArray[np.float64],
    *,
    threads: int = THREADS,
) -> list[Bleed]:
    """Measures how far samples along the islands' borders see other islands, for each level.

    levels: (h, w, c) float32 each, finest first. kind: "value", "color" (linear, 3 channels or 4 with alpha)
    or "normal" (x, y). reach: (islands,) float64, how far samples of an island may lie beyond its border, as
    a share of the map's side; negative: the island is skipped.
    """
    result = np.empty((len(levels), 9), np.float64)
    layout.borders.walk(
        [np.ascontiguousarray(level, np.float32) for level in levels],
        KINDS.index(kind),
        np.ascontiguousarray(reach, np.float64),
        result,
        threads,
    )
    return [
        Bleed(
            mean=row[0],
            p99=row[1],
            all_p99=row[2],
            worst=row[3],
            x=int(row[4]),
            y=int(row[5]),
            island=int(row[6]),
            samples=int(row[7]),
            own=row[8],
        )
        for row in result.tolist()
    ]

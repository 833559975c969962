"""Python interface of our simplifier, which collapses edges, the cheapest first, down to a target.

Wrong shapes and values raise ValueError. The result is the same on all CPUs. Method and sources:
simplify/collapse.hpp.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from paradize.kernels.arrays import finite_rows, to_indices, triangle_rows
from paradize.kernels.simplify import _simplify

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    U32 = npt.NDArray[np.uint32]

STOPS = ("target", "nothing")


@dataclass(frozen=True)
class Simplified:
    """A simplified mesh.

    positions: (k, 3) float64. triangles: (j, 3) uint32, in the order of the source; no triangle has two
    corners at one position. attributes: (k, a) float32. vertex: (k,) a source vertex that was merged into
    each; vertices that did not move have exactly the position and attributes of their source. place: (k,)
    equal for vertices at one position. triangle: (j,) source triangle. stop: "target" (reached) or
    "nothing" (no edge may collapse).
    """

    positions: F64
    triangles: U32
    attributes: F32
    vertex: U32
    place: U32
    triangle: U32
    stop: str


def simplify(
    positions: F64,
    triangles: U32,
    *,
    target: int,
    attributes: npt.ArrayLike | None = None,
    weights: npt.ArrayLike | None = None,
    unit: int | None = None,
    seams: npt.ArrayLike | None = None,
    groups: npt.ArrayLike | None = None,
    kept_area: float = 0.0,
) -> Simplified:
    """Simplifies a mesh to about `target` triangles (never fewer than the last collapse leaves).

    positions: (n, 3) float64, finite, centred, diagonal near 1. triangles: (m, 3) below n; degenerate ones
    are dropped. attributes: (n, a) finite, a up to 32, any unit. weights: (a,), the distance that a
    difference of 1 counts as; 0 (default): interpolated only. unit: first of three columns with unit vectors.
    seams: (n,) id of each vertex's position, below n (default: all different); vertices of one position move
    together. groups: (m,) group of each triangle; borders of groups are kept. kept_area: the share of its
    area, 0 to 1, that each connected part keeps. Raises ValueError for anything else.
    """
    positions = finite_rows(positions, 3, np.float64, name="positions")
    count = len(positions)
    triangles = triangle_rows(triangles, count)
    columns = np.zeros((count, 0), np.float32) if attributes is None else attributes
    values = np.ascontiguousarray(columns, np.float32)
    if values.ndim != 2 or len(values) != count or values.shape[1] > 32 or not np.isfinite(values).all():
        raise ValueError(f"attributes {values.shape}: expected finite ({count}, up to 32)")
    width = values.shape[1]
    weighed = np.ascontiguousarray(np.zeros(width) if weights is None else weights, np.float32)
    if weighed.shape != (width,) or not (np.isfinite(weighed) & (weighed >= 0)).all():
        raise ValueError(f"weights {weighed.shape}: expected ({width},), none below 0")
    if unit is not None and not 0 <= unit <= width - 3:
        raise ValueError(f"unit vectors from column {unit} of {width}")
    if target < 0 or not 0 <= kept_area <= 1:
        raise ValueError(f"target {target}, kept_area {kept_area}")

    def numbers(given: npt.ArrayLike | None, length: int, default: U32) -> U32:
        array = to_indices(default if given is None else given)
        if array.shape != (length,):
            raise ValueError(f"expected ({length},) integers, got {array.shape}")
        return array

    place = numbers(seams, count, np.arange(count, dtype=np.uint32))
    group = numbers(groups, len(triangles), np.zeros(len(triangles), np.uint32))
    if len(triangles) and int(place.max()) >= count:
        raise ValueError(f"an index beyond {count} vertices")
    found = _simplify.simplify(
        positions,
        triangles,
        values,
        weighed,
        -1 if unit is None else unit,
        place,
        group,
        target,
        kept_area,
    )
    points, remaining, carried, vertex, position_ids, triangle, stop = found
    if width == 0:
        carried = np.zeros((len(points), 0), np.float32)
    return Simplified(
        positions=points,
        triangles=remaining,
        attributes=carried,
        vertex=vertex,
        place=position_ids,
        triangle=triangle,
        stop=STOPS[stop],
    )

"""Checked face of the reference kernels, which metrics measure with and no stage imports."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import paradize.kernels._reference as _reference
from paradize.kernels.threads import default_threads


def _rows(values: npt.ArrayLike) -> npt.NDArray[np.float32]:
    rows = np.ascontiguousarray(values, np.float32)
    if rows.ndim != 2 or rows.shape[1] != 3 or not np.isfinite(rows).all():
        raise ValueError(f"expected (n, 3) finite floats, got {rows.shape}")
    return rows


def _triangles(values: npt.ArrayLike, vertices: int) -> npt.NDArray[np.uint32]:
    triangles = np.ascontiguousarray(values, np.uint32)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles):
        raise ValueError(f"expected (m, 3) indices, got {triangles.shape}")
    if int(triangles.max()) >= vertices:
        raise ValueError(f"index {int(triangles.max())} of {vertices} vertices")
    return triangles


class Surface:
    """Triangles that are measured, in a tree; made once for any number of measurements.

    positions: (n, 3) finite, any unit; triangles: (m, 3), m > 0. Both are copied only where they must be.
    """

    def __init__(self, positions: npt.ArrayLike, triangles: npt.ArrayLike) -> None:
        self.positions = _rows(positions)
        self.triangles = _triangles(triangles, len(self.positions))
        self.tree = _reference.Surface(self.positions, self.triangles)

    def distance_to(
        self, other: Surface, *, samples: int, threads: int | None = None
    ) -> tuple[float, float, float]:
        """(max, rms, p99) distance from this surface's samples to the other surface, in the positions' unit.

        samples: about how many in all, besides ten or more in every triangle, 0 to 10^8.
        """
        if not 0 <= samples <= 10**8:
            raise ValueError(f"{samples} samples, expected 0 to 10^8")
        workers = default_threads(8) if threads is None else max(1, threads)
        found = _reference.surface_distance(self.tree, other.tree, samples, workers)
        return float(found[0]), float(found[1]), float(found[2])


def one_sided_distance(
    from_positions: npt.ArrayLike,
    from_triangles: npt.ArrayLike,
    to_positions: npt.ArrayLike,
    to_triangles: npt.ArrayLike,
    *,
    samples: int,
    threads: int | None = None,
) -> tuple[float, float, float]:
    """Surface.distance_to of two surfaces that are measured once."""
    there, back = Surface(from_positions, from_triangles), Surface(to_positions, to_triangles)
    return there.distance_to(back, samples=samples, threads=threads)


def angles_deg(a: npt.ArrayLike, b: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """(n,) angles in degrees, 0 to 180, between the rows of two (n, 3) arrays; 90 where a row is zero."""
    first, second = _rows(a), _rows(b)
    if first.shape != second.shape:
        raise ValueError(f"{first.shape} and {second.shape} rows")
    return _reference.angles_deg(first, second)  # type: ignore[no-any-return]

"""Joins vertices that are nearer to each other than a tolerance, on request only.

By default only equal positions are joined, so a gap of the source stays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from paradize.data import ATTRIBUTES, Mesh
from paradize.errors import BakeError
from paradize.kernels.mesh import number_rows, weld_points
from paradize.vectors import lengths


@dataclass(frozen=True)
class Welding:
    """tolerance_m: as asked for. joined: positions moved onto another. largest_m: the longest move."""

    tolerance_m: float
    joined: int
    largest_m: float


def weld(mesh: Mesh, tolerance_m: float) -> tuple[Mesh, Welding]:
    """Moves positions at most `tolerance_m` (0: nothing is done), each to the nearest earlier one that stays.

    Positions that stay are farther apart than the tolerance. Vertices that are then equal in all attributes
    become one. Triangles keep their number and order; validate_mesh drops those that lost their area. Raises
    BakeError for a tolerance that is negative or not finite.
    """
    if not (math.isfinite(tolerance_m) and tolerance_m >= 0):
        raise BakeError(f"a weld tolerance of {tolerance_m:g} metres", mend="write 0 or more")
    if tolerance_m == 0 or not len(mesh.positions):
        return mesh, Welding(tolerance_m, 0, 0.0)
    places, first = number_rows(mesh.positions)
    points = np.ascontiguousarray(mesh.positions[first])
    target = weld_points(points, tolerance_m)
    moved = np.flatnonzero(target != np.arange(len(target)))
    if not len(moved):
        return mesh, Welding(tolerance_m, 0, 0.0)
    apart = points[moved].astype(np.float64) - points[target[moved]]
    largest = float(lengths(apart).max())
    arrays: dict[str, Any] = {name: getattr(mesh, name) for name in ATTRIBUTES}
    arrays["positions"] = points[target[places]]
    kept = {name: values for name, values in arrays.items() if values is not None}
    number, rows = number_rows(np.concatenate(list(kept.values()), axis=1))
    shared: dict[str, Any] = {name: np.ascontiguousarray(values[rows]) for name, values in kept.items()}
    return replace(mesh, **shared, triangles=number[mesh.triangles]), Welding(
        tolerance_m, len(moved), largest
    )


def welded_messages(done: Welding) -> list[str]:
    """Returns a sentence about what was welded; none if nothing was."""
    if not done.joined:
        return []
    return [
        f"{done.joined} places joined with one at most {done.tolerance_m:g} m away, as asked "
        f"(moved at most {done.largest_m:.3g} m)"
    ]

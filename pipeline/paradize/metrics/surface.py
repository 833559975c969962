"""Two-sided distance between surfaces, as a fraction of the diagonal of the first one's bounding box.

Measured by kernels that no stage imports. The maximum is bounded from below and above over all points of both
surfaces (`reference/bound.hpp`). RMS and 99th percentile are those of dense samples in proportion to area,
ten or more per triangle, against all points of the other surface (`reference/distance.hpp`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from paradize.data import Mesh, rounded, rounded_down, rounded_up
from paradize.kernels.reference import RESOLUTION, Surface

SAMPLES = 100_000
MAX_BOUND_GAP = 0.02


def diagonal(mesh: Mesh) -> float:
    """The diagonal of the bounding box of all used vertices, metres, float64."""
    positions = mesh.positions[mesh.is_used].astype(np.float64)
    x, y, z = (float(side) for side in positions.max(axis=0) - positions.min(axis=0))
    return float(np.sqrt(x * x + y * y + z * z))


class Original:
    """The original that levels are measured against. Keeps the tree of the last level, so that all its
    metrics share it."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.surface = Surface(mesh.positions, mesh.triangles)  # raises for an invalid surface
        self.diagonal_m = diagonal(mesh)
        self._last: tuple[Mesh, Surface] | None = None

    def surface_of(self, level: Mesh) -> Surface:
        """The search tree of a level."""
        if level is self.mesh:
            return self.surface
        if self._last is None or not (
            self._last[0].positions is level.positions and self._last[0].triangles is level.triangles
        ):
            self._last = (level, Surface(level.positions, level.triangles))
        return self._last[1]

    def distance(self, level: Mesh, samples: int = SAMPLES) -> dict[str, float]:
        """error_max, error_max_lower, error_p99 and error_rms of a level, each the larger of both directions,
        as fractions of the original's diagonal.

        No point of either surface is farther from the other than error_max, and some point is as far as
        error_max_lower. They differ by at most 0.1 % or 1e-7, unless the kernel's work limit ends the search
        (is_loose: more than 2 %). samples: approximate number per direction for p99 and RMS (0 to 10^8). Six
        digits; bounds are rounded outwards.
        """
        other = self.surface_of(level)
        distances = self.surface.between(other, samples=samples)
        scale = 1.0 / self.diagonal_m if self.diagonal_m > 0 else 0.0
        lower, upper, rms, p99 = (value * scale for value in distances)
        return {
            "error_max": rounded_up(upper),
            "error_max_lower": rounded_down(lower),
            "error_rms": rounded(rms),
            "error_p99": rounded(p99),
        }


def is_loose(errors: Mapping[str, float]) -> bool:
    """Whether error_max and error_max_lower differ so much that a warning is due."""
    low, high = errors["error_max_lower"], errors["error_max"]
    return high > low * (1.0 + MAX_BOUND_GAP) + 1.01 * RESOLUTION

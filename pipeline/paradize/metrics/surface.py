"""Two-sided distance between surfaces, as a fraction of the first one's bounding-box diagonal.

Measured by kernels of its own, which no stage imports. The largest distance is bounded from below and from
above, over every point of both surfaces (`reference/bound.hpp`); RMS and 99th percentile are of dense samples
in proportion to area, ten or more in every triangle, against every point of the other surface
(`reference/distance.hpp`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from paradize.data import Mesh, six, six_down, six_up
from paradize.kernels.reference import RESOLUTION, Surface

SAMPLES = 100_000
LOOSE = 0.02


def diagonal(mesh: Mesh) -> float:
    """Length of the bounding box's diagonal over the vertices that triangles use, metres, in float64."""
    used = mesh.positions[np.unique(mesh.triangles)].astype(np.float64)
    x, y, z = (float(side) for side in used.max(axis=0) - used.min(axis=0))
    return float(np.sqrt(x * x + y * y + z * z))


class Judge:
    """An original that levels are measured against: looked at once, asked often. The last level that was
    measured is kept, so that all metrics of it share one tree."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.surface = Surface(mesh.positions, mesh.triangles)  # refuses what is no surface
        self.diagonal_m = diagonal(mesh)
        self._last: tuple[Mesh, Surface] | None = None

    def surface_of(self, level: Mesh) -> Surface:
        """The level's triangles, ready to be measured."""
        if level is self.mesh:
            return self.surface
        if self._last is None or not (
            self._last[0].positions is level.positions and self._last[0].triangles is level.triangles
        ):
            self._last = (level, Surface(level.positions, level.triangles))
        return self._last[1]

    def distance(self, level: Mesh, samples: int = SAMPLES) -> dict[str, float]:
        """As surface_distance."""
        other = self.surface_of(level)
        found = self.surface.between(other, samples=samples)
        scale = 1.0 / self.diagonal_m if self.diagonal_m > 0 else 0.0
        least, most, rms, p99 = (value * scale for value in found)
        return {
            "error_max": six_up(most),
            "error_max_lower": six_down(least),
            "error_rms": six(rms),
            "error_p99": six(p99),
        }


def surface_distance(a: Mesh, b: Mesh, samples: int = SAMPLES) -> dict[str, float]:
    """error_max, error_max_lower, error_p99 and error_rms, each the larger of both directions, as fractions
    of a's diagonal.

    No point of either surface lies farther from the other than error_max, and one lies as far as
    error_max_lower: they are 0.1 % of it or 1e-7 apart, unless the kernel's limit of work ended the search
    before (is_loose: more than 2 %). samples: about how many each way for the other two (0 to 10^8). Rounded
    to six digits, bounds outwards, so that a value is the same wherever it is printed.
    """
    return Judge(a).distance(b, samples)


def is_loose(errors: Mapping[str, float]) -> bool:
    """Whether error_max and error_max_lower are so far apart that it must be told."""
    low, high = errors["error_max_lower"], errors["error_max"]
    return high > low * (1.0 + LOOSE) + 1.01 * RESOLUTION

"""Two-sided distance between surfaces, as a fraction of the first one's bounding-box diagonal.

Measured by its own kernel (`reference_distance.hpp`), which no stage imports: dense samples in proportion
to area, ten or more in every triangle, with all vertices and edge midpoints besides, against every point of
the other surface.
"""

from __future__ import annotations

import numpy as np

from paradize.data import Mesh
from paradize.kernels.reference import Surface

SAMPLES = 100_000


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
        there = self.surface.distance_to(other, samples=samples)
        back = other.distance_to(self.surface, samples=samples)
        scale = 1.0 / self.diagonal_m if self.diagonal_m > 0 else 0.0
        worst = [max(pair) * scale for pair in zip(there, back, strict=True)]
        return {
            key: float(f"{value:.6g}")
            for key, value in zip(("error_max", "error_rms", "error_p99"), worst, strict=True)
        }


def surface_distance(a: Mesh, b: Mesh, samples: int = SAMPLES) -> dict[str, float]:
    """error_max, error_p99 and error_rms, each the larger of both directions, as fractions of a's diagonal.

    samples: about how many each way (0 to 10^8). Rounded to six digits, so that a value is the same wherever
    it is printed.
    """
    return Judge(a).distance(b, samples)

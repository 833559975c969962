"""Two-sided distance between surfaces, as a fraction of the first one's bounding-box diagonal.

Measured by its own kernel (`reference_distance.hpp`), which no stage imports: dense samples in proportion
to area, ten or more in every triangle, with all vertices and edge midpoints besides, against every point of
the other surface.
"""

from __future__ import annotations

import numpy as np

from paradize.data import Mesh
from paradize.kernels.reference import one_sided_distance

SAMPLES = 100_000


def diagonal(mesh: Mesh) -> float:
    """Length of the bounding box's diagonal over the vertices that triangles use, metres, in float64."""
    used = mesh.positions[np.unique(mesh.triangles)].astype(np.float64)
    x, y, z = (float(side) for side in used.max(axis=0) - used.min(axis=0))
    return float(np.sqrt(x * x + y * y + z * z))


def surface_distance(a: Mesh, b: Mesh, samples: int = SAMPLES) -> dict[str, float]:
    """error_max, error_p99 and error_rms, each the larger of both directions, as fractions of a's diagonal.

    samples: about how many each way (0 to 10^8). Rounded to six digits, so that a value is the same wherever
    it is printed.
    """
    size = diagonal(a)
    there = one_sided_distance(a.positions, a.triangles, b.positions, b.triangles, samples=samples)
    back = one_sided_distance(b.positions, b.triangles, a.positions, a.triangles, samples=samples)
    scale = 1.0 / size if size > 0 else 0.0
    worst = [max(pair) * scale for pair in zip(there, back, strict=True)]
    return {
        key: float(f"{value:.6g}")
        for key, value in zip(("error_max", "error_rms", "error_p99"), worst, strict=True)
    }

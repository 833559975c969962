"""Python interface of the reference kernel of occlusion. Used by a metric; no stage imports it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import paradize.kernels.reference._reference as _reference
from paradize.kernels.threads import default_threads

F64 = npt.NDArray[np.float64]


def open_shares(
    points: F64,
    normals: F64,
    faces: F64,
    corners: F64,
    *,
    reach: float,
    cells: int = 128,
    threads: int | None = None,
) -> F64:
    """(k,) the share of the cosine-weighted light from above the faces that reaches points, by brute force.

    points, normals, faces: (k, 3), the latter unit. corners: (m, 3, 3), of the triangles that hold light
    back. reach: beyond it nothing does, above 0. cells: of directions across the hemisphere, 8 to 4096.
    """
    rows = [np.ascontiguousarray(values, np.float64).reshape(-1, 3) for values in (points, normals, faces)]
    flat = np.ascontiguousarray(corners, np.float64).reshape(-1, 9)
    if not all(np.isfinite(values).all() for values in (*rows, flat)) or len({len(r) for r in rows}) != 1:
        raise ValueError("points, normals and faces differ in number, or are not finite")
    if not 8 <= cells <= 4096 or not reach > 0.0:
        raise ValueError(f"{cells} cells, reach {reach}")
    workers = default_threads(8) if threads is None else max(1, threads)
    out: F64 = _reference.open_shares(*rows, flat, min(reach, 1e300), cells, workers)
    return out

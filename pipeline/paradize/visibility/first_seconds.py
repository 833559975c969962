"""When each mip of a texture is first needed: for each run of the flight a lower bound of the texels that a
pixel covers, from boxes of triangles. All bounds are lower bounds, so no second is too late."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from paradize.visibility.finest_mip import SLACK, Placement, Surface, sphere_around, split_triangles
from paradize.visibility.query import Sphere, VisibilityQuery
from paradize.visibility.texel_footprint import Views

F64 = npt.NDArray[np.float64]
Seconds = list[float | None]  # of each level, the finest first; None: never during the flight
_BOXES = 32  # of all placements of a surface together; more make the seconds later, but bakes slower


def texels_by_run(views: Views, surface: Surface, places: Sequence[Placement], spread: float = 0.0) -> F64:
    """(runs,) the fewest texels of level 0 that a pixel covers; infinite where no view shows the surface.
    spread: as for finest_mip.finest."""
    query = views.query
    least = np.full(len(query.start_s), np.inf)
    boxes = [(surface.corners, surface.density)] if len(surface.corners) else []
    while boxes and len(boxes) * len(places) < _BOXES and len(boxes[0][0]) > 1:
        corners, density = boxes.pop(0)
        boxes += [(part, density[rows]) for part, rows in split_triangles(corners)]
    for corners, density in boxes:
        middle, radius_m = sphere_around(corners)
        for place in places:
            sphere = Sphere(place.at([float(value) for value in middle]), radius_m * place.scale)
            for covered in views.covered(sphere, query.runs).values():
                seen = covered < np.inf
                texels = np.where(seen, covered, 0.0) * (float(density.min()) / place.scale) - spread
                np.minimum(least, np.maximum(texels, 0.0), out=least, where=seen)
    return least


def mip_seconds(query: VisibilityQuery, texels: F64, levels: int) -> Seconds:
    """From when on each mip, or a finer one, is sampled. texels: from texels_by_run. The coarsest of `levels`
    mips is needed as soon as anything is seen."""
    bounds = [SLACK * float(2 << level) for level in range(levels - 1)] + [np.inf]
    return [first_second(query, texels < bound) for bound in bounds]


def first_second(query: VisibilityQuery, needed: npt.NDArray[np.bool_]) -> float | None:
    """The start of the first run of the flight in which something is needed. needed: (runs,) bool."""
    runs = np.flatnonzero(needed & (query.start_s < query.duration_s))
    return float(query.start_s[runs[0]]) if len(runs) else None

"""Where the picture of a map lies on texture coordinates that another map of the material decides.

A material's maps share its texture coordinates, first or second ones. A map that lies elsewhere can be drawn
anew for them (build/materials/placed_pictures.py) where the coordinates show a whole number of its tiles
beside each other, so that the new picture repeats as they do, or where they stay inside one tile.
"""

from __future__ import annotations

from math import floor

from paradize.material import REPEATED, Placed, Wrap

Bounds = tuple[float, float, float, float]  # the least and the largest texture coordinates: u, v, u, v
_SAME = 1e-6  # of a tile: scales
_INSIDE = 1e-4  # of a tile: coordinates
_MOST = 64.0  # tiles of the map in one of the coordinates


def placed_on(
    scale: tuple[float, float],
    offset: tuple[float, float],
    bounds: Bounds | None,
    wraps: tuple[tuple[Wrap, Wrap], tuple[Wrap, Wrap]],
) -> Placed | None:
    """How a map is drawn anew; None where it cannot be. scale, offset: the map's own coordinates are scale *
    t + offset of the material's t, along u and v. bounds: of t; None: they may repeat. wraps: of the map, and
    of the material's samplers."""
    found: list[tuple[float, float]] = []
    for axis in (0, 1):
        tiles, moved = scale[axis], offset[axis]
        if not 0.0 < abs(tiles) <= _MOST:
            return None
        whole = float(round(tiles))
        repeats = all(wrap[axis] == REPEATED[axis] for wrap in wraps)
        if whole and repeats and abs(tiles - whole) <= _SAME * abs(tiles):
            found.append((whole, moved - floor(moved)))
            continue
        if bounds is None:
            return None
        first = floor(bounds[axis] + _INSIDE)
        if bounds[axis + 2] > first + 1.0 + _INSIDE:
            return None
        found.append((tiles, moved + tiles * first))
    return found[0], found[1]

"""Floors that a model brings along: parts near its foot that face up, which the ground would hide."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from paradize.data import Mesh

_SHARE = 0.05  # of the ground that the model covers: what faces up on less is a rim or a crease, no floor


def least_floor(mesh: Mesh) -> float | None:
    """Returns how far above a mesh's lowest point its lowest floor lies; None where nothing faces up.

    Triangles that face up are taken from the lowest on, until they cover 5 % of the box seen from above."""
    places = mesh.absolute_positions.astype(np.float64)
    low, high = places.min(axis=0), places.max(axis=0)
    a, b, c = (places[mesh.triangles[:, k]] for k in range(3))
    covered = 0.5 * np.cross(b - a, c - a)[:, 1]
    tops = np.maximum(np.maximum(a[:, 1], b[:, 1]), c[:, 1]) - low[1]
    up = np.flatnonzero(covered > 0.0)
    up = up[np.argsort(tops[up], kind="stable")]
    enough = np.cumsum(covered[up]) >= _SHARE * (high[0] - low[0]) * (high[2] - low[2])
    return float(tops[up[np.argmax(enough)]]) if enough.any() else None

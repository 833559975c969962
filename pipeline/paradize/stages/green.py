"""Guesses whether the green of a normal map points up or down, from the normals alone.

The slopes of a height field are integrable: the slope along x changes along y as much as the slope along y
changes along x. Source: R. Frankot and R. Chellappa, "A Method for Enforcing Integrability in Shape from
Shading Algorithms", 1988. Read with the wrong sign of green one of the two changes sign, so that their
correlation is near 1 for green up and near -1 for green down.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]

_TILE = 128  # texels; the map is judged by tiles
_TILES = 12  # along each side at most
_SCALES = (1, 2, 4)  # texels that are averaged first: noise of 8 bits and of JPEG averages out
_STEEPEST = 8.0  # slopes are held to this
_SURE = 0.3  # the least correlation of a map that is sure
_AGREE = 0.75  # the least share of the twist, by tiles, that agrees with the whole
_FLAT = 1e-6  # the least mean square of what is correlated: less is rounding


def guess_green(normals: F32) -> Literal["up", "down"] | None:
    """Whether green points up or down in normals (h, w, 3) that were decoded as if it points up; None where
    the map does not say so surely: it is flat, has slopes along one direction only, or does not come from
    heights."""
    found = [_correlations(normals, scale) for scale in _SCALES]
    best = max(found, key=lambda correlations: abs(_whole(correlations)))
    whole = _whole(best)
    twist = np.abs(best[:, 0])
    agree = float(twist[np.sign(best[:, 0]) == np.sign(whole)].sum())
    if abs(whole) < _SURE or agree < _AGREE * float(twist.sum()):
        return None
    return "up" if whole > 0.0 else "down"


def _whole(tiles: F64) -> float:
    both, along, across = tiles.sum(axis=0)
    texels = np.sqrt(along * across)
    return float(both / texels) if texels > 0.0 else 0.0


def _correlations(normals: F32, scale: int) -> F64:
    """The sums (n, 3) of each tile: of the products of both changes, and of their squares."""
    out = []
    for top, left in product(_starts(normals.shape[0]), _starts(normals.shape[1])):
        x, y, z = np.moveaxis(normals[top : top + _TILE, left : left + _TILE].astype(np.float64), 2, 0)
        steep = np.maximum(z, 1.0 / _STEEPEST)
        along, down = (_averaged(np.clip(v / steep, -_STEEPEST, _STEEPEST), scale) for v in (-x, y))
        if min(along.shape) < 3:
            continue
        one = along[2:, 1:-1] - along[:-2, 1:-1]
        two = down[1:-1, 2:] - down[1:-1, :-2]
        sums = [float((a * b).sum()) for a, b in ((one, two), (one, one), (two, two))]
        out.append(sums if min(sums[1:]) > _FLAT * one.size else [0.0, *sums[1:]])
    return np.array(out or [[0.0, 0.0, 0.0]])


def _starts(size: int) -> list[int]:
    """Where tiles begin: evenly over the side, none over another."""
    count = min(_TILES, max(1, size // _TILE))
    return [k * size // count for k in range(count)]


def _averaged(plane: F64, scale: int) -> F64:
    rows, columns = (size // scale * scale for size in plane.shape)
    blocks = plane[:rows, :columns].reshape(rows // scale, scale, columns // scale, scale)
    return np.asarray(blocks.mean(axis=(1, 3)))

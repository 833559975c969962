"""The texels of a picture whose centres triangles cover: what is judged on all of them, not on samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh
from paradize.kernels import maps
from paradize.material import Wrap

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
PLAIN = 1.0 / 32.0  # of the range: a triangle whose colours differ by less shows one swatch
BEND = 3.5 / 255.0  # a texel that differs by less from the line between its neighbours is part of a gradient
_ROUNDING = 1e-4  # of a tile
_ROUNDS = 8  # after so many in which triangles show more than samples say, nothing is known
_AT_ONCE = 1 << 18  # texels


def owners_of(
    mesh: Mesh, shape: Sequence[int], wrap: tuple[Wrap, Wrap], chosen: npt.NDArray[np.int64] | None = None
) -> npt.NDArray[np.int32] | None:
    """Returns of each texel of a picture (rows, columns) the first of the chosen triangles (None: of all)
    that covers its centre, by its place among them; -1: none. None where that cannot be said: the UVs leave
    a picture that does not repeat, or repeat it too often."""
    triangles = mesh.triangles if chosen is None else mesh.triangles[chosen]
    if mesh.uvs is None or not len(triangles):
        return np.full(tuple(shape[:2]), -1, np.int32)
    used = mesh.uvs[triangles]
    for axis, way in enumerate(wrap):
        beyond = max(-float(used[..., axis].min()), float(used[..., axis].max()) - 1.0)
        if way != "repeat" and beyond > _ROUNDING:
            return None
    ids = np.arange(len(triangles), dtype=np.int32)
    rows, columns = shape[:2]
    try:
        return maps.rasterise(mesh.uvs, triangles, ids, height=rows, width=columns, touched=False)
    except ValueError:  # the UVs repeat too often
        return None


def centres(owners: npt.NDArray[np.int32]) -> Iterator[F64]:
    """The texture coordinates (n, 2) of the centres of all texels that have an owner, in parts."""
    rows, columns = owners.shape
    inside = np.flatnonzero(owners >= 0)
    for first in range(0, len(inside), _AT_ONCE):
        y, x = np.divmod(inside[first : first + _AT_ONCE], columns)
        yield np.stack([(x + 0.5) / columns, (y + 0.5) / rows], axis=1)


def without_drawn(
    mesh: Mesh,
    colors: F32,
    wrap: tuple[Wrap, Wrap],
    claimed: npt.NDArray[np.bool_],
    area: F64,
    enough: float,
) -> npt.NDArray[np.bool_]:
    """Returns which of the claimed triangles show a swatch or a gradient on all their texels. Those that hide
    each other are looked at in turn, until less than `enough` of the area is left. colors: (h, w, 3)."""
    kept = claimed.copy()
    for _ in range(_ROUNDS):
        if area[kept].sum() < enough:
            return kept
        chosen = np.flatnonzero(kept)
        owners = owners_of(mesh, colors.shape, wrap, chosen)
        if owners is None:
            break
        bad = _drawn(colors, owners, len(chosen))
        if not bad.any():
            return kept
        kept[chosen[bad]] = False
    return np.zeros_like(claimed)


def _drawn(colors: F32, owners: npt.NDArray[np.int32], count: int) -> npt.NDArray[np.bool_]:
    """Which of `count` triangles show neither a swatch nor a smooth gradient on the texels that they own."""
    inside = np.flatnonzero(owners >= 0)
    owner = owners.reshape(-1)[inside]
    y, x = (part.astype(np.float64) for part in np.divmod(inside, owners.shape[1]))
    number = np.maximum(np.bincount(owner, minlength=count), 1)

    def total(values: npt.NDArray[np.generic]) -> F64:
        return np.asarray(np.bincount(owner, weights=values, minlength=count), np.float64)

    x -= (total(x) / number)[owner]
    y -= (total(y) / number)[owner]
    xx, xy, yy = total(x * x), total(x * y), total(y * y)
    little = 1e-6 * (xx + yy) + 1e-12  # texels in one line have a slope along it alone
    xx, yy = xx + little, yy + little
    per = xx * yy - xy * xy
    spread, off = np.zeros(count), np.zeros(count)
    for channel in range(colors.shape[2]):
        value = colors[:, :, channel].reshape(-1)[inside].astype(np.float64)
        low, high = np.full(count, np.inf), np.full(count, -np.inf)
        np.minimum.at(low, owner, value)
        np.maximum.at(high, owner, value)
        spread = np.maximum(spread, high - low)
        value -= (total(value) / number)[owner]
        along, down = total(x * value), total(y * value)
        slope_x, slope_y = (yy * along - xy * down) / per, (xx * down - xy * along) / per
        np.maximum.at(off, owner, np.abs(value - slope_x[owner] * x - slope_y[owner] * y))
    bend = np.zeros(count)
    for values, own in ((colors, owners), (colors.swapaxes(0, 1), owners.T)):
        within = (own[1:-1] >= 0) & (own[1:-1] == own[:-2]) & (own[1:-1] == own[2:])
        away = np.abs(values[:-2] + values[2:] - 2.0 * values[1:-1]).max(axis=2)
        np.maximum.at(bend, own[1:-1][within], away[within])
    return np.asarray((spread > PLAIN) & ((off > PLAIN) | (bend > BEND)))

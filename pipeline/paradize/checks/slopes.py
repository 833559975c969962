"""Whether a normal map and a height map are of one source, from the two maps alone.

For any strength and filter, slopes of one source correlate: by 0.6 and more over areas of one, two or four
texels; slopes of two sources by about 0. Gutters are an exception. A texel outside a UV island is a copy of
the nearest texel inside, so heights step where two gutters meet, and the copied normals there do not show the
step. Such steps are left out. If little else is steep (a palette of flat colours), the maps prove nothing.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

TOGETHER = 0.3  # correlation of slopes below which two maps are not of one source
_CODE = 1.0 / 255.0
_FLAT = 2.0 * _CODE  # of the range, from one area to the next: less may be rounding of the height map
_FEW = 32  # areas: fewer prove nothing
_STEP = 4.0 * _CODE  # of the range: the least height of a step
_ALONE = 3.0  # a step is this many times as high as any within two texels beside it
_AWAY = 3  # texels from a step to where a filter no longer sees it
_ANSWER = (
    0.02,
    0.3,
)  # a step that a filter saw changes slopes by this much, and by this share of their range


def agreement(heights: F32, slopes: F64, green_up: bool) -> float | None:
    """The correlation of the slopes of normals, (h, w, 2), along x and up, with those of heights (h, w, 1):
    the largest over areas of three sizes. None if too few areas slope. green_up: whether the second slope is
    known to point up; else it may point down."""
    values = heights.astype(np.float64)
    whole = _largest(values, slopes, green_up, None)
    if whole is None or whole >= TOGETHER:
        return whole
    return _largest(values, slopes, green_up, _between_gutters(heights[:, :, 0], slopes))


def _largest(heights: F64, slopes: F64, green_up: bool, skipped: Mask | None) -> float | None:
    values = [_correlation(heights, slopes, texels, green_up, skipped) for texels in (1, 2, 4)]
    return max((value for value in values if value is not None), default=None)


def _correlation(
    heights: F64, slopes: F64, texels: int, green_up: bool, skipped: Mask | None
) -> float | None:
    """The correlation over steep areas of `texels` x `texels`. None if there are too few, or fewer than those
    that touch a skipped texel."""
    if min(heights.shape[:2]) < 8 * texels:
        return None
    means, lean = (_areas(values, texels) for values in (heights, slopes))
    across = 0.5 * (means[1:-1, 2:] - means[1:-1, :-2])
    up = 0.5 * (means[:-2, 1:-1] - means[2:, 1:-1])
    wanted, lean = np.dstack([across, up]), lean[1:-1, 1:-1]
    steep = (across * across + up * up)[:, :, 0] > _FLAT * _FLAT
    least = _FEW
    if skipped is not None:
        near = _with_neighbours(_areas(skipped[:, :, None].astype(np.float64), texels)[:, :, 0] > 0)
        least = max(_FEW, int((steep & near[1:-1, 1:-1]).sum()))
        steep &= ~near[1:-1, 1:-1]
    wanted, lean = wanted[steep], lean[steep]
    size = float(np.sqrt(np.square(wanted).sum() * np.square(lean).sum()))
    if len(wanted) < least or size == 0.0:
        return None
    along, upward = (wanted * lean).sum(axis=0).tolist()
    return float(along + (upward if green_up else abs(upward))) / size


def _areas(values: F64, texels: int) -> F64:
    """Means over squares of `texels` x `texels`; a rest at the right and below is left out."""
    rows, columns = (size // texels for size in values.shape[:2])
    cut = values[: rows * texels, : columns * texels]
    return np.asarray(cut.reshape(rows, texels, columns, texels, -1).mean(axis=(1, 3)))


def _with_neighbours(areas: Mask) -> Mask:
    grown = areas.copy()
    grown[1:] |= areas[:-1]
    grown[:-1] |= areas[1:]
    grown[:, 1:] |= areas[:, :-1]
    grown[:, :-1] |= areas[:, 1:]
    return grown


def _between_gutters(heights: F32, slopes: F64) -> Mask:
    """The texels (h, w) on both sides of a step of the heights that the normals do not show."""
    lean = slopes.astype(np.float32)
    return _unseen_steps(heights, lean[:, :, 0]) | _unseen_steps(heights.T, lean[:, :, 1].T).T


def _unseen_steps(heights: F32, lean: F32) -> Mask:
    """The texels on both sides of a step along the rows that the normals (lean, (h, w)) do not show. A step
    stands alone: heights beside it hardly change. The slopes of a filter peak
    at a step; copied normals are the same at the step as beside it."""
    steps_found = np.zeros(heights.shape, np.bool_)
    edges = heights.shape[1] - 1
    if edges < 2 * _AWAY:
        return steps_found
    steps = np.abs(np.diff(heights, axis=1))
    beside = np.zeros_like(steps)
    for off in (1, 2):
        beside[:, off:] = np.maximum(beside[:, off:], steps[:, :-off])
        beside[:, :-off] = np.maximum(beside[:, :-off], steps[:, off:])
    alone = (steps > _STEP) & (steps > _ALONE * beside)
    padded = np.pad(lean, ((0, 0), (_AWAY, _AWAY)), mode="edge")
    around = [
        padded[:, k : k + edges] for k in range(2 * _AWAY + 2)
    ]  # the step lies between _AWAY and the next
    low, high = around[0].copy(), around[0].copy()
    for values in around[1:]:
        np.minimum(low, values, out=low)
        np.maximum(high, values, out=high)
    before, after = (np.abs(around[_AWAY + k] - around[k * (2 * _AWAY + 1)]) for k in (0, 1))
    least, share = _ANSWER
    alone &= np.maximum(before, after) < np.maximum(np.float32(least), np.float32(share) * (high - low))
    steps_found[:, :-1] |= alone
    steps_found[:, 1:] |= alone
    return steps_found

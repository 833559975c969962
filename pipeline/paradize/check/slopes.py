"""Whether a normal map leans where its height map slopes, told from the two maps alone.

Whatever the strength and the filter were, slopes of one source go together: their correlation is 0.6 and more
over areas of one, two or four texels; of two sources it is about 0. One thing in a sound pair does not go
together: a gutter. Every texel outside a UV island is a copy of the nearest inside, so heights step where two
gutters meet, and the normals there, copies as well, know nothing of the step. Such steps are left out. Where
little else is steep (a palette: flat swatches, and gutters round them), the maps prove nothing.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

TOGETHER = 0.3  # correlation of slopes below which two maps are not of one source
_CODE = 1.0 / 255.0
_FLAT = 2.0 * _CODE  # of the range, from one area to the next: less may be the codes of the height map
_FEW = 32  # areas
_STEP = 4.0 * _CODE  # of the range: less is no step
_ALONE = 3.0  # a step is so many times as high as what lies two texels to either side of it
_AWAY = 3  # texels from a step to where normals know nothing of it
_ANSWER = (0.02, 0.3)  # slopes that a step changes: by so much, and by this share of their range around it


def agreement(heights: F32, slopes: F64, green_up: bool) -> float | None:
    """The correlation of the slopes that normals show, (h, w, 2), along x and up, with those of heights
    (h, w, 1): the largest over areas of three sizes. None where too little slopes to tell. green_up: whether
    the second slope points up for certain; else it may point down as well."""
    values = heights.astype(np.float64)
    whole = _largest(values, slopes, green_up, None)
    if whole is None or whole >= TOGETHER:
        return whole
    return _largest(values, slopes, green_up, _between_gutters(heights[:, :, 0], slopes))


def _largest(heights: F64, slopes: F64, green_up: bool, skipped: Mask | None) -> float | None:
    told = [_together(heights, slopes, texels, green_up, skipped) for texels in (1, 2, 4)]
    return max((value for value in told if value is not None), default=None)


def _together(heights: F64, slopes: F64, texels: int, green_up: bool, skipped: Mask | None) -> float | None:
    """The correlation over areas of so many texels along each side that slope by more than a code. None where
    there are too few, or fewer than those that touch a skipped texel."""
    if min(heights.shape[:2]) < 8 * texels:
        return None
    means, lean = (_areas(values, texels) for values in (heights, slopes))
    across = 0.5 * (means[1:-1, 2:] - means[1:-1, :-2])
    up = 0.5 * (means[:-2, 1:-1] - means[2:, 1:-1])
    wanted, lean = np.dstack([across, up]), lean[1:-1, 1:-1]
    steep = np.square(wanted).sum(axis=2) > _FLAT * _FLAT
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
    """Means over squares of so many texels; what is left over at the right and below is not counted."""
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
    """The texels (h, w) on both sides of a step of the heights to which no normal answers."""
    lean = slopes.astype(np.float32)
    return _unanswered(heights, lean[:, :, 0]) | _unanswered(heights.T, lean[:, :, 1].T).T


def _unanswered(heights: F32, lean: F32) -> Mask:
    """The same along rows. A step stands alone: heights beside it hardly change. A filter's slopes peak at
    a step of its heights; copies of normals from elsewhere are beside the step what they are away from it."""
    found = np.zeros(heights.shape, np.bool_)
    edges = heights.shape[1] - 1
    if edges < 2 * _AWAY:
        return found
    steps = np.abs(np.diff(heights, axis=1))
    beside = np.zeros_like(steps)
    for off in (1, 2):
        beside[:, off:] = np.maximum(beside[:, off:], steps[:, :-off])
        beside[:, :-off] = np.maximum(beside[:, :-off], steps[:, off:])
    alone = (steps > _STEP) & (steps > _ALONE * beside)
    padded = np.pad(lean, ((0, 0), (_AWAY, _AWAY)), mode="edge")
    around = [
        padded[:, k : k + edges] for k in range(2 * _AWAY + 2)
    ]  # the step is between _AWAY and the next
    low, high = around[0].copy(), around[0].copy()
    for values in around[1:]:
        np.minimum(low, values, out=low)
        np.maximum(high, values, out=high)
    before, after = (np.abs(around[_AWAY + k] - around[k * (2 * _AWAY + 1)]) for k in (0, 1))
    least, share = _ANSWER
    alone &= np.maximum(before, after) < np.maximum(np.float32(least), np.float32(share) * (high - low))
    found[:, :-1] |= alone
    found[:, 1:] |= alone
    return found

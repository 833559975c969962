"""Pixels without a height: values that can be none although no file says so, and what surrounds a hole.

Filling: a pyramid of means gives each hole its coarse shape, and at every level its pixels relax towards the
mean of their four neighbours (a membrane). Sums in a fixed order: the same bits on every CPU.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

# What programs write for "no data", besides numbers near the largest of float32.
_MARKERS = (-999.0, -9999.0, -99999.0, -999999.0, -32767.0, -32768.0, 1e20, -1e20, 9.969209968386869e36)
_NEAR_LARGEST = 3.4e38
_APART = 0.1  # how far a marker lies outside the heights, of their span
_FAR_APART = 10.0  # the same of a number that is no marker
_ALONE = 0.5  # how far a pixel that may be none lies from all others, of their span, where it is the only one
_TOGETHER = 0.25  # the same where two pixels or more hold the number
_STEPS = 4.0  # and of the widest gap between others, so that the lowest of some terraces is none of them
_FEW = 64  # pixels: of fewer, the span of the others says little
_HIGHEST_M = 9000.0  # nothing on Earth's land is farther from 0
_BAND = 256
_ROUNDS = 24


def suspects(
    values: npt.NDArray[Any], known: Sequence[Any], *, metres: bool
) -> tuple[list[float], float | None]:
    """Numbers of a field (h, w) that are no heights though nobody says so; and one that may be none.

    known: numbers that are no data already; they and what is not finite do not count. metres: floats or
    signed integers; among codes (False) none is sure.

    No height, so that it may be filled, is a number at the lower or upper end of the field that is
    - a marker (-999, -9999, -99999, -999999, -32767, -32768, 1e20, the netCDF fill, beyond 3.4e38) and at
      least a tenth of the span of all heights outside of them; or
    - held by two pixels or more, beyond 9,000 m, and ten times the span of all others away from them.
    So a real height is taken for a hole only where it equals a marker exactly with nothing near it (the one
    deepest pixel of a chart at -9999.0), and a marker stays where depths around it are real. One that may be
    none, to be told and not filled, is an end that is farther from all others than half of their span (a
    quarter, where two pixels or more hold it) and than four times the widest gap between them: 0 where all
    else is 400 to 800, but also a real plain under a plateau. Fields of fewer than 64 pixels have none.
    """
    ends = _ends(values, known)
    marks: list[float] = []
    while metres and ends and (found := [end for end in set(ends) if _is_marker(end)]):
        marks += found
        ends = _ends(values, [*known, *marks])
    if ends is None:  # nothing but markers
        return [], None
    low, high = ends
    sure = sorted(mark for mark in marks if max(low - mark, mark - high) >= _APART * (high - low))
    without = [*known, *marks]
    rows = values[:: max(1, len(values) // 64)]
    some = _ends(rows, [*without, low, high])
    if some is None or max(some[0] - low, high - some[1]) <= _TOGETHER * (some[1] - some[0]):
        return sure, None  # the whole's ends are no farther from all others, and these no closer together
    inner = _ends(values, [*without, low, high])
    if inner is None or inner[0] == inner[1]:
        return sure, None
    span = inner[1] - inner[0]
    gaps = [
        (end, gap) for end, gap in ((low, inner[0] - low), (high, high - inner[1])) if gap > _TOGETHER * span
    ]
    step = _widest(rows, [*without, low, high]) if gaps else 0.0
    maybe = None
    for end, gap in gaps:
        alone = _count(values, end) < 2
        if gap <= max(_STEPS * step, _ALONE * span if alone else 0.0):
            continue
        if metres and not alone and gap > _FAR_APART * span and abs(end) > _HIGHEST_M:
            sure.append(end)
        elif values.size >= _FEW:
            maybe = end
    return sure, maybe


def _is_marker(value: float) -> bool:
    return abs(value) >= _NEAR_LARGEST or any(value == float(np.float32(mark)) for mark in _MARKERS)


def _bands(values: npt.NDArray[Any]) -> list[npt.NDArray[Any]]:
    return [values[row : row + _BAND] for row in range(0, len(values), _BAND)]


def _ends(values: npt.NDArray[Any], without: Sequence[Any]) -> tuple[float, float] | None:
    """The least and the largest finite number, some left out; None where there is no other."""
    ends = []
    for band in _bands(values):
        part = band
        if without or band.dtype.kind == "f":
            keep = np.isfinite(band)
            for number in without:
                keep &= band != band.dtype.type(number)
            part = band[keep]
        if part.size:
            ends += [float(part.min()), float(part.max())]
    return (min(ends), max(ends)) if ends else None


def _widest(values: npt.NDArray[Any], without: Sequence[Any]) -> float:
    """The widest gap between neighbours among the numbers of some rows, some left out."""
    known = np.unique(values[np.isfinite(values)]).astype(np.float64)
    return float(np.diff(known[~np.isin(known, np.asarray(without, np.float64))]).max(initial=0.0))


def _count(values: npt.NDArray[Any], number: float) -> int:
    return sum(int(np.count_nonzero(band == band.dtype.type(number))) for band in _bands(values))


def fill_nodata(heights: npt.NDArray[np.float64], known: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
    """The heights (h, w) with every pixel that is not `known` (h, w) put on a membrane through its
    surroundings. At least one pixel must be known; known pixels stay as they are."""
    if known.all():
        return heights
    rows, columns = heights.shape
    padded = np.zeros((rows + rows % 2, columns + columns % 2))
    weight = np.zeros(padded.shape)
    padded[:rows, :columns] = np.where(known, heights, 0.0)
    weight[:rows, :columns] = known
    total, count = (
        ((a[0::2, 0::2] + a[0::2, 1::2]) + a[1::2, 0::2]) + a[1::2, 1::2] for a in (padded, weight)
    )
    coarse = fill_nodata(total / np.maximum(count, 1.0), count > 0.0)
    filled = np.where(known, heights, np.repeat(np.repeat(coarse, 2, axis=0), 2, axis=1)[:rows, :columns])
    row, column = np.nonzero(~known)
    up, down = np.maximum(row - 1, 0), np.minimum(row + 1, rows - 1)
    left, right = np.maximum(column - 1, 0), np.minimum(column + 1, columns - 1)
    for _ in range(_ROUNDS):
        mean = filled[up, column] + filled[down, column] + filled[row, left] + filled[row, right]
        filled[row, column] = 0.25 * mean
    return filled

"""Detects values that mean "no height" although the file does not say so, and fills holes.

Filling: a pyramid of means gives each hole its coarse shape; at every level its pixels relax towards the mean
of their four neighbours (a membrane). Sums are taken in a fixed order, so the bits are the same on all CPUs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

# Numbers that programs write for "no data", besides those near float32's maximum.
_MARKERS = (-999.0, -9999.0, -99999.0, -999999.0, -32767.0, -32768.0, 1e20, -1e20, 9.969209968386869e36)
_NEAR_LARGEST = 3.4e38
_MARKER_MARGIN = 0.1  # distance of a marker from the range of heights, as a share of that range
_OUTLIER_MARGIN = 10.0  # the same for other numbers
_SINGLE_MARGIN = 0.5  # the same for a doubtful number in one pixel
_REPEATED_MARGIN = 0.25  # the same for a doubtful number in two pixels or more
_GAP_FACTOR = 4.0  # and as a multiple of the widest gap between others, to keep the lowest of terraces
_MIN_PIXELS = 64  # the range of fewer pixels says little
_HIGHEST_M = 9000.0  # no land on Earth is farther from 0
_BAND = 256
_ITERATIONS = 24


def suspects(
    values: npt.NDArray[Any], known: Sequence[Any], *, metres: bool
) -> tuple[list[float], float | None]:
    """Finds numbers of a field (h, w) that are not heights although no one says so, and one doubtful number
    or None.

    known: numbers that are no data already; they and non-finite values are ignored. metres: floats or signed
    integers; with unsigned integers (False) no number is certain.

    A number is not a height, and may be filled, if it is the smallest or largest of the field and
    - a marker (-999, -9999, -99999, -999999, -32767, -32768, 1e20, the netCDF fill, beyond 3.4e38), at least
      a tenth of the range of all heights away from them; or
    - held by two pixels or more, beyond 9,000 m, and ten times the range of all others away from them.
    So a real height is taken for a hole only if it equals a marker exactly and nothing is near it (the one
    deepest pixel of a chart at -9999.0). A marker is kept where real depths surround it. Where all pixels are
    markers, none is a height.

    A number is doubtful (reported, not filled) if it is the smallest or largest and farther from all others
    than half of their range (a quarter, where two pixels or more hold it) and than four times the widest gap
    between them: 0 where all others are 400 to 800, but also a real plain below a plateau. Fields of fewer
    than 64 pixels have no doubtful numbers.
    """
    low_high = finite_range(values, known)
    markers: list[float] = []
    while metres and low_high and (new_markers := [value for value in set(low_high) if _is_marker(value)]):
        markers += new_markers
        low_high = finite_range(values, [*known, *markers])
    if low_high is None:  # only markers, or nothing
        return sorted(markers), None
    low, high = low_high
    certain = sorted(
        mark for mark in markers if max(low - mark, mark - high) >= _MARKER_MARGIN * (high - low)
    )
    excluded = [*known, *markers]
    rows = values[:: max(1, len(values) // 64)]
    sample = finite_range(rows, [*excluded, low, high])
    margin = 0.0 if sample is None else _REPEATED_MARGIN * (sample[1] - sample[0])
    if sample is None or max(sample[0] - low, high - sample[1]) <= margin:
        return certain, None  # the other heights of the whole field span at least as much
    inner = finite_range(values, [*excluded, low, high])
    if inner is None or inner[0] == inner[1]:
        return certain, None
    span = inner[1] - inner[0]
    gaps = [
        (value, gap)
        for value, gap in ((low, inner[0] - low), (high, high - inner[1]))
        if gap > _REPEATED_MARGIN * span
    ]
    step = _widest_gap(rows, [*excluded, low, high]) if gaps else 0.0
    doubtful = None
    for value, gap in gaps:
        single = _count(values, value) < 2
        if gap <= max(_GAP_FACTOR * step, _SINGLE_MARGIN * span if single else 0.0):
            continue
        if metres and not single and gap > _OUTLIER_MARGIN * span and abs(value) > _HIGHEST_M:
            certain.append(value)
        elif values.size >= _MIN_PIXELS:
            doubtful = value
    return certain, doubtful


def _is_marker(value: float) -> bool:
    return abs(value) >= _NEAR_LARGEST or any(value == float(np.float32(mark)) for mark in _MARKERS)


def _bands(values: npt.NDArray[Any]) -> list[npt.NDArray[Any]]:
    return [values[row : row + _BAND] for row in range(0, len(values), _BAND)]


def finite_range(values: npt.NDArray[Any], excluded: Sequence[Any]) -> tuple[float, float] | None:
    """The smallest and largest finite number without the excluded ones; None where there is none."""
    extremes = []
    for band in _bands(values):
        kept = band
        if excluded or band.dtype.kind == "f":
            keep = np.isfinite(band)
            for number in excluded:
                keep &= band != band.dtype.type(number)
            kept = band[keep]
        if kept.size:
            extremes += [float(kept.min()), float(kept.max())]
    return (min(extremes), max(extremes)) if extremes else None


def _widest_gap(values: npt.NDArray[Any], excluded: Sequence[Any]) -> float:
    """The widest gap between neighbouring numbers, without the excluded ones."""
    numbers = np.unique(values[np.isfinite(values)]).astype(np.float64)
    return float(np.diff(numbers[~np.isin(numbers, np.asarray(excluded, np.float64))]).max(initial=0.0))


def _count(values: npt.NDArray[Any], number: float) -> int:
    return sum(int(np.count_nonzero(band == band.dtype.type(number))) for band in _bands(values))


def fill_nodata(heights: npt.NDArray[np.float64], known: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
    """Fills every pixel that is not `known` with a membrane through its surroundings.

    heights: (h, w) float64. known: (h, w) bool, at least one True; known pixels are unchanged.
    """
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
    hole = np.flatnonzero(~known)
    row, column = np.divmod(hole, columns)
    up, down = hole - columns * (row > 0), hole + columns * (row < rows - 1)
    left, right = hole - (column > 0), hole + (column < columns - 1)
    flat = filled.reshape(-1)
    for _ in range(_ITERATIONS):
        flat[hole] = 0.25 * (flat[up] + flat[down] + flat[left] + flat[right])
    return filled

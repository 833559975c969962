"""Tangent-space normals of a height map, green up.

Tiers: fast uses the central difference; balanced the filter that stages/filters.py predicts to err least on
the map; exact, of float heights, the eighth-order difference. Of 8- and 16-bit heights exact uses the slopes
of balanced, limited to the range that the rounding of the source leaves around the eighth-order slopes. A
user may name any filter instead.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.kernels import normals
from paradize.stages.filters import REFERENCE_FILTER, taps_of

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import HeightMap

    F32 = npt.NDArray[np.float32]


def normal_rows(height_map: HeightMap, first: int, last: int, *, threads: int = 1) -> F32:
    """Returns unit normals (n, w, 3) float32 of the rows first..last; exactly (0, 0, 1) where the map is
    flat.

    One thread by default, because callers run bands of rows in parallel. Raises SourceError for a height that
    is not finite, BakeError for an unknown filter.
    """
    # The slopes of the reference filter need no limits.
    if height_map.clamp_slopes and height_map.filter_name != REFERENCE_FILTER:
        dx, dy = _limited_slopes(height_map, first, last)
        return normals.normals_from_slopes(
            dx, dy, scale=height_map.slope_scale, green_down=height_map.green_down, threads=threads
        )
    taps = taps_of(height_map.filter_name)
    return normals.normals_from_heights(
        height_map.heights,
        derivative=taps.derivative,
        smooth=taps.smooth,
        scale=height_map.slope_scale,
        wrap=height_map.wrap,
        green_down=height_map.green_down,
        islands=height_map.islands,
        rows=(first, last),
        threads=threads,
    )


def _slopes(height_map: HeightMap, name: str, first: int, last: int) -> tuple[F32, F32]:
    """Returns the slopes of rows along x and down y, heights per texel, by a filter. Quantised heights are
    in 0..1, so no slope is too steep to be computed from a unit normal."""
    taps = taps_of(name)
    normal = normals.normals_from_heights(
        height_map.heights,
        derivative=taps.derivative,
        smooth=taps.smooth,
        scale=(1.0, 1.0),
        wrap=height_map.wrap,
        islands=height_map.islands,
        rows=(first, last),
        threads=1,
    )
    return -normal[:, :, 0] / normal[:, :, 2], normal[:, :, 1] / normal[:, :, 2]


def _limited_slopes(height_map: HeightMap, first: int, last: int) -> tuple[F32, F32]:
    """Returns the filter's slopes, limited to half a step of the source around the eighth-order slopes."""
    assert height_map.height_levels is not None
    reach = len(taps_of(REFERENCE_FILTER).derivative)
    rows = _within(np.arange(first - reach, last + reach), height_map.heights.shape[0], height_map.wrap[1])
    halves = _half_steps(height_map.heights[rows], height_map.height_levels)
    columns = np.arange(-reach, height_map.heights.shape[1] + reach)
    halves = halves[:, _within(columns, height_map.heights.shape[1], height_map.wrap[0])]
    weights = [np.float32(abs(weight)) for weight in taps_of(REFERENCE_FILTER).derivative]
    middle = halves[reach : reach + last - first]
    end = halves.shape[1] - reach
    pairs = enumerate(weights, 1)
    open_x = sum(w * (middle[:, reach + k : end + k] + middle[:, reach - k : end - k]) for k, w in pairs)
    middle = halves[:, reach:end]
    end = len(halves) - reach
    pairs = enumerate(weights, 1)
    open_y = sum(w * (middle[reach + k : end + k] + middle[reach - k : end - k]) for k, w in pairs)
    limited = [
        np.clip(slope, exact - half_range, exact + half_range)
        for slope, exact, half_range in zip(
            _slopes(height_map, height_map.filter_name, first, last),
            _slopes(height_map, REFERENCE_FILTER, first, last),
            (open_x, open_y),
            strict=True,
        )
    ]
    return limited[0], limited[1]


def _within(index: npt.NDArray[np.int64], size: int, wrap: bool) -> npt.NDArray[np.int64]:
    """Returns the texels that are read for positions beyond an edge: wrapped, or mirrored about the edge
    texel."""
    if wrap:
        return index % size
    return np.clip(
        np.where(index < 0, -index, np.where(index >= size, 2 * (size - 1) - index, index)), 0, size - 1
    )


def _half_steps(heights: F32, levels: F32) -> F32:
    """Returns half of the narrower gap between levels beside each height: at most what the source leaves
    open."""
    gaps = np.diff(levels)
    if not len(gaps):
        return np.zeros_like(heights)
    at = np.searchsorted(levels, heights)
    narrow = np.minimum(gaps[np.clip(at - 1, 0, len(gaps) - 1)], gaps[np.clip(at, 0, len(gaps) - 1)])
    return np.float32(0.5) * narrow

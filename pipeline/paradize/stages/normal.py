"""Tangent-space normals of a height map, green up.

Tiers: fast takes the central difference; balanced the taps that stages/filters.py predicts to err least on
the map; exact of floats the eighth-order difference, and of codes the slopes of balanced, each held to what
the half steps of the source leave open around the eighth-order difference: smooth where a code may be meant
so, and true to the codes where not. A user may name any filter instead.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.kernels import normals
from paradize.stages.filters import EXACT, taps_of

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import HeightMap

    F32 = npt.NDArray[np.float32]


def normal_rows(ground: HeightMap, first: int, last: int, *, threads: int = 1) -> F32:
    """Unit normals (n, w, 3) float32 of the rows first..last; of flat ground exactly (0, 0, 1).

    One thread by default, because bands of rows run side by side. Raises SourceError for a height that is not
    finite, BakeError for an unknown filter.
    """
    if ground.clamp_slopes and ground.filter_name != EXACT:  # the slopes of EXACT need no clamp
        dx, dy = _held_slopes(ground, first, last)
        return normals.normals_from_slopes(
            dx, dy, scale=ground.slope_scale, green_down=ground.green_down, threads=threads
        )
    taps = taps_of(ground.filter_name)
    return normals.normals_from_heights(
        ground.heights,
        derivative=taps.derivative,
        smooth=taps.smooth,
        scale=ground.slope_scale,
        wrap=ground.wrap,
        green_down=ground.green_down,
        islands=ground.islands,
        rows=(first, last),
        threads=threads,
    )


def _slopes(ground: HeightMap, name: str, first: int, last: int) -> tuple[F32, F32]:
    """Slopes along x and down y of rows, heights per texel, by a filter. Heights that codes stand for lie in
    0..1, so that none is too steep to be read off a unit normal."""
    taps = taps_of(name)
    normal = normals.normals_from_heights(
        ground.heights,
        derivative=taps.derivative,
        smooth=taps.smooth,
        scale=(1.0, 1.0),
        wrap=ground.wrap,
        islands=ground.islands,
        rows=(first, last),
        threads=1,
    )
    return -normal[:, :, 0] / normal[:, :, 2], normal[:, :, 1] / normal[:, :, 2]


def _held_slopes(ground: HeightMap, first: int, last: int) -> tuple[F32, F32]:
    """The filter's slopes, held to what the half steps leave open around the eighth-order ones."""
    assert ground.height_levels is not None
    reach = len(taps_of(EXACT).derivative)
    rows = _within(np.arange(first - reach, last + reach), ground.heights.shape[0], ground.wrap[1])
    halves = _half_steps(ground.heights[rows], ground.height_levels)
    columns = np.arange(-reach, ground.heights.shape[1] + reach)
    halves = halves[:, _within(columns, ground.heights.shape[1], ground.wrap[0])]
    weights = [np.float32(abs(weight)) for weight in taps_of(EXACT).derivative]
    middle = halves[reach : reach + last - first]
    end = halves.shape[1] - reach
    pairs = enumerate(weights, 1)
    open_x = sum(w * (middle[:, reach + k : end + k] + middle[:, reach - k : end - k]) for k, w in pairs)
    middle = halves[:, reach:end]
    end = len(halves) - reach
    pairs = enumerate(weights, 1)
    open_y = sum(w * (middle[reach + k : end + k] + middle[reach - k : end - k]) for k, w in pairs)
    held = [
        np.clip(slope, exact - room, exact + room)
        for slope, exact, room in zip(
            _slopes(ground, ground.filter_name, first, last),
            _slopes(ground, EXACT, first, last),
            (open_x, open_y),
            strict=True,
        )
    ]
    return held[0], held[1]


def _within(index: npt.NDArray[np.int64], size: int, wrap: bool) -> npt.NDArray[np.int64]:
    """Where texels beyond an edge are read: wrapped, or mirrored about the edge texel."""
    if wrap:
        return index % size
    return np.clip(
        np.where(index < 0, -index, np.where(index >= size, 2 * (size - 1) - index, index)), 0, size - 1
    )


def _half_steps(heights: F32, codes: F32) -> F32:
    """Half of the narrower gap between codes beside each height: never more than the source leaves open."""
    gaps = np.diff(codes)
    if not len(gaps):
        return np.zeros_like(heights)
    at = np.searchsorted(codes, heights)
    narrow = np.minimum(gaps[np.clip(at - 1, 0, len(gaps) - 1)], gaps[np.clip(at, 0, len(gaps) - 1)])
    return np.float32(0.5) * narrow

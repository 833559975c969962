"""Makes mip chains: level 0 first, down to 1 x 1. Each level is the area mean of the one before.

Odd sizes are halved and rounded down; texels are weighted by the area that they cover, so nothing shifts. No
mean crosses an edge of the picture, so a periodic map stays periodic. All levels are float32 until they are
encoded.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.kernels import maps
from paradize.stages.sweep import bands_of, level_count, run, sweep

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from paradize.stages.sweep import Bundle

    F32 = npt.NDArray[np.float32]
    Rows = Callable[[int, int, npt.NDArray[np.uint8]], None]  # level, its first row, RGBA codes (n, w, 4)


def color_rows(
    values: npt.NDArray[Any],
    emit: Rows,
    *,
    encoded: bool,
    alpha_cutoff: float | None = None,
) -> None:
    """Calls emit with 8-bit sRGB values (n, w, 4) of every level of a colour picture (h, w, 1..4), band by
    band.

    values: codes uint8 or uint16, or floats; encoded: sRGB, else linear light. Level 0 keeps its codes; the
    others are means of linear light, weighted by alpha if there is alpha. alpha_cutoff, 0..1: each level's
    alpha is scaled so that as large a share of its texels is at or above the cutoff as in level 0. So
    cut-outs do not become thinner.
    """
    height, width, channels = values.shape
    keep = alpha_cutoff is not None and channels in (2, 4)
    levels = _empty_levels(height, width, channels) if keep else []

    def visit(level: int, first: int, bundle: Bundle) -> None:
        rows = bundle["color"]
        if level and keep:
            levels[level - 1][first : first + len(rows)] = rows
            return
        emit(level, first, maps.rgba_codes(rows, encoded=encoded and not level, threads=1))

    def halve(bundle: Bundle, level: int, rows: int, first: int) -> Bundle:
        return {"color": _half_color(bundle["color"], level, rows, first, encoded)}

    sweep(height, width, lambda first, last: {"color": values[first:last]}, visit, halve=halve)
    if keep:
        share = _share(values, float(alpha_cutoff or 0.0))
        for k, level in enumerate(levels):
            _covered_rows(level, share, float(alpha_cutoff or 0.0), k + 1, emit)


def _half_color(rows: npt.NDArray[Any], level: int, count: int, first: int, encoded: bool) -> F32:
    """Returns half a band: of the values of level 0, or of the linear light of another level."""
    if level == 0:
        if encoded and rows.dtype == np.uint8 and count % 2 == 0 and rows.shape[1] % 2 == 0:
            return maps.halved_light(rows, threads=1)
        rows = maps.linear_light(rows, encoded=encoded, threads=1)
        rows = np.clip(rows, np.float32(0), np.float32(1), out=rows)
    with_alpha = rows.shape[2] in (2, 4)
    return maps.halve(rows, with_alpha=with_alpha, rows=count, first=first, threads=1)


def _empty_levels(height: int, width: int, channels: int) -> list[F32]:
    return [
        np.empty((max(1, height >> k), max(1, width >> k), channels), np.float32)
        for k in range(1, level_count(height, width))
    ]


def _share(values: npt.NDArray[Any], cutoff: float) -> float:
    """The share of texels whose alpha is at or above the cutoff."""
    alpha = values[:, :, -1]
    if alpha.dtype == np.float32:
        passing = np.count_nonzero(alpha >= np.float32(cutoff))
    else:
        top = np.float32(np.iinfo(alpha.dtype).max)
        codes = np.arange(int(top) + 1, dtype=np.float32) / top  # to compare in floats
        passing = np.count_nonzero((codes >= np.float32(cutoff))[alpha])
    return int(passing) / alpha.size


def _covered_rows(level: F32, share: float, cutoff: float, index: int, emit: Rows) -> None:
    alpha = np.ascontiguousarray(level[:, :, -1])
    factor = np.float32(maps.coverage_factor(alpha, fraction=share, cutoff=cutoff))

    def work(band: tuple[int, int]) -> None:
        rows = level[band[0] : band[1]]
        rows[:, :, -1] *= factor  # codes end at 255
        emit(index, band[0], maps.rgba_codes(rows, encoded=False, threads=1))

    run(work, bands_of(*level.shape[:2]))


def unit_rows(bundle: Bundle, level: int) -> F32:
    """Returns unit normals of a band of averaged normals; (0, 0, 1) where the average is zero."""
    return bundle["normal"] if level == 0 else maps.normalise(bundle["normal"], threads=1)


def gloss_rows(bundle: Bundle, level: int) -> F32:
    """Returns gloss (n, w, 2) of a band that holds "normal", "specular" and "variance" (see gloss_bundle).

    Specular is averaged. Smoothness comes from the averaged variance of slopes. On coarser levels it is
    reduced by the variation of normals that averaging removed.
    """
    variance = np.ascontiguousarray(bundle["variance"][:, :, 0])
    if level == 0:
        smooth = bundle["smoothness"][:, :, 0]
    else:
        smooth = maps.widened_smoothness(variance, bundle["normal"], threads=1)
    return np.stack([bundle["specular"][:, :, 0], smooth], axis=2)


def gloss_bundle(gloss: F32) -> Bundle:
    """Returns the quantities of gloss (n, w, 2) that are averaged: specular, and smoothness as variance."""
    smoothness = np.ascontiguousarray(gloss[:, :, 1])
    return {
        "specular": np.ascontiguousarray(gloss[:, :, :1]),
        "variance": maps.smoothness_to_variance(smoothness, threads=1)[:, :, None],
        "smoothness": smoothness[:, :, None],
    }


def half_maps(bundle: Bundle, level: int, rows: int, first: int) -> Bundle:
    """Returns the area means of a band of maps (see stages.sweep). Smoothness itself is left out: coarser
    levels derive it from the variance."""
    del level
    return {
        name: maps.halve(array, rows=rows, first=first, threads=1)
        for name, array in bundle.items()
        if name != "smoothness"
    }

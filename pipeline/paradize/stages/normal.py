"""Tangent-space normals of a height map, green up.

Tiers: fast takes the central difference; balanced the taps that stages/filters.py predicts to err least on
the map; exact the same, with the spectral derivative among them. A user may name any filter instead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from paradize.kernels import filter as filter_kernel
from paradize.kernels import normals
from paradize.stages.filters import SPECTRAL, need_repeats, taps_of

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    I32 = npt.NDArray[np.int32]


@dataclass(frozen=True)
class Normals:
    """What normals of any rows are made from; `prepare` makes it.

    slopes: (h, w) float32 along x and down y, heights per texel, of the spectral filter, else None.
    """

    heights: F32
    slope_scale: tuple[float, float]
    wrap: tuple[bool, bool]
    filter_name: str
    green_down: bool
    islands: I32 | None
    slopes: tuple[F32, F32] | None

    def rows(
        self,
        first: int,
        last: int,
        *,
        encoding: str = "float",
        out: npt.NDArray[Any] | None = None,
        threads: int = 1,
    ) -> npt.NDArray[Any]:
        """Normals of the rows first..last: "float" (n, w, 3) unit float32, "rgb8" (n, w, 3) uint8 or "snorm8"
        (n, w, 2) int8; see kernels.normals. One thread by itself: bands of rows run side by side."""
        if self.slopes is not None:
            dx, dy = self.slopes
            return normals.normals_from_slopes(
                dx[first:last],
                dy[first:last],
                scale=self.slope_scale,
                green_down=self.green_down,
                encoding=encoding,
                out=out,
                threads=threads,
            )
        taps = taps_of(self.filter_name)
        return normals.normals_from_heights(
            self.heights,
            derivative=taps.derivative,
            smooth=taps.smooth,
            scale=self.slope_scale,
            wrap=self.wrap,
            green_down=self.green_down,
            islands=self.islands,
            rows=(first, last),
            encoding=encoding,
            out=out,
            threads=threads,
        )


def prepare(
    heights: F32,
    *,
    slope_scale: tuple[float, float],
    wrap: tuple[bool, bool],
    filter_name: str,
    green_down: bool = False,
    islands: I32 | None = None,
) -> Normals:
    """What the normals of heights (h, w) float32 are made from, row by row; arguments as of `normal_map`.

    With the filter "spectral" the slopes of the whole map are made here, once: two planes of its size.
    Raises BakeError for an unknown filter, and for "spectral" where the map does not repeat on both axes.
    """
    slopes = None
    if filter_name == SPECTRAL:
        need_repeats(wrap, islands)
        slopes = filter_kernel.spectral_slopes(heights)
    else:
        taps_of(filter_name)
    return Normals(heights, slope_scale, wrap, filter_name, green_down, islands, slopes)


def normal_rows(
    heights: F32,
    first: int,
    last: int,
    *,
    slope_scale: tuple[float, float],
    wrap: tuple[bool, bool],
    filter_name: str,
    green_down: bool = False,
    islands: I32 | None = None,
) -> F32:
    """The rows first..last of `normal_map`. Where many bands are wanted of a spectral map, use `prepare`."""
    return prepare(
        heights,
        slope_scale=slope_scale,
        wrap=wrap,
        filter_name=filter_name,
        green_down=green_down,
        islands=islands,
    ).rows(first, last, threads=normals.THREADS)


def normal_map(
    heights: F32,
    *,
    slope_scale: tuple[float, float],
    wrap: tuple[bool, bool],
    filter_name: str,
    green_down: bool = False,
    islands: I32 | None = None,
) -> F32:
    """Unit normals (h, w, 3) float32 of heights (h, w).

    slope_scale: slope of one unit of height between neighbours along (x, y): amplitude over texel size.
    wrap: whether the map repeats along (x, y); where it does not, the slope at an edge goes on as it came.
    filter_name: one of stages.filters.FILTER_NAMES.
    islands: (h, w) int32, an id per UV island and -1 outside: no slope crosses a border. Flat ground gives
    exactly (0, 0, 1). Raises SourceError for a height that is not finite, and what `prepare` raises.
    """
    return normal_rows(
        heights,
        0,
        heights.shape[0],
        slope_scale=slope_scale,
        wrap=wrap,
        filter_name=filter_name,
        green_down=green_down,
        islands=islands,
    )

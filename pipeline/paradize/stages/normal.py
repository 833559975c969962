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

    from paradize.data import Ground

    F32 = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Normals:
    """What normals of any rows of a ground are made from; `prepare` makes it.

    slopes: (h, w) float32 along x and down y, heights per texel, of the spectral filter, else None.
    """

    ground: Ground
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
        (n, w, 2) int8; see kernels.normals. Flat ground gives exactly (0, 0, 1). One thread by itself: bands
        of rows run side by side. Raises SourceError for a height that is not finite."""
        ground = self.ground
        if self.slopes is not None:
            dx, dy = self.slopes
            return normals.normals_from_slopes(
                dx[first:last],
                dy[first:last],
                scale=ground.slope_scale,
                green_down=ground.green_down,
                encoding=encoding,
                out=out,
                threads=threads,
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
            encoding=encoding,
            out=out,
            threads=threads,
        )


def prepare(ground: Ground) -> Normals:
    """What the ground's normals are made from, row by row.

    With the filter "spectral" the slopes of the whole map are made here, once: two planes of its size.
    Raises BakeError for an unknown filter, and for "spectral" where the map does not repeat on both axes;
    SourceError where "spectral" meets a height that is not finite.
    """
    slopes = None
    if ground.filter_name == SPECTRAL:
        need_repeats(ground.wrap, ground.islands)
        normals.require_finite(ground.heights)  # a spectrum spreads what is not over the whole map
        slopes = filter_kernel.spectral_slopes(ground.heights)
    else:
        taps_of(ground.filter_name)
    return Normals(ground, slopes)

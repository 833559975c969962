"""Tangent-space normals of a height map, green up.

Tiers: fast is the central difference; balanced the fourth-order one for heights of 16 bits and more, and
Scharr's for 8-bit heights, whose steps it smooths. Sources: see kernels/maps_normal.hpp.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from paradize.kernels import maps

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]

TIERS = {"fast": "fast", "balanced": "balanced", "exact": "balanced"}  # asked -> used


def derivative_filter(tier: str, source_bits: int) -> str:
    """The filter that a tier uses on heights of so many bits: "central", "scharr" or "fourth"."""
    if TIERS[tier] == "fast":
        return "central"
    return "scharr" if source_bits <= 8 else "fourth"


def normal_map(
    heights: F32,
    *,
    slope_scale: tuple[float, float],
    wrap: tuple[bool, bool],
    filter_name: str,
    green_down: bool = False,
    islands: npt.NDArray[np.int32] | None = None,
) -> F32:
    """Unit normals (h, w, 3) of heights (h, w).

    slope_scale: slope of one unit of height between neighbours along (x, y): amplitude over texel size.
    wrap: whether the map repeats along (x, y); where it does not, the slope at an edge goes on as it came.
    islands: (h, w) int32, an id per UV island and -1 outside: no slope crosses a border. Flat ground gives
    exactly (0, 0, 1).
    """
    return maps.normals_from_heights(
        heights,
        scale=slope_scale,
        filter_name=filter_name,
        wrap=wrap,
        green_down=green_down,
        islands=islands,
    )

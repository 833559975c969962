"""Smooths heights that a coarse source rounded to steps. Each height stays within half a step of its source.

It runs on request only, because the heights between two steps are a guess: those of the surface that bends
least. Source of the method: see kernels/filter/destep.hpp.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.errors import BakeError
from paradize.kernels import filter as kernel

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]

STEP_8_BIT = 1.0 / 255.0  # of an 8-bit picture whose codes stand for 0..1
_LEAST_STEP = 2.0**-126  # bends are counted in steps; with smaller steps the count overflows float32


def destep(heights: F32, step: float = STEP_8_BIT, *, wrap: tuple[bool, bool] = (False, False)) -> F32:
    """Heights (h, w) float32, each exactly within step / 2 of its source, in units of the heights.

    step: the distance of neighbouring values of the source, above 0. wrap: whether the map repeats along (x,
    y). A constant stays; a ramp in steps becomes a slope; where the source bends by more than about half a
    step per texel its values stay as they are. Call it on what the file holds, before levels bend the steps.
    Raises BakeError for a step that is not positive and finite or too small for float32, and for heights that
    are not finite.
    """
    if not _LEAST_STEP <= step < np.inf:
        raise BakeError(f"a step of {step} cannot be smoothed", mend="give the distance of two source values")
    if not np.isfinite(heights).all():
        row, column = (int(k) for k in np.argwhere(~np.isfinite(heights))[0])
        raise BakeError("a height is not a finite number", place=f"row {row}, column {column}")
    return kernel.destep(heights, step=step, wrap=wrap)


def destep_pixels(pixels: F32, *, wrap: tuple[bool, bool] = (False, False)) -> None:
    """Smooths the steps in each channel of a picture (h, w, c), in place, as encoded: before sRGB becomes
    linear light."""
    for c in range(pixels.shape[2]):
        pixels[:, :, c] = destep(pixels[:, :, c], wrap=wrap)

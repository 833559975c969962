"""Heights 0..1 from a picture: the luminance of its linear light, then levels.

For encoded red, green and blue: linear light l = ((v + 0.055) / 1.055)^2.4, v / 12.92 up to 0.04045 (IEC
61966-2-1); luminance y = 0.2126 r + 0.7152 g + 0.0722 b; then, in this order, with the numbers of `Levels`:
  t = clamp((y - black) / (white - black))     black and white point; swapped they invert
  t = t^(1 / gamma)                            gamma above 1 lifts the middle
  t = clamp((t - 1/2) contrast + 1/2 + brightness)
  t = 1 - t                                    where invert
clamp is to 0..1. Linear light and luminance are float32; the levels run in float64 and are rounded once.

Source of the weights: ITU-R BT.709-6, "Parameter values for the HDTV standards", 2015.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from paradize.data import Image
from paradize.errors import BakeError
from paradize.kernels import maps
from paradize.kernels.maps import Levels

F32 = npt.NDArray[np.float32]


def luminance_plane(image: Image) -> F32:
    """Luminance (h, w) of the picture's linear light; alpha is ignored. Data pictures count as linear. Raises
    BakeError for floats that are encoded and so bright that float32 has no linear light for them."""
    encoded = image.color_space == "srgb"
    light = maps.linear_light(image.values, encoded=encoded)
    if encoded and image.values.dtype == np.float32 and not np.isfinite(light).all():
        raise BakeError(
            f"an sRGB value of {np.abs(image.values).max():g} has no linear light in float32; limit 1e16",
            mend="give values of 0 to 1, or say that the picture is linear",
        )
    return maps.luminance(light)


def height_from_color(image: Image, levels: Levels | None = None) -> F32:
    """Heights (h, w) float32 in 0..1 from a colour picture."""
    return maps.apply_levels(luminance_plane(image), levels or Levels())


def height_from_height(image: Image, levels: Levels | None = None) -> F32:
    """Heights (h, w) float32 from a height picture: its values as they are (of colour, their BT.709 mean).

    No colour transform touches them. With levels they come out in 0..1; without, floats keep their range.
    """
    plane = maps.luminance(image.pixels)
    return plane if levels is None else maps.apply_levels(plane, levels)

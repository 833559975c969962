"""Heights 0..1 from a picture: the luminance of its linear light, then levels.

Source of the weights: ITU-R BT.709-6, "Parameter values for the HDTV standards", 2015.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from paradize.data import Image
from paradize.kernels import maps
from paradize.kernels.maps import Levels

F32 = npt.NDArray[np.float32]


def luminance_plane(image: Image) -> F32:
    """Luminance (h, w) of the picture's linear light; alpha is ignored. Data pictures count as linear."""
    return maps.luminance(maps.linear_light(image.values, encoded=image.color_space == "srgb"))


def height_from_color(image: Image, levels: Levels | None = None) -> F32:
    """Heights (h, w) float32 in 0..1 from a colour picture."""
    return maps.apply_levels(luminance_plane(image), levels or Levels())


def height_from_height(image: Image, levels: Levels | None = None) -> F32:
    """Heights (h, w) float32 from a height picture: its values as they are (of colour, their BT.709 mean).

    No colour transform touches them. With levels they come out in 0..1; without, floats keep their range.
    """
    plane = maps.luminance(image.pixels)
    return plane if levels is None else maps.apply_levels(plane, levels)

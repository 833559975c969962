"""Gloss: R specular intensity, G smoothness s (roughness alpha = (1 - s)^2), from the brightness of a
picture."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from paradize.errors import BakeError
from paradize.kernels import maps
from paradize.kernels.maps import Levels

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]


@dataclass(frozen=True)
class GlossSettings:
    """levels: shape the brightness t. specular: (at t = 0, at t = 1) of R, 0..1. smoothness: the same of
    G."""

    levels: Levels = field(default_factory=Levels)
    specular: tuple[float, float] = (0.0, 1.0)
    smoothness: tuple[float, float] = (0.3, 0.6)

    def __post_init__(self) -> None:
        for name, (low, high) in (("specular", self.specular), ("smoothness", self.smoothness)):
            if not (0.0 <= low <= 1.0 and 0.0 <= high <= 1.0):
                raise BakeError(f"{name} runs from {low} to {high}; 0 to 1 is the range")


def gloss_map(brightness: F32, settings: GlossSettings, mask: npt.NDArray[np.bool_] | None = None) -> F32:
    """Gloss (h, w, 2) of a brightness (h, w) 0..1. mask (h, w): where it is false nothing shines (R = 0)."""
    t = maps.apply_levels(brightness, settings.levels)
    gloss = np.empty((*t.shape, 2), np.float32)
    for channel, (low, high) in enumerate((settings.specular, settings.smoothness)):
        gloss[:, :, channel] = np.float32(low) + t * np.float32(high - low)
    if mask is not None:
        gloss[:, :, 0] = np.where(mask, gloss[:, :, 0], np.float32(0))
    return gloss

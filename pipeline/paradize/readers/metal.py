"""Metalness for a model of light that knows the colour of what is reflected instead: glTF's older one.

Source: The Khronos Group, the conversion of KHR_materials_pbrSpecularGlossiness to metallic-roughness, 2017.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from paradize.material import PLASTIC_REFLECTANCE
from paradize.vectors import dot

F64 = npt.NDArray[np.float64]

_LEAST = 1e-6  # a divisor
_BRIGHTNESS = np.array([0.299, 0.587, 0.114])


def metal_of(diffuse: npt.ArrayLike, specular: npt.ArrayLike) -> tuple[F64, F64]:
    """The colour (..., 3) and the metalness (...), 0..1, that reflect as strongly. diffuse, specular:
    (..., 3) linear light, 0..1.

    A colour that reflects no more than plastic stays as it is, with metalness 0.
    """
    diffuse, specular = np.asarray(diffuse, np.float64), np.asarray(specular, np.float64)
    plastic = PLASTIC_REFLECTANCE
    reflected = np.sqrt(dot(specular * specular, _BRIGHTNESS))
    rest = 1.0 - specular.max(axis=-1)
    scattered = np.sqrt(dot(diffuse * diffuse, _BRIGHTNESS)) * rest / (1.0 - plastic)
    b = scattered + reflected - 2.0 * plastic
    root = np.sqrt(np.maximum(b * b - 4.0 * plastic * (plastic - reflected), 0.0))
    metal = np.where(reflected > plastic, np.clip((root - b) / (2.0 * plastic), 0.0, 1.0), 0.0)
    m = metal[..., None]
    of_diffuse = diffuse * np.minimum(rest[..., None] / (1.0 - plastic), 1.0) / np.maximum(1.0 - m, _LEAST)
    of_specular = (specular - plastic * (1.0 - m)) / np.maximum(m, _LEAST)
    color = np.where(m > 0.0, of_diffuse + (of_specular - of_diffuse) * m * m, diffuse)
    return np.clip(color, 0.0, 1.0), metal

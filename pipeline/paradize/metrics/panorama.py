"""The error of a cube map that was cut out of a panorama, against the panorama in float64."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Texture, rounded
from paradize.metrics.source import DARK, linear_light
from paradize.metrics.texels import decode_texels
from paradize.vectors import cube_vectors

F64 = npt.NDArray[np.float64]
Values = npt.NDArray[Any]

_ALONG = 32  # sampled texels along a side of a face
_PLACES = 16  # along a side of a texel


def panorama_errors(texture: Texture, values: Values, *, encoded: bool) -> dict[str, float]:
    """The errors of level 0: error of a channel / brightest channel of the texel, of up to 32 x 32 texels of
    each face. values: (h, 2 h, 1..4). encoded: they are sRGB.

    The truth is the mean of 256 places of a texel, weighted by solid angle, each mixed of the four nearest
    texels of the panorama. Raises ValueError for other shapes."""
    if not 0 < 2 * values.shape[0] == values.shape[1]:
        raise ValueError(f"{values.shape} is the shape of no panorama")
    chosen = np.unique(np.linspace(0, texture.width - 1, min(texture.width, _ALONG)).round().astype(int))
    within = (np.arange(_PLACES) + 0.5) / _PLACES
    places = 2.0 * (chosen[:, None] + within) / texture.width - 1.0
    s, t = np.broadcast_arrays(places[None, :, None, :], places[:, None, :, None])
    found = []
    for face in range(6):
        shown = decode_texels(texture, 0, face)[np.ix_(chosen, chosen)][:, :, :3]
        truth = _true_light(values, encoded, face, s, t)
        difference = np.abs(shown - truth).max(axis=2)
        found.append(difference / np.maximum(np.abs(truth).max(axis=2), DARK))
    return {
        "panorama_p99_relative": rounded(float(np.quantile(found, 0.99))),
        "panorama_max_relative": rounded(float(np.max(found))),
    }


def _true_light(values: Values, encoded: bool, face: int, s: F64, t: F64) -> F64:
    """The light (r, c, 3) of texels of a face. s, t: (r, c, p, p) places to the right and down, -1 to 1."""
    x, y, z = np.moveaxis(cube_vectors(face, s, t), -1, 0)
    length = np.sqrt(1.0 + s * s + t * t)
    rows, width = values.shape[:2]
    column = (0.5 + np.arctan2(x, -z) / (2.0 * np.pi)) * width - 0.5
    row = np.arccos(y / length) / np.pi * rows - 0.5
    left, above = np.floor(column).astype(int), np.floor(row).astype(int)
    weight = length**-3.0
    light = np.zeros((*s.shape[:2], 3))
    for j, i in ((0, 0), (0, 1), (1, 0), (1, 1)):
        beyond = (above + j < 0) | (above + j >= rows)  # on the other side of the pole
        turned = (left + i + np.where(beyond, width // 2, 0)) % width
        texels = values[np.clip(above + j, 0, rows - 1), turned]
        mixed = weight * np.abs((1 - j) - (row - above)) * np.abs((1 - i) - (column - left))
        if texels.shape[-1] < 3:
            texels = texels[..., :1]
        linear = linear_light(texels[..., :3], encoded=encoded)
        light += (mixed[..., None] * linear).sum(axis=(2, 3))
    return np.asarray(light / weight.sum(axis=(2, 3))[..., None], np.float64)

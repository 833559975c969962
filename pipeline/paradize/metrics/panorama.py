"""The error of a cube map that was cut out of a panorama, against the panorama in float64."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Texture, rounded
from paradize.metrics.source import DARK, linear_light
from paradize.metrics.texels import decode_texels

F64 = npt.NDArray[np.float64]
Values = npt.NDArray[Any]

_ALONG = 32  # sampled texels along a side of a face
_PLACES = 16  # along a side of a texel
# Of each face the direction of its middle, to the right and down, as axis and sign: OpenGL 3.3, table 3.18.
_FACES = (
    ((0, 1), (2, -1), (1, -1)),
    ((0, -1), (2, 1), (1, -1)),
    ((1, 1), (0, 1), (2, 1)),
    ((1, -1), (0, 1), (2, -1)),
    ((2, 1), (0, 1), (1, -1)),
    ((2, -1), (0, -1), (1, -1)),
)


def panorama_errors(texture: Texture, values: Values, *, encoded: bool) -> dict[str, float]:
    """The errors of level 0: error of a channel / brightest channel of the texel, of up to 32 x 32 texels of
    each face. values: (h, 2 h, 1..4). encoded: they are sRGB.

    The truth is the mean of 256 places of a texel, weighted by solid angle, each mixed of the four nearest
    texels of the panorama. Raises ValueError for other shapes."""
    if not 0 < 2 * values.shape[0] == values.shape[1]:
        raise ValueError(f"{values.shape} is the shape of no panorama")
    size = texture.width
    chosen = np.unique(np.linspace(0, size - 1, min(size, _ALONG)).round().astype(int))
    worst = []
    for face, axes in enumerate(_FACES):
        shown = decode_texels(texture, 0, face)[np.ix_(chosen, chosen)][:, :, :3]
        truth = np.stack([_row(values, encoded, axes, chosen, y, size) for y in chosen])
        difference = np.abs(shown - truth).max(axis=2)
        worst.append(difference / np.maximum(np.abs(truth).max(axis=2), DARK))
    found = np.concatenate([share.reshape(-1) for share in worst])
    return {
        "panorama_p99_relative": rounded(float(np.quantile(found, 0.99))),
        "panorama_max_relative": rounded(float(found.max())),
    }


def _row(
    values: Values,
    encoded: bool,
    axes: Sequence[tuple[int, int]],
    columns: npt.NDArray[Any],
    y: int,
    size: int,
) -> F64:
    """The light (n, 3) of texels of a row of a face."""
    within = (np.arange(_PLACES) + 0.5) / _PLACES
    s, t = np.broadcast_arrays(
        2.0 * (columns[:, None, None] + within[None, None, :]) / size - 1.0,
        2.0 * (y + within[None, :, None]) / size - 1.0,
    )
    to = [s, s, s]
    for (axis, sign), along in zip(axes, (np.ones_like(s), s, t), strict=True):
        to[axis] = sign * along
    length = np.sqrt(1.0 + s * s + t * t)
    rows, width = values.shape[:2]
    column = (0.5 + np.arctan2(to[0], -to[2]) / (2.0 * np.pi)) * width - 0.5
    row = np.arccos(to[1] / length) / np.pi * rows - 0.5
    left, above = np.floor(column).astype(int), np.floor(row).astype(int)
    light = np.zeros((*s.shape, 3))
    for j, i in ((0, 0), (0, 1), (1, 0), (1, 1)):
        beyond = (above + j < 0) | (above + j >= rows)  # on the other side of the pole
        turned = (left + i + np.where(beyond, width // 2, 0)) % width
        texels = values[np.clip(above + j, 0, rows - 1), turned]
        share = np.abs((1 - j) - (row - above)) * np.abs((1 - i) - (column - left))
        for k in range(3):
            channel = texels[..., k if texels.shape[-1] > 2 else 0]
            light[..., k] += share * linear_light(channel, encoded=encoded)
    weight = length**-3.0
    mean = (weight[..., None] * light).sum(axis=(1, 2)) / weight.sum(axis=(1, 2))[:, None]
    return np.asarray(mean, np.float64)

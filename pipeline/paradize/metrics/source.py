"""References of the maps: heights, gloss and light of a picture, computed in float64 independently of the
stages and of tiers, filters and methods.

Results are float32, rounded once: by 3e-8 of a value at most, below the six digits of an error. Shared with
the stages: the decoded picture (and which texel replaces a transparent one), the numbers of the settings, and
the power function of gamma and sRGB (`kernels/math/functions.hpp`, tested against mpmath).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from paradize.data import rounded
from paradize.kernels.reference import powers
from paradize.metrics.texels import decode_texels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from paradize.data import Image, Texture

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Values = npt.NDArray[Any]
_ROWS = 64  # processed together
DARK = 1e-4  # smallest brightness of the sky that errors are relative to


class Levels(Protocol):
    """Levels as the stages define them: shape of a brightness curve."""

    @property
    def black(self) -> float: ...
    @property
    def white(self) -> float: ...
    @property
    def gamma(self) -> float: ...
    @property
    def contrast(self) -> float: ...
    @property
    def brightness(self) -> float: ...
    @property
    def invert(self) -> bool: ...


def linear_light(values: Values, *, encoded: bool) -> F64:
    """Linear light of integers (as shares of their largest value) or floats. encoded: the values are sRGB
    (IEC 61966-2-1)."""
    if values.dtype == np.float32:
        values64 = values.astype(np.float64)
        return _decoded(values64) if encoded else values64
    top = int(np.iinfo(values.dtype).max)
    levels = np.arange(top + 1) / top
    return np.asarray((_decoded(levels) if encoded else levels)[values], np.float64)


def _decoded(v: F64) -> F64:
    curved = v > 0.04045
    out = v / 12.92
    out[curved] = powers((v[curved] + 0.055) / 1.055, 2.4)
    return out


def brightness(values: Values, *, encoded: bool) -> F64:
    """Luminance (h, w) of a picture (h, w, 1..4) by BT.709. Grey is unchanged, alpha ignored."""
    if values.shape[2] < 3:
        return linear_light(values[:, :, 0], encoded=encoded)
    red, green, blue = (linear_light(values[:, :, k], encoded=encoded) for k in range(3))
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def shaped(t: F64, levels: Levels) -> F64:
    """Applies levels to a brightness, as stages/height.py defines them."""
    t = np.clip((t - levels.black) / (levels.white - levels.black), 0.0, 1.0)
    if levels.gamma != 1.0:
        t = powers(t, 1.0 / levels.gamma)
    t = np.clip((t - 0.5) * levels.contrast + 0.5 + levels.brightness, 0.0, 1.0)
    return 1.0 - t if levels.invert else t


def true_heights(image: Image, source: str, levels: Levels | None) -> F32:
    """Heights (h, w) of a picture: for source "color" its luminance, for "height" its values. With levels,
    and always for colour, within 0..1."""
    rows, columns = image.values.shape[:2]
    out = np.empty((rows, columns), np.float32)
    encoded = source == "color" and image.color_space == "srgb"
    for first, end in _bands(rows):
        heights = brightness(image.values[first:end], encoded=encoded)
        if levels is not None:
            heights = shaped(heights, levels)
        elif source == "color":
            heights = np.clip(heights, 0.0, 1.0)
        out[first:end] = heights
    return out


def true_gloss(
    t: npt.NDArray[Any], levels: Levels, specular: tuple[float, float], smoothness: tuple[float, float]
) -> F32:
    """Gloss (h, w, 2) of a brightness t (h, w): specular intensity and smoothness, each (at 0, at 1)."""
    out = np.empty((*t.shape, 2), np.float32)
    for first, end in _bands(len(t)):
        share = shaped(t[first:end].astype(np.float64), levels)
        for channel, (low, high) in enumerate((specular, smoothness)):
            out[first:end, :, channel] = low + share * (high - low)
    return out


def sky_error(texture: Texture, faces: Sequence[tuple[Values, bool]]) -> float:
    """The largest relative error of level 0 of a cube map: error of a channel / brightest channel of the
    texel. faces: six pictures (n, n, 1..4), and whether each is sRGB."""
    worst = 0.0
    for face, (values, encoded) in enumerate(faces):
        shown = decode_texels(texture, 0, face)
        for first, end in _bands(len(values)):
            rows = values[first:end]
            truth = np.stack(
                [linear_light(rows[:, :, k if rows.shape[2] > 2 else 0], encoded=encoded) for k in range(3)],
                axis=2,
            )
            difference = np.abs(shown[first:end, :, :3] - truth).max(axis=2)
            worst = max(worst, float((difference / np.maximum(np.abs(truth).max(axis=2), DARK)).max()))
    return rounded(worst)


def _bands(rows: int) -> Iterator[tuple[int, int]]:
    return ((first, min(rows, first + _ROWS)) for first in range(0, rows, _ROWS))

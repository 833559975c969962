"""What the maps of a picture are held to: heights, gloss and light of its codes or floats, computed in
float64 once more, apart from the stages, and knowing nothing of tiers, filters and methods.

Planes are handed on as float32, rounded once: by 3e-8 of a value at most, below what six digits of an error
tell. Shared with the stages: the decoded picture (and which texel stands for a transparent one), the numbers
of the settings, and the power function of gamma and sRGB (`kernels/math/functions.hpp`, held to mpmath by
its test).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from paradize.data import six
from paradize.kernels.reference import powers
from paradize.metrics.texels import decode_texels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from paradize.data import Image, Texture

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Values = npt.NDArray[Any]
_ROWS = 64  # at once
_DARK = 1e-4  # a texel of the sky is as bright as this at least: errors are relative to it


class Levels(Protocol):
    """The numbers that a stage calls so."""

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


def light(values: Values, *, encoded: bool) -> F64:
    """Linear light of codes (shares of their largest) or floats. encoded: they are sRGB (IEC 61966-2-1)."""
    if values.dtype == np.float32:
        wide = values.astype(np.float64)
        return _decoded(wide) if encoded else wide
    top = int(np.iinfo(values.dtype).max)
    of_code = np.arange(top + 1) / top
    return np.asarray((_decoded(of_code) if encoded else of_code)[values], np.float64)


def _decoded(v: F64) -> F64:
    bent = v > 0.04045
    out = v / 12.92
    out[bent] = powers((v[bent] + 0.055) / 1.055, 2.4)
    return out


def brightness(values: Values, *, encoded: bool) -> F64:
    """Luminance (h, w) of a picture (h, w, 1..4) by BT.709; grey as it is, alpha aside."""
    if values.shape[2] < 3:
        return light(values[:, :, 0], encoded=encoded)
    red, green, blue = (light(values[:, :, k], encoded=encoded) for k in range(3))
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def shaped(t: F64, levels: Levels) -> F64:
    """A brightness after its levels, as stages/height.py states them."""
    t = np.clip((t - levels.black) / (levels.white - levels.black), 0.0, 1.0)
    if levels.gamma != 1.0:
        t = powers(t, 1.0 / levels.gamma)
    t = np.clip((t - 0.5) * levels.contrast + 0.5 + levels.brightness, 0.0, 1.0)
    return 1.0 - t if levels.invert else t


def true_heights(image: Image, source: str, levels: Levels | None) -> F32:
    """Heights (h, w): of "color" the luminance of its light, of "height" the values as they are; with levels
    (of colour always) within 0..1."""
    rows, columns = image.values.shape[:2]
    out = np.empty((rows, columns), np.float32)
    encoded = source == "color" and image.color_space == "srgb"
    for first, last in _bands(rows):
        plane = brightness(image.values[first:last], encoded=encoded)
        if levels is not None:
            plane = shaped(plane, levels)
        elif source == "color":
            plane = np.clip(plane, 0.0, 1.0)
        out[first:last] = plane
    return out


def true_gloss(
    t: npt.NDArray[Any], levels: Levels, specular: tuple[float, float], smoothness: tuple[float, float]
) -> F32:
    """Gloss (h, w, 2) of a brightness (h, w): specular intensity and smoothness, each (at 0, at 1)."""
    out = np.empty((*t.shape, 2), np.float32)
    for first, last in _bands(len(t)):
        share = shaped(t[first:last].astype(np.float64), levels)
        for channel, (low, high) in enumerate((specular, smoothness)):
            out[first:last, :, channel] = low + share * (high - low)
    return out


def sky_error(texture: Texture, faces: Sequence[tuple[Values, bool]]) -> float:
    """The largest error of any channel of level 0 of a cube map, relative to the texel's brightest. faces:
    the six pictures (n, n, 1..4), and whether they are sRGB."""
    worst = 0.0
    for face, (values, encoded) in enumerate(faces):
        shown = decode_texels(texture, 0, face)
        for first, last in _bands(len(values)):
            rows = values[first:last]
            truth = np.stack(
                [light(rows[:, :, k if rows.shape[2] > 2 else 0], encoded=encoded) for k in range(3)], axis=2
            )
            gap = np.abs(shown[first:last, :, :3] - truth).max(axis=2)
            worst = max(worst, float((gap / np.maximum(np.abs(truth).max(axis=2), _DARK)).max()))
    return six(worst)


def _bands(rows: int) -> Iterator[tuple[int, int]]:
    return ((first, min(rows, first + _ROWS)) for first in range(0, rows, _ROWS))

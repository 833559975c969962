"""Checked numpy face of the normal kernels: heights, slopes or colours -> normals and their kin.

Wrong shapes and types raise ValueError: they are faults of the program, not of a source file. Heights that
are not finite raise SourceError with their place. Results do not depend on `threads`, nor on the CPU.

Every function takes `out`, an array to write into, and returns it: the pages of a fresh array of some tens of
megabytes cost as much time as the work itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from paradize.errors import SourceError
from paradize.kernels.maps import Levels
from paradize.kernels.normals import _normals
from paradize.kernels.threads import default_threads

if TYPE_CHECKING:
    from collections.abc import Sequence

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]

THREADS = default_threads(2)
MAX_REACH = 64  # of a derivative or smoothing filter, texels on either side
# encoding -> (number in the kernel, channels, type)
_ENCODINGS: dict[str, tuple[int, int, type[np.generic]]] = {
    "float": (0, 3, np.float32),
    "rgb8": (1, 3, np.uint8),
    "snorm8": (2, 2, np.int8),
}
_WIDTHS = {"widest": 0, "baseline": 1, "avx2": 2, "avx512": 3}


def widths() -> list[str]:
    """The instruction sets that this CPU runs, for tests: all give the same bits."""
    return [name for name, code in _WIDTHS.items() if _normals.has_width(code)]


def _plane(array: npt.NDArray[Any], name: str) -> F32:
    if array.dtype != np.float32 or array.ndim != 2 or array.size == 0:
        raise ValueError(f"{name} have shape {array.shape} of {array.dtype}, not (h, w) of float32")
    return np.ascontiguousarray(array)


def _weights(values: npt.ArrayLike, name: str, most: int) -> F64:
    weights = np.ascontiguousarray(values, np.float64)
    if weights.ndim != 1 or not 1 <= weights.size <= most or not bool(np.isfinite(weights).all()):
        raise ValueError(f"{name} has shape {weights.shape}; 1 to {most} finite weights are taken")
    return weights


def _target(
    out: npt.NDArray[Any] | None, shape: tuple[int, ...], dtype: type[np.generic], name: str = "out"
) -> npt.NDArray[Any]:
    if out is None:
        return np.empty(shape, dtype)
    if out.shape != shape or out.dtype != dtype or not out.flags.c_contiguous or not out.flags.writeable:
        raise ValueError(
            f"{name} has shape {out.shape} of {out.dtype}, not contiguous {shape} of {dtype.__name__}"
        )
    return out


def _bytes(array: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    return array.reshape(-1).view(np.uint8)


def _refuse(planes: Sequence[F32], what: str) -> SourceError:
    for plane in planes:
        for row, values in enumerate(plane):
            bad = np.flatnonzero(~np.isfinite(values))
            if bad.size:
                place = f"row {row}, column {int(bad[0])}"
                return SourceError(f"{what} is {values[bad[0]]}, not a finite number", place=place)
    return SourceError(f"{what} is not a finite number")


def require_finite(heights: F32) -> None:
    """Raises SourceError with the first place of heights (h, w) that is not finite."""
    if not np.isfinite(heights).all():
        raise _refuse([heights], "a height")


def normals_from_heights(
    heights: F32,
    *,
    derivative: npt.ArrayLike,
    smooth: npt.ArrayLike = (1.0,),
    scale: tuple[float, float],
    wrap: tuple[bool, bool],
    green_down: bool = False,
    islands: I32 | None = None,
    rows: tuple[int, int] | None = None,
    out: npt.NDArray[Any] | None = None,
    encoding: str = "float",
    threads: int = THREADS,
    width: str = "widest",
) -> npt.NDArray[Any]:
    """Unit normals, green up the image, of the rows first..last (`rows`; None: all) of heights (h, w).

    derivative: weights of h[+k] - h[-k], k = 1, 2, ... along an axis; smooth: weights of the centre and of
    both neighbours at 1, 2, ... across it (their sum, centre + 2 * rest, is 1). scale: slope of one unit of
    height from texel to texel along (x, y); any finite number. wrap: whether (x, y) repeat; where they do
    not, the height goes on as it came (odd reflection about the edge texel). green_down: y points down the
    image.
    islands: (h, w) int32, one id per UV island, negative outside. A texel that has taps on another island
    takes these, and those outside the map, from the odd reflection about itself; where both taps of a pair
    are lost, the axis takes the difference of the next texels of its island. Texels outside are of no use
    before a gutter is filled: theirs are the slopes across borders.

    encoding: "float" gives (n, w, 3) float32; "rgb8" (n, w, 3) uint8, the code c whose 2c/255 - 1 is nearest
    and 128 for 0; "snorm8" (n, w, 2) int8, x and y times 127, nearest. Where all taps are equal the normal is
    exactly (0, 0, 1). Slopes of any size are right: those beyond 1e18 are computed in double.
    width: an instruction set out of widths().
    Raises SourceError for a height that is not finite, with its row and column.
    """
    heights = _plane(heights, "heights")
    if islands is None:
        islands = np.empty((0,), np.int32)
    elif islands.shape != heights.shape or islands.dtype != np.int32:
        raise ValueError(f"islands have shape {islands.shape} of {islands.dtype}; heights {heights.shape}")
    first, last = (0, heights.shape[0]) if rows is None else rows
    if not 0 <= first <= last <= heights.shape[0]:
        raise ValueError(f"rows {first} to {last} of {heights.shape[0]}")
    code, channels, dtype = _ENCODINGS[encoding]
    out = _target(out, (last - first, heights.shape[1], channels), dtype)
    done = _normals.normals_from_heights(
        heights,
        np.ascontiguousarray(islands),
        _weights(derivative, "derivative", MAX_REACH),
        _weights(smooth, "smooth", MAX_REACH + 1),
        float(scale[0]),
        float(scale[1]),
        wrap[0],
        wrap[1],
        green_down,
        first,
        last,
        code,
        _bytes(out),
        threads,
        _WIDTHS[width],
    )
    if not done:
        raise _refuse([heights], "a height")
    return out


def normals_from_slopes(
    dx: F32,
    dy: F32,
    *,
    scale: tuple[float, float],
    green_down: bool = False,
    out: npt.NDArray[Any] | None = None,
    encoding: str = "float",
    threads: int = THREADS,
    width: str = "widest",
) -> npt.NDArray[Any]:
    """Unit normals, green up, of slopes dx, dy (h, w): height per texel along the rows and down the columns.

    scale: what the slopes along (x, y) are multiplied by. The rest as in normals_from_heights.
    Raises SourceError for a slope that is not finite, with its row and column.
    """
    dx, dy = _plane(dx, "dx"), _plane(dy, "dy")
    if dx.shape != dy.shape:
        raise ValueError(f"dx has shape {dx.shape}, dy {dy.shape}")
    code, channels, dtype = _ENCODINGS[encoding]
    out = _target(out, (*dx.shape, channels), dtype)
    done = _normals.normals_from_slopes(
        dx,
        dy,
        float(scale[0]),
        float(scale[1]),
        green_down,
        code,
        _bytes(out),
        threads,
        _WIDTHS[width],
    )
    if not done:
        raise _refuse([dx, dy], "a slope")
    return out


@dataclass(frozen=True)
class MaterialMaps:
    """Four maps of one picture as codes. height: (h, w) uint16, 65535 times the height. normal: (h, w, 3)
    uint8 as "rgb8" of normals_from_heights. gloss: (h, w, 2) uint8, 255 times specular intensity and
    smoothness. dudv: (h, w, 2) int8, 127 times x and y of the normal less a mean, each summing to exactly
    zero."""

    height: npt.NDArray[np.uint16]
    normal: npt.NDArray[np.uint8]
    gloss: npt.NDArray[np.uint8]
    dudv: npt.NDArray[np.int8]


def empty_maps(height: int, width: int) -> MaterialMaps:
    """Room for the maps of a picture, to be used again and again as `out` of material_maps."""
    return MaterialMaps(
        np.empty((height, width), np.uint16),
        np.empty((height, width, 3), np.uint8),
        np.empty((height, width, 2), np.uint8),
        np.empty((height, width, 2), np.int8),
    )


def _numbers(levels: Levels) -> F64:
    return np.array(
        [
            levels.black,
            levels.white,
            levels.gamma,
            levels.contrast,
            levels.brightness,
            float(levels.invert),
        ]
    )


def material_maps(
    color: npt.NDArray[Any],
    *,
    derivative: npt.ArrayLike,
    smooth: npt.ArrayLike = (1.0,),
    scale: tuple[float, float],
    wrap: tuple[bool, bool],
    green_down: bool = False,
    levels: Levels | None = None,
    gloss_levels: Levels | None = None,
    specular: tuple[float, float] = (0.0, 1.0),
    smoothness: tuple[float, float] = (0.3, 0.6),
    encoded: bool = True,
    out: MaterialMaps | None = None,
    threads: int = THREADS,
    width: str = "widest",
) -> MaterialMaps:
    """Height, normal, gloss and du/dv of a picture (h, w, 3 or 4) uint8, uint16 or float32, alpha ignored.

    One sweep down the rows, a second for du/dv: less than three times the time of the normals alone. What
    stages.height, .normal, .gloss and .dudv make one after the other, bit for bit; but du/dv, which is within
    5/8 of a code of the normal's x and y less one mean, where theirs may put other texels right to sum to
    zero. Nothing is filled: pictures with a UV layout or with transparent texels go the way of the stages.

    encoded: the colour is sRGB, else linear light; codes are shares of their largest. levels: luminance to
    height; gloss_levels: luminance to t; specular, smoothness: their values (at t = 0, at t = 1), in 0..1.
    The rest as in normals_from_heights. out: see empty_maps.
    Raises SourceError for a colour whose luminance is not finite, with its row and column.
    """
    if (
        color.dtype not in (np.uint8, np.uint16, np.float32)
        or color.ndim != 3
        or color.shape[2] not in (3, 4)
    ):
        raise ValueError(f"color has shape {color.shape} of {color.dtype}")
    if color.size == 0 or not all(0.0 <= end <= 1.0 for end in (*specular, *smoothness)):
        raise ValueError(f"color {color.shape} is empty, or {specular}, {smoothness} are not within 0..1")
    color = np.ascontiguousarray(color)
    rows, columns = color.shape[:2]
    out = out or empty_maps(rows, columns)
    _target(out.height, (rows, columns), np.uint16, "out.height")
    _target(out.normal, (rows, columns, 3), np.uint8, "out.normal")
    _target(out.gloss, (rows, columns, 2), np.uint8, "out.gloss")
    _target(out.dudv, (rows, columns, 2), np.int8, "out.dudv")
    gloss = [specular[0], specular[1] - specular[0], smoothness[0], smoothness[1] - smoothness[0]]
    done = _normals.material_maps(
        color,
        _weights(derivative, "derivative", MAX_REACH),
        _weights(smooth, "smooth", MAX_REACH + 1),
        float(scale[0]),
        float(scale[1]),
        wrap[0],
        wrap[1],
        green_down,
        _numbers(levels or Levels()),
        _numbers(gloss_levels or Levels()),
        np.array(gloss, np.float32),
        encoded,
        out.height,
        out.normal,
        out.gloss,
        out.dudv,
        threads,
        _WIDTHS[width],
    )
    if not done:
        raise _refuse([np.asarray(color[:, :, :3].sum(axis=2))], "the luminance of a colour")
    return out

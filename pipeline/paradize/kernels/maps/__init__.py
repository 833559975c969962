"""Python interface of the map kernels. Functions return new arrays; only `balance` changes its arguments.

Images are (h, w, c) or (h, w) float32, row 0 at the top. Wrong shapes and types raise ValueError: they are
faults of the program, not of a source file. Results do not depend on `threads`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from paradize.kernels.arrays import to_indices
from paradize.kernels.maps import _maps
from paradize.kernels.threads import default_threads

if TYPE_CHECKING:
    from collections.abc import Sequence

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]

THREADS = default_threads(2)


def _f32(array: npt.NDArray[Any], *, shape: Sequence[int | None], name: str) -> F32:
    """`array` as contiguous float32. Its shape must match; None stands for any size of at least 1."""
    if array.dtype != np.float32:
        raise ValueError(f"{name} is {array.dtype}, not float32")
    if array.ndim != len(shape) or array.size == 0:
        raise ValueError(f"{name} has shape {array.shape}")
    if any(size is not None and size != have for size, have in zip(shape, array.shape, strict=True)):
        raise ValueError(f"{name} has shape {array.shape}, not {tuple(shape)}")
    return np.ascontiguousarray(array)


_TEXEL_TYPES = (np.uint8, np.uint16, np.float32)


def _texels(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """(h, w, 1..4) uint8, uint16 or float32, contiguous."""
    if values.dtype not in _TEXEL_TYPES or values.ndim != 3 or values.size == 0 or values.shape[2] > 4:
        raise ValueError(f"texels have shape {values.shape} of {values.dtype}")
    return np.ascontiguousarray(values)


def linear_light(values: npt.NDArray[Any], *, encoded: bool, threads: int = THREADS) -> F32:
    """Integers or floats (h, w, 1..4) -> linear light (h, w, c) float32. Alpha, the last of 2 or 4 channels,
    is unchanged.

    encoded: colour is sRGB, else linear. Integers are shares of their largest value.
    """
    values = _texels(values)
    out = np.empty(values.shape, np.float32)
    _maps.linear_light(values, values.shape[2], encoded, out, threads)
    return out


def halved_light(codes: npt.NDArray[np.uint8], *, threads: int = THREADS) -> F32:
    """sRGB (h, w, 1..4) uint8, h and w even -> linear means of 2 x 2 texels, weighted by alpha."""
    if codes.dtype != np.uint8:
        raise ValueError(f"codes are {codes.dtype}, not uint8")
    codes = _texels(codes)
    out = np.empty((codes.shape[0] // 2, codes.shape[1] // 2, codes.shape[2]), np.float32)
    _maps.halved_light(codes, out, threads)
    return out


def rgba_codes(values: npt.NDArray[Any], *, encoded: bool, threads: int = THREADS) -> npt.NDArray[np.uint8]:
    """Integers or floats (h, w, 1..4) -> nearest 8-bit sRGB values (h, w, 4). Grey is copied to three
    channels; a missing alpha is opaque. encoded: colour is sRGB, else linear. Clamped to 0..1."""
    values = _texels(values)
    if encoded and values.dtype == np.uint8 and values.shape[2] == 4:
        return values
    out = np.empty((*values.shape[:2], 4), np.uint8)
    _maps.rgba_codes(values, values.shape[2], encoded, out, threads)
    return out


def luminance(pixels: F32, *, threads: int = THREADS) -> F32:
    """Rec. 709 luminance (h, w) of linear (h, w, c). Grey is copied, alpha ignored."""
    pixels = _f32(pixels, shape=(None, None, None), name="pixels")
    out = np.empty(pixels.shape[:2], np.float32)
    _maps.luminance(pixels, pixels.shape[2], out, threads)
    return out


@dataclass(frozen=True)
class Levels:
    """Converts a luminance to a height or a gloss. Applied in this order; all values within -1e6..1e6.

    black, white: luminances that become 0 and 1; they must differ, and swapped they invert. gamma: at least
    0.001; above 1 brightens the middle. contrast: around 0.5. brightness: added. invert: 1 - t at the end.
    """

    black: float = 0.0
    white: float = 1.0
    gamma: float = 1.0
    contrast: float = 1.0
    brightness: float = 0.0
    invert: bool = False

    def __post_init__(self) -> None:
        numbers = (self.black, self.white, self.gamma, self.contrast, self.brightness)
        if not all(-1e6 <= number <= 1e6 for number in numbers):  # NaN fails too
            raise ValueError(f"levels {numbers} are not within -1e6..1e6")
        if self.black == self.white or self.gamma < 1e-3:
            raise ValueError(f"black {self.black} equals white, or gamma {self.gamma} is below 0.001")


def apply_levels(values: F32, levels: Levels, *, threads: int = THREADS) -> F32:
    """Applies levels to a plane (h, w): black..white -> 0..1, t^(1/gamma), contrast, brightness, invert."""
    values = _f32(values, shape=(None, None), name="values")
    out = np.empty_like(values)
    _maps.apply_levels(
        values,
        levels.black,
        levels.white,
        levels.gamma,
        levels.contrast,
        levels.brightness,
        levels.invert,
        out,
        threads,
    )
    return out


def half_size(size: int) -> int:
    """The size of the next mip level."""
    return max(1, size // 2)


def rows_below(rows: int, first: int, end: int) -> tuple[int, int]:
    """The rows [begin, end) of a level with `rows` rows from which the rows [first, end) of the next level
    are computed."""
    return (0, 1) if rows == 1 else (2 * first, 2 * end + rows % 2)


def halve(
    image: F32,
    *,
    with_alpha: bool = False,
    rows: int | None = None,
    first: int = 0,
    threads: int = THREADS,
) -> F32:
    """Area means (half_size(h), half_size(w), c) of (h, w, c). with_alpha: weighted by the last channel.

    rows: the image is a band of a level with this many rows (see rows_below); `first` is the first row of the
    result in the next level.
    """
    image = _f32(image, shape=(None, None, None), name="image")
    whole = image.shape[0] if rows is None else rows
    count = 1 if whole == 1 else (image.shape[0] - whole % 2) // 2
    out = np.empty((count, half_size(image.shape[1]), image.shape[2]), np.float32)
    _maps.halve(image, whole, first, with_alpha, out, threads)
    return out


def cut_face(
    light: F32, axes: npt.NDArray[np.float64], *, size: int, spots: int, threads: int = THREADS
) -> F32:
    """(size, size, 3): a face of a cube map, cut out of a panorama (h, 2 h, 3) that is south, west, north
    (-Z), east and south from left to right; each texel the mean of spots * spots places, by solid angle.

    axes: (3, 3) middle, right, down: the direction of the place s, t, -1..1 each, is middle + s * right + t *
    down.
    """
    light = _f32(light, shape=(None, None, 3), name="light")
    if axes.shape != (3, 3):
        raise ValueError(f"axes of shape {axes.shape}, expected (3, 3)")
    out = np.empty((size, size, 3), np.float32)
    _maps.cut_face(light, axes.reshape(-1).tolist(), spots, out, threads)
    return out


def normalise(vectors: F32, *, threads: int = THREADS) -> F32:
    """(h, w, 3) vectors with length 1; a zero vector becomes (0, 0, 1)."""
    vectors = _f32(vectors, shape=(None, None, 3), name="vectors")
    out = np.empty_like(vectors)
    _maps.normalise(vectors, out, threads)
    return out


def coverage_factor(alpha: F32, *, fraction: float, cutoff: float) -> float:
    """The factor, within 1/16..16, that keeps a `fraction` of alpha (h, w) at or above `cutoff`."""
    alpha = _f32(alpha, shape=(None, None), name="alpha")
    return float(_maps.coverage_factor(alpha, fraction, cutoff))


def smoothness_to_variance(smoothness: F32, *, threads: int = THREADS) -> F32:
    """(h, w) smoothness s -> squared roughness (1 - s)^4, which averages linearly."""
    smoothness = _f32(smoothness, shape=(None, None), name="smoothness")
    out = np.empty_like(smoothness)
    _maps.smoothness_to_variance(smoothness, out, threads)
    return out


def widened_smoothness(variance: F32, averages: F32, *, threads: int = THREADS) -> F32:
    """(h, w) smoothness from squared roughness (h, w) and mean vectors (h, w, 3) of unit normals."""
    variance = _f32(variance, shape=(None, None), name="variance")
    averages = _f32(averages, shape=(*variance.shape, 3), name="averages")
    out = np.empty_like(variance)
    _maps.widened_smoothness(variance, averages, out, threads)
    return out


def uv_islands(uvs: F32, triangles: npt.NDArray[np.uint32]) -> I32:
    """The island (m,) of each triangle (m, 3): triangles that share a UV point (n, 2), finite, share an
    island."""
    uvs = _f32(uvs, shape=(None, 2), name="uvs")
    if not np.isfinite(uvs).all():
        raise ValueError("uvs are not finite")
    out = np.empty(len(triangles), np.int32)
    _maps.uv_islands(uvs, to_indices(triangles), out)
    return out


def rasterise(
    uvs: F32,
    triangles: npt.NDArray[np.uint32],
    ids: I32,
    *,
    height: int,
    width: int,
    work_limit: float = 2e9,
    touched: bool = True,
) -> I32:
    """Draws ids (m,) of triangles (m, 3) by their top-left UVs (n, 2) into (height, width) int32; -1: none.

    Conservative: each touched texel gets an id, also from a line or a point; where not `touched`, only texels
    whose centre a triangle covers. Raises ValueError where the UVs
    repeat so often that their rows of texels, in all tiles, would be more than work_limit.
    """
    uvs = _f32(uvs, shape=(None, 2), name="uvs")
    out = np.empty((height, width), np.int32)
    _maps.rasterise(
        uvs,
        to_indices(triangles),
        np.ascontiguousarray(ids, np.int32),
        work_limit,
        touched,
        out,
    )
    return out


def nearest_covered(
    covered: npt.NDArray[np.bool_], *, wrap: tuple[bool, bool], threads: int = THREADS
) -> I32:
    """For each texel (h, w) the flat index of the nearest covered texel; -1 where none is covered."""
    if covered.ndim != 2 or covered.size == 0:
        raise ValueError(f"covered has shape {covered.shape}")
    out = np.empty(covered.shape, np.int32)
    _maps.nearest_covered(np.ascontiguousarray(covered, np.uint8), wrap[0], wrap[1], out, threads)
    return out


def snorm8(values: F32, *, threads: int = THREADS) -> npt.NDArray[np.int8]:
    """Nearest integers -127..127 of values within [-1, 1], any shape."""
    values = np.ascontiguousarray(values, np.float32)
    out = np.empty(values.shape, np.int8)
    _maps.snorm8(values, out, threads)
    return out


def dudv_codes(
    vectors: F32, mean: tuple[float, float], *, threads: int = THREADS
) -> tuple[npt.NDArray[np.int8], npt.NDArray[np.int8]]:
    """x and y of vectors (h, w, 3) minus their mean -> SNORM values (h, w, 2) int8, and the rounding residual
    of each in steps of 1/64 (for `balance`)."""
    vectors = _f32(vectors, shape=(None, None, 3), name="vectors")
    codes = np.empty((*vectors.shape[:2], 2), np.int8)
    residual = np.empty_like(codes)
    _maps.dudv_codes(vectors, mean[0], mean[1], codes, residual, threads)
    return codes, residual


def balance(codes: npt.NDArray[np.int8], residual: npt.NDArray[np.int8]) -> None:
    """Changes values (h, w, 2) in place, each by at most one, until the sum of each channel is exactly zero.
    `residual`, from dudv_codes, decides their order and is updated."""
    for array in (codes, residual):
        if array.dtype != np.int8 or array.shape != codes.shape or not array.flags.c_contiguous:
            raise ValueError(f"codes and rests have shapes {codes.shape}, {residual.shape}")
    _maps.balance(codes, residual)

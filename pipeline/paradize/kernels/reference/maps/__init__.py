"""Python interface of the reference kernels that compare the levels of a map with float64. No stage imports
it.

Each result is a list with an Error per level, level 0 first. It does not depend on the number of threads.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

import paradize.kernels.reference._reference as _reference
from paradize.kernels.threads import default_threads

Taps: TypeAlias = tuple[Sequence[float], Sequence[float]]

PLAIN = {"unorm8": 0, "snorm8": 1, "unorm16": 2, "snorm16": 3, "float32": 4}
BLOCKS = {"bc1": (5, 3, 8), "bc3": (6, 4, 16), "bc4": (7, 1, 8), "bc5": (8, 2, 16), "bc5_signed": (9, 2, 16)}
_BYTES = {"unorm8": 1, "snorm8": 1, "unorm16": 2, "snorm16": 2, "float32": 4}
_THREADS = 8
MAX_REACH = 64  # of a filter, texels to each side


class Error(NamedTuple):
    """The errors of a level. number: their count. sum: of the angles, or of the squared differences. p99,
    max: of the angles or the absolute differences; p99 is the 99th percentile."""

    number: int
    sum: float
    p99: float
    max: float
    alpha_squares: float
    alpha_number: int


def _require_finite(values: npt.NDArray[Any], what: str) -> None:
    """Raises ValueError for NaN and infinity, which comparisons would treat as no error. Makes no copy."""
    if values.dtype.kind == "f" and values.size and not np.isfinite([values.min(), values.max()]).all():
        raise ValueError(f"{what} are not finite")


class Texture:
    """The levels of a texture for the kernels.

    name: of PLAIN (with its number of channels) or BLOCKS. levels: bytes, level 0 first, tightly packed.
    Raises ValueError for wrong sizes.
    """

    def __init__(
        self, name: str, rows: int, columns: int, levels: Sequence[bytes | memoryview], channels: int = 0
    ) -> None:
        if rows < 1 or columns < 1 or not levels:
            raise ValueError(f"{len(levels)} levels of {columns} x {rows} texels")
        if name in BLOCKS:
            number, channels, size = BLOCKS[name]
        elif name in PLAIN and 1 <= channels <= 4:
            number, size = PLAIN[name], _BYTES[name] * channels
        else:
            raise ValueError(f"no texels of {channels} x {name!r}")
        data_of_levels = []
        for k, level in enumerate(levels):
            down, across = max(1, rows >> k), max(1, columns >> k)
            if name in BLOCKS:
                down, across = -(-down // 4), -(-across // 4)
            data = np.frombuffer(level, np.uint8)
            if len(data) != down * across * size:
                raise ValueError(f"level {k} holds {len(data)} bytes, not {down * across * size}")
            if name == "float32":
                _require_finite(data.view("<f4"), f"texels of level {k}")
            data_of_levels.append(data)
        self.rows, self.columns, self.channels = rows, columns, channels
        self.native = _reference.Texture(number, channels, rows, columns, data_of_levels)


class HeightMap:
    """Heights (h, w) float32, finite, and how their slopes are derived.

    taps: (derivative, smooth) as defined in kernels/reference/maps/height_map.hpp. scale: slope along (x, y)
    of one unit of height between neighbouring texels. wrap: whether the map repeats along (x, y). islands:
    (h, w) int32, negative outside. height_levels: (n,) float32, rising: the heights that neighbouring
    integers of the source stand for; None for float sources. exact: the derivative around whose slopes the
    half steps lie. clamp_slopes: whether slopes are clamped to what the half steps allow. cones: whether
    angles that the half steps leave open count as no error. Raises ValueError.
    """

    def __init__(
        self,
        heights: npt.ArrayLike,
        *,
        taps: Taps,
        scale: tuple[float, float],
        wrap: tuple[bool, bool],
        green_down: bool = False,
        islands: npt.ArrayLike | None = None,
        height_levels: npt.ArrayLike | None = None,
        exact: Sequence[float] = (),
        clamp_slopes: bool = False,
        cones: bool = False,
    ) -> None:
        rows = np.ascontiguousarray(heights, np.float32)
        if rows.ndim != 2 or rows.size == 0:
            raise ValueError(f"expected (h, w) heights, got {rows.shape}")
        _require_finite(rows, "heights")
        if not np.isfinite([*scale]).all():
            raise ValueError(f"a scale of {scale}")
        derivative, smooth = [*map(float, taps[0])], [*map(float, taps[1])]
        longest = max(len(derivative), len(smooth) - 1, len(exact))
        if not smooth or not derivative or longest > MAX_REACH:
            raise ValueError(f"{len(derivative)} and {len(smooth)} taps")
        ids = None if islands is None else np.ascontiguousarray(islands, np.int32)
        if ids is not None and ids.shape != rows.shape:
            raise ValueError(f"{ids.shape} islands of {rows.shape} heights")
        steps = None if height_levels is None else np.ascontiguousarray(height_levels, np.float32)
        if steps is not None and not (
            steps.ndim == 1 and np.isfinite(steps).all() and (np.diff(steps) > 0).all()
        ):
            raise ValueError("the heights of codes do not rise")
        if (clamp_slopes or (cones and steps is not None)) and not exact:
            raise ValueError("half steps lie around exact slopes, of which there are none")
        self.shape, self.cones = rows.shape, cones
        self.native = _reference.height_map(
            rows,
            derivative,
            smooth,
            (float(scale[0]), float(scale[1])),
            wrap,
            green_down,
            ids,
            steps,
            [*map(float, exact)],
            clamp_slopes,
            cones,
        )


class Vectors:
    """Unit vectors (h, w, 3) float32, finite: the normals of an authored map. islands: as of
    HeightMap. Raises ValueError."""

    cones = False

    def __init__(self, vectors: npt.ArrayLike, *, islands: npt.ArrayLike | None = None) -> None:
        exact = np.ascontiguousarray(vectors, np.float32)
        if exact.ndim != 3 or exact.shape[2] != 3 or exact.size == 0:
            raise ValueError(f"expected (h, w, 3) vectors, got {exact.shape}")
        _require_finite(exact, "vectors")
        ids = None if islands is None else np.ascontiguousarray(islands, np.int32)
        if ids is not None and ids.shape != exact.shape[:2]:
            raise ValueError(f"{ids.shape} islands of {exact.shape} vectors")
        self.shape = exact.shape[:2]
        self.native = _reference.drawn(exact, ids)


Normals: TypeAlias = HeightMap | Vectors


def _workers(threads: int | None) -> int:
    return default_threads(_THREADS) if threads is None else max(1, threads)


def _errors(levels: list[tuple[Any, ...]]) -> list[Error]:
    return [Error(*level) for level in levels]


def _check_size(texture: Texture, shape: tuple[int, ...], channels: int) -> None:
    if shape[:2] != (texture.rows, texture.columns) or texture.channels < channels:
        what = f"{texture.columns} x {texture.rows} texels of {texture.channels} channels"
        raise ValueError(f"a texture of {what} beside {shape}")


def normal_levels(
    texture: Texture, height_map: Normals, *, offsets: bool = False, threads: int | None = None
) -> list[Error]:
    """Angles in degrees between the normals rebuilt from the texture's x and y and those of the height map.
    offsets: the texture is du/dv, minus its mean."""
    _check_size(texture, height_map.shape, 2)
    return _errors(_reference.normal_levels(texture.native, height_map.native, offsets, _workers(threads)))


def filter_angles(height_map: HeightMap, other: HeightMap, *, threads: int | None = None) -> Error:
    """Angles in degrees between the normals of the same heights by two filters."""
    if height_map.shape != other.shape:
        raise ValueError(f"{height_map.shape} and {other.shape} heights")
    return _errors(_reference.filter_angles(height_map.native, other.native, _workers(threads)))[0]


def open_angles(height_map: HeightMap, *, threads: int | None = None) -> Error:
    """Angles in degrees of the cones of a height map: between each normal and the farthest normal that the
    half steps allow."""
    if not height_map.cones:
        raise ValueError("a height map without cones")
    return _errors(_reference.open_angles(height_map.native, _workers(threads)))[0]


def value_levels(texture: Texture, values: npt.ArrayLike, *, threads: int | None = None) -> list[Error]:
    """Differences from values (h, w, c) float32."""
    exact = np.ascontiguousarray(values, np.float32)
    if exact.ndim != 3 or exact.shape[2] == 0:
        raise ValueError(f"expected (h, w, c) values, got {exact.shape}")
    _require_finite(exact, "values")
    _check_size(texture, exact.shape, exact.shape[2])
    return _errors(_reference.value_levels(texture.native, exact, _workers(threads)))


def gloss_levels(
    texture: Texture, gloss: npt.ArrayLike, height_map: Normals, *, threads: int | None = None
) -> list[Error]:
    """Differences from gloss (h, w, 2) float32, whose smoothness is widened by the normals of the height
    map."""
    exact = _gloss(texture, gloss, height_map)
    return _errors(_reference.gloss_levels(texture.native, exact, height_map.native, _workers(threads)))


def highlight_levels(
    texture: Texture, gloss: npt.ArrayLike, height_map: Normals, *, threads: int | None = None
) -> list[Error]:
    """Errors of the half-width of highlights of this smoothness, in degrees, at half maximum of GGX's
    distribution of slopes."""
    exact = _gloss(texture, gloss, height_map)
    return _errors(_reference.highlight_levels(texture.native, exact, height_map.native, _workers(threads)))


def _gloss(texture: Texture, gloss: npt.ArrayLike, height_map: Normals) -> npt.NDArray[np.float32]:
    exact = np.ascontiguousarray(gloss, np.float32)
    if exact.ndim != 3 or exact.shape[2] != 2 or exact.shape[:2] != height_map.shape:
        raise ValueError(f"gloss {exact.shape} on heights of {height_map.shape}")
    _require_finite(exact, "values of gloss")
    _check_size(texture, exact.shape, 2)
    return exact


def color_levels(
    texture: Texture,
    pixels: npt.NDArray[Any],
    *,
    encoded: bool,
    alpha_cutoff: float | None = None,
    threads: int | None = None,
) -> list[Error]:
    """Differences from pixels (h, w, 3 | 4) uint8, uint16 or float32, as defined in
    reference/maps/maps.hpp."""
    exact = np.ascontiguousarray(pixels)
    if (
        exact.ndim != 3
        or exact.shape[2] not in (3, 4)
        or exact.dtype not in (np.uint8, np.uint16, np.float32)
    ):
        raise ValueError(f"expected (h, w, 3 | 4) pixels, got {exact.shape} of {exact.dtype}")
    _require_finite(exact, "pixels")
    _check_size(texture, exact.shape, exact.shape[2])
    cutoff = 0.0 if alpha_cutoff is None else float(alpha_cutoff)
    return _errors(_reference.color_levels(texture.native, exact, encoded, cutoff, _workers(threads)))

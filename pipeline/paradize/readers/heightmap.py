"""A grey-level picture -> Heightfield: integers span 0..H metres, floats and signed integers are metres.

Raw SRTM tiles (`.hgt`: square, signed 16 bit, big-endian) are read too. Pixels without a height are filled
from their surroundings and told: NaN, the value that a TIFF declares (GDAL's tag), SRTM's -32768.

Pixel (0, 0) is the corner at -X, -Z; a pixel is a vertex, so the sizes span the first to the last pixel.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from paradize.data import Heightfield, Image
from paradize.errors import SourceError
from paradize.readers.image import read_image
from paradize.readers.nodata import declared_nodata, fill_nodata

MAX_SIDE = 16385
HEIGHT_LIMIT_M = 1e7
SRTM_VOID = -32768.0
BAND = 256  # rows


def read_heightmap(
    path: Path, *, size_x_m: float, size_z_m: float, height_m: float, base_m: float = 0.0
) -> tuple[Heightfield, list[str]]:
    """The heights in `path`, metres, and warnings.

    height_m: how far white lies above black, for integer pictures; floats are metres already. base_m: y of
    black (of 0 in floats). Sizes: metres, > 0. Raises SourceError for what is no picture, less than 2 pixels
    on a side, more than MAX_SIDE, coloured, without any height, infinite or farther than
    HEIGHT_LIMIT_M from 0, with the pixel.
    """
    warnings: list[str] = []
    void: float | None
    if path.suffix.lower() == ".hgt":
        image, metres, void = _read_srtm(path), True, SRTM_VOID
    else:
        image = read_image(path, color_space="data", finite=False)
        metres, void = image.plain, declared_nodata(path)
        if void is not None and not metres:  # a code, as the pixels are shares of the largest
            top = np.float32({8: 255.0, 16: 65535.0}.get(image.source_bits, 4294967295.0))
            void = float(np.float32(void) / top)
    rows, columns, channels = image.values.shape
    if min(rows, columns) < 2 or max(rows, columns) > MAX_SIDE:
        raise SourceError(
            f"is {columns} x {rows} pixels; allowed: 2 to {MAX_SIDE} on each side",
            file=path,
            mend="a pixel is a vertex, so a terrain needs two each way",
        )
    levels = image.values[:, :, 0]
    if channels >= 3 and not all(np.array_equal(levels, image.values[:, :, k]) for k in (1, 2)):
        raise SourceError("is a colour picture", file=path, mend="save the heights as one grey channel")
    if channels in (2, 4):
        warnings.append(f"{path}: the alpha channel is ignored")
    if not metres and image.source_bits == 8:
        step = abs(height_m) / 255.0
        warnings.append(
            f"{path}: has 8 bits a pixel: heights are steps of {step:.3g} m; save it with 16 bits"
        )
    heights = np.empty((rows, columns), np.float32)
    filled: npt.NDArray[np.float64] | None = None
    if any(_missing(_levels(image, band), void).any() for band in _bands(rows)):
        filled, told = _filled(_levels(image, slice(0, rows)), void, path)
        warnings.extend(told)
    bad = 0
    worst: tuple[int, int, float] | None = None
    for band in _bands(rows):
        part = _levels(image, band) if filled is None else filled[band]
        if not metres:
            part = part * height_m
        part = part + base_m
        wrong = ~(np.abs(part) <= HEIGHT_LIMIT_M)
        if wrong.any():
            row, column = (int(k) for k in np.argwhere(wrong)[0])
            worst = worst or (band.start + row, column, float(part[row, column]))
            bad += int(wrong.sum())
        with np.errstate(over="ignore"):  # what overflows is told below
            heights[band] = part
    if worst is not None:
        row, column, height = worst
        raise SourceError(
            f"holds {height:g} m; allowed: up to {HEIGHT_LIMIT_M:g} m ({bad} such)",
            file=path,
            place=f"pixel ({column}, {row})",
        )
    return Heightfield(heights, size_x_m, size_z_m), warnings


def _bands(rows: int) -> list[slice]:
    """Rows in bands, so that large fields are widened a piece at a time."""
    return [slice(first, min(first + BAND, rows)) for first in range(0, rows, BAND)]


def _levels(image: Image, band: slice) -> npt.NDArray[np.float64]:
    """The first channel of some rows, codes as shares of the largest."""
    return replace(image, values=image.values[band, :, :1]).pixels[:, :, 0].astype(np.float64)


def _read_srtm(path: Path) -> Image:
    """A raw SRTM tile: 2 bytes a pixel, as many rows as columns (3601 or 1201 as published)."""
    try:
        size = path.stat().st_size
        side = math.isqrt(size // 2)
        if size % 2 or side * side * 2 != size or not 2 <= side <= MAX_SIDE:
            raise SourceError(
                f"has {size} bytes; a .hgt file has 2 for each pixel of a square, 2 to {MAX_SIDE} on a side",
                file=path,
                mend="fetch it again: it may be cut",
            )
        raw = np.fromfile(path, dtype=">i2")
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror}", file=path) from error
    if raw.size != side * side:
        raise SourceError("changed while it was read", file=path)
    return Image(raw.reshape(side, side, 1).astype(np.float32), "data", 32)


def _missing(heights: npt.NDArray[np.float64], void: float | None) -> npt.NDArray[np.bool_]:
    missing = np.isnan(heights)
    if void is not None and not math.isnan(void):
        missing |= heights == np.float64(np.float32(void))
    return missing


def _filled(
    heights: npt.NDArray[np.float64], void: float | None, path: Path
) -> tuple[npt.NDArray[np.float64], list[str]]:
    """Heights without holes, and a warning with the number of pixels filled and the first of them."""
    missing = _missing(heights, void)
    count = int(np.count_nonzero(missing))
    row, column = (int(k) for k in np.argwhere(missing)[0])
    place = f"pixel ({column}, {row})"
    if count == heights.size:
        raise SourceError("has no height in any pixel", file=path)
    wrong = np.isinf(heights) & ~missing
    if wrong.any():
        row, column = (int(k) for k in np.argwhere(wrong)[0])
        raise SourceError("holds infinity", file=path, place=f"pixel ({column}, {row})")
    text = f"{path}: {count} pixels without a height are filled from their surroundings, the first at {place}"
    return fill_nodata(heights, ~missing), [text]

"""A grey-level picture -> Heightfield: integers span 0..H metres, floats and signed integers are metres.

Pixel (0, 0) is the corner at -X, -Z; a pixel is a vertex, so the sizes span the first to the last pixel.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from paradize.data import Heightfield
from paradize.errors import SourceError
from paradize.readers.image import holds_plain_numbers, read_image

MAX_SIDE = 16385
HEIGHT_LIMIT_M = 1e7


def read_heightmap(
    path: Path, *, size_x_m: float, size_z_m: float, height_m: float, base_m: float = 0.0
) -> tuple[Heightfield, list[str]]:
    """The heights in `path`, metres, and warnings.

    height_m: how far white lies above black, for integer pictures; floats are metres already. base_m: y of
    black (of 0 in floats). Sizes: metres, > 0. Raises SourceError for what is no picture, less than 2 pixels
    on a side, more than MAX_SIDE, coloured, NaN, infinite or farther than HEIGHT_LIMIT_M from 0, with the
    pixel.
    """
    warnings: list[str] = []
    image = read_image(path, color_space="data")
    metres = holds_plain_numbers(path)
    pixels = image.pixels
    rows, columns, channels = pixels.shape
    if min(rows, columns) < 2 or max(rows, columns) > MAX_SIDE:
        raise SourceError(
            f"is {columns} x {rows} pixels; allowed: 2 to {MAX_SIDE} on each side",
            file=path,
            mend="a pixel is a vertex, so a terrain needs two each way",
        )
    levels = pixels[:, :, 0]
    if channels >= 3 and not all(np.array_equal(levels, pixels[:, :, k]) for k in (1, 2)):
        raise SourceError("is a colour picture", file=path, mend="save the heights as one grey channel")
    if channels in (2, 4):
        warnings.append(f"{path}: the alpha channel is ignored")
    if not metres and image.source_bits == 8:
        step = abs(height_m) / 255.0
        warnings.append(
            f"{path}: has 8 bits a pixel: heights are steps of {step:.3g} m; save it with 16 bits"
        )
    heights = levels.astype(np.float64)
    if not metres:
        heights = heights * height_m
    heights = heights + base_m
    bad = ~(np.abs(heights) <= HEIGHT_LIMIT_M)
    if bad.any():
        row, column = (int(k) for k in np.argwhere(bad)[0])
        raise SourceError(
            f"holds {heights[row, column]:g} m; allowed: up to {HEIGHT_LIMIT_M:g} m ({int(bad.sum())} such)",
            file=path,
            place=f"pixel ({column}, {row})",
        )
    return Heightfield(np.ascontiguousarray(heights.astype(np.float32)), size_x_m, size_z_m), warnings

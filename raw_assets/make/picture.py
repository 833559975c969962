"""Writes images through OpenImageIO, with the same bytes in every run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from noise import Array


def write_image(path: Path, pixels: Array, depth: str) -> None:
    """Writes one image and creates its folder.

    pixels : (h, w) or (h, w, c), 0..1 for the integer depths, any finite value for half
    depth : "uint8" (sRGB colour, tagged so), "uint16" (plain data) or "half" (EXR, ZIP)
    Raises OSError with OpenImageIO's message if it cannot be written.
    """
    if not np.isfinite(pixels).all():
        raise ValueError(f"{path.name}: a pixel is not finite")
    grid = pixels if pixels.ndim == 3 else pixels[:, :, None]
    height, width, channels = grid.shape
    if depth == "half":
        data = np.ascontiguousarray(grid, dtype=np.float16)
    else:
        top = 255 if depth == "uint8" else 65535
        data = np.ascontiguousarray(np.floor(np.clip(grid, 0.0, 1.0) * top + 0.5).astype(depth))
    spec = oiio.ImageSpec(width, height, channels, depth)
    spec.attribute("DateTime", "2026:01:01 00:00:00")
    spec.attribute("Software", "paradize raw_assets")
    spec.attribute("oiio:ColorSpace", "srgb_rec709_scene" if depth == "uint8" else "data")
    if depth == "half":
        spec.attribute("compression", "zip")
        spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
    else:
        spec.attribute("png:compressionLevel", 7)
    path.parent.mkdir(parents=True, exist_ok=True)
    output = oiio.ImageOutput.create(str(path))
    if output is None:
        raise OSError(f"{path}: {oiio.geterror()}")
    try:
        if not (output.open(str(path), spec) and output.write_image(data)):
            raise OSError(f"{path}: {output.geterror()}")
    finally:
        output.close()


def srgb_encode(linear: Array) -> Array:
    """Linear light 0..1 to sRGB 0..1 (IEC 61966-2-1)."""
    clipped = np.clip(linear, 0.0, 1.0)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)


def hex_color(code: str) -> Array:
    """ "#RRGGBB" to three sRGB values 0..1."""
    return np.array([int(code[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0

"""Heights, normals and picture files that tests of maps share."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from paradize.kernels import maps

FILTERS = ("central", "scharr", "fourth")


def normals(
    heights: np.ndarray,
    *,
    scale: tuple[float, float] = (1.0, 1.0),
    filter_name: str = "fourth",
    wrap: tuple[bool, bool] = (False, False),
    green_down: bool = False,
    islands: np.ndarray | None = None,
) -> np.ndarray:
    return maps.normals_from_heights(
        np.ascontiguousarray(heights, np.float32),
        scale=scale,
        filter_name=filter_name,
        wrap=wrap,
        green_down=green_down,
        islands=islands,
    )


def waves(rows: int, columns: int, seed: int, wavelength: float = 12.0) -> np.ndarray:
    """Smooth periodic heights of a few sinusoids whose wavelengths are whole parts of the size, not below
    `wavelength`."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:rows, 0:columns]
    heights = np.zeros((rows, columns))
    for _ in range(6):
        kx = rng.integers(-columns // wavelength, columns // wavelength + 1)
        ky = rng.integers(-rows // wavelength, rows // wavelength + 1)
        heights += np.sin(2 * np.pi * (kx * x / columns + ky * y / rows) + rng.random() * 6)
    return heights.astype(np.float32)


def save(path: Path, pixels: np.ndarray, kind: object = oiio.UINT8) -> Path:
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    assert target.write_image(np.ascontiguousarray(pixels))
    assert target.close()
    return path

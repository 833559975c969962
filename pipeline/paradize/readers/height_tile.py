"""Tiles of web maps whose 8-bit colours are the digits of heights in metres.

Sources: Mapzen, "Terrain tiles: formats" (Terrarium), 2017; Mapbox, "Access elevation data" (Terrain-RGB),
2016.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from paradize.data import Image
from paradize.errors import SourceError
from paradize.files import open_file

_JPEG = b"\xff\xd8\xff"
_WEBP = b"RIFF", b"WEBPVP8 "  # of lossy pictures without alpha, with the size between
_LOWEST_M, _HIGHEST_M = -12_000.0, 9_000.0  # of the Earth, the sea's floor included


@dataclass(frozen=True)
class _Digits:
    """Metres of one step of red, green and blue, and of black."""

    red_m: float
    green_m: float
    blue_m: float
    black_m: float


_DIGITS = {
    "terrarium": _Digits(256.0, 1.0, 1.0 / 256.0, -32768.0),
    "terrain-rgb": _Digits(6553.6, 25.6, 0.1, -10000.0),
}


def tile_step_m(encoding: str) -> float:
    """The smallest difference of two heights of a tile, metres."""
    return _DIGITS[encoding].blue_m


def metres_of_tile(image: Image, path: Path, encoding: str) -> Image:
    """The heights of a tile as one channel of float32 metres; NaN where it is transparent.

    encoding: "terrarium" or "terrain-rgb". Raises SourceError for a picture that is not of 8-bit colours, or
    is a JPEG or a lossy WebP, which keep no digits.
    """
    channels = image.values.shape[2]
    if image.values.dtype != np.uint8 or channels < 3:
        held = f"{channels} {'channels' if channels > 1 else 'channel'} of {image.source_bits} bits"
        raise SourceError(
            f"has {held}; a {encoding} tile has colours of 8 bits",
            file=path,
            mend='take the tile as its server sends it, or the encoding "grey"',
        )
    with open_file(path) as file:
        start = file.read(16)
    lossy = "JPEG" if start.startswith(_JPEG) else "lossy WebP" if (start[:4], start[8:]) == _WEBP else ""
    if lossy:
        what = f"is a {lossy}, which changes colours a little: the digits of a {encoding} tile are lost"
        raise SourceError(what, file=path, mend="take the tile as PNG or as lossless WebP")
    digits = _DIGITS[encoding]
    metres: npt.NDArray[np.float32] = np.empty((*image.values.shape[:2], 1), np.float32)
    for row, colors in enumerate(image.values):
        red, green, blue = (colors[:, channel].astype(np.float64) for channel in range(3))
        total = red * digits.red_m + green * digits.green_m + blue * digits.blue_m
        metres[row, :, 0] = total + digits.black_m
        if channels == 4:
            metres[row, colors[:, 3] == 0, 0] = np.nan
    return replace(image, values=metres, source_bits=32, top=None)


def tile_warnings(image: Image, path: Path, encoding: str) -> list[str]:
    """A warning where heights of a tile lie beyond those of the Earth. image: of metres_of_tile, without
    holes."""
    low, high = float(image.values.min()), float(image.values.max())
    if low >= _LOWEST_M and high <= _HIGHEST_M:
        return []
    other = next(name for name in _DIGITS if name != encoding)
    spans = f"spans {low:g} to {high:g} m as {encoding}"
    earth = f"more than the Earth ({_LOWEST_M:g} to {_HIGHEST_M:g} m)"
    return [f"{path}: {spans}, {earth}: is it {other}, or a picture of something else?"]

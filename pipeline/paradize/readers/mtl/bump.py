"""Tells whether a bump map is a normal map in truth, from its texels."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from paradize.data import Image
from paradize.errors import ParadizeError
from paradize.readers.image import read_image

if TYPE_CHECKING:
    import numpy.typing as npt

Bump = Literal["normal", "height", "unclear", "unreadable"]

_SAMPLES = 256  # texels looked at along each side, at most
_GREY, _LENGTH = 0.02, 0.15  # tolerances: of a grey's channels, of a unit vector's length
_LEANING = 0.15  # of the mean direction: a surface's normals lean to no side
# Of vectors that a strength has scaled: least height on the mean; largest correlation of two channels, which
# are alike in other pictures, because light makes them so.
_UPWARD, _ALIKE = 0.3, 0.3
_SURE, _LEAST = 0.95, 0.05  # share of texels that decides; share that has to hold a direction at all


def bump_of_file(path: Path) -> Bump:
    """Whether a picture holds heights or normals, as `bump_of` says; "unreadable" where it cannot be read."""
    try:
        status = path.stat()
    except OSError:
        return "unreadable"
    return _bump_of_version(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=64)
def _bump_of_version(path: Path, _mtime_ns: int, _size: int) -> Bump:
    try:
        return bump_of(read_image(path))
    except ParadizeError:
        return "unreadable"


def bump_of(image: Image) -> Bump:
    """Returns "height" for a grey picture; "normal" where nearly all texels that are no grey point out of the
    surface (x = 2 red - 1 ...), lean to no side on the mean, and are unit vectors, or are bluish on the mean
    with channels that do not rise and fall together; "unclear" for other colours. Grey texels count as empty
    places between the parts of a normal map."""
    height, width, channels = image.values.shape
    if channels < 3:
        return "height"
    steps = (-(-height // _SAMPLES), -(-width // _SAMPLES))
    sample = replace(image, values=image.values[:: steps[0], :: steps[1], :3])
    texels = sample.pixels.reshape(-1, 3).clip(-2.0, 2.0)  # floats beyond are no directions either
    colored = texels[np.ptp(texels, axis=1) > _GREY]
    if len(colored) < _LEAST * len(texels):
        return "height"
    vectors = 2.0 * colored - 1.0
    lengths = np.sqrt((vectors * vectors).sum(axis=1))
    outward, (x, y, z) = vectors[:, 2] > 0.0, vectors.mean(axis=0)
    if z < _UPWARD or _are_alike(vectors):
        outward &= np.abs(lengths - 1.0) < _LENGTH
    return "normal" if max(abs(x), abs(y)) < _LEANING and outward.mean() >= _SURE else "unclear"


def _are_alike(vectors: npt.NDArray[np.float32]) -> bool:
    """Whether two channels rise and fall together, or none does."""
    low = vectors - vectors.mean(axis=0)
    spread = np.sqrt((low * low).mean(axis=0))
    if (spread[:2] < _GREY).any():
        return True
    shared = np.abs(low.T @ low) / (len(low) * np.outer(spread, spread).clip(1e-12))
    return bool(max(shared[0, 1], shared[0, 2], shared[1, 2]) > _ALIKE)

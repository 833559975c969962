"""Checked numpy face of the block compressors. Wrong shapes and types raise ValueError.

All take a band of whole block rows as well as a whole image: the blocks of the bands, one after another, are
the image's. Strides between rows and texels are free: `normals[:, :, :2]` is read where it lies. Sizes that
4 does not divide repeat the last row and column.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.kernels.bcn import _bcn
from paradize.kernels.maps import THREADS

if TYPE_CHECKING:
    import numpy.typing as npt

# How much is searched. No block is worse at a later one, in its sum of squares or at its worst texel.
QUALITIES = ("fast", "balanced", "exact")


def _quality(name: str) -> int:
    if name not in QUALITIES:
        raise ValueError(f"quality is {name!r}, not one of {', '.join(QUALITIES)}")
    return QUALITIES.index(name)


def _readable(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The array itself, or a copy where the channels of a texel do not lie one after another."""
    near = array.shape[2] == 1 or array.strides[2] == array.itemsize
    whole = all(stride % array.itemsize == 0 for stride in array.strides)
    return array if near and whole and array.flags.aligned else np.ascontiguousarray(array)


def _color(rgba: npt.NDArray[np.uint8], with_alpha: bool, quality: str, threads: int) -> bytes:
    if rgba.dtype != np.uint8 or rgba.ndim != 3 or rgba.shape[2] not in (3, 4) or rgba.size == 0:
        raise ValueError(f"rgba has shape {rgba.shape} of {rgba.dtype}")
    return _bcn.encode_color(_readable(rgba), with_alpha, _quality(quality), threads)


def encode_bc1(rgba: npt.NDArray[np.uint8], *, quality: str = "balanced", threads: int = THREADS) -> bytes:
    """(h, w, 3 or 4) uint8 -> 8 bytes per 4 x 4 block, always four colours; alpha is ignored."""
    return _color(rgba, False, quality, threads)


def encode_bc3(rgba: npt.NDArray[np.uint8], *, quality: str = "balanced", threads: int = THREADS) -> bytes:
    """(h, w, 3 or 4) uint8 -> 16 bytes per 4 x 4 block; alpha is 255 where there is none."""
    return _color(rgba, True, quality, threads)


def encode_values(
    values: npt.NDArray[Any], *, signed: bool, quality: str = "balanced", threads: int = THREADS
) -> bytes:
    """(h, w, 1) -> BC4, (h, w, 2) -> BC5, 8 bytes per block and channel.

    values: float32, 0..1, or -1..1 when signed (beyond is clamped); or int8 codes when signed, -127..127;
    or uint8, or uint16, when not.
    """
    kinds = (np.float32, np.int8) if signed else (np.float32, np.uint8, np.uint16)
    fits = values.dtype in [np.dtype(kind) for kind in kinds]
    if not fits or values.ndim != 3 or values.shape[2] not in (1, 2) or values.size == 0:
        raise ValueError(f"values have shape {values.shape} of {values.dtype}")
    return _bcn.encode_values(_readable(values), signed, _quality(quality), threads)

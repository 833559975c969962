"""Python interface of the block compressors. Raises ValueError for wrong shapes and types.

All functions accept a whole image or a band of whole rows of blocks; the concatenated blocks of the bands are
those of the image. Any strides between rows and texels are allowed: `normals[:, :, :2]` is read without a
copy. The last row and column are repeated where 4 does not divide the size.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.kernels.bcn import _bcn
from paradize.kernels.maps import THREADS
from paradize.tiers import TIERS

if TYPE_CHECKING:
    import numpy.typing as npt

# Effort of the search. At a later entry no block has a larger sum of squares or a worse worst texel.
QUALITIES = TIERS


def _quality(name: str) -> int:
    if name not in QUALITIES:
        raise ValueError(f"quality is {name!r}, not one of {', '.join(QUALITIES)}")
    return QUALITIES.index(name)


def _readable(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The array, or a copy where the channels of a texel are not adjacent."""
    packed = array.shape[2] == 1 or array.strides[2] == array.itemsize
    divides = all(stride % array.itemsize == 0 for stride in array.strides)
    return array if packed and divides and array.flags.aligned else np.ascontiguousarray(array)


def _color(rgba: npt.NDArray[np.uint8], with_alpha: bool, quality: str, threads: int) -> bytes:
    if rgba.dtype != np.uint8 or rgba.ndim != 3 or rgba.shape[2] not in (3, 4) or rgba.size == 0:
        raise ValueError(f"rgba has shape {rgba.shape} of {rgba.dtype}")
    return _bcn.encode_color(_readable(rgba), with_alpha, _quality(quality), threads)


def encode_bc1(rgba: npt.NDArray[np.uint8], *, quality: str = "balanced", threads: int = THREADS) -> bytes:
    """Encodes (h, w, 3 or 4) uint8 into 8 bytes per 4 x 4 block, always four colours; alpha is ignored."""
    return _color(rgba, False, quality, threads)


def encode_bc3(rgba: npt.NDArray[np.uint8], *, quality: str = "balanced", threads: int = THREADS) -> bytes:
    """Encodes (h, w, 3 or 4) uint8 into 16 bytes per 4 x 4 block; a missing alpha is 255."""
    return _color(rgba, True, quality, threads)


def encode_values(
    values: npt.NDArray[Any], *, signed: bool, quality: str = "balanced", threads: int = THREADS
) -> bytes:
    """Encodes (h, w, 1) into BC4 or (h, w, 2) into BC5: 8 bytes per block and channel.

    values: float32, 0..1 or, if signed, -1..1 (clamped); or int8 -127..127 if signed; or uint8 or uint16 if
    not.
    """
    kinds = (np.float32, np.int8) if signed else (np.float32, np.uint8, np.uint16)
    accepted = values.dtype in [np.dtype(kind) for kind in kinds]
    if not accepted or values.ndim != 3 or values.shape[2] not in (1, 2) or values.size == 0:
        raise ValueError(f"values have shape {values.shape} of {values.dtype}")
    return _bcn.encode_values(_readable(values), signed, _quality(quality), threads)

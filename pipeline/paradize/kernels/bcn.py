"""Checked numpy face of the block compressors. Wrong shapes and types raise ValueError."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from paradize.kernels import _bcn
from paradize.kernels.maps import THREADS

PASSES = 2  # searches of the neighbourhood of a block's endpoints; 0 is fast, 4 hardly gains any more


def _blocks(shape: tuple[int, ...]) -> int:
    return ((shape[0] + 3) // 4) * ((shape[1] + 3) // 4)


def _color(rgba: npt.NDArray[np.uint8], with_alpha: bool, passes: int, threads: int) -> bytes:
    if rgba.dtype != np.uint8 or rgba.ndim != 3 or rgba.shape[2] != 4 or rgba.size == 0:
        raise ValueError(f"rgba has shape {rgba.shape} of {rgba.dtype}")
    out = np.empty(_blocks(rgba.shape) * (16 if with_alpha else 8), np.uint8)
    _bcn.encode_color(np.ascontiguousarray(rgba), with_alpha, passes, out, threads)
    return out.tobytes()


def encode_bc1(rgba: npt.NDArray[np.uint8], *, passes: int = PASSES, threads: int = THREADS) -> bytes:
    """(h, w, 4) uint8 -> 8 bytes per 4 x 4 block; alpha is ignored."""
    return _color(rgba, False, passes, threads)


def encode_bc3(rgba: npt.NDArray[np.uint8], *, passes: int = PASSES, threads: int = THREADS) -> bytes:
    """(h, w, 4) uint8 -> 16 bytes per 4 x 4 block."""
    return _color(rgba, True, passes, threads)


def encode_values(
    values: npt.NDArray[np.float32], *, signed: bool, passes: int = PASSES, threads: int = THREADS
) -> bytes:
    """(h, w, 1) float32 -> BC4, (h, w, 2) -> BC5; values 0..1, or -1..1 when signed."""
    if values.dtype != np.float32 or values.ndim != 3 or values.shape[2] not in (1, 2) or values.size == 0:
        raise ValueError(f"values have shape {values.shape} of {values.dtype}")
    out = np.empty(_blocks(values.shape) * 8 * values.shape[2], np.uint8)
    _bcn.encode_values(np.ascontiguousarray(values), signed, passes, out, threads)
    return out.tobytes()

"""Python interface of the BC7 encoder. Raises ValueError for wrong shapes and types."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from paradize.kernels.bc7 import _bc7
from paradize.kernels.threads import default_threads
from paradize.tiers import TIERS

THREADS = default_threads(2)

Quality = Literal["fast", "balanced", "exact"]
QUALITIES = {tier: i for i, tier in enumerate(TIERS)}


def encode_bc7(
    rgba: npt.NDArray[np.uint8],
    *,
    quality: Quality = "balanced",
    alpha_weight: float = 1.0,
    threads: int = THREADS,
) -> bytes:
    """Encodes (h, w, 4) uint8 with straight alpha into 16 bytes per 4 x 4 block, row by row.

    The last row and column are repeated where 4 does not divide the size. Bands of whole rows of blocks may
    be encoded separately. Minimizes the squared error over all four channels, alpha weighted by alpha_weight
    (1 to 64). Opaque blocks stay opaque; blocks of one colour are exact.
    """
    if rgba.dtype != np.uint8 or rgba.ndim != 3 or rgba.shape[2] != 4 or rgba.size == 0:
        raise ValueError(f"rgba has shape {rgba.shape} of {rgba.dtype}")
    if quality not in QUALITIES:
        raise ValueError(f"quality is {quality!r}; there are {', '.join(QUALITIES)}")
    blocks = ((rgba.shape[0] + 3) // 4) * ((rgba.shape[1] + 3) // 4)
    out = np.empty(16 * blocks, np.uint8)
    _bc7.encode(np.ascontiguousarray(rgba), QUALITIES[quality], alpha_weight, out, threads)
    return out.tobytes()

"""Peak signal-to-noise ratio of a decoded map against what it should hold, in dB."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

LOSSLESS_DB = 120.0  # reported where the mean squared error is below 1e-12 of the peak


def psnr_db(
    decoded: npt.NDArray[np.floating], truth: npt.NDArray[np.floating], *, peak: float = 1.0
) -> float:
    """10 log10(peak^2 / mean squared error) over all values of two arrays of one shape; at most LOSSLESS_DB.

    The logarithm is Decimal's, which is the same on every machine; numpy's and libm's are not.
    """
    difference = decoded.astype(np.float64) - truth
    return psnr_of(float((difference * difference).sum()) / difference.size / (peak * peak))


def psnr_of(mean_square: float) -> float:
    """The same of a mean squared error whose peak is 1."""
    if mean_square <= 1e-12:
        return LOSSLESS_DB
    return float(-10 * Decimal(mean_square).log10())

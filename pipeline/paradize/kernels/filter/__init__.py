"""Python interface of the kernels of derivative filters. Inputs are not changed.

Heights are (h, w) float32 and finite. Wrong shapes and types raise ValueError: they are faults of the
program, not of a source file. Results do not depend on `threads`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from paradize.kernels.filter import _filter
from paradize.kernels.threads import default_threads

if TYPE_CHECKING:
    from collections.abc import Sequence

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]

REACH = 16  # texels to each side that the longest filter reads
THREADS = default_threads(2)


def _plane(array: npt.NDArray[Any]) -> F32:
    if array.dtype != np.float32 or array.ndim != 2 or array.size == 0:
        raise ValueError(f"heights are {array.dtype} of shape {array.shape}, not (h, w) float32")
    return np.ascontiguousarray(array)


@dataclass(frozen=True)
class Prediction:
    """Predicted root mean square errors of filters on a map, slopes in heights per texel."""

    errors: tuple[float, ...]
    step: float


def predict_errors(
    heights: F32,
    filters: Sequence[tuple[F64, F64]],
    *,
    source_bits: int,
    wrap: tuple[bool, bool],
    islands: I32 | None = None,
    codes: F32 | None = None,
) -> Prediction:
    """Predicts the errors of filters (derivative (r,), smooth (s + 1,)), r and s up to REACH, on the heights.

    source_bits: 8, 16 or 32, of the file. islands: (h, w) int32; no measured patch lies on two of them.
    codes: (n,) float32, rising: the heights that the integers of the source stand for; None: unknown.
    """
    heights = _plane(heights)
    if islands is None:
        islands = np.empty((0,), np.int32)
    elif islands.shape != heights.shape or islands.dtype != np.int32:
        raise ValueError(f"islands have shape {islands.shape} of {islands.dtype}; heights {heights.shape}")
    codes = np.empty(0, np.float32) if codes is None else codes
    if codes.dtype != np.float32 or codes.ndim != 1:
        raise ValueError(f"codes are {codes.dtype} of shape {codes.shape}, not (n,) float32")
    derivatives = np.zeros((len(filters), REACH))
    smooths = np.zeros((len(filters), REACH + 1))
    for row, (derivative, smooth) in enumerate(filters):
        derivatives[row, : len(derivative)] = derivative
        smooths[row, : len(smooth)] = smooth
    errors, step = _filter.predict_errors(
        heights,
        np.ascontiguousarray(islands),
        source_bits,
        wrap[0],
        wrap[1],
        derivatives,
        smooths,
        codes,
    )
    roots = tuple(float(root) for root in np.sqrt(np.maximum(np.array(errors), 0.0)))
    return Prediction(roots, float(step))


def destep(heights: F32, *, step: float, wrap: tuple[bool, bool], threads: int = THREADS) -> F32:
    """Returns heights within step / 2 of the given ones, exactly, with the least bending that this allows."""
    heights = _plane(heights)
    if not step > 0.0:
        raise ValueError(f"a step of {step} is not positive")
    out = np.empty_like(heights)
    _filter.destep(heights, step, wrap[0], wrap[1], out, threads)
    return out

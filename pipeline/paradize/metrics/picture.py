"""The visible difference of two pictures.

Source: P. Andersson, J. Nilsson, T. Akenine-Moeller, M. Oskarsson, K. Astroem, M. D. Fairchild, "FLIP: A
Difference Evaluator for Alternating Images", 2020. The authors' own library computes it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Picture = npt.NDArray[np.float32]


def flip(reference: Picture, test: Picture) -> Picture:
    """The FLIP error (h, w) float32, 0..1, of two pictures (h, w, 3) float32, sRGB 0..1, at FLIP's default
    viewing distance (67 pixels per degree). Raises ValueError for different shapes, empty pictures and values
    that are not finite, which the library does not check."""
    if reference.shape != test.shape or not reference.size:
        raise ValueError(f"pictures of {reference.shape} and {test.shape} cannot be compared")
    if not np.isfinite([reference.min(), reference.max(), test.min(), test.max()]).all():
        raise ValueError("a value of the pictures is not finite")
    import flip_evaluator

    errors, _, _ = flip_evaluator.evaluate(reference, test, "LDR", inputsRGB=True, applyMagma=False)
    return np.asarray(errors, np.float32).reshape(reference.shape[:2])


def flip_errors(references: Sequence[Picture], tests: Sequence[Picture]) -> dict[str, float]:
    """Mean, 99th percentile and maximum of FLIP over all pixels of all pairs of pictures."""
    errors = np.concatenate([flip(a, b).ravel() for a, b in zip(references, tests, strict=True)])
    return {
        "mean": float(errors.mean(dtype=np.float64)),
        "p99": float(np.percentile(errors, 99.0)),
        "max": float(errors.max()),
    }

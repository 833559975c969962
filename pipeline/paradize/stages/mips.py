"""Mip chains: level 0 first, down to 1 x 1, each level the area mean of the one before.

Odd sizes are halved downwards with the weights that the areas have, so nothing shifts. Areas never pass an
edge, so a periodic map stays periodic. All chains are float32; quantisation comes last.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.kernels import maps

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]


def scalar_mips(image: F32) -> list[F32]:
    """Plain means of linear data (h, w, c)."""
    levels = [image]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(maps.halve(levels[-1]))
    return levels


def color_mips(linear: F32, *, alpha_cutoff: float | None = None) -> list[F32]:
    """Means of linear light (h, w, 3), or (h, w, 4) with colour weighted by alpha.

    alpha_cutoff, 0..1: every level keeps level 0's share of texels at or above it, by a factor on its alpha
    (cut-outs do not thin out). None: alpha is averaged only.
    """
    if linear.shape[2] == 3:
        return scalar_mips(linear)
    levels = [linear]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(maps.halve(levels[-1], with_alpha=True))
    if alpha_cutoff is None:
        return levels
    share = int(np.count_nonzero(linear[:, :, 3] >= np.float32(alpha_cutoff))) / linear[:, :, 3].size
    return [linear, *(_covered(level, share, alpha_cutoff) for level in levels[1:])]


def _covered(level: F32, share: float, cutoff: float) -> F32:
    alpha = np.ascontiguousarray(level[:, :, 3])
    factor = np.float32(maps.coverage_factor(alpha, fraction=share, cutoff=cutoff))
    out = level.copy()
    out[:, :, 3] = np.minimum(alpha * factor, np.float32(1))
    return out


def normal_means(normals: F32) -> list[F32]:
    """Means of unit normals (h, w, 3), not normalised: what they lost in length tells how they disagree."""
    return scalar_mips(normals)


def normal_mips(means: list[F32]) -> list[F32]:
    """The means with length 1; where they cancel out, (0, 0, 1)."""
    return [means[0], *(maps.normalise(level) for level in means[1:])]


def gloss_mips(gloss: F32, means: list[F32]) -> list[F32]:
    """Chains of gloss (h, w, 2): R is averaged; G's roughness is averaged as a variance of slopes, and
    widened by the variance that averaging took out of the normals (`means`, as normal_means gives them)."""
    specular = scalar_mips(np.ascontiguousarray(gloss[:, :, :1]))
    variance = scalar_mips(maps.smoothness_to_variance(np.ascontiguousarray(gloss[:, :, 1]))[:, :, None])
    levels = [gloss]
    for level in range(1, len(specular)):
        smooth = maps.widened_smoothness(np.ascontiguousarray(variance[level][:, :, 0]), means[level])
        levels.append(np.ascontiguousarray(np.dstack([specular[level][:, :, 0], smooth])))
    return levels

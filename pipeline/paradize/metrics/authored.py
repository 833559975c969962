"""References of authored maps: normals and shares of a picture's own values, in float64.

The formulas are those of the formats that name the pictures, not those of the stages: glTF's normals (the
codes in the middle are 0, z below 0 counts as 0, black has no direction), roughness as 1 - smoothness.
Results are float32, rounded once. Shared with the stages: the decoded picture, which of its channels is
read, and which texel a gutter copies.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    Values = npt.NDArray[Any]

_ROWS = 64  # processed together


def true_normals(texels: Values, *, signed: bool, without_z: bool, green_down: bool, scale: float) -> F32:
    """Unit normals (h, w, 3), green up, of a picture (h, w, 3 or 4)."""
    out = np.empty((*texels.shape[:2], 3), np.float32)
    signed = signed and texels.dtype == np.float32
    for first in range(0, len(texels), _ROWS):
        rows = texels[first : first + _ROWS]
        stored = [true_shares(rows[:, :, k]) for k in range(3)]
        x, y, z = (_component(share, rows.dtype, signed) for share in stored)
        if without_z:
            z = np.sqrt(np.maximum(0.0, 1.0 - (x * x + y * y)))
        x, y, z = x * scale, y * (-scale if green_down else scale), np.where(z < 0.0, 0.0, z)
        length = np.sqrt(x * x + y * y + z * z)
        flat = length == 0.0
        if not signed and not without_z:
            flat |= (stored[0] == 0.0) & (stored[1] == 0.0) & (stored[2] == 0.0)
        length = np.where(flat, 1.0, length)
        for k, part in enumerate((x, y, z)):
            out[first : first + _ROWS, :, k] = np.where(flat, float(k == 2), part / length)
    return out


def _component(share: F64, kind: Any, signed: bool) -> F64:
    if signed:
        return share
    found = 2.0 * share - 1.0
    if kind != np.float32:  # the two codes about the middle
        found[np.abs(found) < 1.5 / int(np.iinfo(kind).max)] = 0.0
    return found


def true_shares(plane: Values) -> F64:
    """The values of a plane as shares of 1."""
    if plane.dtype == np.float32:
        return plane.astype(np.float64)
    return plane.astype(np.float64) / int(np.iinfo(plane.dtype).max)


def true_resized(plane: F64, rows: int, columns: int, wrap: tuple[bool, bool]) -> F64:
    """A plane at another size: between texel centres linear where it becomes larger along an axis, means over
    the area where it becomes smaller (differences of its integral)."""
    along = np.stack([_resized_line(line, columns, wrap[0]) for line in plane])
    return np.stack([_resized_line(line, rows, wrap[1]) for line in along.T], axis=1)


def _resized_line(line: F64, to: int, wrap: bool) -> F64:
    size = len(line)
    if to < size:
        integral = np.concatenate([[0.0], np.cumsum(line)])
        found = np.interp(np.arange(to + 1) * (size / to), np.arange(size + 1), integral)
        return np.asarray(np.diff(found) * (to / size))
    centres = (np.arange(to) + 0.5) * (size / to) - 0.5
    return np.asarray(np.interp(centres, np.arange(size), line, period=size if wrap else None), np.float64)


def true_smoothness(roughness: F64, factor: float) -> F64:
    """Smoothness of glTF's perceptual roughness times its factor: alpha = roughness^2 = (1 - s)^2."""
    return 1.0 - np.clip(roughness * factor, 0.0, 1.0)


def true_occlusion(occlusion: F64, strength: float) -> F64:
    """Occlusion of a strength: 1 where nothing is hidden."""
    return np.clip(1.0 + strength * (occlusion - 1.0), 0.0, 1.0)

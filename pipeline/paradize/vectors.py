"""Rows of vectors: products and lengths, in one order of operations, so that equal rows give equal bits."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

Float = TypeVar("Float", np.float32, np.float64)


def dot(a: npt.NDArray[Float], b: npt.NDArray[Float]) -> npt.NDArray[Float]:
    """The scalar products (...) of rows (..., 3)."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def cross(a: npt.NDArray[Float], b: npt.NDArray[Float]) -> npt.NDArray[Float]:
    """The cross products (..., 3) of rows (..., 3)."""
    return np.stack(
        [a[..., k - 2] * b[..., k - 1] - a[..., k - 1] * b[..., k - 2] for k in range(3)], axis=-1
    )


def cross_2d(a: npt.NDArray[Float], b: npt.NDArray[Float]) -> npt.NDArray[Float]:
    """The signed areas (...) of the parallelograms that rows (..., 2) span."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def squared_lengths(rows: npt.NDArray[Float]) -> npt.NDArray[Float]:
    """The squares of the lengths (...) of rows (..., 3)."""
    return dot(rows, rows)


def lengths(rows: npt.NDArray[Float]) -> npt.NDArray[Float]:
    """The lengths (...) of rows (..., 3)."""
    return np.asarray(np.sqrt(squared_lengths(rows)))


def doubled_areas(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Twice the areas (m,) of triangles (m, 3, 3)."""
    return lengths(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def doubled_areas_2d(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Twice the signed areas (m,) of triangles (m, 3, 2)."""
    return cross_2d(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def cube_vectors(
    face: int, s: npt.NDArray[np.float64], t: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """The vectors (..., 3) to places on a face, 0 to 5, of the cube from -1 to 1 that a cube map is. s, t: to
    the right and down, -1 to 1.

    Source: M. Segal and K. Akeley, "The OpenGL Graphics System", version 3.3, 2010, table 3.18.
    """
    one = np.ones_like(s)
    x, y, z = (
        (one, -t, -s),
        (-one, -t, s),
        (s, one, t),
        (s, -one, -t),
        (s, -t, one),
        (-s, -t, -one),
    )[face]
    return np.stack([x, y, z], axis=-1)

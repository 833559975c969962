"""Decodes quantised vertices to float32."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import ORIGIN, Mesh, QuantisationGrid, QuantisedValues, Vec3

_MAX_DISTANCE = 8.0  # in widths of the grid: up to there float32 moves a vertex by less than 1/30 of a step


def decoded(quantised: QuantisedValues) -> dict[str, Any]:
    """The vertex arrays of a Mesh by field name: float32, normals and tangents unit and in metric space."""
    step, origin = np.array(quantised.grid.step), np.array(quantised.grid.origin)
    with np.errstate(over="ignore"):
        arrays = {"positions": (origin + quantised.positions.astype(np.float64) * step).astype(np.float32)}
    scale = None if quantised.grid.uniform else step
    for name, values, factor in (
        ("normals", quantised.normals, None if scale is None else 1.0 / scale),
        ("tangents", quantised.tangents, scale),
    ):
        if values is not None:
            arrays[name] = _directions(_to_float(values), factor)
    for name in ("uvs", "uvs1", "colors", "sway"):
        values = getattr(quantised, name)
        if values is not None:
            arrays[name] = _to_float(values).astype(np.float32)
    return arrays


def decoded_mesh(mesh: Mesh, quantised: QuantisedValues) -> Mesh:
    """The mesh with the vertices that a reader of the file gets."""
    return Mesh(**decoded(quantised), triangles=mesh.triangles, groups=mesh.groups, origin=mesh.origin)


def split_origin(grid: QuantisationGrid) -> tuple[Vec3, QuantisationGrid]:
    """The origin of a mesh and its grid relative to that origin, from the grid that a node declares: (0, 0,
    0) and the grid itself, unless it lies so far away that float32 would lose some of its steps."""
    reach = max(abs(value) for value in grid.origin)
    if reach <= _MAX_DISTANCE * 65535.0 * max(grid.step):
        return ORIGIN, grid
    return grid.origin, QuantisationGrid(grid.step, ORIGIN)


def _to_float(values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    values64 = values.astype(np.float64)
    return values64 if values.dtype.kind == "f" else np.maximum(values64 / np.iinfo(values.dtype).max, -1.0)


def _directions(
    values64: npt.NDArray[np.float64], scale: npt.NDArray[np.float64] | None
) -> npt.NDArray[np.float32]:
    """Normalizes vectors after multiplying x, y, z by `scale`; w is unchanged. Vectors of length 0 are
    kept."""
    x, y, z = (values64[:, axis] * (1.0 if scale is None else scale[axis] / scale.max()) for axis in range(3))
    length = np.sqrt(x * x + y * y + z * z)
    length[length == 0.0] = 1.0
    values64[:, :3] = np.stack([x / length, y / length, z / length], axis=1)
    return values64.astype(np.float32)

"""Codes -> the floats that they stand for."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import ORIGIN, Mesh, QuantizationGrid, QuantizedValues, Vec3

_NEAR = 8.0  # sides of a lattice: float32 moves what lies no farther away by less than a step's 30th


def decoded(codes: QuantizedValues) -> dict[str, Any]:
    """The vertex arrays of a Mesh (float32; directions unit and in metres' space), by its fields' names."""
    step, origin = np.array(codes.lattice.step), np.array(codes.lattice.origin)
    with np.errstate(over="ignore"):
        found = {"positions": (origin + codes.positions.astype(np.float64) * step).astype(np.float32)}
    stretch = None if codes.lattice.uniform else step
    for name, values, by in (
        ("normals", codes.normals, None if stretch is None else 1.0 / stretch),
        ("tangents", codes.tangents, stretch),
    ):
        if values is not None:
            found[name] = _directions(_real(values), by)
    for name in ("uvs", "uvs1", "colors"):
        values = getattr(codes, name)
        if values is not None:
            found[name] = _real(values).astype(np.float32)
    return found


def decoded_mesh(mesh: Mesh, codes: QuantizedValues) -> Mesh:
    """The mesh as a reader of its codes sees it."""
    return Mesh(**decoded(codes), triangles=mesh.triangles, groups=mesh.groups, origin=mesh.origin)


def apart(lattice: QuantizationGrid) -> tuple[Vec3, QuantizationGrid]:
    """The origin of a mesh whose node states this lattice, and the lattice counted from there: (0, 0, 0) and
    itself, unless it lies so far away that float32 would lose steps of it."""
    reach = max(abs(value) for value in lattice.origin)
    if reach <= _NEAR * 65535.0 * max(lattice.step):
        return ORIGIN, lattice
    return lattice.origin, QuantizationGrid(lattice.step, ORIGIN)


def _real(values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    wide = values.astype(np.float64)
    return wide if values.dtype.kind == "f" else np.maximum(wide / np.iinfo(values.dtype).max, -1.0)


def _directions(
    wide: npt.NDArray[np.float64], stretch: npt.NDArray[np.float64] | None
) -> npt.NDArray[np.float32]:
    """Unit vectors again; w, where there is one, as it is. A vector of length 0 stays."""
    x, y, z = (
        wide[:, axis] * (1.0 if stretch is None else stretch[axis] / stretch.max()) for axis in range(3)
    )
    length = np.sqrt(x * x + y * y + z * z)
    length[length == 0.0] = 1.0
    wide[:, :3] = np.stack([x / length, y / length, z / length], axis=1)
    return wide.astype(np.float32)

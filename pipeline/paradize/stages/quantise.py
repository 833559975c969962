"""Quantises vertices to integers, as in KHR_mesh_quantization: smaller meshes, with a known error.

All levels of a mesh, or all parts of a terrain, use one grid: vertices at one position stay at one position,
so seams, welds and borders stay closed. Directions take 8 bits where the largest error allows it, else 16.
Texture coordinates take 16 bits if they are in 0 to 1; others stay floats, because they would need a
transform of the texture.

Source: The Khronos Group, "KHR_mesh_quantization", extension of glTF 2.0, 2020.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, QuantisationGrid, QuantisedValues
from paradize.errors import BakeError
from paradize.vectors import cross, lengths

LARGEST_CODE = 65535
# Directions take 8 bits where none is turned by more than this.
DIRECTION_DEG = 0.1
# The smallest step: below it float32, in which a graphics card multiplies, loses bits.
_LEAST_STEP = 2.0**-126
# A terrain's heights take steps no finer than this share of a pixel, where the bound has room: so its
# normals, which are stretched with the grid, keep their precision in 16 bits.
_FLATTEST = 64
_ROOM = 8
_DEGREES = 180.0 / 3.141592653589793


def mesh_grid(meshes: Sequence[Mesh]) -> QuantisationGrid:
    """Returns the finest grid of equal steps that spans all vertices of the meshes.

    Step and origin are float32 values, as the graphics card uses them. Raises BakeError if the mesh is too
    small for a step in float32.
    """
    lows = np.min([mesh.positions.min(axis=0) for mesh in meshes], axis=0).astype(np.float64)
    highs = np.max([mesh.positions.max(axis=0) for mesh in meshes], axis=0).astype(np.float64)
    extent = float((highs - lows).max())
    if extent == 0.0:
        step = 1.0
    else:
        rounded = np.float32(extent / LARGEST_CODE)
        if float(rounded) * LARGEST_CODE < extent:
            rounded = np.nextafter(rounded, np.float32(np.inf))
        step = float(rounded)
        if step < _LEAST_STEP:
            raise BakeError(
                f"{extent:g} metres are too small a mesh for 16-bit positions: a step of {step:g}",
                mend="scale the model up, or leave its floats as they are",
            )
    x, y, z = (float(value) for value in lows)
    return QuantisationGrid((step, step, step), (x, y, z))


def terrain_grid(
    shape: tuple[int, int],
    size_m: tuple[float, float],
    heights_m: tuple[float, float],
    max_error_m: float = 0.0,
) -> QuantisationGrid:
    """Returns the grid of a whole terrain: x and z count columns and rows of its pixels, y spans its heights.

    shape: (rows, columns), at most 65,536 each. size_m: (x, z), first to last pixel. heights_m: (lowest,
    highest). max_error_m: the terrain's bound; where a step of a 64th of a pixel's side costs no more than an
    eighth of it, heights take that step, unless they need a larger one. Raises BakeError.
    """
    rows, columns = shape
    if max(shape) > LARGEST_CODE + 1:
        raise BakeError(
            f"{columns} x {rows} pixels, limit of 16-bit positions {LARGEST_CODE + 1} a side",
            mend="leave its floats as they are",
        )
    low, high = heights_m
    across, along = size_m[0] / (columns - 1), size_m[1] / (rows - 1)
    up = (high - low) / LARGEST_CODE
    gentle = max(across, along) / _FLATTEST
    if up < gentle and (gentle <= 2.0 * max_error_m / _ROOM or up == 0.0):
        up = gentle
    # A little more than the range, so that no code lies beyond the largest by rounding.
    up = float(np.nextafter(up, np.inf))
    if min(across, along, up) < _LEAST_STEP:
        raise BakeError("the terrain is too small for 16-bit positions", mend="leave its floats as they are")
    return QuantisationGrid((across, up, along), (-0.5 * size_m[0], low, -0.5 * size_m[1]))


def quantise(
    mesh: Mesh, grid: QuantisationGrid, *, direction_bits: int = 16, float_uvs: bool | None = None
) -> QuantisedValues:
    """Returns the mesh's vertices quantised to a grid. direction_bits: 8, 16 or 32 (float32) for normals and
    tangents. float_uvs: whether the first texture coordinates stay float32; None: if they leave 0 to 1. Parts
    of one terrain must set it, because only some of them leave 0 to 1.

    The result of a vertex depends on that vertex only. Raises BakeError for a vertex outside the grid.
    """
    step, origin = np.array(grid.step), np.array(grid.origin)
    quantised = np.rint((mesh.positions.astype(np.float64) - origin) / step)
    if quantised.size and (quantised.min() < 0 or quantised.max() > LARGEST_CODE):
        at = int(np.flatnonzero(((quantised < 0) | (quantised > LARGEST_CODE)).any(axis=1))[0])
        raise BakeError(f"a vertex outside the grid of 16-bit positions: values {quantised[at].tolist()}")
    stretch = None if grid.uniform else step
    return QuantisedValues(
        grid=grid,
        positions=quantised.astype(np.uint16),
        normals=_directions(mesh.normals, stretch, direction_bits),
        tangents=_directions(mesh.tangents, None if stretch is None else 1.0 / stretch, direction_bits),
        uvs=mesh.uvs if float_uvs else _shares(mesh.uvs),
        uvs1=_shares(mesh.uvs1),
        colors=_colors(mesh.colors),
        sway=None if mesh.sway is None else np.rint(mesh.sway.astype(np.float64) * 255.0).astype(np.uint8),
    )


def quantise_levels(
    meshes: Sequence[Mesh], grid: QuantisationGrid, *, direction_deg: float = DIRECTION_DEG
) -> list[QuantisedValues]:
    """Quantises all levels of a mesh to one grid. direction_deg: normals and tangents of all levels take 8
    bits if that turns none of them by more than this, else 16."""
    eight = [quantise(mesh, grid, direction_bits=8) for mesh in meshes]
    turned = max(_most_turned(mesh, quantised) for mesh, quantised in zip(meshes, eight, strict=True))
    return eight if turned <= direction_deg else [quantise(mesh, grid) for mesh in meshes]


def direction_bits(grid: QuantisationGrid, direction_deg: float = DIRECTION_DEG) -> int:
    """Returns the bits of directions that keep the bound on any mesh of a grid: 8, 16, or 32 for floats. It
    depends on the grid alone, so all parts of a terrain take the same."""
    # Half a code along each axis, magnified by no more than the ratio of the steps.
    ratio = max(grid.step) / min(grid.step)
    for bits in (8, 16):
        if 0.5 * 3.0**0.5 / (2 ** (bits - 1) - 1) * ratio * _DEGREES <= direction_deg:
            return bits
    return 32


def _directions(
    values: npt.NDArray[np.float32] | None, stretch: npt.NDArray[np.float64] | None, bits: int
) -> Any:
    """Returns unit vectors (n, 3) or (n, 4: w = +-1) as integers of `bits` bits, or float32."""
    if values is None:
        return None
    wide = values.astype(np.float64)
    if stretch is not None:
        x, y, z = (wide[:, axis] * (stretch[axis] / stretch.max()) for axis in range(3))
        length = np.sqrt(x * x + y * y + z * z)
        length[length == 0.0] = 1.0
        wide[:, :3] = np.stack([x / length, y / length, z / length], axis=1)
    if bits == 32:
        return wide.astype(np.float32)
    top = 2 ** (bits - 1) - 1
    return np.rint(np.clip(wide, -1.0, 1.0) * top).astype(np.int8 if bits == 8 else np.int16)


def _shares(values: npt.NDArray[np.float32] | None) -> Any:
    if values is None or values.min() < 0.0 or values.max() > 1.0:
        return values
    return np.rint(values.astype(np.float64) * LARGEST_CODE).astype(np.uint16)


def _colors(values: npt.NDArray[np.float32] | None) -> Any:
    """Returns colours in 8 bits if their values are multiples of 1/255, else in 16."""
    if values is None:
        return None
    wide = values.astype(np.float64)
    quantised = np.rint(wide * 255.0)
    if np.abs(quantised / 255.0 - wide).max() <= 1e-6:
        return quantised.astype(np.uint8)
    return np.rint(wide * LARGEST_CODE).astype(np.uint16)


def _most_turned(mesh: Mesh, quantised: QuantisedValues) -> float:
    """Returns a bound on the largest angle between a direction and its quantised value, in degrees. Both are
    compared in metres, not in steps of the grid. Uses the sine for the angle, which is small."""
    most = 0.0
    step = np.array(quantised.grid.step)
    for values, coded, stretch in (
        (mesh.normals, quantised.normals, 1.0 / step),
        (mesh.tangents, quantised.tangents, step),
    ):
        if values is None or coded is None:
            continue
        a = values[:, :3].astype(np.float64)
        b = coded[:, :3].astype(np.float64) * (stretch / stretch.max())
        sine, size = lengths(cross(a, b)), lengths(b)
        sound = size > 0
        if sound.any():
            most = max(most, float((sine[sound] / size[sound]).max()) * _DEGREES)
    return most

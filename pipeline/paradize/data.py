"""What flows between stages: arrays with units, frozen, with no reading or writing of files.

Axes: right-handed, Y up, metres. UVs: origin at the top-left texel corner, v grows downwards. Every array is
C-contiguous; a stage returns new arrays and never writes into those it was given.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    I8: TypeAlias = npt.NDArray[np.int8]
    I16: TypeAlias = npt.NDArray[np.int16]
    U8: TypeAlias = npt.NDArray[np.uint8]
    U16: TypeAlias = npt.NDArray[np.uint16]
    F32: TypeAlias = npt.NDArray[np.float32]
    I32: TypeAlias = npt.NDArray[np.int32]
    U32: TypeAlias = npt.NDArray[np.uint32]
    F64: TypeAlias = npt.NDArray[np.float64]


Vec3: TypeAlias = tuple[float, float, float]
ORIGIN: Vec3 = (0.0, 0.0, 0.0)


def six(value: float) -> float:
    """A measured value as it is told: six significant digits, the same wherever it was measured."""
    return float(f"{value:.6g}")


def six_up(value: float) -> float:
    """The same of a bound: not below it."""
    found = six(value)
    return found if found >= value else six(value * (1.0 + 1e-5))


def six_down(value: float) -> float:
    """The same of a lower bound, 0 or more: not above it."""
    found = six(value)
    return found if found <= value else six(value * (1.0 - 1e-5))


@dataclass(frozen=True)
class Group:
    """A run of triangles that share a name and a material: triangles [first, first + count)."""

    name: str
    material: str
    first: int
    count: int


@dataclass(frozen=True)
class Mesh:
    """Indexed triangles; a vertex is unique in (position, normal, uv, uv1).

    positions: (n, 3) float32, metres, Y up, counted from origin. triangles: (m, 3) uint32, counter-clockwise
    from outside.
    normals: (n, 3) float32, unit. tangents: (n, 4) float32, xyz unit, w = +-1, B = w * cross(N, T).
    uvs, uvs1: (n, 2) float32, top-left origin. colors: (n, 4) float32, linear, 0..1.
    groups cover all triangles in order, without gap or overlap; one per run of a material. origin: where the
    mesh lies, x y z in metres as float64; other than 0 only far from it, where float32 loses small distances.
    """

    positions: F32
    triangles: U32
    normals: F32 | None = None
    tangents: F32 | None = None
    uvs: F32 | None = None
    uvs1: F32 | None = None
    colors: F32 | None = None
    groups: tuple[Group, ...] = ()
    origin: Vec3 = ORIGIN

    @property
    def places(self) -> F64:
        """(n, 3) float64: the positions in the mesh's space, origin and all."""
        return self.positions.astype(np.float64) + self.origin


@dataclass(frozen=True)
class SourcePlaces:
    """Where a source file has a mesh's vertices. places: (n, 3) float64, as the file counts them; of several
    that are one vertex, the farthest from it. merged: triangles with an area in the file of which two corners
    became one vertex, and the first."""

    places: F64
    merged: int = 0
    first_merged: int = 0


@dataclass(frozen=True)
class Image:
    """A decoded picture, as its file holds it.

    values: (h, w, c) with row 0 at the top: uint8 or uint16 codes, or float32 numbers as they are.
    color_space: "srgb" (values stay encoded as in the file; stages linearise them), "linear" or "data".
    source_bits: 8, 16 or 32: bits per channel of the file. top: the file's code that stands for 1 (255, 65535
    ...); None where it holds floats or signed integers, which are numbers as they are.
    """

    values: U8 | U16 | F32
    color_space: str
    source_bits: int
    top: int | None = None

    @property
    def pixels(self) -> F32:
        """The values as float32, codes mapped to 0..1 by correctly rounded division; made anew at each call
        from codes."""
        if self.values.dtype == np.float32:
            return self.values  # type: ignore[return-value]
        top = np.float32(255 if self.values.dtype == np.uint8 else 65535)
        pixels = self.values.astype(np.float32)
        np.divide(pixels, top, out=pixels)
        return pixels


@dataclass(frozen=True)
class Heightfield:
    """Heights on a regular grid whose pixels are vertices; pixel (0, 0) is the corner at -X, -Z.

    heights_m: (h, w) float32, metres, row 0 at -Z. size_x_m and size_z_m span first to last pixel. metres:
    whether the source holds metres, so that a height given for white says nothing of it.
    """

    heights_m: F32
    size_x_m: float
    size_z_m: float
    metres: bool = False


@dataclass(frozen=True)
class HeightMap:
    """Heights of a map and how its normals are taken from them.

    heights: (h, w) float32. slope_scale: slope of one unit of height between neighbours along (x, y):
    amplitude over texel size. wrap: whether the map repeats along (x, y); where it does not, the slope at an
    edge goes on as it came. filter_name: one of stages.filters.FILTERS. islands: (h, w) int32, an id per
    UV island and below zero outside; no slope crosses a border. codes: (n,) float32, rising: the heights that
    the codes of the source stand for, so that a height is known to half of the gap beside it; None where the
    source holds floats. held: whether slopes are held to what those half steps allow. truth: (h, w) float32,
    the heights of the source that metrics hold the map to (metrics/source.py), and true_codes the same of its
    codes; None: `heights` and `codes`.
    """

    heights: F32
    slope_scale: tuple[float, float]
    wrap: tuple[bool, bool]
    filter_name: str
    green_down: bool = False
    islands: I32 | None = None
    codes: F32 | None = None
    held: bool = False
    truth: F32 | None = None
    true_codes: F32 | None = None


@dataclass(frozen=True)
class Texture:
    """An encoded texture: `format` as in KTX2's VkFormat without prefix and suffix, for example "BC5_SNORM".

    levels: the bytes of each mip, level 0 (the finest) first; with six faces each level holds
    +X -X +Y -Y +Z -Z one after the other. width and height are those of level 0, in texels.
    """

    format: str
    width: int
    height: int
    levels: tuple[bytes, ...]
    faces: int = 1


@dataclass(frozen=True)
class QuantizationGrid:
    """Places that whole numbers can name: origin + code * step along each axis, codes 0 to 65,535.

    step, origin: metres along x, y, z; steps are above 0.
    """

    step: tuple[float, float, float]
    origin: tuple[float, float, float]

    @property
    def uniform(self) -> bool:
        """Whether one step serves all axes: then directions need no change."""
        return self.step[0] == self.step[1] == self.step[2]


@dataclass(frozen=True)
class QuantizedValues:
    """A mesh's vertices as whole numbers, one row each; what is float32 stayed as it was.

    positions: (n, 3), places of `lattice`. normals (n, 3), tangents (n, 4): v = max(code / 127, -1) or of
    32,767; in the lattice's space: where its steps differ, a normal's part along an axis was multiplied by
    the step and a tangent's divided by it, and both made unit again. uvs, uvs1: code / 65,535. colors:
    (n, 4), code / 255 or / 65,535.
    """

    lattice: QuantizationGrid
    positions: U16
    normals: I8 | I16 | F32 | None = None
    tangents: I8 | I16 | F32 | None = None
    uvs: U16 | F32 | None = None
    uvs1: U16 | F32 | None = None
    colors: U8 | U16 | None = None


@dataclass(frozen=True)
class Lod:
    """One level of detail with its two-sided surface distance from level 0, as fractions of the bounding
    box's diagonal: the largest found, and the larger of the two directions' RMS. errors: what else was
    measured of it, by name. codes: its vertices as a file shall hold them; None: as float32."""

    mesh: Mesh
    error_max: float
    error_rms: float
    errors: Mapping[str, float] = field(default_factory=dict)
    codes: QuantizedValues | None = None

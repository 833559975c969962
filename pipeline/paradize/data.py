"""The data that stages exchange: frozen arrays with units. Nothing here reads or writes files.

Axes: right-handed, Y up, metres. UVs: origin at the top-left texel corner, v grows downwards. All arrays are
C-contiguous. A stage returns new arrays and never writes into its arguments.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

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


def rounded(value: float) -> float:
    """Rounds a measured value to six significant digits, the form in which values are written to files."""
    return float(f"{value:.6g}")


def rounded_up(value: float) -> float:
    """Rounds an upper bound to six significant digits, never downwards."""
    nearest = rounded(value)
    return nearest if nearest >= value else rounded(value * (1.0 + 1e-5))


def rounded_down(value: float) -> float:
    """Rounds a lower bound (>= 0) to six significant digits, never upwards."""
    nearest = rounded(value)
    return nearest if nearest <= value else rounded(value * (1.0 - 1e-5))


@dataclass(frozen=True)
class Group:
    """Triangles [first, first + count), which share a name and a material."""

    name: str
    material: str
    first: int
    count: int


# The attributes of a Mesh's vertices beside positions, and their columns.
ATTRIBUTES = {"normals": 3, "tangents": 4, "uvs": 2, "uvs1": 2, "colors": 4, "sway": 2}


@dataclass(frozen=True)
class Mesh:
    """Indexed triangles. Vertices of one position may differ in any other attribute.

    positions: (n, 3) float32, metres, Y up, relative to `origin`. triangles: (m, 3) uint32, counter-clockwise
    seen from outside. normals: (n, 3) float32, unit; as read of any length, 0 where there is none. tangents:
    (n, 4) float32, xyz unit, w = +-1, B = w * cross(N, T). uvs, uvs1: (n, 2) float32, top-left origin.
    colors: (n, 4) float32, linear, 0..1. sway: (n, 2) float32, 0..1, how far wind moves a vertex
    (stages/sway.py).

    groups: cover all triangles in order without gaps or overlaps, one for each run of triangles with the same
    name and material. second_frames: the materials whose normal maps lie on uvs1, so that tangents follow
    these there. origin: position of the mesh, x y z in metres. It is 0 except for a mesh far from 0,
    where float32 positions would lose small distances.
    """

    positions: F32
    triangles: U32
    normals: F32 | None = None
    tangents: F32 | None = None
    uvs: F32 | None = None
    uvs1: F32 | None = None
    colors: F32 | None = None
    sway: F32 | None = None
    groups: tuple[Group, ...] = ()
    second_frames: frozenset[str] = frozenset()
    origin: Vec3 = ORIGIN

    @property
    def absolute_positions(self) -> F64:
        """(n, 3) float64, metres: positions + origin."""
        return self.positions.astype(np.float64) + self.origin

    @property
    def is_used(self) -> npt.NDArray[np.bool_]:
        """(n,) whether a triangle has the vertex as a corner."""
        used = np.zeros(len(self.positions), np.bool_)
        used[self.triangles] = True
        return used

    @property
    def all_groups(self) -> tuple[Group, ...]:
        """The groups; of a mesh without any, one of all triangles."""
        return self.groups or (Group("default", "default", 0, len(self.triangles)),)

    def with_vertices(self, source: npt.NDArray[np.integer], triangles: U32, **changed: F32) -> Mesh:
        """The mesh with the vertices `source` (k,) of it, in this order, and other triangles over them, whose
        groups are the caller's. changed: attributes (k, ...) that are not taken from it."""
        same = len(source) == len(self.positions) and bool((source == np.arange(len(source))).all())
        taken = {
            name: np.ascontiguousarray(values if same else values[source])
            for name in ("positions", *ATTRIBUTES)
            if name not in changed and (values := getattr(self, name)) is not None
        }
        return replace(self, **(taken | changed), triangles=triangles)  # type: ignore[arg-type]

    def laid_out_for_frames(self) -> tuple[Mesh, U32 | None]:
        """The mesh with the texture coordinates that tangents follow as `uvs`, and the vertex of this mesh
        that each of its own is; None: the same. A vertex where materials of both kinds meet becomes two. The
        triangles keep their order."""
        if not self.second_frames or self.uvs is None or self.uvs1 is None:
            return self, None
        second = np.zeros(len(self.triangles), np.bool_)
        for group in self.all_groups:
            second[group.first : group.first + group.count] = group.material in self.second_frames
        count = len(self.positions)
        keys, corners = np.unique(self.triangles + second[:, None] * np.int64(count), return_inverse=True)
        source = (keys % count).astype(np.uint32)
        arrays = {
            name: values[source]
            for name in ("positions", "normals", "tangents", "colors", "sway")
            if (values := getattr(self, name)) is not None
        }
        uvs = np.where((keys >= count)[:, None], self.uvs1[source], self.uvs[source])
        triangles = corners.reshape(-1, 3).astype(np.uint32)
        mesh = replace(self, **arrays, uvs=uvs, uvs1=None, triangles=triangles, second_frames=frozenset())
        return mesh, source

    def of_materials(self, names: Collection[str]) -> Mesh:
        """The triangles of these materials, with all vertices."""
        kept = [group for group in self.groups if group.material in names]
        if len(kept) == len(self.groups):
            return self
        runs = [self.triangles[group.first : group.first + group.count] for group in kept]
        groups, first = [], 0
        for group in kept:
            groups.append(replace(group, first=first))
            first += group.count
        triangles = np.concatenate([self.triangles[:0], *runs])
        return replace(self, triangles=triangles, groups=tuple(groups))


@dataclass(frozen=True)
class SourcePositions:
    """Vertex positions as the source file writes them, the reference for errors of loading.

    positions: (n, 3) float64. If several positions of the file became one vertex, the one farthest from that
    vertex. merged: number of triangles with an area in the file of which two corners became one vertex.
    first_merged: the first of them.
    """

    positions: F64
    merged: int = 0
    first_merged: int = 0


@dataclass(frozen=True)
class Image:
    """A decoded picture, with the values of its file.

    values: (h, w, c), row 0 at the top: uint8 or uint16 integers, or float32. color_space: "srgb" (values are
    encoded as in the file; stages convert them to linear), "linear" or "data". source_bits: 8, 16 or 32 bits
    per channel of the file. top: the integer of the file that means 1 (255, 65535 ...); None where the file
    holds floats or signed integers, which are used as they are. nodata: the number that means "no height" in
    a grid of heights; None where the format does not say. notes: what its reader guessed; color_notes: what
    concerns it as colours alone.
    """

    values: U8 | U16 | F32
    color_space: str
    source_bits: int
    top: int | None = None
    nodata: float | None = None
    notes: tuple[str, ...] = ()
    color_notes: tuple[str, ...] = ()

    @property
    def pixels(self) -> F32:
        """The values as float32, integers mapped to 0..1 by correctly rounded division. Each call on integers
        makes a new array."""
        if self.values.dtype == np.float32:
            return self.values  # type: ignore[return-value]
        top = np.float32(255 if self.values.dtype == np.uint8 else 65535)
        pixels = self.values.astype(np.float32)
        np.divide(pixels, top, out=pixels)
        return pixels

    def warnings(self, path: Path) -> list[str]:
        """All notes, as warnings about the file."""
        return [f"{path}: {note}" for note in (*self.notes, *self.color_notes)]


@dataclass(frozen=True)
class Heightfield:
    """Heights on a regular grid. A pixel is a vertex; pixel (0, 0) is the corner at -X, -Z.

    heights_m: (h, w) float32, metres, row 0 at -Z. size_x_m, size_z_m: distance from the first to the last
    pixel. step_m: between two integers of the source; 0: it holds metres.
    """

    heights_m: F32
    size_x_m: float
    size_z_m: float
    step_m: float = 0.0


@dataclass(frozen=True)
class HeightMap:
    """Heights of a texture and how its normals are derived.

    heights: (h, w) float32. slope_scale: slope along (x, y) of one unit of height between neighbouring
    texels, amplitude / texel size. wrap: whether the map repeats along (x, y); where it does not, the slope
    continues at the edges. filter_name: one of stages.filters.TAPS. islands: (h, w) int32, id of the
    UV island, below 0 outside; no slope crosses a border.

    height_levels: (n,) float32, rising: the heights that the integers of the source stand for. A height is
    known to half the gap between neighbouring levels. None where the source holds floats. clamp_slopes:
    whether slopes are clamped to what these half gaps allow. reference_heights: (h, w) float32, heights of
    the source that metrics compare with (metrics/source.py), and reference_levels its height_levels; None:
    `heights` and `height_levels`.
    """

    heights: F32
    slope_scale: tuple[float, float]
    wrap: tuple[bool, bool]
    filter_name: str
    green_down: bool = False
    islands: I32 | None = None
    height_levels: F32 | None = None
    clamp_slopes: bool = False
    reference_heights: F32 | None = None
    reference_levels: F32 | None = None


@dataclass(frozen=True)
class AuthoredNormals:
    """The normals of an authored map, as metrics compare with them. vectors: (h, w, 3) float32,
    unit, green up. islands: as of HeightMap; None: all texels count."""

    vectors: F32
    islands: I32 | None = None


@dataclass(frozen=True)
class Texture:
    """An encoded texture. format: KTX2's VkFormat without prefix and suffix, such as "BC5_SNORM".

    levels: bytes of each mip, level 0 (the finest) first. With six faces each level holds +X -X +Y -Y +Z -Z
    in this order. width, height: of level 0, in texels.
    """

    format: str
    width: int
    height: int
    levels: tuple[bytes, ...]
    faces: int = 1


@dataclass(frozen=True)
class QuantisationGrid:
    """A grid of positions: origin + i * step along each axis, i = 0..65535.

    step, origin: metres along x, y, z; steps are above 0.
    """

    step: tuple[float, float, float]
    origin: tuple[float, float, float]

    @property
    def uniform(self) -> bool:
        """Whether the steps of all axes are equal. Then normals and tangents need no correction."""
        return self.step[0] == self.step[1] == self.step[2]


@dataclass(frozen=True)
class QuantisedValues:
    """Vertices as integers, one row each. Attributes that are not quantised stay float32.

    positions: (n, 3), indices into `grid`. normals: (n, 3), tangents: (n, 4): v = max(q / 127, -1) for int8,
    q / 32767 for int16. They are in the space of the grid: where its steps differ, the components of a normal
    are multiplied by the steps and those of a tangent divided by them, and both are normalized again. uvs,
    uvs1: q / 65535. colors: (n, 4), q / 255 or q / 65535. sway: (n, 2), q / 255.
    """

    grid: QuantisationGrid
    positions: U16
    normals: I8 | I16 | F32 | None = None
    tangents: I8 | I16 | F32 | None = None
    uvs: U16 | F32 | None = None
    uvs1: U16 | F32 | None = None
    colors: U8 | U16 | None = None
    sway: U8 | None = None


@dataclass(frozen=True)
class Lod:
    """A level of detail. error_max, error_rms: two-sided surface distance from level 0 as a fraction of the
    bounding box's diagonal: the largest, and the larger RMS of the two directions. errors: further errors by
    name. quantised: its vertices as integers; None: float32."""

    mesh: Mesh
    error_max: float
    error_rms: float
    errors: Mapping[str, float] = field(default_factory=dict)
    quantised: QuantisedValues | None = None

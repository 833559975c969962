"""Finds the UV islands of a map and fills its gutters: every texel outside an island copies the nearest one
inside.

So no sample beside an island reads black: no bilinear sample, no coarse mip, no parallax offset. README.md
says how wide a gutter must be, and why what bleeds is measured (kernels/gutter/walk.hpp).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.errors import BakeError
from paradize.kernels import gutter, maps
from paradize.stages.sweep import bands_of, run

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    import numpy.typing as npt

    from paradize.data import Mesh

    F32 = npt.NDArray[np.float32]
    I32 = npt.NDArray[np.int32]

STEEPEST = 1.0  # the same in shaders/lib/parallax.glsl
FOOTPRINT = 2.0  # texels of a level that a sample and its pixel reach beyond a border
_ROUNDING = 1e-5  # of the map's side
WORST = 2.5  # no sample is off by more than so many times the bound


def _drawn(mesh: Mesh, ids: I32, height: int, width: int, file: object) -> I32:
    if mesh.uvs is None:
        raise BakeError("the mesh has no UVs", file=file, mend="leave out --uv, or unwrap the model")
    try:
        return maps.rasterise(mesh.uvs, mesh.triangles, ids, height=height, width=width)
    except ValueError as error:
        raise BakeError(str(error), file=file, mend="give UVs of one tile, or leave out --uv") from error


def island_map(mesh: Mesh, *, height: int, width: int, file: object = None) -> I32:
    """Returns the number of the UV island at each texel, (height, width) int32; -1 outside. Raises BakeError
    if the UVs are no layout."""
    if mesh.uvs is None:
        raise BakeError("the mesh has no UVs", file=file, mend="leave out --uv, or unwrap the model")
    return _drawn(mesh, maps.uv_islands(mesh.uvs, mesh.triangles), height, width, file)


def group_mask(
    mesh: Mesh, names: Collection[str], *, height: int, width: int, file: object = None
) -> npt.NDArray[np.bool_]:
    """Returns which texels belong to the named groups or materials, (height, width). Raises BakeError for an
    unknown name."""
    known = {group.name for group in mesh.groups} | {group.material for group in mesh.groups}
    missing = sorted(set(names) - known)
    if missing:
        what = f"no group or material {', '.join(map(repr, missing))}"
        raise BakeError(what, file=file, mend=f"there are {', '.join(map(repr, sorted(known)))}")
    ids = np.zeros(len(mesh.triangles), np.int32)
    for group in mesh.groups:
        if group.name in names or group.material in names:
            ids[group.first : group.first + group.count] = 1
    return np.asarray(_drawn(mesh, ids, height, width, file) == 1, np.bool_)


def goes_around(mesh: Mesh) -> bool:
    """Whether UVs leave 0..1 by more than rounding. Then opposite edges of the map meet, whatever its author
    said."""
    if mesh.uvs is None:
        return False
    used = mesh.uvs[mesh.triangles]
    return bool((used < -_ROUNDING).any() or (used > 1.0 + _ROUNDING).any())


def layout_source(islands: I32, mesh: Mesh, wrap: tuple[bool, bool]) -> I32 | None:
    """The gutter_source of an island map (h, w). It crosses the map's edges if the layout does."""
    return gutter_source(islands >= 0, (True, True) if goes_around(mesh) else wrap)


def gutter_source(covered: npt.NDArray[np.bool_], wrap: tuple[bool, bool]) -> I32 | None:
    """Returns the flat index of the nearest covered texel for each texel. None if all or none are covered."""
    if covered.all() or not covered.any():
        return None
    return maps.nearest_covered(covered, wrap=wrap)


def gathered(texels: npt.NDArray[Any], source: I32) -> npt.NDArray[Any]:
    """Returns rows of texels taken from elsewhere in a map (h, w, ...). source (n, w): their flat indices."""
    flat = texels.reshape(-1, *texels.shape[2:])
    return np.asarray(flat[source])


def fill_gutter(texels: npt.NDArray[Any], source: I32 | None) -> npt.NDArray[Any]:
    """The map (h, w, c) with every texel taken from its source (see gutter_source)."""
    if source is None:
        return texels
    out = np.empty(texels.shape, texels.dtype)
    for first, last in bands_of(*source.shape):
        out[first:last] = gathered(texels, source[first:last])
    return out


def with_source(islands: I32, source: I32 | None) -> I32:
    """Writes the sources of the gutters into an island map (h, w), in place: outside an island it then holds
    -2 - flat index of the source. So one array holds both."""
    for first, last in bands_of(*islands.shape) if source is not None else []:
        rows = islands[first:last]
        np.copyto(rows, -2 - source[first:last], where=rows < 0)  # type: ignore[index]
    return islands


def source_rows(islands: I32, first: int, last: int) -> I32:
    """Returns the flat indices (n, w) of the source texels of some rows of a map made by with_source."""
    width = islands.shape[1]
    rows = islands[first:last]
    own = np.arange(first * width, last * width, dtype=np.int32).reshape(rows.shape)
    return np.where(rows < 0, -2 - rows, own)


class Border:
    """Normals of the texels that gutters copy. These lie along the borders of islands and are few.

    islands: (h, w) int32, from with_source. rows: returns the normals (n, w, 3) of rows first..last.
    """

    def __init__(self, islands: I32, rows: Callable[[int, int], F32]) -> None:
        height, width = islands.shape
        bands = bands_of(height, width)
        wanted = np.zeros(height * width, np.bool_)
        for first, last in bands:
            part = islands[first:last]
            wanted[-2 - part[part < 0]] = True
        self._islands = islands
        self._at = np.flatnonzero(wanted).astype(np.int32)
        self._normals = np.empty((len(self._at), 3), np.float32)

        def work(band: tuple[int, int]) -> None:
            begin, end = np.searchsorted(self._at, [band[0] * width, band[1] * width])
            if begin < end:
                made = rows(*band).reshape(-1, 3)
                self._normals[begin:end] = made[self._at[begin:end] - band[0] * width]

        run(work, bands)

    def fill(self, normals: F32, first: int) -> None:
        """Fills the texels outside islands, in place. normals: rows (n, w, 3) from row `first` on."""
        rows = self._islands[first : first + len(normals)]
        outside = rows < 0
        normals[outside] = self._normals[np.searchsorted(self._at, -2 - rows[outside])]


@dataclass(frozen=True)
class Islands:
    """The islands of a map; islands that touch count as one. layout: for the kernels. of_triangle: (m,)
    int32, the island of each triangle. count: number of islands. width_texels: half the smallest distance
    between two islands, the widest possible gutter; None if there is one island."""

    layout: gutter.Layout
    of_triangle: I32
    count: int
    width_texels: float | None


def find_islands(mesh: Mesh, *, height: int, width: int, repeat: bool, file: object = None) -> Islands | None:
    """The islands of a mesh's UV layout on a map of height x width texels. repeat: whether the map repeats.
    None where the UVs cover no texel. Raises BakeError for UVs that are no layout."""
    drawn = island_map(mesh, height=height, width=width, file=file)
    if mesh.uvs is None or not (drawn >= 0).any():
        return None
    ids = maps.uv_islands(mesh.uvs, mesh.triangles)
    names = gutter.touching(drawn, int(ids.max()) + 1, repeat=repeat)
    inside = drawn >= 0
    source = maps.nearest_covered(inside, wrap=(repeat, repeat))
    owner = names[drawn.ravel()[source]]
    layout = gutter.Layout(inside, source, owner, repeat)
    gap = gutter.smallest_gap(layout)[0]
    return Islands(layout, names[ids], int(names.max()) + 1, None if gap < 0.0 else 0.5 * gap)


def parallax_reach(scale: float, bias: float) -> float:
    """How far the steepest view moves a sample, as a share of the map's sides."""
    return STEEPEST * (0.5 * abs(scale) + abs(bias))


def needed_texels(level: int, reach: float, size: int) -> float:
    """The gutter, in texels of level 0, that samples at `level` and a parallax reach need on a map `size`
    texels long on its longer side."""
    return FOOTPRINT * float(1 << level) + reach * size


def level_by_width(width_texels: float, reach: float, size: int, last: int) -> int:
    """The last level that a gutter of width_texels is wide enough for, whatever the colours; -1: none."""
    level = -1
    while level < last and needed_texels(level + 1, reach, size) <= width_texels:
        level += 1
    return level


def is_safe(found: gutter.Bleed, bound: float, known: tuple[float, float] = (0.0, 0.0)) -> bool:
    """Whether the bleeding of a level stays within the bound. known: (99 of 100, largest) of level 0, if that
    alone exceeds the bound: noise that blocks cannot hold, which no coarsest level mends."""
    return found.all_p99 <= max(bound, known[0]) and found.worst <= max(WORST * bound, known[1])


def safe_level(found: Sequence[gutter.Bleed], bound: float) -> int:
    """The last level up to which all are safe; at least 0."""
    level = 0
    while level + 1 < len(found) and is_safe(found[level + 1], bound):
        level += 1
    return level

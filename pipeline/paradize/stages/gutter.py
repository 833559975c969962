"""UV islands on a map, the texels of a material's groups, and gutters: every texel outside takes the nearest
inside.

Nothing samples black beside an island, neither a bilinear tap, nor a coarse mip, nor a parallax offset.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.errors import BakeError
from paradize.kernels import maps

if TYPE_CHECKING:
    from collections.abc import Collection

    import numpy.typing as npt

    from paradize.data import Mesh

    F32 = npt.NDArray[np.float32]
    I32 = npt.NDArray[np.int32]


def _drawn(mesh: Mesh, ids: I32, height: int, width: int, file: object) -> I32:
    if mesh.uvs is None:
        raise BakeError("the mesh has no UVs", file=file, mend="bake it with --atlas, or unwrap it")
    try:
        return maps.rasterise(mesh.uvs, mesh.triangles, ids, height=height, width=width)
    except ValueError as error:
        raise BakeError(str(error), file=file, mend="give UVs of one tile, or leave out --uv") from error


def island_map(mesh: Mesh, *, height: int, width: int, file: object = None) -> I32:
    """(height, width) int32: the UV island at each texel, -1 outside. Raises BakeError for UVs that are no
    layout."""
    if mesh.uvs is None:
        raise BakeError("the mesh has no UVs", file=file, mend="bake it with --atlas, or unwrap it")
    return _drawn(mesh, maps.uv_islands(mesh.uvs, mesh.triangles), height, width, file)


def group_mask(
    mesh: Mesh, names: Collection[str], *, height: int, width: int, file: object = None
) -> npt.NDArray[np.bool_]:
    """(height, width): the texels of the groups or materials named. Raises BakeError for a name that is
    none."""
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


def gutter_source(covered: npt.NDArray[np.bool_], wrap: tuple[bool, bool]) -> I32 | None:
    """For each texel the flat index of the nearest covered one; None where all or none are covered."""
    if covered.all() or not covered.any():
        return None
    return maps.nearest_covered(covered, wrap=wrap)


def fill_gutter(pixels: F32, source: I32 | None) -> F32:
    """The map (h, w, c) with every texel taken from its source (see gutter_source)."""
    if source is None:
        return pixels
    flat = pixels.reshape(-1, pixels.shape[2])
    return np.ascontiguousarray(flat[source.ravel()].reshape(pixels.shape))

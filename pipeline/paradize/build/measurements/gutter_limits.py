"""Measures what the gutters of an object's maps allow, on the published bytes.

From the GLB's texture coordinates and the KTX2s' decoded levels: the last safe mip and the steepest safe
parallax. The player clamps to them, `paradize check` finds and measures the borders by itself, `paradize
explain` prints them. The method: stages/gutter.py.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, Texture, rounded
from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.kernels.gutter import Bleed, linear_light, walk
from paradize.map_table import MAPS
from paradize.metrics.texels import decode_texels
from paradize.stages import gutter
from paradize.vectors import doubled_areas, doubled_areas_2d

F32 = npt.NDArray[np.float32]

_STEPS = 6  # bisections: the reach is within 1/64 of the largest safe one


@dataclass(frozen=True)
class Borders:
    """The UV islands of a mesh on maps of one size, and by material the islands of its triangles."""

    islands: gutter.Islands
    materials: dict[str, npt.NDArray[np.int32]]
    width: int
    height: int

    def reach(self, given: Mapping[str, float], *, only: str | None = None) -> npt.NDArray[np.float64]:
        """Returns (islands,): how far samples of each island may go, the farthest of its materials. given:
        by material. only: one material; the islands of others get -1."""
        reach = np.full(self.islands.count, -1.0)
        for name, ids in self.materials.items():
            if only in (None, name):
                reach[ids] = np.maximum(reach[ids], given.get(name, 0.0))
        return reach


def find_borders(mesh: Mesh, *, width: int, height: int, repeat: bool, file: object = None) -> Borders | None:
    """Returns None if the UVs cover no texel. Raises BakeError for UVs that are not a layout."""
    islands = gutter.find_islands(mesh, height=height, width=width, repeat=repeat, file=file)
    if islands is None:
        return None
    materials: dict[str, npt.NDArray[np.int32]] = {}
    for group in mesh.groups:
        ids = islands.of_triangle[group.first : group.first + group.count]
        known = materials.get(group.material, np.empty(0, np.int32))
        materials[group.material] = np.unique(np.concatenate([known, ids]))
    return Borders(islands, materials, width, height)


def sampled_levels(texture: Texture, name: str) -> list[F32]:
    """Returns all levels of an object's map as they are compared: colour in linear light, normals as x and
    y, others as they are, of gloss the intensity (smoothness changes from level to level by design)."""
    levels = [decode_texels(texture, level) for level in range(len(texture.levels))]
    if MAPS[name].kind == "color":
        for level in levels:
            level[:, :, :3] = linear_light(level[:, :, :3])
        opaque = levels[0].shape[2] == 4 and bool((levels[0][:, :, 3] >= 1).all())
        return [level[:, :, :3] for level in levels] if opaque else levels
    return [np.ascontiguousarray(level[:, :, : 2 if MAPS[name].kind == "normal" else 1]) for level in levels]


def measure_gutters(
    glb: bytes,
    textures: Mapping[str, bytes],
    *,
    name: str,
    parallax: Mapping[str, tuple[float, float]],
    bleed: float,
    pixel_m: float | None,
) -> dict[str, Any]:
    """Returns {"repeat", "limits": {material: reach or None}, "maps": {map: facts}}.

    textures: KTX2 by map. name: of their set. parallax: (scale, bias) of each material that they lie on.
    bleed: the bound, a share of the range. pixel_m: metres of the object that the largest pixel of the flight
    covers; None if it is never seen.

    repeat: whether the maps must repeat, because UVs lie outside 0..1. limits: the farthest safe reach where
    the requested one is too far. facts: see FORMAT.md; None for maps that repeat.
    """
    mesh = decode_glb(glb, name)[0].mesh.of_materials(parallax)
    requested = {key: gutter.parallax_reach(*parallax[key]) for key in sorted(parallax)}
    limits: dict[str, float | None] = dict.fromkeys(requested)
    if mesh.uvs is None or not len(mesh.triangles):
        return {"repeat": True, "limits": limits, "maps": dict.fromkeys(textures)}
    around = gutter.goes_around(mesh)
    decoded = {key: decode_ktx2(data, f"{name}_{key}") for key, data in textures.items()}
    chains = {key: sampled_levels(texture, key) for key, texture in decoded.items()}
    sizes = {(texture.width, texture.height) for texture in decoded.values()}
    of_size = {
        size: find_borders(mesh, width=size[0], height=size[1], repeat=around, file=name)
        for size in sorted(sizes)
    }
    of_map: dict[str, Borders] = {}
    for key, texture in decoded.items():
        borders = of_size[texture.width, texture.height]
        if borders is None:
            return {"repeat": True, "limits": limits, "maps": dict.fromkeys(textures)}
        of_map[key] = borders
    safe_reach = dict(requested)
    if "height" in textures:
        for material, reach in requested.items():
            safe_reach[material] = _safe_reach(material, reach, chains, of_map, bleed)
            if safe_reach[material] < reach:
                limits[material] = safe_reach[material]
    else:
        safe_reach = dict.fromkeys(requested, 0.0)
    maps = {}
    for key, chain in chains.items():
        at = of_map[key]
        size = max(at.width, at.height)
        bleed_by_level = walk(chain, MAPS[key].kind, at.islands.layout, at.reach(safe_reach))
        level = _level_in_use(mesh, at.width, at.height, pixel_m, len(chain) - 1)
        maps[key] = _facts(
            bleed_by_level, at.islands, level, max(safe_reach.values(), default=0.0), size, bleed
        )
    return {"repeat": around, "limits": limits, "maps": maps}


def _safe_reach(
    material: str, reach: float, chains: Mapping[str, list[F32]], of_map: Mapping[str, Borders], bleed: float
) -> float:
    """Returns the farthest reach, up to the requested one, whose samples at level 0 stay within the bound."""

    def level_0(key: str, tried: float) -> Bleed:
        at = of_map[key]
        far = at.reach({material: tried}, only=material)
        return walk(chains[key][:1], MAPS[key].kind, at.islands.layout, far)[0]

    def safe(tried: float) -> bool:
        return all(gutter.is_safe(level_0(key, tried), bleed, known[key]) for key in chains)

    if reach == 0.0 or material not in next(iter(of_map.values())).materials:
        return reach
    known = {}
    for key in chains:
        flat = level_0(key, 0.0)
        known[key] = (flat.all_p99, flat.worst)
    if safe(reach):
        return reach
    low, high = 0.0, 1.0
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if safe(middle * reach) else (low, middle)
    return low * reach


def _level_in_use(mesh: Mesh, width: int, height: int, pixel_m: float | None, last: int) -> int:
    """Returns the coarsest level that a pixel of pixel_m metres reads on the mesh, seen face on."""
    if pixel_m is None or mesh.uvs is None:
        return 0
    metres = math.fsum(doubled_areas(mesh.positions.astype(np.float64)[mesh.triangles]).tolist())
    uv = mesh.uvs.astype(np.float64)[mesh.triangles] * [width, height]
    texels = math.fsum(np.abs(doubled_areas_2d(uv)).tolist())
    across = math.sqrt(texels / metres) * pixel_m if metres > 0.0 else 0.0
    level = 0
    while level < last and float(1 << level) < across:
        level += 1
    return level


def _facts(
    bleed_by_level: list[Bleed], islands: gutter.Islands, in_use: int, reach: float, size: int, bleed: float
) -> dict[str, Any]:
    last = len(bleed_by_level) - 1
    safe = gutter.safe_level(bleed_by_level, bleed)
    width = islands.width_texels
    return {
        "islands": islands.count,
        "needed_texels": rounded(gutter.needed_texels(in_use, reach, size)),
        "width_texels": None if width is None else rounded(width),
        "level_in_use": in_use,
        "level_by_width": last if width is None else gutter.level_by_width(width, reach, size, last),
        "max_level": None if safe == last else safe,
        "bound": bleed,
        "bleed_p99": [rounded(level.all_p99) for level in bleed_by_level],
        "bleed_max": [rounded(level.worst) for level in bleed_by_level],
    }

"""The UV islands of a published mesh on a published map, and what samples beside their borders may see.

All of it is found anew from the files and judged by limits that stand here; the kernels draw the triangles
and walk the borders. So a fault in how the bake finds islands, reads levels or decides what is safe shows.
The limits are those that stages/README.md explains.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, Texture
from paradize.kernels import maps
from paradize.kernels.gutter import Bleed, Layout, linear_light, touching, walk
from paradize.map_table import MAPS
from paradize.metrics.texels import decode_texels

F32 = npt.NDArray[np.float32]
_WINDOW = 2  # texels round one of a gutter, of which the nearest of its island is one
WORST = 2.5  # no sample is off by more than so many times the bound


@dataclass(frozen=True)
class Borders:
    """The borders of the islands on maps of one size. materials: the islands of each material's triangles."""

    layout: Layout
    count: int
    materials: Mapping[str, npt.NDArray[np.int32]]

    def reach(self, shifts: Mapping[str, float]) -> npt.NDArray[np.float64]:
        """(islands,): how far samples of each may go, a share of the map's side, by their materials' shifts;
        -1 where no triangle has a material."""
        found = np.full(self.count, -1.0)
        for name, ids in self.materials.items():
            found[ids] = np.maximum(found[ids], shifts.get(name, 0.0))
        return found

    def with_gutters_as_they_are(self) -> Borders:
        """The borders where a gutter holds what its texels show, not the nearest texel of its island."""
        texels = np.arange(self.layout.source.size, dtype=np.int32).reshape(self.layout.source.shape)
        return replace(self, layout=replace(self.layout, source=texels))

    def gutter_excess(self, level: F32, left: int) -> F32:
        """(h, w): how far the gutter beside an island lies beyond what the island allows, of the finest
        published level (h, w, c) of a map of whose levels `left` are gone; 0 elsewhere, and within.

        A gutter repeats outermost texels of the level that is gone. Each of them is one of 4**left texels
        whose mean the island shows, so it lies so many times as far from them as they lie apart, at most.
        """
        rows, columns, _ = level.shape
        inside = self.layout.inside.reshape(rows, 1 << left, columns, 1 << left).any(axis=(1, 3))
        low, high = np.full(level.shape, np.inf, np.float32), np.full(level.shape, -np.inf, np.float32)
        beside = np.zeros(inside.shape, np.bool_)
        mode = "wrap" if self.layout.repeat else "constant"
        near = np.pad(inside, _WINDOW, mode=mode)  # type: ignore[call-overload]
        shown = np.pad(level, [(_WINDOW, _WINDOW), (_WINDOW, _WINDOW), (0, 0)], mode=mode)  # type: ignore[call-overload]
        for y in range(2 * _WINDOW + 1):
            for x in range(2 * _WINDOW + 1):
                there = near[y : y + rows, x : x + columns]
                texels = shown[y : y + rows, x : x + columns]
                np.minimum(low, texels, out=low, where=there[:, :, None])
                np.maximum(high, texels, out=high, where=there[:, :, None])
                if max(abs(y - _WINDOW), abs(x - _WINDOW)) == 1:
                    beside |= there
        out = np.zeros(inside.shape, np.float32)
        at = beside & ~inside
        span = (4**left - 1) * (high[at] - low[at])
        out[at] = np.maximum(low[at] - span - level[at], level[at] - high[at] - span).max(axis=1).clip(min=0)
        return out

    def walked(self, levels: list[F32], kind: str, reach: npt.NDArray[np.float64]) -> list[Bleed]:
        """The findings of a walk along the borders, by level."""
        return walk(levels, kind, self.layout, reach)


def find_borders(mesh: Mesh, *, width: int, height: int, repeat: bool) -> Borders | None:
    """None where the UVs are no layout or cover no texel: another rule's fault, or nothing to walk."""
    if mesh.uvs is None:
        return None
    ids = maps.uv_islands(mesh.uvs, mesh.triangles)
    try:
        drawn = maps.rasterise(mesh.uvs, mesh.triangles, ids, height=height, width=width)
    except ValueError:
        return None
    inside = drawn >= 0
    if not inside.any():
        return None
    names = touching(drawn, int(ids.max()) + 1, repeat=repeat)
    source = maps.nearest_covered(inside, wrap=(repeat, repeat))
    layout = Layout(inside, source, names[drawn.ravel()[source]], repeat)
    parts: dict[str, list[npt.NDArray[np.int32]]] = {}
    for group in mesh.groups:
        parts.setdefault(group.material, []).append(names[ids[group.first : group.first + group.count]])
    materials = {name: np.unique(np.concatenate(found)) for name, found in parts.items()}
    return Borders(layout, int(names.max()) + 1, materials)


def compared_levels(texture: Texture, name: str) -> list[F32]:
    """All levels of an object's map as samples are compared: colour in linear light, with alpha where some
    texel is not opaque; normals as x and y; of others the first channel (of gloss the intensity: smoothness
    widens from level to level by design)."""
    levels = [decode_texels(texture, level) for level in range(len(texture.levels))]
    if MAPS[name].kind != "color":
        channels = 2 if MAPS[name].kind == "normal" else 1
        return [np.ascontiguousarray(level[:, :, :channels]) for level in levels]
    for level in levels:
        level[:, :, :3] = linear_light(level[:, :, :3])
    opaque = levels[0].shape[2] < 4 or bool((levels[0][:, :, 3] >= 1).all())
    return [level[:, :, :3] for level in levels] if opaque else levels


def parallax_shift(scale: float, bias: float) -> float:
    """How far the steepest look moves a sample, a share of the map's side: heights run from -1/2 to 1/2."""
    return 0.5 * abs(scale) + abs(bias)


def is_safe(found: Bleed, bound: float, known: tuple[float, float]) -> bool:
    """Whether a level's walk stays within the bound: 99 of 100 samples within it, all within WORST times it.
    known: the same of level 0 where that is worse by itself, as noise is that blocks cannot hold."""
    return found.all_p99 <= max(bound, known[0]) and found.worst <= max(WORST * bound, known[1])

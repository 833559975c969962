"""Levels of detail by how they look: each is as coarse as it may be at the size on the screen where it takes
over.

A level by ratio may have so few triangles that it looks unlike the source at any size, and is never drawn.
Here the size comes first: level 1 takes over where the mesh has `size_px` pixels along its diagonal, and each
next level where it has half as many. Compared are the normals of the vertices, the silhouette and the light
on the faces that are drawn, without maps (metrics/seen.py, metrics/switch.py): a changed picture makes no
level anew. The published levels are measured with maps and holes (build/measurements/lods_seen.py).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from paradize.data import Mesh
from paradize.kernels.reference.seen import SeenMaterial, SeenMesh
from paradize.metrics.seen import (
    SMALLEST_PX,
    Limits,
    seen_difference,
    seen_mesh,
    seen_within,
)
from paradize.metrics.switch import ROOM, switch_flip

_ROOM = 0.7 * ROOM  # of the limit: maps, which are not compared here, change the picture too


@dataclass(frozen=True)
class ScreenSize:
    """size_px: at which level 1 takes over, 4 to 4096. normal_deg, silhouette: how much a level may differ
    there, as Limits. flip: how much the switch to it may change the picture; 1: anything. two_sided: the
    materials whose back faces are drawn."""

    size_px: float
    normal_deg: float = Limits.normal_deg
    silhouette: float = Limits.silhouette
    flip: float = 0.01
    two_sided: Collection[str] = ()

    def of_level(self, level: int) -> float:
        """The size in pixels at which a level, 1 or more, takes over."""
        return max(SMALLEST_PX, self.size_px * 0.5 ** (level - 1))

    def judge(self, source: Mesh, level: int, before: Mesh) -> Judge:
        """Returns the judge of meshes that may be this level, after the level `before`."""
        limits = Limits(self.normal_deg, self.silhouette)
        finest, last = (_plain(mesh, self.two_sided) for mesh in (source, before))
        return Judge(finest, last, self.of_level(level), limits, self.flip, self.two_sided)


@dataclass(frozen=True)
class Judge:
    """Says of a mesh whether it may take over from the level `before` at `size_px`: as ScreenSize."""

    finest: SeenMesh
    before: SeenMesh
    size_px: float
    limits: Limits
    flip: float
    two_sided: Collection[str] = ()

    def accepts(self, mesh: Mesh) -> bool:
        """Whether it may."""
        level = _plain(mesh, self.two_sided)
        if seen_within(self.finest, level, self.size_px, self.limits) is None:
            return False
        return self.flip >= 1.0 or switch_flip(self.before, level, self.size_px) <= _ROOM * self.flip

    def fault(self, mesh: Mesh) -> str:
        """Says which limit the mesh exceeds; an empty string if none."""
        level = _plain(mesh, self.two_sided)
        found = seen_difference(self.finest, level, self.size_px)
        over = []
        if found.p99_deg > self.limits.normal_deg:
            over.append(f"normals by {found.p99_deg:.3g} degrees, limit {self.limits.normal_deg:g}")
        if found.silhouette > self.limits.silhouette:
            over.append(f"silhouette by {found.silhouette:.2g}, limit {self.limits.silhouette:g}")
        if over:
            return f"look unlike the source at {self.size_px:g} pixels: {', '.join(over)}"
        change = 0.0 if self.flip >= 1.0 else switch_flip(self.before, level, self.size_px)
        if change <= _ROOM * self.flip:
            return ""
        return (
            f"look unlike the level before at {self.size_px:g} pixels: the picture by {change:.2g} of FLIP, "
            f"limit {_ROOM * self.flip:.2g}"
        )


def _plain(mesh: Mesh, two_sided: Collection[str]) -> SeenMesh:
    """The mesh without maps, half white."""
    grey = (np.full((1, 1, 3), 0.5, np.float32),)
    names = ["", *(group.material for group in mesh.groups)]
    return seen_mesh(mesh, {name: SeenMaterial(colors=grey, two_sided=name in two_sided) for name in names})

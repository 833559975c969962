"""Levels of detail by how they look: each is as coarse as it may be at the size on the screen where it takes
over.

A level by ratio may have so few triangles that it looks unlike the source at any size, and is never drawn.
Here the size comes first: level 1 takes over where the mesh has `size_px` pixels along its diagonal, and each
next level where it has half as many. Compared are the normals of the vertices, the silhouette of front faces
and the light on them, without maps (metrics/seen.py, metrics/switch.py); the published levels are measured
with maps (build/lods_seen.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from paradize.data import Mesh
from paradize.metrics.seen import LARGEST_PX, SMALLEST_PX, Limits, seen_difference, seen_mesh
from paradize.metrics.switch import ROOM, switch_flip


@dataclass(frozen=True)
class ScreenSize:
    """size_px: at which level 1 takes over, 4 to 4096. normal_deg, silhouette: how much a level may differ
    there, as Limits. flip: how much the switch to it may change the picture; 1: anything."""

    size_px: float
    normal_deg: float = Limits.normal_deg
    silhouette: float = Limits.silhouette
    flip: float = 0.01

    def in_range(self) -> bool:
        """Whether all numbers mean something."""
        limits = 0.0 <= self.normal_deg <= 180.0 and 0.0 <= self.silhouette <= 1.0 and 0.0 < self.flip <= 1.0
        return limits and SMALLEST_PX <= self.size_px <= LARGEST_PX

    def of_level(self, level: int) -> float:
        """The size in pixels at which a level, 1 or more, takes over."""
        return max(SMALLEST_PX, self.size_px * 0.5 ** (level - 1))

    def judge(self, source: Mesh, level: int, before: Mesh) -> Callable[[Mesh], str]:
        """Returns a function that says why a mesh may not be this level after the level `before`; an empty
        string where it may."""
        finest, size = seen_mesh(source, {}), self.of_level(level)
        limits, last = Limits(self.normal_deg, self.silhouette), seen_mesh(before, {})

        def fault(mesh: Mesh) -> str:
            seen = seen_mesh(mesh, {})
            found = seen_difference(finest, seen, size)
            if found.inside(limits):
                change = 0.0 if self.flip >= 1.0 else switch_flip(last, seen, size)
                if change <= ROOM * self.flip:
                    return ""
                return (
                    f"look unlike the level before at {size:g} pixels: the picture by {change:.2g} of FLIP, "
                    f"limit {ROOM * self.flip:.2g}"
                )
            over = []
            if found.p99_deg > limits.normal_deg:
                over.append(f"normals by {found.p99_deg:.3g} degrees, limit {limits.normal_deg:g}")
            if found.silhouette > limits.silhouette:
                over.append(f"silhouette by {found.silhouette:.2g}, limit {limits.silhouette:g}")
            return f"look unlike the source at {size:g} pixels: {', '.join(over)}"

        return fault

"""Levels of detail by how they look: each is as coarse as it may be at the size on the screen where it takes
over.

A level by ratio may have so few triangles that it looks unlike the source at any size, and is never drawn.
Here the size comes first: level 1 takes over where the mesh has `size_px` pixels along its diagonal, and each
next level where it has half as many. Compared are the normals of the vertices and the silhouette of
front faces, without maps (metrics/seen.py); the published levels are measured with maps (build/lods_seen.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from paradize.data import Mesh
from paradize.metrics.seen import LARGEST_PX, SMALLEST_PX, Limits, seen_difference, seen_mesh


@dataclass(frozen=True)
class ScreenSize:
    """size_px: at which level 1 takes over, 4 to 4096. normal_deg, silhouette: how much a level may differ
    there, as Limits."""

    size_px: float
    normal_deg: float = Limits.normal_deg
    silhouette: float = Limits.silhouette

    def in_range(self) -> bool:
        """Whether all numbers mean something."""
        limits = 0.0 <= self.normal_deg <= 180.0 and 0.0 <= self.silhouette <= 1.0
        return limits and SMALLEST_PX <= self.size_px <= LARGEST_PX

    def of_level(self, level: int) -> float:
        """The size in pixels at which a level, 1 or more, takes over."""
        return max(SMALLEST_PX, self.size_px * 0.5 ** (level - 1))

    def judge(self, source: Mesh, level: int) -> Callable[[Mesh], str]:
        """Returns a function that says why a mesh may not be this level; an empty string where it may."""
        finest, limits, size = (
            seen_mesh(source, {}),
            Limits(self.normal_deg, self.silhouette),
            self.of_level(level),
        )

        def fault(mesh: Mesh) -> str:
            found = seen_difference(finest, seen_mesh(mesh, {}), size)
            if found.inside(limits):
                return ""
            over = []
            if found.p99_deg > limits.normal_deg:
                over.append(f"normals by {found.p99_deg:.3g} degrees, limit {limits.normal_deg:g}")
            if found.silhouette > limits.silhouette:
                over.append(f"silhouette by {found.silhouette:.2g}, limit {limits.silhouette:g}")
            return f"look unlike the source at {size:g} pixels: {', '.join(over)}"

        return fault

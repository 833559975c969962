"""Decides from which distance on each level of detail is drawn.

A level is selected by an error in metres, scene.json's `error_m`: the larger of what its surface and its
texture are off, and of what makes it look unlike the finest level (lods_seen.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate
from typing import Any

from paradize.artifact import SEEN, Artifact
from paradize.build.manifest import MeshFacts
from paradize.scene.settings import Scene

SEEN_OF_LEVELS = SEEN[1:]  # what budgets may limit of them


def with_levels_seen(
    scene: Scene, mesh: Artifact, facts: MeshFacts, seen: Sequence[dict[str, Any]]
) -> tuple[Artifact, MeshFacts]:
    """Returns a mesh with what lods_seen.measure_lods_seen found of its levels. A level that differs too
    much at any size is drawn where the whole mesh is a pixel wide, and its differences do not count."""
    pixel_m = 2.0 * facts.radius_m * scene.head.lod_error_px
    found = (pixel_m if level["switch_m"] is None else level["switch_m"] for level in seen)
    switch_m = accumulate(map(max, found, (error_m for _, error_m in facts.lods)), max)
    levels = [
        level | {key: difference[key] for key in SEEN}
        for level, difference in zip(mesh.levels, seen, strict=True)
    ]
    drawn = [level for level in seen if level["switch_m"] is not None]
    worst = {f"lod_{key}": max(level[key] for level in drawn) for key in SEEN_OF_LEVELS}
    return replace(mesh, levels=levels, errors=mesh.errors | worst), replace(facts, switch_m=tuple(switch_m))

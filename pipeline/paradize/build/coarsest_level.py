"""Decides from which distance on each level of detail is drawn, and leaves out the levels that are then never
drawn in the flight.

A level is selected by an error in metres, scene.json's `error_m`: the larger of what its surface and its
texture are off, and of what makes it look unlike the finest level (lods_seen.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate
from pathlib import Path
from typing import Any

from paradize.artifact import Artifact
from paradize.bakers.registry import LARGEST_OF_LEVELS
from paradize.build.artifacts import keep_artifact, read_artifact
from paradize.build.manifest import MeshFacts
from paradize.formats.glb.cut import cut_glb
from paradize.scene.finest_views import COARSEST_LOD
from paradize.scene.settings import Scene
from paradize.store.local import Store

MEASURED = ("seen_px", "seen_p99_deg", "seen_mean_deg", "seen_silhouette")
_BUDGETED = MEASURED[1:]


def with_levels_seen(
    scene: Scene, mesh: Artifact, facts: MeshFacts, seen: Sequence[dict[str, Any]]
) -> tuple[Artifact, MeshFacts]:
    """Returns a mesh with what lods_seen.measure_lods_seen found of its levels. A level that differs too
    much at any size is drawn where the whole mesh is a pixel wide."""
    pixel_m = 2.0 * facts.radius_m * scene.head.lod_error_px
    switch_m = accumulate((pixel_m if one["switch_m"] is None else one["switch_m"] for one in seen), max)
    levels = [
        level | {key: one[key] for key in MEASURED} for level, one in zip(mesh.levels, seen, strict=True)
    ]
    worst = {f"lod_{key}": max(one[key] for one in seen) for key in _BUDGETED}
    return replace(mesh, levels=levels, errors=mesh.errors | worst), replace(facts, switch_m=tuple(switch_m))


def drawn_levels(scene: Scene, switch_m: Sequence[float], pixel_m: float | None) -> int:
    """Returns how many levels of a mesh the flight draws, the finest among them, in the player's coarsest
    quality. pixel_m: from sightings.ObjectSighting. All where it is never seen or the camera is free."""
    if pixel_m is None or scene.free_camera is not None:
        return len(switch_m)
    accepted_m = COARSEST_LOD * scene.head.lod_error_px * pixel_m
    return max(1, sum(error_m <= accepted_m for error_m in switch_m))


def without_coarsest(
    store: Store, mesh: Artifact, facts: MeshFacts, count: int, path: Path
) -> tuple[Artifact, MeshFacts, Path]:
    """Returns a mesh with its `count` finest levels alone, and the path of its bytes. Errors are then
    those of these levels. path: of its bytes."""
    data = read_artifact(path)
    sha256, kept = keep_artifact(store, cut_glb(data, coarser=len(facts.lods) - count, file=mesh.file))
    levels = mesh.levels[:count]
    known = LARGEST_OF_LEVELS | {
        metric: metric.removeprefix("lod_")
        for metric in mesh.errors
        if metric.startswith(("lod_mapped_", "lod_seen_"))
    }
    errors = {
        metric: max(level[known[metric]] for level in levels)
        if all(known.get(metric) in level for level in levels)
        else value
        for metric, value in mesh.errors.items()
    }
    left_out = {"coarser_left_out": len(facts.lods) - count}
    mesh = replace(
        mesh, levels=levels, errors=errors, sha256=sha256, bytes=kept.stat().st_size, required_detail=left_out
    )
    return mesh, replace(facts, lods=facts.lods[:count], switch_m=facts.switch_m[:count]), kept

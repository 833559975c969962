"""What a scene's flight can see of a mesh -> how fine its levels of detail must be.

Two bounds: at the nearest view an error of `lod_error_px` pixels (what is finer than that is not baked), and
at the farthest (a level coarser than that is never drawn). Distances are to the bounding sphere, as the
player takes them, and pixels those of the middle of the picture.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from paradize.bakers.mesh.bake import MeshProduct, bake_mesh
from paradize.bakers.mesh.lods import Plan
from paradize.data import Mesh
from paradize.formats.glb.cut import cut_glb
from paradize.metrics.surface import diagonal
from paradize.scene.baker_settings import MeshSettings
from paradize.scene.flight import plan_flight, sightings_of, sine_cosine
from paradize.scene.placement import to_world
from paradize.scene.settings import EyePoint, Flight, TargetPoint


def sight_plan(seen: dict[str, Any], instances: Sequence[Mapping[str, Any]]) -> Callable[[Mesh, Plan], Plan]:
    """A plan for a mesh that stands at `instances` (as scene.Instance) in what `seen` (as
    scene/requirements.py orders it) shows. A mesh that the flight never sees keeps one level, as
    coarse as the plan's limit allows."""
    told = dict(seen["flight"])
    told["eye"] = tuple(EyePoint(**point) for point in told["eye"])
    told["target"] = tuple(TargetPoint(**point) for point in told["target"])
    settings = Flight(**told)
    width, height = seen["viewport"]
    sine, cosine = sine_cosine(0.5 * settings.fov_deg)
    pixel_per_m = 2.0 * (sine / cosine) / height  # metres that a pixel covers, per metre of distance

    def plan(mesh: Mesh, asked: Plan) -> Plan:
        used = mesh.absolute_positions[np.unique(mesh.triangles)]
        low, high = used.min(axis=0), used.max(axis=0)
        center = [float(value) for value in (low + high) / 2]
        size = diagonal(mesh)
        if not size > 0:
            return asked
        spheres = []
        for instance in instances:
            turn, scale = sine_cosine(instance["yaw_deg"]), instance["scale"]
            spheres.append((to_world(center, instance["position"], turn, scale), scale * size / 2))
        met = sightings_of(plan_flight(settings), settings.fov_deg, width / height, spheres)
        near, far = [], []
        for sighting, instance in zip(met, instances, strict=True):
            if sighting.seen:
                near.append(sighting.nearest_m / instance["scale"])
                far.append(sighting.farthest_seen_m / instance["scale"])
        if not near:
            return replace(asked, count=1, finest=asked.limit)
        near_share, far_share = (seen[key] * pixel_per_m / size for key in ("error_px", "far_error_px"))
        finest = min(near_share * min(near), asked.limit)
        return replace(asked, finest=finest, farthest=far_share * max(far))

    return plan


def bake_seen(path: Path, settings: MeshSettings, *, tier: str) -> MeshProduct:
    """bake_mesh with levels for what the flight sees, where settings.sight says what that is. Of its
    attributes the GLB holds those of the settings."""
    plan = None if settings.sight is None else sight_plan(settings.sight, settings.instances)
    made = bake_mesh(path, settings, tier=tier, plan=plan, tangent_tiers=False)
    return replace(made, glb=cut_glb(made.glb, attributes=settings.attributes))

"""Derives from the flight how fine the levels of detail of a mesh must be.

Two bounds: an error of `error_px` pixels at the nearest view (nothing finer is baked), and of `far_error_px`
at the farthest (a coarser level is never drawn). Distances are to the bounding sphere and pixels those in the
middle of the picture, as in the player.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from paradize.bakers.mesh.bake import MeshProduct, bake_mesh
from paradize.bakers.mesh.lods import Plan
from paradize.data import Mesh
from paradize.formats.glb.cut import cut_glb
from paradize.metrics.surface import diagonal
from paradize.placement import largest_scale, to_world
from paradize.scene.baker_settings import MeshSettings
from paradize.scene.flight import plan_flight, sightings_of, sine_cosine
from paradize.scene.settings import EyePoint, Flight, TargetPoint


def plan_by_flight(
    views: dict[str, Any], instances: Sequence[Mapping[str, Any]]
) -> Callable[[Mesh, Plan], Plan]:
    """Returns a function that adapts a plan to a mesh. views: from scene/finest_views.py. instances: as
    in scene.json. A mesh that the flight never sees keeps one level, as coarse as the plan's limit allows."""
    fields = dict(views["flight"])
    fields["eye"] = tuple(EyePoint(**point) for point in fields["eye"])
    fields["target"] = tuple(TargetPoint(**point) for point in fields["target"])
    settings = Flight(**fields)
    width, height = views["viewport"]
    sine, cosine = sine_cosine(0.5 * settings.fov_deg)
    pixel_per_m = 2.0 * (sine / cosine) / height  # metres that a pixel covers, per metre of distance

    def plan(mesh: Mesh, requested: Plan) -> Plan:
        used = mesh.absolute_positions[mesh.is_used]
        low, high = used.min(axis=0), used.max(axis=0)
        center = [float(value) for value in (low + high) / 2]
        size = diagonal(mesh)
        if not size > 0:
            return requested
        spheres = []
        for instance in instances:
            spheres.append((to_world(center, instance), largest_scale(instance) * size / 2))
        sightings = sightings_of(plan_flight(settings), settings.fov_deg, width / height, spheres)
        near, far = [], []
        for sighting, instance in zip(sightings, instances, strict=True):
            if sighting.seen:
                near.append(sighting.nearest_m / largest_scale(instance))
                far.append(sighting.farthest_seen_m / largest_scale(instance))
        if not near:
            return replace(requested, count=1, finest=requested.limit)
        near_share, far_share = (views[key] * pixel_per_m / size for key in ("error_px", "far_error_px"))
        finest = min(near_share * min(near), requested.limit)
        return replace(requested, finest=finest, farthest=far_share * max(far))

    return plan


def bake_seen(path: Path, settings: MeshSettings, *, tier: str, root: Path | None = None) -> MeshProduct:
    """Calls bake_mesh, with levels adapted to the flight if settings.flight_views is set. The GLB holds the
    attributes of the settings. root: as of read_model."""
    plan = (
        None if settings.flight_views is None else plan_by_flight(settings.flight_views, settings.instances)
    )
    product = bake_mesh(path, settings, tier=tier, root=root, plan=plan, tangent_tiers=False)
    return replace(product, glb=cut_glb(product.glb, attributes=settings.attributes))

"""How the flight sees the objects of a scene. Imports numpy only where it is measured."""

from __future__ import annotations

from dataclasses import dataclass

from paradize.placement import largest_scale, to_world
from paradize.scene.flight import Flight, Vec, sightings_of, sine_cosine
from paradize.scene.motion import stands
from paradize.scene.settings import Scene


@dataclass(frozen=True)
class ObjectSighting:
    """How the flight sees an object, over all its instances. first_s: when it first comes into view,
    seconds; the end of the flight if it never does. pixel_m: metres of the object that the largest pixel
    covers at its farthest, seen face on, per metre of the mesh; None if it is never seen."""

    first_s: float
    pixel_m: float | None


def object_sightings(
    scene: Scene, flight: Flight, bounds: dict[str, tuple[Vec, float]]
) -> dict[str, ObjectSighting]:
    """Returns how the flight sees each object, by name. Reflection and refraction count too.

    bounds: center (metres, in the object's space) and radius (metres) by object name.
    """
    spheres: list[tuple[Vec, float]] = []
    owners: list[tuple[str, float]] = []
    for item in scene.objects:
        center, radius = bounds[item.name]
        for instance in stands(item):
            scale = largest_scale(instance)
            spheres.append((to_world(center, instance), scale * radius))
            owners.append((item.name, scale))
    width, height = scene.head.viewport
    sightings = {item.name: ObjectSighting(flight.duration_s, None) for item in scene.objects}
    seen = sightings_of(flight, scene.flight.fov_deg, width / height, spheres)
    sine, cosine = sine_cosine(0.5 * scene.flight.fov_deg)
    views = [scene.reflection, scene.refraction] if scene.water else []
    rows = height * min([1.0, *(view.scale for view in views if view)])
    for (owner, scale), sighting in zip(owners, seen, strict=True):
        if sighting.seen:
            before = sightings[owner]
            pixel_m = 2.0 * sighting.farthest_seen_m * (sine / cosine) / rows / scale
            first_s = min(before.first_s, sighting.first_seen_s)
            sightings[owner] = ObjectSighting(first_s, max(before.pixel_m or 0.0, pixel_m))
    return sightings

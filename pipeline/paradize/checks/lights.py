"""Rules for point lights: whether each is on at some moment and reaches something, and whether the sets hold
all that reach."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.checks.rules import Finding
from paradize.placement import largest_scale, to_world
from paradize.player_limits import MOST_LIGHTS_OF_A_SET

F64 = npt.NDArray[np.float64]


def check_lights(manifest: dict[str, Any], file: str) -> Iterator[Finding]:
    """The findings about the lights of a scene.json."""
    lights = manifest.get("lights", [])
    sets = [set(light_set["lights"]) for light_set in manifest.get("light_sets", [])]
    reached: set[int] = set()
    for place, indices, gaps_m in _drawn(manifest, lights):
        of_place = [sets[index] for index in indices]
        for k, light in enumerate(lights):
            near = np.flatnonzero(gaps_m[:, k] < light["range_m"])
            if len(near):
                reached.add(k)
            # Triangles that only just touch are left to rounding.
            missing = [
                row
                for row in near.tolist()
                if gaps_m[row, k] < 0.999 * light["range_m"]
                and k not in of_place[row]
                and len(of_place[row]) < MOST_LIGHTS_OF_A_SET
            ]
            if missing:
                what = f"lights[{k}] ({light['name']}) is not in the set of {len(missing)} that it reaches"
                yield Finding("PZ426", file, what, f"{place}[{missing[0]}]")
    for k, light in enumerate(lights):
        hours = light["hours"]
        if k not in reached:
            what = f"{light['name']}: nothing lies within {light['range_m']:g} m"
            yield Finding("PZ424", file, what, f"lights[{k}]")
        if light["intensity"] * max(light["color"]) == 0.0 or (hours and hours["on_s"] == hours["off_s"]):
            yield Finding("PZ425", file, light["name"], f"lights[{k}]")


def _drawn(manifest: dict[str, Any], lights: list[dict[str, Any]]) -> Iterator[tuple[str, list[int], F64]]:
    """Yields for objects, terrain and water: their place in scene.json, the set of each part, and the
    distance from each part's bounding sphere to each light, (parts, lights), metres."""
    if not lights:
        return
    places = np.array([light["position"] for light in lights])
    for i, item in enumerate(manifest["objects"]):
        centers = [to_world(item["center"], instance) for instance in item["instances"]]
        radii = [item["radius_m"] * largest_scale(instance) for instance in item["instances"]]
        indices = item.get("light_sets", [0] * len(radii))
        yield f"objects[{i}].light_sets", indices, _gaps(np.array(centers), np.array(radii), places)
    if terrain := manifest["terrain"]:
        radii_m = np.array(terrain["patches"]["radius_m"])
        indices = terrain.get("light_sets", [0] * len(radii_m))
        gaps = _gaps(np.array(terrain["patches"]["center"]), radii_m, places)
        yield "terrain.light_sets", indices, gaps
    if water := manifest["water"]:
        yield "water.light_set", [water.get("light_set", 0)], np.abs(places[None, :, 1] - water["level_m"])


def _gaps(centers: F64, radii_m: F64, places: F64) -> F64:
    way = centers[:, None, :] - places[None, :, :]
    gaps: F64 = np.sqrt((way * way).sum(axis=2)) - radii_m[:, None]
    return gaps

"""Finds which lights reach what the player draws with one call: an instance of an object, a patch of terrain,
the water.

The player gives each draw call only the lights of its set: those whose spheres of `range_m` meet a bounding
sphere. Sets that are alike stand once in scene.json.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from paradize.placement import largest_scale, to_world
from paradize.player_limits import MOST_LIGHT_SETS, MOST_LIGHTS_OF_A_SET
from paradize.scene.motion import reach_m as way_reach_m
from paradize.scene.placement import placed
from paradize.scene.settings import Light, Scene

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


def light_entries(scene: Scene) -> tuple[list[dict[str, Any]], dict[str, list[int]]]:
    """Returns `lights` of scene.json, one for each instance of a light's object; and by object the index of
    the light of each of its instances."""
    objects = {item.name: item for item in scene.objects}
    entries: list[dict[str, Any]] = []
    glow: dict[str, list[int]] = {}
    for light in scene.lights:
        if light.object is None:
            assert light.position is not None
            entries.append(_entry(light, list(light.position), 0, scene.flight.duration_s))
            continue
        instances = objects[light.object].instances
        glow[light.object] = list(range(len(entries), len(entries) + len(instances)))
        for k, instance in enumerate(instances):
            place = [float(value) for value in to_world(light.offset, placed(instance))]
            entries.append(_entry(light, place, k, scene.flight.duration_s))
    return entries, glow


def _entry(light: Light, position: list[float], step: int, duration_s: float) -> dict[str, Any]:
    hours = None
    if light.on_s is not None and light.off_s is not None:
        hours = {"on_s": (light.on_s + step * light.step_s) % duration_s, "off_s": light.off_s}
    beam = {"beam_m": light.beam_m} if light.beam_m > 0.0 else {}
    return {
        "name": light.name,
        "position": position,
        "color": list(light.color),
        "intensity": light.intensity,
        "radius_m": light.radius_m,
        "range_m": light.range_m,
        "hours": hours,
        "fade_s": light.fade_s,
        "flicker": light.flicker,
    } | beam


@dataclass
class _Sets:
    """The sets in the order in which they were found. full: whether there were more than the player takes."""

    entries: list[dict[str, Any]] = field(default_factory=lambda: [{"lights": [], "glow": None}])
    known: dict[tuple[tuple[int, ...], int | None], int] = field(default_factory=lambda: {((), None): 0})
    full: bool = False

    def index(self, lights: Sequence[int], glow: int | None = None) -> int:
        """The index of a set. Beyond the most that the player takes: 0, no light."""
        key = tuple(lights), glow
        if key not in self.known:
            self.full |= len(self.entries) == MOST_LIGHT_SETS
            if self.full:
                return 0
            self.known[key] = len(self.entries)
            self.entries.append({"lights": list(lights), "glow": glow})
        return self.known[key]


def add_light_sets(manifest: dict[str, Any], glow: dict[str, list[int]]) -> list[str]:
    """Adds `light_sets` to a manifest and to its objects, terrain and water. glow: from light_entries.
    Returns warnings: where more lights reach something than the player takes, the strongest are kept."""
    sets = _Sets()
    warnings: list[str] = []
    lights = manifest["lights"]
    terrain, water = manifest["terrain"], manifest["water"]
    manifest["light_sets"] = sets.entries
    for item in manifest["objects"]:
        spheres = _instance_spheres(item)
        own = glow.get(item["name"])
        found = _reaching(lights, *spheres, f"the object {item['name']}", warnings)
        indices = [
            sets.index(lights_of_instance, own[k] if own else None)
            for k, lights_of_instance in enumerate(found)
        ]
        if any(indices):
            item["light_sets"] = indices
    if terrain:
        patches = terrain["patches"]
        found = _reaching(lights, patches["center"], patches["radius_m"], "a terrain patch", warnings)
        indices = [sets.index(lights_of_patch) for lights_of_patch in found]
        if any(indices):
            terrain["light_sets"] = indices
    if water:
        away_m = [abs(light["position"][1] - water["level_m"]) for light in lights]
        found = _strongest(lights, [away_m], "the water", warnings)
        if found[0]:
            water["light_set"] = sets.index(found[0])
    if sets.full:
        warnings.append(f"lights: more than {MOST_LIGHT_SETS} sets of them; make range_m smaller")
    return warnings


def _instance_spheres(item: dict[str, Any]) -> tuple[list[tuple[float, float, float]], list[float]]:
    """Returns centres and radii of the instances' bounding spheres, metres, as the player finds them; of what
    moves, of all its way."""
    sway, motion = item["sway"], item["motion"]
    reach_m = sway["lean_m"] + 1.1 * sway["flutter_m"] if sway else 0.0
    instances = item["instances"]
    centers = [to_world(item["center"], instance) for instance in instances]
    radius_m = item["radius_m"]
    if motion is not None:
        reach_m += way_reach_m(motion)
        beat = motion["beat"] or {"lift_rad": 0.0, "swing_rad": 0.0}
        radius_m *= 1.0 + beat["lift_rad"] + beat["swing_rad"]
        radius_m += 2.0 * math.hypot(*item["center"])  # it turns about its origin
    return centers, [radius_m * largest_scale(instance) + reach_m for instance in instances]


_SLACK_M = 1e-3  # more than the player's float32 rounds away near the origin


def _reaching(
    lights: list[dict[str, Any]],
    centers: Sequence[Sequence[float]],
    radii_m: Sequence[float],
    what: str,
    warnings: list[str],
) -> list[list[int]]:
    """Returns the lights that reach each sphere, in rising order."""
    import numpy as np  # here: a scene without lights needs none

    middles, radii = np.asarray(centers, np.float64), np.asarray(radii_m, np.float64)
    away = np.empty((len(radii), len(lights)))
    for k, light in enumerate(lights):
        way = middles - np.asarray(light["position"], np.float64)
        away[:, k] = np.sqrt((way * way).sum(axis=1)) - radii
    return _strongest(lights, away - _SLACK_M, what, warnings)


def _strongest(
    lights: list[dict[str, Any]],
    away_m: npt.NDArray[np.float64] | list[list[float]],
    what: str,
    warnings: list[str],
) -> list[list[int]]:
    """Returns the lights that reach each thing, at most as many as the player takes. away_m : (things,
    lights), from each light to the nearest point of the thing, metres."""
    import numpy as np

    away = np.maximum(np.asarray(away_m, np.float64), 0.0)
    reach = np.array([light["range_m"] for light in lights])
    power = np.array([light["intensity"] * max(light["color"]) for light in lights])
    nearest = np.array([light["radius_m"] for light in lights])
    most = 0
    rows = np.flatnonzero((away < reach).any(axis=1))
    lists: list[list[int]] = [[] for _ in range(len(away))]
    for row in rows.tolist():
        near = np.flatnonzero(away[row] < reach)
        most = max(most, len(near))
        if len(near) > MOST_LIGHTS_OF_A_SET:
            strength = power[near] / np.maximum(away[row][near], nearest[near]) ** 2
            near = np.sort(near[np.argsort(-strength, kind="stable")[:MOST_LIGHTS_OF_A_SET]])
        lists[row] = near.tolist()
    if most > MOST_LIGHTS_OF_A_SET:
        warnings.append(
            f"lights: {most} reach {what}, and the player takes {MOST_LIGHTS_OF_A_SET}: the weakest are left "
            "out; make range_m smaller"
        )
    return lists

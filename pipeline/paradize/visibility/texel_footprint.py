"""How small a pixel ever is on a surface: metres of it that one pixel covers, in any view, at any moment.

A pixel's width at distance r, seen at an angle a from the picture's middle, is p r cos(a)^2 across the ray, p
its width at one metre straight ahead; what the surface is tilted away only makes it longer one way. So
p r cos(a)^2 bounds from below the shorter of the two axes of the ellipse that a pixel covers, and that is the
axis by which anisotropic filtering picks its mip (EXT_texture_filter_anisotropic); isotropic filtering takes
the longer one. Nothing is taken to be hidden by anything else. Arithmetic: + - * / sqrt by element.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.visibility.query import Demand, Runs, Sphere, is_lit, lifted, plan_demand

F64 = npt.NDArray[np.float64]
# What lies below the water is drawn where it is seen through it, straight above. That makes surfaces steeper
# or flatter: by how much a pixel may then cover less of one.
_BENT = 0.8
FREE = "free camera"


@dataclass(frozen=True)
class Views:
    """The views that draw a thing. pixel: width of the camera's pixel at one metre straight ahead, metres.
    camera: whether it is one of them. mirror, refraction: size of their pictures over the camera's; None:
    they do not draw it. light_m: width of a texel of the shadow map; None: as those."""

    demand: Demand
    pixel: float
    camera: bool
    mirror: float | None
    refraction: float | None
    light_m: float | None

    def covered(self, sphere: Sphere, runs: Runs) -> dict[str, F64]:
        """By view: metres of a surface in the sphere that a pixel covers at least in each of `runs`; infinite
        where the view does not show it."""
        found = {}
        demand = self.demand
        if self.camera:
            found["camera"] = self._covered(sphere, runs)
        x, y, z = sphere.center
        level = demand.mirror_m
        if self.mirror is not None and level is not None and y + sphere.radius_m >= level - 0.1:
            below = Sphere((x, 2.0 * level - y, z), sphere.radius_m)
            rows = self._covered(below, runs) / self.mirror
            found["mirror"] = np.where(demand.highest(runs) > level, rows, np.inf)
        if self.refraction is not None and demand.water_m is not None and y < demand.water_m:
            rows = np.minimum.reduce([self._covered(at, runs) for at in lifted(sphere, demand.water_m)])
            rows = rows * (_BENT / self.refraction)
            found["refraction"] = np.where(demand.highest(runs) > demand.water_m, rows, np.inf)
        if self.light_m is not None and demand.light is not None and is_lit(sphere, demand.light):
            found["light"] = np.full(len(runs), self.light_m)
        return found

    def _covered(self, sphere: Sphere, runs: Runs) -> F64:
        demand = self.demand
        toward = [c - axis[runs] for c, axis in zip(sphere.center, demand.eye, strict=True)]
        square = toward[0] * toward[0] + toward[1] * toward[1] + toward[2] * toward[2]
        away = np.sqrt(square)
        safe = np.maximum(away, 1e-30)
        ahead = [axis[runs] for axis in demand.ahead]
        cos = (toward[0] * ahead[0] + toward[1] * ahead[1] + toward[2] * ahead[2]) / safe
        sin = np.sqrt(np.maximum(0.0, 1.0 - cos * cos))
        # The angle to the sphere's middle, and by how much more its far side and a turn may lie off.
        wide = np.minimum(1.0, (sphere.radius_m + demand.slack_m[runs]) / safe)
        turn = demand.turn[runs]
        wide_cos, turn_cos = np.sqrt(1.0 - wide * wide), np.sqrt(1.0 - turn * turn)
        more_cos = wide_cos * turn_cos - wide * turn
        more_sin = wide * turn_cos + wide_cos * turn
        off = cos * more_cos - sin * more_sin
        known = (more_cos > 0.0) & (off > 0.0) & (cos > 0.0)
        edge = np.where(known, np.maximum(off, demand.corner), demand.corner)
        rows: F64 = self.pixel * demand.nearest(sphere, runs) * edge * edge
        return np.where(demand.in_cone(sphere, runs), rows, np.inf)

    def reached(self, point: tuple[float, float, float], runs: Runs) -> dict[str, F64]:
        """By view: the same of a point of the surface, from the middle of each run's ball: what is seen."""
        x, y, z = point
        demand = self.demand
        found = {}
        places: list[tuple[str, float, float]] = [("camera", y, 1.0)] if self.camera else []
        if self.mirror is not None and demand.mirror_m is not None and y >= demand.mirror_m:
            places.append(("mirror", 2.0 * demand.mirror_m - y, self.mirror))
        for name, height, scale in places:
            toward = [c - axis[runs] for c, axis in zip((x, height, z), demand.eye, strict=True)]
            away = np.sqrt(toward[0] * toward[0] + toward[1] * toward[1] + toward[2] * toward[2])
            ahead = [axis[runs] for axis in demand.ahead]
            depth = toward[0] * ahead[0] + toward[1] * ahead[1] + toward[2] * ahead[2]
            seen = (depth >= demand.near_m[runs]) & (depth >= demand.corner * away) & (depth <= demand.far_m)
            seen &= demand.turn[runs] < 1.0
            if name == "mirror":
                seen &= demand.eye[1][runs] > (demand.mirror_m or 0.0)
            rows = self.pixel * depth * depth / np.maximum(away, 1e-30) / scale
            found[name] = np.where(seen, rows, np.inf)
        if self.light_m is not None and demand.light is not None and is_lit(Sphere(point, 0.0), demand.light):
            found["light"] = np.full(len(runs), self.light_m)
        return found

    def moment(self, run: int, view: str) -> tuple[float | None, str]:
        """The second of a run, and the view in words; no second where it is no moment of the flight."""
        if self.demand.start_s[run] >= self.demand.duration_s:
            return None, FREE if view == "camera" else f"{FREE}'s {view}"
        return None if view == "light" else float(self.demand.start_s[run]), view


@lru_cache(maxsize=2)
def _demand_of(sight: str) -> Demand:
    """One flight is asked of many objects."""
    return plan_demand(json.loads(sight))


def views_of(sight: dict[str, Any], drawn: tuple[str, ...], light_m: float | None) -> Views:
    """Of what require.ground_sight orders, and `scales`: of reflection and refraction by name, where they
    are. drawn: the views that draw a thing, as scene.VIEWS names them. light_m: as in Views."""
    demand = _demand_of(json.dumps(sight))
    scales = sight["scales"]
    return Views(
        demand,
        1.0 / (demand.pixels * sight["error_px"]),
        "camera" in drawn,
        scales.get("reflection") if "reflection" in drawn else None,
        scales.get("refraction") if "refraction" in drawn else None,
        light_m if "shadow" in drawn else None,
    )

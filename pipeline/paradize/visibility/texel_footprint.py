"""The footprint of a pixel on a surface: the fewest metres that one pixel covers, in any view, at any moment.

A pixel at distance r and angle a from the picture's centre is p r cos(a)^2 wide across the ray, where p is
its width at 1 m on the axis. A tilted surface only makes the footprint longer in one direction. So p r
cos(a)^2 is a lower bound of the shorter axis of the footprint's ellipse, by which anisotropic filtering picks
its mip (EXT_texture_filter_anisotropic); isotropic filtering uses the longer axis. Occlusion is ignored.
Arithmetic: element-wise + - * / sqrt.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.visibility.query import Runs, Sphere, VisibilityQuery, is_lit, lifted_spheres, plan_query

F64 = npt.NDArray[np.float64]
# Refraction raises what lies below the water, which tilts surfaces. Smallest factor of a pixel's footprint.
_REFRACTION_FACTOR = 0.8
FREE_CAMERA = "free camera"


@dataclass(frozen=True)
class Views:
    """The views that draw an object. pixel: width of the camera's pixel at 1 m on the axis, metres. camera:
    whether the camera draws it. mirror, refraction: size of their pictures relative to the camera's; None:
    they do not draw it. light_m: width of a texel of the shadow map; None: the light does not draw it."""

    query: VisibilityQuery
    pixel: float
    camera: bool
    mirror: float | None
    refraction: float | None
    light_m: float | None

    def covered(self, sphere: Sphere, runs: Runs) -> dict[str, F64]:
        """By view: lower bound of the metres that a pixel covers on a surface inside the sphere, for each
        run; infinite where the view does not show it."""
        found = {}
        query = self.query
        if self.camera:
            found["camera"] = self._covered(sphere, runs)
        x, y, z = sphere.center
        level = query.mirror_m
        if self.mirror is not None and level is not None and y + sphere.radius_m >= level - 0.1:
            below = Sphere((x, 2.0 * level - y, z), sphere.radius_m)
            rows = self._covered(below, runs) / self.mirror
            found["mirror"] = np.where(query.highest(runs) > level, rows, np.inf)
        if self.refraction is not None and query.water_m is not None and y < query.water_m:
            rows = np.minimum.reduce(
                [self._covered(at, runs) for at in lifted_spheres(sphere, query.water_m)]
            )
            rows = rows * (_REFRACTION_FACTOR / self.refraction)
            found["refraction"] = np.where(query.highest(runs) > query.water_m, rows, np.inf)
        if self.light_m is not None and query.light is not None and is_lit(sphere, query.light):
            found["light"] = np.full(len(runs), self.light_m)
        return found

    def _covered(self, sphere: Sphere, runs: Runs) -> F64:
        query = self.query
        toward = [c - axis[runs] for c, axis in zip(sphere.center, query.eye, strict=True)]
        square = toward[0] * toward[0] + toward[1] * toward[1] + toward[2] * toward[2]
        away = np.sqrt(square)
        safe = np.maximum(away, 1e-30)
        ahead = [axis[runs] for axis in query.ahead]
        cos = (toward[0] * ahead[0] + toward[1] * ahead[1] + toward[2] * ahead[2]) / safe
        sin = np.sqrt(np.maximum(0.0, 1.0 - cos * cos))
        # The angle to the sphere's centre, and the additional angle of its far side and of a turn.
        wide = np.minimum(1.0, (sphere.radius_m + query.slack_m[runs]) / safe)
        turn = query.turn[runs]
        wide_cos, turn_cos = np.sqrt(1.0 - wide * wide), np.sqrt(1.0 - turn * turn)
        more_cos = wide_cos * turn_cos - wide * turn
        more_sin = wide * turn_cos + wide_cos * turn
        off = cos * more_cos - sin * more_sin
        known = (more_cos > 0.0) & (off > 0.0) & (cos > 0.0)
        edge = np.where(known, np.maximum(off, query.corner), query.corner)
        rows: F64 = self.pixel * query.nearest(sphere, runs) * edge * edge
        return np.where(query.in_cone(sphere, runs), rows, np.inf)

    def reached(self, point: tuple[float, float, float], runs: Runs) -> dict[str, F64]:
        """By view: the same of a point of the surface, from the middle of each run's ball: what is seen."""
        x, y, z = point
        query = self.query
        found = {}
        places: list[tuple[str, float, float]] = [("camera", y, 1.0)] if self.camera else []
        if self.mirror is not None and query.mirror_m is not None and y >= query.mirror_m:
            places.append(("mirror", 2.0 * query.mirror_m - y, self.mirror))
        for name, height, scale in places:
            toward = [c - axis[runs] for c, axis in zip((x, height, z), query.eye, strict=True)]
            away = np.sqrt(toward[0] * toward[0] + toward[1] * toward[1] + toward[2] * toward[2])
            ahead = [axis[runs] for axis in query.ahead]
            depth = toward[0] * ahead[0] + toward[1] * ahead[1] + toward[2] * ahead[2]
            seen = (depth >= query.near_m[runs]) & (depth >= query.corner * away) & (depth <= query.far_m)
            seen &= query.turn[runs] < 1.0
            if name == "mirror":
                seen &= query.eye[1][runs] > (query.mirror_m or 0.0)
            rows = self.pixel * depth * depth / np.maximum(away, 1e-30) / scale
            found[name] = np.where(seen, rows, np.inf)
        if self.light_m is not None and query.light is not None and is_lit(Sphere(point, 0.0), query.light):
            found["light"] = np.full(len(runs), self.light_m)
        return found

    def moment(self, run: int, view: str) -> tuple[float | None, str]:
        """The second of a run (None for the free camera and the light) and the view in words."""
        if self.query.start_s[run] >= self.query.duration_s:
            return None, FREE_CAMERA if view == "camera" else f"{FREE_CAMERA}'s {view}"
        return None if view == "light" else float(self.query.start_s[run]), view


@lru_cache(maxsize=2)
def _query_of(flight_views: str) -> VisibilityQuery:
    """Cached: many objects share one flight."""
    return plan_query(json.loads(flight_views))


def views_of(flight_views: dict[str, Any], drawn: tuple[str, ...], light_m: float | None) -> Views:
    """The views of an object. flight_views: as for plan_query, and `scales` of reflection and refraction by
    name. drawn: names of the views that draw the object (player_limits.VIEWS). light_m: as in Views."""
    query = _query_of(json.dumps(flight_views))
    scales = flight_views["scales"]
    return Views(
        query,
        1.0 / (query.pixels * flight_views["error_px"]),
        "camera" in drawn,
        scales.get("reflection") if "reflection" in drawn else None,
        scales.get("refraction") if "refraction" in drawn else None,
        light_m if "shadow" in drawn else None,
    )

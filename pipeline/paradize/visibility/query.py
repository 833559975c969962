"""Visibility queries of a flight: when a part of the scene is in view, and when it must be fine.

The flight is divided into short runs. In each run the eye stays inside a ball and the view direction inside a
cone; both contain the whole run (bounds from the splines' Bezier control points), so nothing between samples
is missed. Views: the camera, the water's refraction (which raises what lies below the water towards its
surface), the mirror, the light. The camera's eye decides the level of detail for all of them, as in the
player. Arithmetic: element-wise + - * / sqrt.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.scene.flight import PI, Cubic, Flight, Vec, plan_flight, sine_cosine
from paradize.scene.settings import EyePoint, TargetPoint
from paradize.scene.settings import Flight as FlightSettings

F64 = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Runs = npt.NDArray[np.intp]

RUN_S = 0.05
RUN_COUNTS = (256, 8192)  # smallest and largest number
MAX_LIFTED = 8  # largest number of spheres that cover the path of one that refraction raises
MIRROR_CLIP_M = 0.1  # the mirror may show ground this far below the water's level; the player uses 0.05


@dataclass(frozen=True)
class Sphere:
    """center: metres. radius_m: >= 0."""

    center: Vec
    radius_m: float


@dataclass(frozen=True)
class _Light:
    """The box that the light sees: its centre, unit axes, and half its extent along each, metres."""

    middle: Vec
    axes: tuple[Vec, Vec, Vec]
    reach_m: Vec


def drawn_to_m(near_m: float, far_m: float) -> float:
    """The depth up to which a player may draw: its matrix is of float32, which moves the far plane out where
    it lies many times as far as the near one, without end in the extreme."""
    across = far_m - near_m
    excess = float(np.float32((far_m + near_m) / across)) - 1.0 - 4.0 * float(np.finfo(np.float32).eps)
    return max(far_m, 2.0 * far_m * near_m / across / excess) if excess > 0.0 else np.inf


@dataclass(frozen=True)
class VisibilityQuery:
    """The n runs of a flight and what is needed to ask about them.

    start_s: (n,) start of each run. eye: three (n,) metres, centre of the ball of the eye; slack_m: (n,) its
    radius. ahead: three (n,), unit view direction. sine, cosine: (n,) of half the angle of the cone that
    contains the picture during the run; cosine <= 0: all directions. corner: cosine of half the cone at one
    moment. turn: (n,) sine of the largest turn of `ahead`, at most 1. pixels: pixels that 1 m covers at 1 m
    distance, divided by the accepted error in pixels. near_m: (n,) nearer things are not drawn. reach: three
    (n,) metres, half the sides of the box of ball centres: 0 except for the free camera. mirror_m, water_m:
    water level for reflection and refraction, or None. The free camera, if there is one, is a last run that
    starts at the flight's end.
    """

    duration_s: float
    start_s: F64
    eye: tuple[F64, F64, F64]
    slack_m: F64
    ahead: tuple[F64, F64, F64]
    sine: F64
    cosine: F64
    corner: float
    turn: F64
    pixels: float
    near_m: F64
    reach: tuple[F64, F64, F64]
    far_m: float
    mirror_m: float | None
    water_m: float | None
    light: _Light | None

    @property
    def runs(self) -> Runs:
        """The indices of all runs."""
        return np.arange(len(self.start_s))

    def wanting(self, error_m: float, sphere: Sphere, runs: Runs) -> Runs:
        """The runs in which an error_m somewhere in the sphere exceeds the accepted error in pixels."""
        return runs[error_m * self.pixels > self.nearest(sphere, runs)]

    def nearest(self, sphere: Sphere, runs: Runs) -> F64:
        """The smallest possible distance of the eye to the sphere in each run, metres, at least `near_m`."""
        near: F64 = np.maximum(
            self.near_m[runs], self._distance(sphere, runs) - sphere.radius_m - self.slack_m[runs]
        )
        return near

    def seeing(self, sphere: Sphere, runs: Runs) -> Runs:
        """The runs in which some view may show a part of the sphere."""
        if self.light is not None and is_lit(sphere, self.light):
            return runs
        seen = self.in_cone(sphere, runs)
        x, y, z = sphere.center
        if self.mirror_m is not None and y + sphere.radius_m >= self.mirror_m - MIRROR_CLIP_M:
            mirrored = Sphere((x, 2.0 * self.mirror_m - y, z), sphere.radius_m)
            above = self.highest(runs) > self.mirror_m
            seen |= above & self.in_cone(mirrored, runs)
        if self.water_m is not None and y < self.water_m:
            above = self.highest(runs) > self.water_m
            for higher in lifted_spheres(sphere, self.water_m):
                seen |= above & self.in_cone(higher, runs)
        return runs[seen]

    def highest(self, runs: Runs) -> F64:
        """The largest possible height of the eye in each run, metres."""
        top: F64 = self.eye[1][runs] + self.slack_m[runs] + self.reach[1][runs]
        return top

    def _distance(self, sphere: Sphere, runs: Runs) -> F64:
        x, y, z = (
            np.maximum(np.abs(c - axis[runs]) - half[runs], 0.0)
            for c, axis, half in zip(sphere.center, self.eye, self.reach, strict=True)
        )
        away: F64 = np.sqrt(x * x + y * y + z * z)
        return away

    def in_cone(self, sphere: Sphere, runs: Runs) -> Mask:
        """In which runs the camera may see a part of the sphere; (runs,) bool."""
        x, y, z = (c - axis[runs] for c, axis in zip(sphere.center, self.eye, strict=True))
        fx, fy, fz = (axis[runs] for axis in self.ahead)
        square = x * x + y * y + z * z
        along = x * fx + y * fy + z * fz
        off_axis = np.sqrt(np.maximum(0.0, square - along * along))
        radius = sphere.radius_m + self.slack_m[runs]
        sine, cosine, turn = self.sine[runs], self.cosine[runs], self.turn[runs]
        inside = (along > -radius) & (off_axis * cosine - along * sine <= radius)
        around = (cosine <= 0.0) | (square <= radius * radius)
        # Nothing is drawn beyond the far plane: by the least depth in any direction of the run, and by the
        # distance of the plane's corners, whatever the direction.
        depth = along * np.sqrt(np.maximum(0.0, 1.0 - turn * turn)) - off_axis * turn
        corners = self._distance(sphere, runs) <= self.far_m / self.corner + radius
        reached: Mask = (depth <= self.far_m + radius) & corners
        return (around | inside) & reached


def lifted_spheres(sphere: Sphere, water_m: float) -> list[Sphere]:
    """Spheres that cover everything between a sphere below the water and the surface straight above it."""
    x, y, z = sphere.center
    rise = water_m - y
    count = MAX_LIFTED if rise > MAX_LIFTED * sphere.radius_m else max(1, -int(-rise // sphere.radius_m))
    half = 0.5 * rise / count
    return [Sphere((x, y + (2 * k + 1) * half, z), sphere.radius_m + half) for k in range(count)]


def is_lit(sphere: Sphere, light: _Light) -> bool:
    """Whether the light may see a part of the sphere."""
    offset = [a - b for a, b in zip(sphere.center, light.middle, strict=True)]
    return all(
        abs(offset[0] * axis[0] + offset[1] * axis[1] + offset[2] * axis[2]) <= reach + sphere.radius_m
        for axis, reach in zip(light.axes, light.reach_m, strict=True)
    )


def plan_query(flight_views: dict[str, Any]) -> VisibilityQuery:
    """The visibility query of a scene.

    flight_views: as scene/finest_views.py makes it: `flight` (scene.settings.Flight as a dict), `viewport`
    (largest, pixels), `error_px`, `mirror_m` and `water_m` (water level for reflection and refraction, or
    None), `shadow` (extent_m and center, or None), `sun` (unit vector towards it), and optionally `region`
    (scene.settings.FreeCamera as a dict).
    """
    flight = dict(flight_views["flight"])
    flight["eye"] = tuple(EyePoint(**point) for point in flight["eye"])
    flight["target"] = tuple(TargetPoint(**point) for point in flight["target"])
    settings = FlightSettings(**flight)
    return _query(plan_flight(settings), settings.fov_deg, flight_views)


def camera_query(manifest: dict[str, Any]) -> VisibilityQuery:
    """The query of the camera's view alone for the flight and the free camera's box of a scene.json. The
    accepted error is one pixel of the largest picture."""
    flight = Flight.from_json(manifest["flight"])
    flight_views = {"viewport": manifest["largest_viewport"], "error_px": 1.0}
    flight_views |= {"mirror_m": None, "water_m": None, "shadow": None, "region": manifest["free_camera"]}
    return _query(flight, flight.fov_rad * (180.0 / PI), flight_views)


def _query(flight: Flight, fov_deg: float, flight_views: dict[str, Any]) -> VisibilityQuery:
    width, height = flight_views["viewport"]
    sine, cosine = sine_cosine(0.5 * fov_deg)
    tangent = sine / cosine
    corner_slope = tangent * tangent * (1.0 + (width / height) * (width / height))  # squared tangent
    start_s, eye, eye_slack, target, target_slack = _runs(flight)
    fx, fy, fz = (b - a for a, b in zip(eye, target, strict=True))
    length = np.sqrt(fx * fx + fy * fy + fz * fz)
    turn = (eye_slack + target_slack) / np.maximum(length, 1e-12)  # sine of the largest turn
    straight = np.sqrt(np.maximum(0.0, 1.0 - turn * turn))
    half_cos = 1.0 / np.sqrt(1.0 + corner_slope)
    half_sin = np.sqrt(corner_slope) * half_cos
    cone_cos = np.where(turn < 1.0, half_cos * straight - half_sin * turn, -1.0)
    safe = np.maximum(length, 1e-12)
    ahead = (fx / safe, fy / safe, fz / safe)
    near_m = np.full(len(start_s), flight.near_m)
    reach = (np.zeros(len(start_s)), np.zeros(len(start_s)), np.zeros(len(start_s)))
    if region := flight_views.get("region"):
        low, high = region["low"], region["high"]
        eye = _append(eye, [0.5 * (a + b) for a, b in zip(low, high, strict=True)])
        reach = _append(reach, [0.5 * (b - a) for a, b in zip(low, high, strict=True)])
        ahead = _append(ahead, [0.0, 0.0, -1.0])
        start_s, eye_slack = np.append(start_s, flight.duration_s), np.append(eye_slack, 0.0)
        near_m = np.append(near_m, max(flight.near_m, region["near_m"]))
        cone_cos, turn = np.append(cone_cos, -1.0), np.append(turn, 1.0)  # it looks in all directions
    shadow = flight_views["shadow"]
    return VisibilityQuery(
        duration_s=flight.duration_s,
        start_s=start_s,
        eye=eye,
        slack_m=eye_slack,
        ahead=ahead,
        sine=np.sqrt(np.maximum(0.0, 1.0 - cone_cos * cone_cos)),
        cosine=cone_cos,
        corner=float(half_cos),
        turn=np.minimum(turn, 1.0),
        pixels=height / (2.0 * tangent) / flight_views["error_px"],
        near_m=near_m,
        reach=reach,
        far_m=drawn_to_m(flight.near_m, flight.far_m),
        mirror_m=flight_views["mirror_m"],
        water_m=flight_views["water_m"],
        light=_light(shadow["extent_m"], shadow["center"], flight_views["sun"]) if shadow else None,
    )


def _append(columns: tuple[F64, F64, F64], row: list[float]) -> tuple[F64, F64, F64]:
    x, y, z = (np.append(column, value) for column, value in zip(columns, row, strict=True))
    return x, y, z


def _light(extent_m: float, center: list[float], sun: list[float] | None) -> _Light:
    """The light's box as the player makes it: a square around `center` across the light, three times as deep
    as wide. sun: None if the light turns; then it is a box around all those boxes."""
    if sun is None:
        around = float(np.sqrt(0.5 * 0.5 + 0.5 * 0.5 + 1.5 * 1.5)) * extent_m * (1.0 + 1e-4)
        axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        return _Light((center[0], center[1], center[2]), axes, (around, around, around))
    x, y, z = sun
    ux, uy, uz = (0.0, 0.0, -1.0) if abs(y) > 0.999 else (0.0, 1.0, 0.0)
    side = _unit((uy * z - uz * y, uz * x - ux * z, ux * y - uy * x))
    up = _unit((y * side[2] - z * side[1], z * side[0] - x * side[2], x * side[1] - y * side[0]))
    margin = 1.0 + 1e-4
    half, deep = 0.5 * extent_m * margin, 1.5 * extent_m * margin
    return _Light((center[0], center[1], center[2]), (side, up, (x, y, z)), (half, half, deep))


def _unit(v: Vec) -> Vec:
    length = float(np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))
    return v[0] / length, v[1] / length, v[2] / length


def _runs(
    flight: Flight,
) -> tuple[F64, tuple[F64, F64, F64], F64, tuple[F64, F64, F64], F64]:
    """(start_s, eye, its slack, target, its slack) of consecutive runs over the whole flight. No run crosses
    the border of two segments."""
    count = min(max(RUN_COUNTS[0], round(flight.duration_s / RUN_S)), RUN_COUNTS[1])
    rows: list[tuple[float, float, float]] = []  # second, U at the start, U at the end
    for i in range(count):
        start, end = (flight.duration_s * k / count for k in (i, i + 1))
        u = _clamped(flight.parameter(start), len(flight.eye))
        u_end = _clamped(flight.parameter(end), len(flight.eye)) if i + 1 < count else float(len(flight.eye))
        while u < u_end:
            stop = min(u_end, float(int(u) + 1))
            rows.append((start, u, stop))
            u = stop
    table = np.array(rows, np.float64)
    segment = np.minimum(table[:, 1].astype(np.intp), len(flight.eye) - 1)
    u0, u1 = table[:, 1] - segment, table[:, 2] - segment
    eye, eye_slack = _balls(flight.eye, segment, u0, u1)
    target, target_slack = _balls(flight.target, segment, u0, u1)
    return np.ascontiguousarray(table[:, 0]), eye, eye_slack, target, target_slack


def _clamped(u: float, largest: int) -> float:
    """Clamps a parameter to the path; tables of damaged files may hold any number."""
    return max(0.0, min(u, float(largest)))


def _balls(
    segments: tuple[tuple[Cubic, Cubic, Cubic], ...], segment: Runs, u0: F64, u1: F64
) -> tuple[tuple[F64, F64, F64], F64]:
    """A ball around each piece [u0, u1] of a cubic segment; it contains the piece's Bezier control points."""
    cubics = np.array(segments, np.float64)[segment]  # (n, 3, 4)
    third = (u1 - u0) / 3.0
    middles: list[F64] = []
    square, size = np.zeros(len(segment)), np.zeros(len(segment))
    for axis in range(3):
        a, b, c, d = (cubics[:, axis, k] for k in range(4))
        first, last = (a + u * (b + u * (c + u * d)) for u in (u0, u1))
        leave, reach = (third * (b + u * (2.0 * c + u * (3.0 * d))) for u in (u0, u1))
        points = (first, first + leave, last - reach, last)
        low = np.minimum.reduce(points)
        high = np.maximum.reduce(points)
        middles.append(0.5 * (low + high))
        square += 0.25 * (high - low) * (high - low)
        size = np.maximum(size, np.maximum(np.abs(low), np.abs(high)))
    # The player computes positions in float32.
    return (middles[0], middles[1], middles[2]), np.sqrt(square) + 1e-6 * size

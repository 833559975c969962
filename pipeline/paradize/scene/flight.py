"""The camera path: eye, target and roll on periodic cubic splines, and a table from time to path parameter.

Spline: C2 periodic cubics that pass exactly through the waypoints (de Boor, "A Practical Guide to Splines",
1978, ch. 4), from one cyclic tridiagonal system solved by Sherman-Morrison. Knots: chord length of the eye's
path, rounded to whole units. Each span is cut into unit segments, so that the parameter U is uniform (one
unit per segment) and the whole path is C2 in U.

Time: dU/dt = V s(U) / |E'(U)|. s is the speed factor of the waypoints, joined by smoothsteps; V makes the
flight last `duration_s` exactly. t(U) is integrated by five-point Gauss-Legendre. Its inverse is stored as a
periodic cubic Hermite table, dense enough that the speed deviates from the requested one by less than RIPPLE.

Uses only float64 + - * / sqrt, so the bytes are the same on every machine. Does not import numpy.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Any

from paradize.angles import PI as PI
from paradize.angles import sine_cosine as sine_cosine
from paradize.errors import SceneError
from paradize.scene.settings import Flight as FlightSettings

Vec = tuple[float, float, float]
Cubic = tuple[float, float, float, float]  # a + b u + c u^2 + d u^3, u in [0, 1]

UNITS_PER_SPAN = 6  # mean number of unit segments between two waypoints
RIPPLE = 2e-4  # largest relative deviation from the requested speed that the table may cause
DENSITIES = (2, 4, 8, 16, 32, 64, 128, 256)  # table cells per unit segment, tried in turn

# Abramowitz and Stegun, "Handbook of Mathematical Functions", 1964, table 25.4, n = 5, moved to [0, 1].
_SIGHTING_STEP_S = 0.25
_GAUSS = (
    (0.046910077030668004, 0.11846344252809454),
    (0.23076534494715845, 0.23931433524968324),
    (0.5, 0.28444444444444444),
    (0.7692346550528415, 0.23931433524968324),
    (0.953089922969332, 0.11846344252809454),
)


def solve_cyclic(
    low: list[float], diagonal: list[float], high: list[float], right: list[float]
) -> list[float]:
    """Solves the n x n cyclic tridiagonal system whose row i is low[i], diagonal[i], high[i] at columns
    i - 1, i, i + 1 (mod n), n >= 3, diagonally dominant (Sherman and Morrison, 1950)."""
    n = len(diagonal)
    gamma = -diagonal[0]
    d = list(diagonal)
    d[0] -= gamma
    d[-1] -= low[0] * high[-1] / gamma
    x = list(right)
    z = [gamma] + [0.0] * (n - 2) + [high[-1]]
    for i in range(1, n):
        factor = low[i] / d[i - 1]
        d[i] -= factor * high[i - 1]
        x[i] -= factor * x[i - 1]
        z[i] -= factor * z[i - 1]
    x[-1] /= d[-1]
    z[-1] /= d[-1]
    for i in range(n - 2, -1, -1):
        x[i] = (x[i] - high[i] * x[i + 1]) / d[i]
        z[i] = (z[i] - high[i] * z[i + 1]) / d[i]
    share = (x[0] + low[0] * x[-1] / gamma) / (1.0 + z[0] + low[0] * z[-1] / gamma)
    return [a - share * b for a, b in zip(x, z, strict=True)]


def periodic_spline(values: Sequence[float], units: Sequence[int]) -> list[Cubic]:
    """Returns the C2 periodic cubic through `values` as sum(units) cubics of unit length. units[i]:
    distance of the knots of values i and i + 1. The first cubic of each span starts exactly at its value."""
    n = len(values)
    slope = [(values[(i + 1) % n] - values[i]) / units[i] for i in range(n)]
    second = solve_cyclic(
        [float(units[i - 1]) for i in range(n)],
        [2.0 * (units[i - 1] + units[i]) for i in range(n)],
        [float(units[i]) for i in range(n)],
        [6.0 * (slope[i] - slope[i - 1]) for i in range(n)],
    )
    cubics: list[Cubic] = []
    for i in range(n):
        h = units[i]
        m0, m1 = second[i], second[(i + 1) % n]
        a, b = values[i], slope[i] - h * (2.0 * m0 + m1) / 6.0
        c, d = 0.5 * m0, (m1 - m0) / (6.0 * h)
        for j in range(h):
            cubics.append((a + j * (b + j * (c + j * d)), b + j * (2 * c + 3 * j * d), c + 3 * j * d, d))
    return cubics


def _units(points: Sequence[Vec]) -> list[int]:
    chords = [_distance(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]
    total = 0.0
    for chord in chords:
        total += chord
    unit = total / (UNITS_PER_SPAN * len(points))
    return [min(max(1, round(chord / unit)), 64) for chord in chords]


def _distance(a: Vec, b: Vec) -> float:
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    return sqrt(x * x + y * y + z * z)


def value(cubic: Cubic, u: float) -> float:
    """Evaluates the cubic at u in [0, 1]."""
    a, b, c, d = cubic
    return a + u * (b + u * (c + u * d))


def derivative(cubic: Cubic, u: float) -> float:
    """Evaluates the derivative of the cubic at u in [0, 1]."""
    _, b, c, d = cubic
    return b + u * (2.0 * c + u * 3.0 * d)


@dataclass(frozen=True)
class Flight:
    """A camera path that loops. eye, target: per unit segment a cubic for each axis. roll: a cubic per
    segment, radians. table: (t seconds, U, dU/dt), t from 0 to duration_s, U from 0 to len(eye).
    waypoint_u: U at waypoints."""

    duration_s: float
    fov_rad: float
    near_m: float
    far_m: float
    eye: tuple[tuple[Cubic, Cubic, Cubic], ...]
    target: tuple[tuple[Cubic, Cubic, Cubic], ...]
    roll: tuple[Cubic, ...]
    table: tuple[tuple[float, float, float], ...]
    waypoint_u: tuple[int, ...]

    def parameter(self, t_s: float) -> float:
        """Returns U at a time. t_s: any real number, since the flight loops."""
        t = t_s % self.duration_s
        k = min(max(bisect_right(self.table, t, key=lambda row: row[0]) - 1, 0), len(self.table) - 2)
        (t0, u0, d0), (t1, u1, d1) = self.table[k], self.table[k + 1]
        h = t1 - t0
        x = (t - t0) / h
        rest = u1 - u0
        return u0 + x * (h * d0 + x * (3 * rest - h * (2 * d0 + d1) + x * (h * (d0 + d1) - 2 * rest)))

    def view(self, t_s: float) -> tuple[Vec, Vec]:
        """Returns eye and target, metres, at a time."""
        u = self.parameter(t_s)
        k = min(max(int(u), 0), len(self.eye) - 1)
        e, t = self.eye[k], self.target[k]
        u -= k
        return (
            (value(e[0], u), value(e[1], u), value(e[2], u)),
            (value(t[0], u), value(t[1], u), value(t[2], u)),
        )

    def pose(self, t_s: float) -> tuple[Vec, Vec, float]:
        """Returns eye and target, metres, and roll, radians, at a time."""
        u = self.parameter(t_s)
        k = min(max(int(u), 0), len(self.eye) - 1)
        return (*self.view(t_s), value(self.roll[k], u - k))

    @classmethod
    def from_json(cls, tree: dict[str, Any]) -> Flight:
        """Reads what as_json returned."""

        def axes(key: str) -> tuple[Any, ...]:
            return tuple(tuple(map(tuple, segment[key])) for segment in tree["segments"])

        return cls(
            duration_s=tree["duration_s"],
            fov_rad=tree["fov_rad"],
            near_m=tree["near_m"],
            far_m=tree["far_m"],
            eye=axes("eye"),
            target=axes("target"),
            roll=tuple(tuple(segment["roll"]) for segment in tree["segments"]),
            table=tuple(map(tuple, tree["time_table"])),
            waypoint_u=tuple(tree["waypoint_u"]),
        )

    def as_json(self) -> dict[str, Any]:
        """Returns the `flight` object of scene.json."""
        return {
            "duration_s": self.duration_s,
            "fov_rad": self.fov_rad,
            "near_m": self.near_m,
            "far_m": self.far_m,
            "segments": [
                {"eye": [list(c) for c in e], "target": [list(c) for c in t], "roll": list(r)}
                for e, t, r in zip(self.eye, self.target, self.roll, strict=True)
            ],
            "time_table": [list(row) for row in self.table],
            "waypoint_u": list(self.waypoint_u),
        }


class _Speed:
    """|E'(U)|, with a lower bound where the path turns on the spot, and the requested speed factor s(U)."""

    def __init__(
        self, eye: Sequence[tuple[Cubic, Cubic, Cubic]], units: Sequence[int], factors: Sequence[float]
    ):
        self.eye = eye
        self.spans: list[
            tuple[float, float, float, float]
        ] = []  # per segment: from, to factor; offset, length
        for i, h in enumerate(units):
            ends = (factors[i], factors[(i + 1) % len(units)])
            self.spans += [(*ends, float(j), float(h)) for j in range(h)]
        mean = 0.0
        for segment in eye:
            mean += self._raw(segment, 0.5)
        slow = 1e-3 * mean / len(eye)
        self.floor = slow * slow

    @staticmethod
    def _raw(segment: tuple[Cubic, Cubic, Cubic], u: float) -> float:
        x, y, z = (derivative(axis, u) for axis in segment)
        return sqrt(x * x + y * y + z * z)

    def factor(self, k: int, u: float) -> float:
        start, end, offset, length = self.spans[k]
        x = (offset + u) / length
        return start + (end - start) * x * x * (3.0 - 2.0 * x)

    def pace(self, k: int, u: float) -> float:
        """Returns dt/dU at V = 1: |E'| / s."""
        x, y, z = (derivative(axis, u) for axis in self.eye[k])
        return sqrt(x * x + y * y + z * z + self.floor) / self.factor(k, u)


def _segment_rows(speed: _Speed, k: int, density: int) -> tuple[list[tuple[float, float, float]], float]:
    """Returns the rows (t, U, dU/dt) of segment k at V = 1, with t from 0; and the largest relative
    deviation of the table's dU/dt from the requested one, at three times of each cell, or 1 where the
    cubic could turn back."""
    t = 0.0
    rows = [(t, float(k), 1.0 / speed.pace(k, 0.0))]
    worst = 0.0
    for j in range(density):
        cell = 0.0
        for node, weight in _GAUSS:
            cell += weight * speed.pace(k, (j + node) / density)
        h, rest, d0 = cell / density, 1.0 / density, rows[-1][2]
        t += h
        rows.append((t, k + (j + 1) / density, 1.0 / speed.pace(k, (j + 1) / density)))
        d1 = rows[-1][2]
        if d0 * h > 3.0 * rest or d1 * h > 3.0 * rest:  # Fritsch and Carlson, 1980
            return rows, 1.0
        for x in (0.21, 0.5, 0.79):
            u = x * (h * d0 + x * (3 * rest - h * (2 * d0 + d1) + x * (h * (d0 + d1) - 2 * rest)))
            du = d0 + x * (2 * (3 * rest / h - 2 * d0 - d1) + 3 * x * (d0 + d1 - 2 * rest / h))
            worst = max(worst, abs(du * speed.pace(k, j / density + u) - 1.0))
    return rows, worst


def _table(speed: _Speed, count: int, duration_s: float) -> tuple[tuple[float, float, float], ...]:
    """Returns the time table. Each segment has the fewest cells that keep RIPPLE, or the most allowed."""
    table = [(0.0, 0.0, 1.0 / speed.pace(0, 0.0))]
    for k in range(count):
        for density in DENSITIES:
            rows, worst = _segment_rows(speed, k, density)
            if worst <= RIPPLE:
                break
        if worst >= 1.0:
            raise SceneError(
                "the camera's path turns back on itself too sharply to be timed",
                place="flight.eye",
                mend="move the waypoints around the turn apart, or add one",
            )
        start = table[-1][0]
        table += [(start + t, u, d) for t, u, d in rows[1:]]
    scale = duration_s / table[-1][0]
    return (
        *((t * scale, u, d / scale) for t, u, d in table[:-1]),
        (duration_s, float(count), table[0][2] / scale),
    )


def _require_path(eye: Sequence[Vec], target: Sequence[Vec]) -> None:
    """Raises SceneError for waypoints that no path can follow."""
    for name, points in (("eye", eye), ("target", target)):
        if len(points) < 3:
            raise SceneError(f"{len(points)} waypoints of the {name}, a loop needs 3")
        for k, point in enumerate(points):
            if not all(isfinite(number) for number in point):
                raise SceneError(f"waypoint {k} of the {name} is at {point}, not at finite numbers")
    if all(point == eye[0] for point in eye):
        raise SceneError(
            f"all {len(eye)} waypoints of the eye are at {eye[0]}", mend="move one: a path has a length"
        )


def plan_flight(settings: FlightSettings) -> Flight:
    """Lays the splines and the time table through the scene's waypoints.

    Raises SceneError for fewer than three waypoints, for waypoints that are all at one position or not
    finite, and where the path turns back too sharply for a table of allowed size.
    """
    points = [point.position for point in settings.eye]
    _require_path(points, [point.position for point in settings.target])
    units = _units(points)
    axes = [periodic_spline([point[axis] for point in points], units) for axis in range(3)]
    targets = [
        periodic_spline([point.position[axis] for point in settings.target], units) for axis in range(3)
    ]
    roll = periodic_spline([point.roll_deg * (PI / 180.0) for point in settings.eye], units)
    eye = tuple(zip(*axes, strict=True))
    speed = _Speed(eye, units, [point.speed for point in settings.eye])
    starts = [0]
    for h in units[:-1]:
        starts.append(starts[-1] + h)
    return Flight(
        duration_s=settings.duration_s,
        fov_rad=settings.fov_deg * (PI / 180.0),
        near_m=settings.near_m,
        far_m=settings.far_m,
        eye=eye,
        target=tuple(zip(*targets, strict=True)),
        roll=tuple(roll),
        table=_table(speed, len(eye), settings.duration_s),
        waypoint_u=tuple(starts),
    )


@dataclass(frozen=True)
class Sighting:
    """How the flight sees a sphere. nearest_m: least distance from the eye to its surface. first_seen_s:
    when it is first inside the view cone, 0 if never. farthest_seen_m: farthest distance of its far side
    while it is inside, 0 if never."""

    nearest_m: float
    first_seen_s: float
    seen: bool
    farthest_seen_m: float


def sightings_of(
    flight: Flight, fov_deg: float, aspect: float, spheres: Sequence[tuple[Vec, float]]
) -> list[Sighting]:
    """Tests each sphere (center metres, radius metres) every quarter of a second. The view cone contains the
    whole picture (vertical field of view fov_deg, width / height = aspect)."""
    import numpy as np

    sine, cosine = sine_cosine(0.5 * fov_deg)
    tangent = sine / cosine * sqrt(1.0 + aspect * aspect)
    cos_half = 1.0 / sqrt(1.0 + tangent * tangent)
    sin_half = tangent * cos_half
    centers = np.array([center for center, _ in spheres], np.float64).reshape(-1, 3).T
    radius = np.array([radius for _, radius in spheres], np.float64)
    nearest, farthest = np.full(len(spheres), np.inf), np.zeros(len(spheres))
    first = np.full(len(spheres), -1.0)
    count = max(1, round(flight.duration_s / _SIGHTING_STEP_S))
    for i in range(count):
        t = flight.duration_s * i / count
        eye, target = flight.view(t)
        length = _distance(eye, target) or 1.0
        ahead = tuple((b - a) / length for a, b in zip(eye, target, strict=True))
        x, y, z = (c - e for c, e in zip(centers, eye, strict=True))
        away = np.sqrt(x * x + y * y + z * z)
        nearest = np.minimum(nearest, np.maximum(0.0, away - radius))
        along = x * ahead[0] + y * ahead[1] + z * ahead[2]
        aside = np.sqrt(np.maximum(0.0, away * away - along * along))
        seen = (away <= radius) | ((along > -radius) & (aside * cos_half - along * sin_half <= radius))
        first[seen & (first < 0.0)] = t
        farthest[seen] = np.maximum(farthest, away + radius)[seen]
    return [
        Sighting(near, max(seen_s, 0.0), seen_s >= 0.0, far)
        for near, seen_s, far in zip(nearest.tolist(), first.tolist(), farthest.tolist(), strict=True)
    ]

"""Bounds by how many pixels the error of a surface moves the picture, over the whole flight and the box of
the free camera.

A visible point at depth z, at an angle a from the middle of the picture, and any point within d metres of it
are at most F d / ((z - d) cos a) pixels apart in the picture. F: pixels that one metre covers at a distance
of one metre. So the least depth at which a surface is visible bounds the effect of its error. Depths are
bounded from below (query.py: balls around the eye in short runs of the flight). Nothing counts as hidden."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.visibility.finest_mip import sphere_around, split_triangles
from paradize.visibility.query import Runs, Sphere, VisibilityQuery, camera_query

F64 = npt.NDArray[np.float64]
_BLOCK = 32  # runs whose eyes get a common box
_ROWS = 4096  # spheres in a batch
_ENOUGH, _SMALL, _MOST = 0.05, 0.2, 8000  # pixels; radius over distance; parts that are halved
_FAR_M = 1e100  # squares of smaller distances are finite
_FLOAT = 1e-4  # relative error of the player's float32 distances


@dataclass(frozen=True)
class Surfaces:
    """n surfaces, each inside a sphere (center (n, 3), radius_m) and nowhere off by more than error_m. The
    player draws a surface only if the eye is from_m or more away from the sphere of core_m around the center
    (0: always); no point of the surface lies more than beyond_m outside that sphere."""

    center: F64
    radius_m: F64
    error_m: F64
    from_m: F64
    core_m: F64
    beyond_m: F64


@dataclass(frozen=True)
class Moved:
    """px: no pixel moves by more; infinite if the eye may be too near for a bound. row: the surface that may
    move most; away_m: its least distance; second_s: when, None for the free camera."""

    px: float
    row: int
    away_m: float
    second_s: float | None


@dataclass(frozen=True)
class _Part:
    """A part of a surface, or all of it (corners None), in a sphere of radius_m; runs: of the flight, that
    show it."""

    moved: Moved
    corners: F64 | None
    radius_m: float
    runs: Runs


def _shapeless(_: int) -> F64 | None:
    return None


class Camera:
    """The camera's view of a baked scene. usable: whether its path has finite numbers."""

    def __init__(self, manifest: dict[str, Any]) -> None:
        with np.errstate(over="ignore", invalid="ignore"):  # a damaged path is not usable
            query = camera_query(manifest)
        self.query: VisibilityQuery = query
        self.pixels = query.pixels  # that one metre covers at one metre
        columns = (*query.eye, *query.ahead, *query.reach, query.slack_m)
        self.usable = all(bool((np.abs(column) < _FAR_M).all()) for column in columns)
        self.near_m = float(query.near_m.min())
        firsts = np.arange(0, len(query.start_s), _BLOCK)
        rows = list(zip(query.eye, query.reach, strict=True))
        low = [np.minimum.reduceat(eye - query.slack_m - reach, firsts) for eye, reach in rows]
        high = [np.maximum.reduceat(eye + query.slack_m + reach, firsts) for eye, reach in rows]
        self._low, self._high = np.stack(low, axis=1), np.stack(high, axis=1)  # boxes of the eye, by block

    def second(self, run: int) -> float | None:
        """When a run starts; None for the free camera."""
        start = float(self.query.start_s[run])
        return start if start < self.query.duration_s else None

    def cosine(self, sphere: Sphere, runs: Runs) -> F64:
        """The cosine of the largest angle from the middle of the picture at which the sphere may appear, at
        least that of the picture's corner. The angle is a sum, below 90 degrees: to the sphere's middle, to
        its border, and the turn of the camera in a run."""
        query = self.query
        toward = [c - eye[runs] for c, eye in zip(sphere.center, query.eye, strict=True)]
        away = np.sqrt(toward[0] * toward[0] + toward[1] * toward[1] + toward[2] * toward[2])
        safe = np.maximum(away, 1e-30)
        cos = sum(a * ahead[runs] for a, ahead in zip(toward, query.ahead, strict=True)) / safe
        sin = np.sqrt(np.maximum(0.0, 1.0 - cos * cos))
        more_sines = ((sphere.radius_m + query.slack_m[runs]) / safe, query.turn[runs])
        usable = cos > 0.0
        for more_sin in more_sines:
            usable &= more_sin < 1.0
            more_cos = np.sqrt(np.maximum(0.0, 1.0 - more_sin * more_sin))
            cos, sin = cos * more_cos - sin * more_sin, sin * more_cos + cos * more_sin
            usable &= cos > 0.0
        return np.asarray(np.where(usable, np.maximum(query.corner, cos), query.corner), np.float64)

    def moved(self, error_m: F64, away_m: F64, cosine: F64 | float) -> F64:
        """The most pixels by which an error moves points that are `away_m` or more from the eye, at an angle
        of this cosine or nearer to the middle of the picture."""
        depth = np.maximum(self.near_m, away_m * cosine) - error_m
        safe = np.where(depth > 0.0, depth, 1.0)
        px = self.pixels * error_m / (safe * cosine)
        return np.asarray(np.where(error_m == 0.0, 0.0, np.where(depth > 0.0, px, np.inf)), np.float64)

    def most_moved(self, surfaces: Surfaces, shape: Callable[[int], F64 | None] = _shapeless) -> Moved | None:
        """The surface that may move most; None if the camera shows none. shape: the triangles (m, 3, 3),
        metres, of a surface that is always drawn; None: only its sphere is known. Where the sphere gives more
        than _ENOUGH pixels, branch and bound halves the part that may move most, until it is small compared
        with its distance, or its bound is close to what a known point moves."""
        return _Search(self, surfaces).run(shape)

    def away(self, surfaces: Surfaces) -> F64:
        """The least distance of each surface from the eye, from boxes around many runs."""
        distances = np.empty(len(surfaces.radius_m))
        for first in range(0, len(distances), _ROWS):
            part = slice(first, first + _ROWS)
            center = surfaces.center[part, None, :]
            gap = np.maximum(np.maximum(self._low - center, center - self._high), 0.0)
            away = np.sqrt((gap * gap).sum(axis=2)).min(axis=1)
            distances[part] = np.maximum(0.0, away - surfaces.radius_m[part])
        return distances


class _Search:
    """Branch and bound: the parts that remain, the one that may move most first, and the most that a point is
    known to move."""

    def __init__(self, camera: Camera, surfaces: Surfaces) -> None:
        self.camera, self.surfaces = camera, surfaces
        self.from_m = surfaces.from_m * (1.0 - _FLOAT)
        self.parts: list[tuple[float, int, _Part]] = []
        self.looks = 0
        self.known: Moved | None = None

    def run(self, shape: Callable[[int], F64 | None]) -> Moved | None:
        surfaces, camera = self.surfaces, self.camera
        away_m = np.maximum(camera.away(surfaces), self.from_m - surfaces.beyond_m)
        bounds = camera.moved(surfaces.error_m, away_m, camera.query.corner)
        order = [int(row) for row in np.argsort(-bounds, kind="stable")]
        following = 0
        while True:
            while following < len(order) and self._least() <= bounds[order[following]]:
                row = order[following]
                following += 1
                center, radius_m = surfaces.center[row], float(surfaces.radius_m[row])
                self._look(row, None, center, radius_m, camera.query.runs)
            if not self.parts:
                return self.known
            _, _, part = heapq.heappop(self.parts)
            corners, moved = part.corners, part.moved
            known = self.known.px if self.known is not None else 0.0
            loose = part.radius_m > _SMALL * moved.away_m and moved.px > max(_ENOUGH, (1.0 + _SMALL) * known)
            loose &= self.looks < _MOST
            if corners is None and loose and not self.from_m[moved.row]:
                corners = shape(moved.row)
            if corners is None or not loose:
                return self.known if self.known is not None and known > moved.px else moved
            for half, _ in split_triangles(corners):
                middle, radius_m = sphere_around(half)
                radius_m += float(surfaces.error_m[moved.row])
                self._look(moved.row, half, middle, radius_m, part.runs)

    def _least(self) -> float:
        """A surface that moves less need not be looked at now."""
        waiting = -self.parts[0][0] if self.parts else 0.0
        return max(waiting, self.known.px if self.known is not None else 0.0)

    def _look(self, row: int, corners: F64 | None, center: F64, radius_m: float, runs: Runs) -> None:
        """Adds a part of a surface if some run shows it and may move it more than the known point."""
        query, camera = self.camera.query, self.camera
        self.looks += 1
        x, y, z = (float(value) for value in center)
        sphere = Sphere((x, y, z), radius_m)
        runs = runs[query.in_cone(sphere, runs)]
        from_m = float(self.from_m[row])
        if from_m > 0.0 and len(runs):
            gaps = [
                np.abs(c - eye[runs]) + reach[runs]
                for c, eye, reach in zip((x, y, z), query.eye, query.reach, strict=True)
            ]
            far = np.sqrt(gaps[0] * gaps[0] + gaps[1] * gaps[1] + gaps[2] * gaps[2]) + query.slack_m[runs]
            runs = runs[far - self.surfaces.core_m[row] >= from_m]
        if not len(runs):
            return
        error_m = np.full(len(runs), self.surfaces.error_m[row])
        away_m = np.maximum(query.nearest(sphere, runs), from_m - self.surfaces.beyond_m[row])
        px = camera.moved(error_m, away_m, camera.cosine(sphere, runs))
        if self.known is not None:
            more = px > self.known.px
            runs, px, away_m = runs[more], px[more], away_m[more]
            if not len(runs):
                return
        at = int(np.argmax(px))
        moved = Moved(float(px[at]), row, float(away_m[at]), camera.second(int(runs[at])))
        heapq.heappush(self.parts, (-moved.px, self.looks, _Part(moved, corners, radius_m, runs)))
        if corners is not None:
            self._see(row, corners[0].sum(axis=0) / 3.0, runs)

    def _see(self, row: int, place: F64, runs: Runs) -> None:
        """Updates `known` with a point that the camera shows in one of the runs."""
        query, camera = self.camera.query, self.camera
        x, y, z = (float(value) for value in place)
        point = Sphere((x, y, z), 0.0)
        away_m = query.nearest(point, runs) + 2.0 * query.slack_m[runs]
        toward = [c - eye[runs] for c, eye in zip((x, y, z), query.eye, strict=True)]
        depth = sum(a * ahead[runs] for a, ahead in zip(toward, query.ahead, strict=True))
        length = np.sqrt(toward[0] * toward[0] + toward[1] * toward[1] + toward[2] * toward[2])
        shown = (query.cosine[runs] <= 0.0) | (depth >= query.corner * length)
        if not shown.any():
            return
        away_m = away_m[shown]
        at = int(np.argmin(away_m))
        px = float(camera.moved(self.surfaces.error_m[row : row + 1], away_m[at : at + 1], 1.0)[0])
        if self.known is None or px > self.known.px:
            second = camera.second(int(runs[shown][at]))
            self.known = Moved(px, row, float(away_m[at]), second)

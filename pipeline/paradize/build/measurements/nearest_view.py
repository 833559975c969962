"""Measures how near a scene's flight comes to a mesh, for the pixels that an error of a level of detail
covers, and when it sees it.

A bounding sphere is no use where the camera flies through it. Distances are to about a thousand points of the
mesh or more, spread over its triangles, at sampled times of the flight: good enough to report, not a bound.
What is stored is read without numpy.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from paradize.build.artifacts import read_artifact
from paradize.build.entries import PIXELS, SIGHTINGS, fits
from paradize.errors import FormatError
from paradize.formats.glb.document import finest_corners
from paradize.jobs.code import code_digest
from paradize.placement import largest_scale, to_world
from paradize.scene.flight import Flight, Vec, sine_cosine
from paradize.scene.motion import stands
from paradize.scene.settings import Scene
from paradize.scene.sightings import ObjectSighting, object_sightings
from paradize.store.local import Store, key_of

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    F64 = npt.NDArray[np.float64]

_POINTS = 2000
_STEP_S = 0.25
_ROUNDING = 1e-9  # relative, of bounds
_AT_ONCE = 256  # instances
_GOLDEN = 2654435769  # of 2^32


def sample_points(glb: bytes, name: str) -> list[Vec]:
    """Returns points of a GLB's finest level, metres in its space: corners of triangles, and points inside
    them where there are few. Raises FormatError if Paradize did not write it."""
    runs = list(finest_corners(glb, name))
    total = sum(map(len, runs))
    parts = 1
    while total * (parts + 1) * (parts + 2) < _POINTS:
        parts += 1
    try:
        return [
            point
            for corners in runs
            for triangle in _chosen_triangles(len(corners), total)
            for point in _spread(corners.of(triangle), parts)
        ]
    except (TypeError, ValueError, struct.error) as error:
        raise FormatError(f"is not a mesh that Paradize wrote: {error}", file=name) from None


def _chosen_triangles(count: int, total: int) -> Iterable[int]:
    """Returns triangles of a primitive with `count` of the mesh's `total`: all, or its share of those that
    give _POINTS points. Steps of the golden ratio, so that they do not align with rows of a grid."""
    share = -(-count * _POINTS // (3 * total))
    return (
        range(count) if share >= count else ((i * _GOLDEN & 0xFFFFFFFF) * count >> 32 for i in range(share))
    )


def _spread(corners: Sequence[tuple[float, ...]], parts: int) -> list[Vec]:
    """Returns points of a triangle on a grid that cuts each side into `parts`."""
    points: list[Vec] = []
    for i in range(parts + 1):
        for j in range(parts + 1 - i):
            u, v = i / parts, j / parts
            x, y, z = (a + u * (b - a) + v * (c - a) for a, b, c in zip(*corners, strict=True))
            points.append((x, y, z))
    return points


def nearest_pixel_m(scene: Scene, flight: Flight, points: Mapping[str, Sequence[Vec]]) -> dict[str, float]:
    """Returns by object the metres that one pixel covers at the flight's nearest view, per metre of its
    mesh: the least over its instances. Objects that never come into view are left out. No view is nearer
    than the camera's near plane. points: by object name, from sample_points, at least one."""
    import numpy as np

    width, height = scene.head.viewport
    sine, cosine = sine_cosine(0.5 * scene.flight.fov_deg)
    pixel_m: dict[str, float] = {}
    count = max(1, round(flight.duration_s / _STEP_S))
    views = [flight.view(flight.duration_s * i / count) for i in range(count)]
    cone = _Cone(views, sine / cosine, width / height)
    for item in scene.objects:
        places = np.array(points[item.name], np.float64).T
        instances = stands(item)
        scales = [largest_scale(instance) for instance in instances]

        def pixel(near_m: float, scale: float) -> float:
            return 2.0 * max(near_m, scene.flight.near_m) * (sine / cosine) / height / scale

        # Those that may be nearest come first, so that most need no second look.
        bounds = [
            pixel(near, scale) for near, scale in zip(cone.bounds(places, instances), scales, strict=True)
        ]
        best = float("inf")
        for k in sorted(range(len(bounds)), key=bounds.__getitem__):
            if bounds[k] * (1.0 - _ROUNDING) >= best:
                break
            near_m = cone.nearest(np.stack(to_world(places, instances[k])))
            if near_m is not None:
                best = min(best, pixel(near_m, scales[k]))
        if best < float("inf"):
            pixel_m[item.name] = best
    return pixel_m


def stored_pixels(
    store: Store,
    scene: Scene,
    flight: Flight,
    meshes: Mapping[str, Path],
    sha256: Mapping[str, str],
    *,
    force: bool,
) -> dict[str, float]:
    """Returns nearest_pixel_m of the scene's objects, from the store where it is known. meshes, sha256: by
    artifact. force: read nothing from the store."""
    frame = [flight.as_json(), scene.head.viewport, scene.flight.fov_deg, scene.flight.near_m]
    common = key_of(__name__, code_digest(__name__), frame)
    pixel_m: dict[str, float] = {}
    for item in scene.objects:
        name = f"{item.name}_mesh"
        key = key_of(common, sha256[name], stands(item))
        stored = None if force else store.get_product(key)
        if not fits(stored, PIXELS):
            alone = replace(scene, objects=(item,))
            pixels = nearest_pixel_m(
                alone, flight, {item.name: sample_points(read_artifact(meshes[name]), name)}
            )
            stored = {"pixel_m": pixels.get(item.name)}
            store.put_product(key, stored)
        if stored["pixel_m"] is not None:
            pixel_m[item.name] = float(stored["pixel_m"])
    return pixel_m


def stored_sightings(
    store: Store, scene: Scene, flight: Flight, bounds: dict[str, tuple[Vec, float]], *, force: bool
) -> dict[str, ObjectSighting]:
    """Returns object_sightings, from the store where it is known. force: read nothing from the store."""
    views = [asdict(view) for view in (scene.reflection, scene.refraction) if view and scene.water]
    frame = [flight.as_json(), scene.head.viewport, scene.flight.fov_deg, views]
    where = {item.name: stands(item) for item in scene.objects}
    key = key_of(__name__, code_digest(__name__), frame, bounds, where)
    stored = None if force else store.get_product(key)
    if not fits(stored, SIGHTINGS) or stored.keys() != bounds.keys():
        found = object_sightings(scene, flight, bounds)
        stored = {name: asdict(sighting) for name, sighting in found.items()}
        store.put_product(key, stored)
    return {name: ObjectSighting(**sighting) for name, sighting in stored.items()}


class _Cone:
    """The view cones of a flight's views. Each contains the whole picture. eyes, ahead: three (m,), metres
    and unit vectors. tangent: of half the vertical field of view. aspect: width / height."""

    def __init__(self, views: Sequence[tuple[Vec, Vec]], tangent: float, aspect: float) -> None:
        import numpy as np

        self.eyes = np.array([eye for eye, _ in views], np.float64).T
        self.ahead = np.array([_direction(eye, target) for eye, target in views], np.float64).T
        self.slope = tangent * tangent * (1.0 + aspect * aspect)

    def bounds(self, places: F64, instances: Sequence[Mapping[str, Any]]) -> list[float]:
        """Returns for each instance a lower bound of the least distance of its places (3, n) that a view
        shows, metres; infinite where no view can show one."""
        import numpy as np

        low, high = places.min(axis=1), places.max(axis=1)
        middle = 0.5 * (low + high)
        radius = 0.5 * np.sqrt(((high - low) * (high - low)).sum()) * (1.0 + _ROUNDING)
        cosine = 1.0 / sqrt(1.0 + self.slope)
        sine = sqrt(self.slope) * cosine
        found: list[float] = []
        for first in range(0, len(instances), _AT_ONCE):
            some = instances[first : first + _AT_ONCE]
            columns = {key: np.array([instance[key] for instance in some]).T[..., None] for key in some[0]}
            x, y, z = (c - e for c, e in zip(to_world(middle, columns), self.eyes, strict=True))
            reach = radius * np.array([largest_scale(instance) for instance in some])[:, None]
            away = np.sqrt(x * x + y * y + z * z)
            along = x * self.ahead[0] + y * self.ahead[1] + z * self.ahead[2]
            aside = np.sqrt(np.maximum(0.0, away * away - along * along))
            slack = reach + _ROUNDING * away
            hidden = (away > slack) & ((along < -slack) | (aside * cosine - along * sine > slack))
            found += np.where(hidden, np.inf, np.maximum(away - slack, 0.0)).min(axis=1).tolist()
        return found

    def nearest(self, places: F64) -> float | None:
        """Returns the least distance from an eye to a place (3, n) inside its view cone; None if there is
        none."""
        import numpy as np

        low, high = places.min(axis=1), places.max(axis=1)
        gap = [
            np.maximum(0.0, np.maximum(a - e, e - b)) for a, b, e in zip(low, high, self.eyes, strict=True)
        ]
        least = gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2]
        # A place is in the cone if its depth is at least this share of its distance, both squared.
        share = 1.0 / (1.0 + self.slope)
        best = float("inf")  # squared
        for k in np.argsort(least, kind="stable").tolist():
            if least[k] * (1.0 - _ROUNDING) >= best:
                break
            x, y, z = (axis - eye for axis, eye in zip(places, self.eyes[:, k].tolist(), strict=True))
            fx, fy, fz = self.ahead[:, k].tolist()
            square = x * x + y * y + z * z
            along = x * fx + y * fy + z * fz
            inside = (along >= 0) & (along * along >= share * square)
            best = min(best, float(np.where(inside, square, np.inf).min()))
        return None if best == float("inf") else sqrt(best)


def _direction(eye: Vec, target: Vec) -> Vec:
    x, y, z = (b - a for a, b in zip(eye, target, strict=True))
    length = sqrt(x * x + y * y + z * z) or 1.0
    return x / length, y / length, z / length

"""Measures how near a scene's flight comes to a mesh, for the pixels that an error of a level of detail
covers.

A bounding sphere is no use where the camera flies through it. Distances are to about a thousand points of the
mesh or more, spread over its triangles, at sampled times of the flight: good enough to report, not a bound.
Does not import numpy.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import sqrt
from pathlib import Path

from paradize.build.artifacts import read_artifact
from paradize.build.entries import PIXELS, fits
from paradize.errors import FormatError
from paradize.formats.glb.document import glb_document
from paradize.jobs.code import code_digest
from paradize.placement import largest_scale, to_world
from paradize.scene.flight import Flight, Vec, sine_cosine
from paradize.scene.placement import placed
from paradize.scene.settings import Scene
from paradize.store.local import Store, key_of

_POINTS = 2000
_STEP_S = 0.25
_GOLDEN = 2654435769  # of 2^32
_TYPES = {5121: "B", 5123: "H", 5125: "I", 5126: "f"}  # glTF's component types
_COUNTS = {"SCALAR": 1, "VEC3": 3}


def sample_points(glb: bytes, name: str) -> list[Vec]:
    """Returns points of a GLB's finest level, metres in its space: corners of triangles, and points inside
    them where there are few. Raises FormatError if Paradize did not write it."""
    try:
        tree, start = glb_document(glb, name)
        node = tree["nodes"][0]
        step, origin = node.get("scale", (1.0, 1.0, 1.0)), node.get("translation", (0.0, 0.0, 0.0))

        def at(index: int) -> tuple[int, int, int, int]:
            """Returns first byte, stride in bytes, count and component type of an accessor."""
            accessor_json = tree["accessors"][index]
            view = tree["bufferViews"][accessor_json["bufferView"]]
            offset = start + view.get("byteOffset", 0) + accessor_json.get("byteOffset", 0)
            component = int(accessor_json["componentType"])
            stride = view.get(
                "byteStride", _COUNTS[accessor_json["type"]] * struct.calcsize(_TYPES[component])
            )
            return offset, stride, int(accessor_json["count"]), component

        def point(raw: Sequence[float]) -> Vec:
            x, y, z = (a + b * c for a, b, c in zip(origin, step, raw, strict=True))
            return x, y, z

        runs = [
            (at(primitive["attributes"]["POSITION"]), at(primitive["indices"]))
            for primitive in tree["meshes"][node["mesh"]]["primitives"]
        ]
        total = sum(count // 3 for _, (_, _, count, _) in runs)
        parts = 1
        while total * (parts + 1) * (parts + 2) < _POINTS:
            parts += 1
        points: list[Vec] = []
        for (positions, stride, _, coordinate), (indices, size, count, component) in runs:
            form, row = f"<3{_TYPES[component]}", f"<3{_TYPES[coordinate]}"
            for triangle in _chosen_triangles(count // 3, total):
                corners = [
                    point(struct.unpack_from(row, glb, positions + stride * index))
                    for index in struct.unpack_from(form, glb, indices + 3 * triangle * size)
                ]
                points += _spread(corners, parts)
    except (KeyError, IndexError, TypeError, ValueError, struct.error) as error:
        raise FormatError(f"is no mesh of ours: {error}", file=name) from None
    return points


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
    width, height = scene.head.viewport
    sine, cosine = sine_cosine(0.5 * scene.flight.fov_deg)
    pixel_m: dict[str, float] = {}
    count = max(1, round(flight.duration_s / _STEP_S))
    views = [flight.view(flight.duration_s * i / count) for i in range(count)]
    for item in scene.objects:
        for instance in map(placed, item.instances):
            world = [to_world(point, instance) for point in points[item.name]]
            near_m = _nearest(views, world, sine / cosine, width / height)
            if near_m is not None:
                pixel = 2.0 * max(near_m, scene.flight.near_m) * (sine / cosine) / height
                pixel /= largest_scale(instance)
                pixel_m[item.name] = min(pixel_m.get(item.name, pixel), pixel)
    return pixel_m


def stored_pixels(
    store: Store,
    scene: Scene,
    flight: Flight,
    meshes: Mapping[str, Path],
    sha256: Mapping[str, str],
    *,
    force: bool = False,
) -> dict[str, float]:
    """Returns nearest_pixel_m of the scene's objects, from the store where it is known. meshes, sha256: by
    artifact. force: read nothing from the store."""
    frame = [flight.as_json(), scene.head.viewport, scene.flight.fov_deg, scene.flight.near_m]
    common = key_of(__name__, code_digest(__name__), frame)
    pixel_m: dict[str, float] = {}
    for item in scene.objects:
        name = f"{item.name}_mesh"
        key = key_of(common, sha256[name], [placed(instance) for instance in item.instances])
        stored = None if force else store.get_product(key)
        if not fits(stored, PIXELS):
            one = replace(scene, objects=(item,))
            pixels = nearest_pixel_m(
                one, flight, {item.name: sample_points(read_artifact(meshes[name]), name)}
            )
            stored = {"pixel_m": pixels.get(item.name)}
            store.put_product(key, stored)
        if stored["pixel_m"] is not None:
            pixel_m[item.name] = float(stored["pixel_m"])
    return pixel_m


def _nearest(
    views: Sequence[tuple[Vec, Vec]], points: Sequence[Vec], tangent: float, aspect: float
) -> float | None:
    """Returns the least distance from an eye to a point inside its view cone; None if there is none. The
    cone contains the whole picture. tangent: of half the vertical field of view. aspect: width / height."""
    low, high = (tuple(pick(point[k] for point in points) for k in range(3)) for pick in (min, max))
    middle = tuple(0.5 * (a + b) for a, b in zip(low, high, strict=True))
    radius = 0.5 * _length(tuple(b - a for a, b in zip(low, high, strict=True)))
    # A point is in the cone if its depth is at least this share of its distance, both squared.
    share = 1.0 / (1.0 + tangent * tangent * (1.0 + aspect * aspect))
    best: float | None = None  # squared
    for eye, target in views:
        away = _length(tuple(b - a for a, b in zip(eye, middle, strict=True))) - radius
        if best is not None and away > 0 and away * away >= best:
            continue
        ahead = tuple(b - a for a, b in zip(eye, target, strict=True))
        length = _length(ahead) or 1.0
        fx, fy, fz = (part / length for part in ahead)
        ex, ey, ez = eye
        for px, py, pz in points:
            x, y, z = px - ex, py - ey, pz - ez
            square = x * x + y * y + z * z
            if best is not None and square >= best:
                continue
            along = x * fx + y * fy + z * fz
            if along >= 0 and along * along >= share * square:
                best = square
    return None if best is None else sqrt(best)


def _length(v: Sequence[float]) -> float:
    x, y, z = v
    return sqrt(x * x + y * y + z * z)

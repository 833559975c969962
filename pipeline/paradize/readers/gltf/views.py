"""Cameras and lights of a glTF model, as records. A scene may be made of them; the surface needs none.

What is broken of them is a warning: the model itself is as sound without.
"""

from __future__ import annotations

from math import degrees, isfinite, sqrt
from typing import Any

from paradize.errors import SourceError, one_line
from paradize.readers.gltf.document import Document
from paradize.readers.gltf.nodes import Matrix, Nodes
from paradize.readers.record import Camera, Light, Vec3, Views

_LIGHTS = "KHR_lights_punctual"
_MOST = 64  # of each, that are read
_MAX_NAME = 80


def read_views(document: Document, nodes: Nodes, shown: list[int]) -> Views:
    """Returns what stands in the scene. shown: its nodes."""
    cameras: list[Camera] = []
    lights: list[Light] = []
    notes: list[str] = []
    for node in shown:
        try:
            entry, place = document.item("nodes", node, ""), f"/nodes/{node}"
            camera = document.get(entry, place, "camera", int, None)
            if camera is not None and len(cameras) < _MOST:
                cameras.append(_camera(document, camera, nodes.world[node], entry))
            light = document.extension(entry, place, _LIGHTS)
            if light is not None and len(lights) < _MOST:
                number = document.get(light, f"{place}/extensions/{_LIGHTS}", "light", int)
                lights.append(_light(document, number, nodes.world[node], entry))
        except SourceError as error:
            notes.append(str(error))
    return Views(cameras, lights, tuple(notes))


def _camera(document: Document, number: int, matrix: Matrix, node: dict[str, Any]) -> Camera:
    entry, place = document.item("cameras", number, "/cameras"), f"/cameras/{number}"
    name = _name(node, entry, f"camera {number}")
    kind = document.get(entry, place, "type", str)
    forward, up = _unit(document, matrix, 2, -1.0, place), _unit(document, matrix, 1, 1.0, place)
    eye = (matrix[3], matrix[7], matrix[11])
    if kind != "perspective":
        return Camera(name, eye, forward, up, None)
    lens = document.get(entry, place, kind, dict)
    fov = degrees(document.get(lens, f"{place}/{kind}", "yfov", float))
    aspect = document.get(lens, f"{place}/{kind}", "aspectRatio", float, None)
    near = document.get(lens, f"{place}/{kind}", "znear", float, None)
    return Camera(name, eye, forward, up, fov, aspect, near)


def _light(document: Document, number: int, matrix: Matrix, node: dict[str, Any]) -> Light:
    place = f"/extensions/{_LIGHTS}"
    table = document.get(document.extension(document.tree, "", _LIGHTS) or {}, place, "lights", list, [])
    place = f"{place}/lights/{number}"
    if not 0 <= number < len(table) or not isinstance(table[number], dict):
        raise document.fault(f"there is no light {number}", place)
    entry: dict[str, Any] = table[number]
    red, green, blue = document.floats(entry, place, "color", 3, (1.0, 1.0, 1.0))
    intensity = document.get(entry, place, "intensity", float, 1.0)
    if not all(isfinite(value) and value >= 0.0 for value in (red, green, blue, intensity)):
        raise document.fault("a colour or an intensity that is none", place)
    kind = document.get(entry, place, "type", str)
    direction = _unit(document, matrix, 2, -1.0, place)
    return Light(
        _name(node, entry, f"light {number}"), one_line(kind)[:20], direction, (red, green, blue), intensity
    )


def _unit(document: Document, matrix: Matrix, column: int, sign: float, place: str) -> Vec3:
    x, y, z = (sign * matrix[row + column] for row in (0, 4, 8))
    length = sqrt(x * x + y * y + z * z)
    if not (length > 0.0 and isfinite(length)):
        raise document.fault("its node has no direction", place)
    return x / length, y / length, z / length


def _name(node: dict[str, Any], entry: dict[str, Any], otherwise: str) -> str:
    names = (owner.get("name") for owner in (entry, node))
    return next((one_line(name)[:_MAX_NAME] for name in names if isinstance(name, str) and name), otherwise)

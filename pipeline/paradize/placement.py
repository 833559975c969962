"""Transforms between an object's space and the world. An instance is a mapping of position, rotation (a unit
quaternion x, y, z, w) and scale (three numbers), as in `instances` of scene.json. All code that places
instances uses these functions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Number = TypeVar("Number", float, npt.NDArray[np.float64])


IDENTITY: tuple[float, ...] = (
    1.0,
    0.0,
    0.0,
    0.0,
    0.0,
    1.0,
    0.0,
    0.0,
    0.0,
    0.0,
    1.0,
    0.0,
)  # 3 x 4, by rows
UNMOVED = {"position": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0]}


def to_world(point: Iterable[Number], instance: Mapping[str, Any]) -> tuple[Number, Number, Number]:
    """Transforms a point from the object's space to the world: scales, turns, translates. point: x, y, z in
    metres, numbers or arrays of them."""
    x, y, z = (value * scale for value, scale in zip(point, instance["scale"], strict=True))
    x, y, z = turned((x, y, z), instance["rotation"])
    px, py, pz = instance["position"]
    return px + x, py + y, pz + z


def largest_scale(instance: Mapping[str, Any]) -> float:
    """How many times as long as in the object's space a distance may be in the world."""
    return max(abs(float(scale)) for scale in instance["scale"])


def turned(point: tuple[Number, Number, Number], rotation: Sequence[float]) -> tuple[Number, Number, Number]:
    """Turns a point by a unit quaternion x, y, z, w."""
    x, y, z = point
    a, b, c, w = rotation
    # v + 2 w (q x v) + 2 q x (q x v)
    tx, ty, tz = 2.0 * (b * z - c * y), 2.0 * (c * x - a * z), 2.0 * (a * y - b * x)
    return (
        x + w * tx + (b * tz - c * ty),
        y + w * ty + (c * tx - a * tz),
        z + w * tz + (a * ty - b * tx),
    )


def turned_back(
    point: tuple[Number, Number, Number], rotation: Sequence[float]
) -> tuple[Number, Number, Number]:
    """The inverse of `turned`."""
    a, b, c, w = rotation
    return turned(point, (-a, -b, -c, w))

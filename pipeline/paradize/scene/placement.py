"""Transforms a point of an object to the world. All code that places instances uses this function."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Number = TypeVar("Number", float, npt.NDArray[np.float64])


def to_world(
    point: Iterable[Number], position: Sequence[float], turn: tuple[float, float], scale: float
) -> tuple[Number, Number, Number]:
    """Transforms a point from an object's space to the world: scales, turns about +Y, translates.

    point: x, y, z in metres, numbers or arrays of them. position: of the instance, metres. turn: sine and
    cosine of the yaw.
    """
    x, y, z = point
    (px, py, pz), (sine, cosine) = position, turn
    return px + scale * (x * cosine + z * sine), py + scale * y, pz + scale * (z * cosine - x * sine)

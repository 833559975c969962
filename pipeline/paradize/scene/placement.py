"""Where a point of an object lies in the world: the one place that says how an instance stands."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Number = TypeVar("Number", float, npt.NDArray[np.float64])


def placed(
    point: Iterable[Number], position: Sequence[float], turn: tuple[float, float], scale: float
) -> tuple[Number, Number, Number]:
    """A point of an object's space in the world: turned about +Y, scaled, moved.

    point: x, y, z in metres, numbers or arrays of them. turn: sine and cosine of the yaw.
    """
    x, y, z = point
    (px, py, pz), (sine, cosine) = position, turn
    return px + scale * (x * cosine + z * sine), py + scale * y, pz + scale * (z * cosine - x * sine)

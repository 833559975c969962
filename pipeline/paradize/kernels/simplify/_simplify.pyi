"""Native simplifier; simplify is its checked face."""

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]

def simplify(
    positions: Array,
    triangles: Array,
    attributes: Array,
    weights: Array,
    unit: int,
    place: Array,
    group: Array,
    target: int,
    kept_area: float,
) -> tuple[Array, Array, Array, Array, Array, Array, int]: ...

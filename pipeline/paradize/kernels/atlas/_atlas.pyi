"""Native atlas kernels; atlas is their checked face."""

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]

def make_charts(
    positions: Array, triangles: Array, deviation: float, most: int, threads: int
) -> tuple[Array, Array, int]: ...
def most_charts(resolution: int, padding: int) -> int: ...
def pack(corners: Array, chart: Array, count: int, resolution: int, padding: int) -> tuple[Array, float]: ...

"""Native normal kernels; normals is their checked face. Results are written into the last arrays."""

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]

def has_width(width: int) -> bool: ...
def normals_from_heights(
    heights: Array,
    islands: Array,
    derivative: Array,
    smooth: Array,
    scale_x: float,
    scale_y: float,
    wrap_x: bool,
    wrap_y: bool,
    green_down: bool,
    first: int,
    last: int,
    result: Array,
    threads: int,
    width: int,
) -> bool: ...
def normals_from_slopes(
    dx: Array,
    dy: Array,
    scale_x: float,
    scale_y: float,
    green_down: bool,
    result: Array,
    threads: int,
    width: int,
) -> bool: ...

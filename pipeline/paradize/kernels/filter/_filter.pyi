"""Native kernels of the derivative filters; filter is their checked face. Calls write into arrays."""

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]

def predict_errors(
    heights: Array,
    islands: Array,
    source_bits: int,
    wrap_x: bool,
    wrap_y: bool,
    derivative: Array,
    smooth: Array,
    codes: Array,
) -> tuple[list[float], float]: ...
def destep(heights: Array, step: float, wrap_x: bool, wrap_y: bool, out: Array, threads: int) -> None: ...

"""Native block compressors; bcn is their checked face. quality: 0 fast, 1 balanced, 2 exact."""

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]

def encode_color(rgba: Array, with_alpha: bool, quality: int, threads: int) -> bytes: ...
def encode_values(values: Array, is_signed: bool, quality: int, threads: int) -> bytes: ...

"""Native block compressors; bcn.py is their checked face. A call writes `blocks`."""

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]

def encode_color(rgba: Array, with_alpha: bool, passes: int, blocks: Array, threads: int) -> None: ...
def encode_values(values: Array, is_signed: bool, passes: int, blocks: Array, threads: int) -> None: ...

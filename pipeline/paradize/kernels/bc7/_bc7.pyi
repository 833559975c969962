"""Native BC7 encoder; bc7 is its checked face. A call writes `blocks`."""

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]

def encode(rgba: Array, quality: int, alpha_weight: float, blocks: Array, threads: int) -> None: ...

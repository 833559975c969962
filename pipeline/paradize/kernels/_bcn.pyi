"""Native block compressors; bcn.py is their checked face. `blocks` is written."""

from typing import Any

import numpy.typing as npt

def encode_color(rgba: npt.NDArray[Any], with_alpha: bool, blocks: npt.NDArray[Any], threads: int) -> None: ...
def encode_values(values: npt.NDArray[Any], is_signed: bool, blocks: npt.NDArray[Any], threads: int) -> None: ...

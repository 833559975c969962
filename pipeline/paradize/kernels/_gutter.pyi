"""Native gutter kernels; gutter.py is their checked face. A call writes the array named result or names."""

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]

def linear_light(values: Array, result: Array) -> None: ...
def touching(ids: Array, count: int, repeat: bool, names: Array) -> None: ...
def smallest_gap(inside: Array, source: Array, owner: Array, repeat: bool) -> tuple[float, int, int]: ...
def walk(
    texels: Array,
    channels: int,
    kind: int,
    inside: Array,
    source: Array,
    owner: Array,
    repeat: bool,
    reach: Array,
    result: Array,
    threads: int,
) -> None: ...

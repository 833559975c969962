"""OpenMesh; openmesh is its checked face."""

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]
VERSION: int

def count(positions: Array, triangles: Array) -> tuple[int, int, int]: ...
def simplify(positions: Array, triangles: Array, target: int) -> tuple[Array, Array]: ...

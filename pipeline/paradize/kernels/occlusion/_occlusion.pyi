"""Native occlusion kernels; occlusion is their checked face. Results are written into the arrays given."""

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]

class Scene:
    def __init__(self, positions: Array, triangles: Array, rays: int) -> None: ...

def has_width(width: int) -> bool: ...
def cast(
    scene: Scene,
    points: Array,
    normals: Array,
    faces: Array,
    texels: Array,
    columns: int,
    reach: float,
    result: Array,
    threads: int,
    width: int,
) -> None: ...
def places(uvs: Array, triangles: Array, touched: Array, most: int) -> tuple[Array, Array, Array, int]: ...

"""The cost of drawing a mesh in its order of triangles and vertices.

Measured by its own kernel (`reference/draw.hpp`), which no stage imports.
"""

from __future__ import annotations

from paradize.data import Mesh
from paradize.kernels.reference.draw import draw_cost

_STREAMS = (
    *(("positions", 12), ("normals", 12), ("tangents", 16), ("uvs", 8), ("uvs1", 8), ("colors", 16)),
    ("sway", 8),
)


def draw_costs(mesh: Mesh) -> dict[str, float]:
    """acmr: vertices transformed per triangle. atvr: transforms per vertex. overfetch: bytes read per byte of
    vertices. For a FIFO cache of 16 vertices and a memory cache of 64 KiB; four significant digits.

    All groups are drawn one after the other without clearing the caches, as the player draws a level.
    """
    strides = [width for name, width in _STREAMS if getattr(mesh, name) is not None]
    costs = draw_cost(mesh.triangles, len(mesh.positions), strides)
    return {k: float(f"{v:.4g}") for k, v in zip(("acmr", "atvr", "overfetch"), costs, strict=True)}

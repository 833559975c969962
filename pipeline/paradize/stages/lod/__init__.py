"""Simplifies a mesh by one of four simplifiers: `paradize` (our own quadric edge collapse,
`kernels/simplify/collapse.hpp`), `meshoptimizer`, `fast-simplification` and `openmesh`.

The first two keep attributes. Vertices are joined only if their position, texture coordinates and material
agree, and a vertex on a texture seam or a border between materials moves along it or not at all. So surfaces
stay closed there, unless that leaves too many triangles (`simplify`). Parts that would lose most of their
area (leaves, cards, ropes) are kept whole.

The last two see only positions. The mesh is welded by position, and texture coordinates and normals are taken
from the source's surface again. Texture seams are not kept, borders may recede, and thin parts may vanish.

All work on the mesh centred on the origin and scaled to a diagonal of 1. Tier `exact` (`refine.py`) tries the
first two. `tests/bench/README.md` compares all.

Sources: M. Garland and P. Heckbert, "Surface simplification using quadric error metrics", 1997; H. Hoppe,
"New quadric metric for simplifying meshes with appearance attributes", 1999.
"""

from paradize.stages.lod.methods import (
    LEAST_TRIANGLES,
    VARIANTS,
    simplifier_version,
    simplify,
)
from paradize.stages.lod.positions import require_simplifier
from paradize.stages.lod.surface import Simplified

__all__ = [
    "LEAST_TRIANGLES",
    "VARIANTS",
    "Simplified",
    "require_simplifier",
    "simplifier_version",
    "simplify",
]

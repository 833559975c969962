"""A mesh with fewer triangles, by one of four simplifiers: `paradize` (our own quadric edge collapse,
`kernels/simplify/collapse.hpp`) and `meshoptimizer`, both with attributes, `fast-simplification` and
`openmesh`, which know positions alone.

Halving ten models of 280 to 1,800 triangles, ours came nearer to the source than meshoptimizer 0.22 by RMS on
nine; by the 99th percentile of normals on four, and less near on four: tier `exact` (`refine.py`) measures
both. Of large meshes: `tests/bench/README.md`. For the other two the mesh is welded by position, and texture
coordinates and normals are taken from the source's surface again: texture seams are let go, borders may
recede, and thin parts may vanish.

The mesh is centred on the origin with a diagonal of 1. Surfaces stay closed at texture seams and borders
between materials: vertices are joined only where position, texture coordinate and material agree, and what
lies on such a border moves along it or not at all. Parts that would lose most of their area (leaves, cards,
ropes) are kept whole.

Sources: M. Garland and P. Heckbert, "Surface simplification using quadric error metrics", 1997; H. Hoppe,
"New quadric metric for simplifying meshes with appearance attributes", 1999.
"""

from paradize.stages.lod.methods import (
    LEAST_TRIANGLES,
    METHODS,
    RATIO,
    SIMPLIFIERS,
    VARIANTS,
    simplifier_version,
    simplify,
)
from paradize.stages.lod.positions import require_simplifier
from paradize.stages.lod.surface import Simplified

__all__ = [
    "LEAST_TRIANGLES",
    "METHODS",
    "RATIO",
    "SIMPLIFIERS",
    "VARIANTS",
    "Simplified",
    "require_simplifier",
    "simplifier_version",
    "simplify",
]

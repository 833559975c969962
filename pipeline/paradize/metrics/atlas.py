"""How good a mesh's UV layout is: stretch, seams, packing, overlap, gutters, texel density.

Measured by its own kernel (`reference/atlas.hpp`), which no stage imports. Source of the stretch: P. Sander,
J. Snyder, S. Gortler and H. Hoppe, "Texture mapping progressive meshes", 2001.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, six
from paradize.errors import BakeError
from paradize.kernels.reference.atlas import layout_quality, layout_raster


def _places(positions: npt.NDArray[np.float32]) -> npt.NDArray[np.uint32]:
    """The number of each vertex' place: vertices at equal positions share one."""
    order = np.lexsort(positions.T)
    first = np.ones(len(order), np.bool_)
    first[1:] = (positions[order[1:]] != positions[order[:-1]]).any(axis=1)
    places = np.empty(len(order), np.uint32)
    places[order] = order[np.maximum.accumulate(np.where(first, np.arange(len(order)), 0))]
    return places


def atlas_quality(mesh: Mesh, *, resolution: int = 1024, padding: int = 4) -> dict[str, Any]:
    """What is told of the layout `mesh.uvs`, six digits.

    stretch: L2, 1 at best; seam_length in square roots of the surface's area; packing: share of the square;
    charts; overlap: share of the covered texels that two triangles cover; near: texels of a chart that have
    another chart within fewer than `padding` texels; flipped, without: triangles that are mirrored, or that
    have an area on the surface alone, but for those too thin for float32 coordinates to tell; texels_per_m:
    smallest, middle and largest density in a texture of `resolution`. Raises BakeError where there is no
    layout or it leaves the unit square.
    """
    if mesh.uvs is None:
        raise BakeError("no texture coordinates to measure")
    corners = mesh.uvs[mesh.triangles].astype(np.float64)
    if not np.isfinite(corners).all() or corners.min() < 0 or corners.max() > 1:
        raise BakeError("texture coordinates leave the unit square")
    triangles = _places(mesh.positions)[mesh.triangles]
    wide = mesh.positions.astype(np.float64)
    unit = float((wide.max(axis=0) - wide.min(axis=0)).max()) or 1.0
    points = (wide - wide.min(axis=0)) / unit  # their squares neither vanish nor overflow
    found = layout_quality(points, triangles, corners)
    covered, twice, near = layout_raster(
        points, triangles, corners, resolution=resolution, gap=max(padding - 1, 0)
    )
    density = np.sort(found["density"]) * resolution / unit
    middle = density[[0, len(density) // 2, -1]].tolist() if len(density) else [0.0, 0.0, 0.0]
    told = {key: six(found[key]) for key in ("stretch", "seam_length", "packing")}
    return {
        **told,
        "charts": int(found["charts"]),
        "overlap": six(twice / covered if covered else 0.0),
        "near": near,
        "flipped": int(found["flipped"]),
        "without": int(found["without"]),
        "texels_per_m": [six(value) for value in middle],
    }

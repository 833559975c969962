"""Quality of a mesh's UV layout: stretch, seams, packing, overlap, gutters, texel density.

Measured by its own kernel (`reference/atlas.hpp`), which no stage imports. Source of the stretch: P. Sander,
J. Snyder, S. Gortler and H. Hoppe, "Texture mapping progressive meshes", 2001.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, rounded
from paradize.errors import BakeError
from paradize.kernels.reference.atlas import layout_quality, layout_raster


def _position_ids(positions: npt.NDArray[np.float32]) -> npt.NDArray[np.uint32]:
    """(n,) uint32: an id for each vertex, equal for vertices at equal positions."""
    order = np.lexsort(positions.T)
    first = np.ones(len(order), np.bool_)
    first[1:] = (positions[order[1:]] != positions[order[:-1]]).any(axis=1)
    ids = np.empty(len(order), np.uint32)
    ids[order] = order[np.maximum.accumulate(np.where(first, np.arange(len(order)), 0))]
    return ids


def atlas_quality(mesh: Mesh, *, resolution: int = 1024, padding: int = 4) -> dict[str, Any]:
    """Measures the layout `mesh.uvs`; numbers have six significant digits.

    stretch: L2 stretch, 1 is best. seam_length: in square roots of the surface's area. packing: covered share
    of the unit square. charts: their number. overlap: share of the covered texels that two triangles cover.
    near: texels of a chart with another chart within fewer than `padding` texels. flipped, without: triangles
    that are mirrored, and triangles with an area on the surface but none in the layout, except those too thin
    for float32. texels_per_m: smallest, median and largest density in a texture of `resolution` texels per
    side.

    Raises BakeError where there are no UVs or they leave the unit square.
    """
    if mesh.uvs is None:
        raise BakeError("no texture coordinates to measure")
    corners = mesh.uvs[mesh.triangles].astype(np.float64)
    if not np.isfinite(corners).all() or corners.min() < 0 or corners.max() > 1:
        raise BakeError("texture coordinates leave the unit square")
    triangles = _position_ids(mesh.positions)[mesh.triangles]
    positions = mesh.positions.astype(np.float64)
    unit = float((positions.max(axis=0) - positions.min(axis=0)).max()) or 1.0
    points = (positions - positions.min(axis=0)) / unit  # scaled: squares neither underflow nor overflow
    quality = layout_quality(points, triangles, corners)
    covered, overlapping, too_near = layout_raster(
        points, triangles, corners, resolution=resolution, gap=max(padding - 1, 0)
    )
    density = np.sort(quality["density"]) * resolution / unit
    middle = density[[0, len(density) // 2, -1]].tolist() if len(density) else [0.0, 0.0, 0.0]
    shares = {key: rounded(quality[key]) for key in ("stretch", "seam_length", "packing")}
    return {
        **shares,
        "charts": int(quality["charts"]),
        "overlap": rounded(overlapping / covered if covered else 0.0),
        "near": too_near,
        "flipped": int(quality["flipped"]),
        "without": int(quality["without"]),
        "texels_per_m": [rounded(value) for value in middle],
    }

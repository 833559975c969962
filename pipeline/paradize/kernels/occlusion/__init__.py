"""Python interface of the occlusion kernels: the places of a surface that texels show, and rays from them.

Results do not depend on `threads`. Wrong shapes and types raise ValueError. Method: occlusion/rays.hpp,
occlusion/directions.hpp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from paradize.kernels.arrays import finite_rows, to_indices, triangle_rows
from paradize.kernels.occlusion import _occlusion
from paradize.kernels.threads import default_threads

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]
U32 = npt.NDArray[np.uint32]

THREADS = default_threads(8)
_MOST_RAYS = 1 << 16
_OVERLAPS = 16  # places of a texel, on average of the map, beyond which a layout is refused


@dataclass(frozen=True)
class Places:
    """One row for each texel and triangle that shows there. texel: (n,) flat index. triangle: (n,). weights:
    (n, 3) float64, of its corners. shared: texels inside more than one triangle."""

    texel: U32
    triangle: U32
    weights: npt.NDArray[np.float64]
    shared: int


def places(uvs: F32, triangles: U32, touched: I32) -> Places:
    """The places that texels show: of each triangle that the texel's centre lies in, else of the triangle
    that touches it.

    uvs: (n, 2) top-left. triangles: (m, 3). touched: (h, w) int32, a triangle that covers a part of the
    texel, -1: none. Raises ValueError for UVs that overlap more than 16 times on average.
    """
    rows = finite_rows(uvs, 2, np.float32, name="uvs")
    indices = triangle_rows(triangles, len(rows))
    if touched.ndim != 2 or not touched.size or int(touched.max()) >= len(indices):
        raise ValueError(f"touched has shape {touched.shape}")
    shown = np.ascontiguousarray(touched, np.int32)
    return Places(*_occlusion.places(rows, indices, shown, _OVERLAPS * touched.size))


def has_width(width: int) -> bool:
    """Whether this CPU can cast so many rays at a time: 0: the most that it can, 1: 4, 2: 8, 3: 16."""
    return bool(_occlusion.has_width(width))


class Blockers:
    """Triangles that hold light back, and the directions that are tried.

    positions: (n, 3), best within 1 of the origin. triangles: (m, 3); none: nothing holds light back. rays:
    of each point, a power of two, 16 to 65536.
    """

    def __init__(self, positions: npt.ArrayLike, triangles: npt.ArrayLike, rays: int) -> None:
        points = finite_rows(positions, 3, np.float32, name="positions")
        if not 16 <= rays <= _MOST_RAYS or rays & (rays - 1):
            raise ValueError(f"{rays} rays, expected a power of two, 16 to {_MOST_RAYS}")
        self._native = _occlusion.Scene(points, triangle_rows(triangles, len(points)), rays)

    def open_shares(
        self,
        points: F32,
        normals: F32,
        faces: F32,
        texels: U32,
        columns: int,
        *,
        reach: float,
        threads: int = THREADS,
        width: int = 0,
    ) -> F32:
        """(n,) the share of the light from all around, weighted by the cosine to the normal, that reaches the
        points; light from below the face does not count.

        points: (n, 3). normals, faces: (n, 3) unit, with a product of 0 or more. texels: (n,) flat indices on
        a map of so many columns: neighbours try other directions. reach: length of the rays, above 0. width:
        as of has_width.
        """
        begin, up, face = (finite_rows(array, 3, np.float32) for array in (points, normals, faces))
        if not reach > 0.0:
            raise ValueError(f"reach is {reach}")
        out = np.empty(len(begin), np.float32)
        at = to_indices(texels)
        _occlusion.cast(self._native, begin, up, face, at, columns, min(reach, 3e38), out, threads, width)
        return out

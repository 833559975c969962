"""Python interface of the native mesh kernels. Checks shapes, ranges and finiteness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

import paradize.kernels.mesh._mesh as _mesh
from paradize.kernels.arrays import finite_rows, to_indices, triangle_rows
from paradize.kernels.threads import default_threads

F32: TypeAlias = npt.NDArray[np.float32]
U32: TypeAlias = npt.NDArray[np.uint32]
UNKNOWN_SMOOTHING = 0xFFFFFFFF
_NONE = 0xFFFFFFFF
# The mean at each vertex, MikkTSpace's rules.
TANGENT_METHODS = ("vertex", "mikktspace")


@dataclass(frozen=True)
class Occurrences:
    """count: how many there are. triangle: a triangle at the first; None where there are none."""

    count: int
    triangle: int | None


@dataclass(frozen=True)
class Topology:
    """edges: their number. border: edges of one triangle. non_manifold: edges of three or more. turned: edges
    that both triangles traverse in the same direction. bow_tie: vertices where fans touch without a common
    edge. components, component: (m,) uint32 of each triangle, connected by edges. island: (n,) uint32 of each
    vertex, connected by vertices; an index of a vertex."""

    edges: int
    border: Occurrences
    non_manifold: Occurrences
    turned: Occurrences
    bow_tie: Occurrences
    components: int
    component: U32
    island: U32


def _column(values: npt.ArrayLike, count: int) -> U32:
    column = to_indices(values)
    if column.shape != (count,):
        raise ValueError(f"expected ({count},) integers, got {column.shape}")
    return column


def number_rows(rows: npt.ArrayLike) -> tuple[U32, U32]:
    """Numbers rows (n, k) of finite float32 by value, in order of first use. Returns the number of each row
    (n,) and the first row of each number (distinct,)."""
    values = np.ascontiguousarray(rows, np.float32)
    return _mesh.number_rows(finite_rows(values, values.shape[1], np.float32))  # type: ignore[no-any-return]


def number_corners(base: npt.ArrayLike, rows: npt.ArrayLike) -> tuple[U32, U32]:
    """Numbers pairs of an integer (c,) and a row (c, k), as number_rows does rows."""
    values = np.ascontiguousarray(rows, np.float32)
    keys = _column(base, len(values))
    return _mesh.number_corners(keys, finite_rows(values, values.shape[1], np.float32))  # type: ignore[no-any-return]


def corner_normals(
    positions: F32, triangles: U32, smoothing: npt.ArrayLike | None = None, *, crease_deg: float
) -> F32:
    """(m, 3, 3) unit normals by smoothing group where known, else by crease angle (0 to 180 degrees).

    positions: (n, 3) metres. smoothing: (m,) group of each triangle, 0 flat, UNKNOWN_SMOOTHING by crease.
    """
    positions = finite_rows(positions, 3, np.float32)
    triangles = triangle_rows(triangles, len(positions))
    if smoothing is None:
        smoothing = np.full(len(triangles), UNKNOWN_SMOOTHING, np.uint32)
    if not 0 <= crease_deg <= 180:
        raise ValueError(f"crease angle {crease_deg} degrees, expected 0 to 180")
    ids, _ = number_rows(positions)
    out: F32 = _mesh.corner_normals(positions, ids, triangles, _column(smoothing, len(triangles)), crease_deg)
    return out.reshape(-1, 3, 3)


def split_tangents(
    positions: F32,
    normals: F32,
    uvs: F32,
    triangles: U32,
    *,
    method: str = "mikktspace",
    threads: int | None = None,
) -> tuple[U32, U32, F32]:
    """Tangents of an indexed mesh whose vertices are split where their corners' tangents differ. Returns new
    triangles (m, 3), and the old vertex (k,) and the tangent (k, 4) of each new vertex, numbered by first
    use; w is such that w * cross(N, T) points up the image.

    positions, normals: (n, 3), normals unit. uvs: (n, 2), top-left origin. method: one of TANGENT_METHODS.
    """
    index, source, tangents = _mesh.split_tangents(
        *_surface(positions, normals, uvs, triangles), TANGENT_METHODS.index(method), _workers(threads)
    )
    return index.reshape(-1, 3), source, tangents


def _surface(positions: F32, normals: F32, uvs: F32, triangles: U32) -> tuple[F32, F32, F32, U32]:
    positions = finite_rows(positions, 3, np.float32)
    return (
        positions,
        finite_rows(normals, 3, np.float32, count=len(positions)),
        finite_rows(uvs, 2, np.float32, count=len(positions)),
        triangle_rows(triangles, len(positions)),
    )


def _workers(threads: int | None) -> int:
    return default_threads(8) if threads is None else max(1, threads)


def topology(triangles: npt.ArrayLike, vertices: int) -> Topology:
    """Counts edges, borders and components. triangles: (m, 3); no triangle may use a vertex twice."""
    rows = triangle_rows(triangles, vertices)
    if (rows == np.roll(rows, 1, axis=1)).any():
        raise ValueError("a triangle names a vertex twice")
    raw = _mesh.topology(rows, vertices)

    def occurrences(key: str) -> Occurrences:
        count, triangle = raw[key]
        return Occurrences(count, None if triangle == _NONE else triangle)

    return Topology(
        edges=raw["edges"],
        border=occurrences("border"),
        non_manifold=occurrences("non_manifold"),
        turned=occurrences("turned"),
        bow_tie=occurrences("bow_tie"),
        components=raw["components"],
        component=raw["component"],
        island=raw["island"],
    )


def weld_points(points: F32, tolerance: float) -> U32:
    """(n,): the representative of each of the distinct points (n, 3): itself, or the nearest earlier
    representative within `tolerance` (above 0)."""
    if not 0 < tolerance < float("inf"):
        raise ValueError(f"tolerance {tolerance}, expected a number above 0")
    return _mesh.weld(finite_rows(points, 3, np.float32), tolerance)  # type: ignore[no-any-return]


def project(
    source_positions: F32,
    source_triangles: U32,
    charts: npt.ArrayLike,
    positions: F32,
    triangles: U32,
    *,
    one_chart: bool = False,
) -> tuple[U32, npt.NDArray[np.float64]]:
    """For each corner (3 m) of a simplified mesh the source triangle and barycentric weights (3 m, 3) of the
    point whose attributes it takes. charts: (source triangles,) equal where attributes are continuous."""
    positions = finite_rows(positions, 3, np.float32)
    source_positions = finite_rows(source_positions, 3, np.float32)
    source_triangles = triangle_rows(source_triangles, len(source_positions))
    if not len(source_triangles):
        raise ValueError("no triangles to look up")
    return _mesh.project(  # type: ignore[no-any-return]
        source_positions,
        source_triangles,
        _column(charts, len(source_triangles)),
        positions,
        triangle_rows(triangles, len(positions)),
        one_chart,
    )


@dataclass(frozen=True)
class Reach:
    """from_root: (n,) float64, metres along edges from where the mesh is rooted, and over gaps where a part
    hangs on another. in_branch: (n,) float64, the same from where its branch begins, 0 to 1 at the branch's
    farthest; 0 in rooted parts."""

    from_root: npt.NDArray[np.float64]
    in_branch: npt.NDArray[np.float64]


def reach(places: F32, triangles: npt.ArrayLike, rooted: float) -> Reach:
    """How far the places (n, 3) of a mesh are from where it is rooted: in the lowest `rooted` (0 to 1) of its
    height. triangles: (m, 3). Places must differ, else they are joined by gaps of length 0. mesh/reach.hpp
    tells the method. Raises ValueError."""
    if not 0.0 <= rooted <= 1.0:
        raise ValueError(f"rooted {rooted}, expected 0 to 1")
    rows = finite_rows(places, 3, np.float32)
    return Reach(*_mesh.reach(rows, triangle_rows(triangles, len(rows)), rooted))

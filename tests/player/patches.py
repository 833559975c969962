"""A small terrain as tiles of patches, made without a bake: a complete tree of right triangles on a square.

Every patch is subdivided in the same way. Two patches that share an edge therefore have the same vertices on
it, whatever their levels are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Group, Mesh, QuantisationGrid
from paradize.formats.glb.quantised import decoded_mesh
from paradize.formats.glb.tiles import TilePatch, encode_tiles
from paradize.stages.quantise import direction_bits, quantise

Height = Callable[[npt.NDArray[np.float64], npt.NDArray[np.float64]], npt.NDArray[np.float64]]
Point = tuple[float, float]  # x and z, 0 to 1 over the square
Corners = tuple[Point, Point, Point]  # the right angle first, then the hypotenuse's ends


def flat(x: npt.NDArray[np.float64], z: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """A flat terrain: every level draws the same."""
    return 0.0 * (x + z)


@dataclass(frozen=True)
class Tiled:
    """tiles: GLB files. tables: `patches`, `diamonds` and `demand` of scene.json's terrain."""

    tiles: list[bytes]
    tables: dict[str, Any]


@dataclass
class _Patch:
    corners: Corners
    level: int
    made_by: int
    diamond: int = -1


def _middle(a: Point, b: Point) -> Point:
    return (a[0] + b[0]) / 2, (a[1] + b[1]) / 2


def _tree(levels: int) -> tuple[list[_Patch], list[list[int]]]:
    """Patches of levels 0 to levels - 1, coarse first, and of each diamond the patches that it replaces."""
    patches = [
        _Patch(((0.0, 1.0), (0.0, 0.0), (1.0, 1.0)), 0, -1),
        _Patch(((1.0, 0.0), (1.0, 1.0), (0.0, 0.0)), 0, -1),
    ]
    diamonds: list[list[int]] = []
    start = 0
    for level in range(1, levels):
        end, shared = len(patches), dict[tuple[Point, ...], int]()
        for i in range(start, end):
            patch = patches[i]
            ends = tuple(sorted(patch.corners[1:]))
            if ends not in shared:
                shared[ends] = len(diamonds)
                diamonds.append([])
            patch.diamond = shared[ends]
            diamonds[patch.diamond].append(i)
        for i in range(start, end):
            a, b, c = patches[i].corners
            m = _middle(b, c)
            patches += [_Patch(half, level, patches[i].diamond) for half in ((m, a, b), (m, c, a))]
        start = end
    return patches, diamonds


def _cut(corners: Corners, refine: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
    """A patch bisected `refine` times: (n, 2) positions and (m, 3) indices, counterclockwise from above."""
    triangles = [corners]
    for _ in range(refine):
        halves: list[Corners] = []
        for a, b, c in triangles:
            m = _middle(b, c)
            halves += [(m, a, b), (m, c, a)]
        triangles = halves
    places, indices = np.unique(np.array(triangles).reshape(-1, 2), axis=0, return_inverse=True)
    faces = indices.reshape(-1, 3).astype(np.uint32)
    (ax, az), (bx, bz), (cx, cz) = (places[faces[0, k]] for k in range(3))
    if (bx - ax) * (cz - az) - (bz - az) * (cx - ax) > 0:
        faces = faces[:, [0, 2, 1]]
    return places, np.ascontiguousarray(faces)


def _mesh(
    places: npt.NDArray[np.float64],
    faces: npt.NDArray[np.uint32],
    size_m: float,
    height: Height,
    repeat: float,
) -> Mesh:
    x, z = ((places[:, k] - 0.5) * size_m for k in range(2))
    step = 1e-3 * size_m
    slope_x = (height(x + step, z) - height(x - step, z)) / (2 * step)
    slope_z = (height(x, z + step) - height(x, z - step)) / (2 * step)
    normals = np.stack([-slope_x, np.ones(len(x)), -slope_z], axis=1)
    tangents = np.stack([np.ones(len(x)), slope_x, np.zeros(len(x))], axis=1)
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]

    def f32(values: Any) -> npt.NDArray[np.float32]:
        return np.ascontiguousarray(values, dtype=np.float32)

    return Mesh(
        f32(np.stack([x, height(x, z), z], axis=1)),
        faces,
        f32(normals / np.linalg.norm(normals, axis=1)[:, None]),
        f32(np.concatenate([tangents, np.ones((len(x), 1))], axis=1)),
        f32(places * repeat),
        f32(places),
        groups=(Group("sand", "sand", 0, len(faces)),),
    )


def _error_m(mesh: Mesh, height: Height) -> float:
    """The largest vertical distance at points inside the triangles and on their edges."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    worst = 0.0
    for a in range(5):
        for b in range(5 - a):
            weights = np.array([a, b, 4 - a - b]) / 4
            point = np.einsum("tkc,k->tc", corners, weights)
            worst = max(worst, float(np.abs(point[:, 1] - height(point[:, 0], point[:, 2])).max()))
    return worst


def _tile_patch(
    index: int, mesh: Mesh, error_m: float, finest: bool, grid: QuantisationGrid | None
) -> TilePatch:
    if grid is None:
        return TilePatch(index, mesh, error_m, finest)
    codes = quantise(mesh, grid, direction_bits=direction_bits(grid), float_uvs=True)
    return TilePatch(index, decoded_mesh(mesh, codes), error_m, finest, codes)


def tiled(
    size_m: float,
    height: Height = flat,
    *,
    levels: int = 5,
    refine: int = 2,
    repeat: float = 8.0,
    error_m: float | None = None,
    tiles: int = 2,
    grid: QuantisationGrid | None = None,
    torn: bool = False,
) -> Tiled:
    """A square terrain around the origin.

    error_m: error of the roots, halved every other level; None: measured. grid: step of the quantisation
    grid, if vertices are quantised. torn: every patch is a thousandth too narrow, which opens cracks."""
    patches, members = _tree(levels)
    meshes = [_mesh(*_cut(patch.corners, refine), size_m, height, repeat) for patch in patches]
    if torn:
        for i, mesh in enumerate(meshes):
            middle = mesh.positions.mean(axis=0)
            narrower = middle + (mesh.positions - middle) * np.float32(0.999)
            meshes[i] = replace(mesh, positions=narrower)
    errors = [
        error_m * 0.5 ** (patch.level / 2) if error_m is not None else _error_m(mesh, height)
        for patch, mesh in zip(patches, meshes, strict=True)
    ]
    centers, radii = [], []
    for mesh in meshes:
        center = (mesh.positions.max(axis=0) + mesh.positions.min(axis=0)).astype(np.float64) / 2
        centers.append(center)
        radii.append(float(np.linalg.norm(mesh.positions - center, axis=1).max()) * 1.0001)
    # A diamond holds its patches and the diamonds below them.
    wide = [(0.0, np.zeros(3), 0.0)] * len(members)
    below: list[set[int]] = [set() for _ in members]
    for patch in patches:
        if patch.made_by >= 0 and patch.diamond >= 0:
            below[patch.made_by].add(patch.diamond)
    for d in reversed(range(len(members))):
        center = np.mean([centers[i] for i in members[d]], axis=0)
        inner = [(centers[i], radii[i]) for i in members[d]] + [wide[b][1:] for b in below[d]]
        radius = max(float(np.linalg.norm(c - center)) + r for c, r in inner) * 1.0001
        error = max([errors[i] for i in members[d]] + [wide[b][0] for b in below[d]])
        wide[d] = (error, center, radius)

    share = -(-len(patches) // tiles)
    files: list[bytes] = []
    columns: dict[str, list[Any]] = {"tile": [], "node": []}
    for first in range(0, len(patches), share):
        group = range(first, min(first + share, len(patches)))
        (data, rows), *_ = encode_tiles(
            _tile_patch(i, meshes[i], errors[i], patches[i].diamond < 0, grid) for i in group
        )
        assert rows == list(group)
        columns["tile"] += [len(files)] * len(group)
        columns["node"] += list(range(len(group)))
        files.append(data)
    columns |= {key: [getattr(patch, key) for patch in patches] for key in ("level", "made_by", "diamond")}
    columns |= {"center": [list(c) for c in centers], "radius_m": radii, "error_m": errors}
    columns["first_needed_s"] = [0.0] * len(patches)
    diamonds = {
        "level": [patches[i[0]].level for i in members],
        "error_m": [w[0] for w in wide],
        "center": [list(w[1]) for w in wide],
        "radius_m": [w[2] for w in wide],
    }
    demand = {"finest_level": levels - 1, "finest_s": 0.0, "left_out": 0, "left_out_bytes": 0}
    return Tiled(files, {"patches": columns, "diamonds": diamonds, "demand": demand})

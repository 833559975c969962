"""Fits the vertices or normals of a level of detail to the original surface. Its triangles stay the same.

Samples on both surfaces are paired with the nearest place on the other surface. The vertices then move so
that the distances of all pairs, weighted by area, are least in the sense of least squares. A simplifier
places each vertex once, when it collapses an edge; here all vertices move together.

Source: H. Hoppe, T. DeRose, T. Duchamp, J. McDonald and W. Stuetzle, "Mesh optimization", 1993 (the fit for
given triangles, sections 4.1 and 4.2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Mesh
from paradize.kernels.mesh import number_rows, project, topology
from paradize.vectors import cross, lengths, squared_lengths

if TYPE_CHECKING:
    import numpy.typing as npt

    F64 = npt.NDArray[np.float64]
    U32 = npt.NDArray[np.uint32]

# About how many samples are taken. Each triangle is cut into equal parts with three samples each.
_SAMPLES = 20_000
_FIT, _CHECK = 0.5, 0.02  # share by which samples move inward: spread out to fit; near corners to find maxima
_MOST_CUTS = 8  # along each side of a triangle
_SWEEPS = 12  # of damped Jacobi; a mass matrix of triangles needs few
_DAMPING = 0.7
# Tikhonov regularization, a share of a vertex's own weight: vertices that no sample reaches stay.
_REGULARIZATION = 1e-3
# A vertex keeps its bits where its move is below this share of the extent.
_LEAST_MOVE = 1e-6
_FARTHEST = 0.9  # of the reach
_ROUNDS = 2


@dataclass(frozen=True)
class _Samples:
    """Places on a level: corners (n, 3) as vertices of it, weights (n, 3) barycentric, area (n,). original,
    original_weights: the nearest place on the original, its corners' vertices (n, 3) and weights (n, 3)."""

    corners: U32
    weights: F64
    area: F64
    original: U32
    original_weights: F64


def fit_positions(original: Mesh, level: Mesh, reach_m: float) -> F64:
    """Returns the positions (n, 3) at which the level is nearest to the original surface, float64, metres.

    reach_m: the largest distance between the two surfaces. A sample that is farther from its partner met
    another part of the surface and is ignored. A vertex stays where its move would bring a sample nearly as
    far off.
    """
    samples, off = _apart(original, level, _FIT)
    points = level.positions.astype(np.float64)
    met = squared_lengths(off) <= reach_m * reach_m
    place, first = number_rows(level.positions)  # vertices of one place stay together
    pulling = replace(samples, corners=place[samples.corners], area=np.where(met, samples.area, 0.0))
    moves = _least_squares(pulling, off, len(first))
    size = points.max(axis=0) - points.min(axis=0)
    moves[(np.abs(moves) < _LEAST_MOVE * float(size.max())).all(axis=1)] = 0.0
    before = squared_lengths(_apart(original, level, _CHECK)[1])
    met = before <= reach_m * reach_m
    limit = np.maximum(before, (_FARTHEST * reach_m) ** 2)
    for _ in range(_ROUNDS):
        trial = replace(level, positions=(points + moves[place]).astype(np.float32))
        samples, off = _apart(original, trial, _CHECK)
        worse = place[samples.corners[met & (squared_lengths(off) > limit)]]
        if not moves[worse].any():
            break
        moves[worse] = 0.0
    return points + moves[place]


def fit_normals(original: Mesh, level: Mesh) -> npt.NDArray[np.float32]:
    """Returns unit normals (n, 3) for the level whose interpolation is nearest to the original's normals.
    Both meshes must have normals."""
    assert original.normals is not None and level.normals is not None
    samples = _samples(original, level, _FIT)
    target = _unit(_mixed(original.normals.astype(np.float64), samples.original, samples.original_weights))
    normals = level.normals.astype(np.float64)
    apart = target - _mixed(normals, samples.corners, samples.weights)
    return _unit(normals + _least_squares(samples, apart, len(normals))).astype(np.float32)


def _apart(original: Mesh, level: Mesh, inward: float) -> tuple[_Samples, F64]:
    """Returns samples, and the vector (n, 3) from each one on the level to its place on the original."""
    samples = _samples(original, level, inward)
    target = _mixed(original.positions.astype(np.float64), samples.original, samples.original_weights)
    return samples, target - _mixed(level.positions.astype(np.float64), samples.corners, samples.weights)


def _samples(original: Mesh, level: Mesh, inward: float) -> _Samples:
    """Returns samples of both surfaces, weighted by area, each with its nearest place on the other."""
    centre = (original.positions.min(axis=0) + original.positions.max(axis=0)) / 2
    meshes = [
        replace(mesh, positions=(mesh.positions - centre).astype(np.float32)) for mesh in (level, original)
    ]
    there = _one_way(meshes[0], meshes[1], inward)
    back = _one_way(meshes[1], meshes[0], inward)
    return _Samples(
        corners=np.concatenate([there[0], back[3]]),
        weights=np.concatenate([there[1], back[4]]),
        area=np.concatenate([there[2], back[2]]),
        original=np.concatenate([there[3], back[0]]),
        original_weights=np.concatenate([there[4], back[1]]),
    )


def _one_way(level: Mesh, original: Mesh, inward: float) -> tuple[U32, F64, F64, U32, F64]:
    """Returns samples of one surface (corners, weights, area) and their nearest places on the other (corners,
    weights)."""
    cuts = int(np.clip(np.sqrt(_SAMPLES / (3 * max(1, len(level.triangles)))), 1, _MOST_CUTS))
    grid = _barycentric_grid(cuts, inward)  # (k, 3 corners, 3 weights)
    count = len(level.triangles)
    weights = np.tile(grid.reshape(-1, 3), (count, 1))
    corners = np.repeat(level.triangles, 3 * len(grid), axis=0)
    points = level.positions.astype(np.float64)
    at = _mixed(points, corners, weights)
    charts = topology(original.triangles, len(original.positions)).component
    small = np.arange(len(at), dtype=np.uint32).reshape(-1, 3)
    place, there = project(original.positions, original.triangles, charts, at.astype(np.float32), small)
    area = np.repeat(_areas(points, level.triangles), 3 * len(grid)) / (3 * len(grid))
    return corners, weights, area, original.triangles[place], there


def _barycentric_grid(cuts: int, inward: float) -> F64:
    """Cuts a triangle into cuts^2 equal ones. Returns the barycentric weights of their corners, (cuts^2, 3,
    3), moved towards the middle of each by the share `inward`."""
    found = []
    for i in range(cuts):
        for j in range(cuts - i):
            found.append([(i, j), (i + 1, j), (i, j + 1)])
            if i + j + 1 < cuts:
                found.append([(i + 1, j + 1), (i, j + 1), (i + 1, j)])
    steps = np.array(found, np.float64) / cuts
    steps = (1 - inward) * steps + inward * steps.mean(axis=1, keepdims=True)
    return np.stack([1 - steps[..., 0] - steps[..., 1], steps[..., 0], steps[..., 1]], axis=-1)


def _mixed(values: F64, corners: U32, weights: F64) -> F64:
    found: F64 = values[corners[:, 0]] * weights[:, :1]
    found += values[corners[:, 1]] * weights[:, 1:2]
    found += values[corners[:, 2]] * weights[:, 2:]
    return found


def _areas(points: F64, triangles: U32) -> F64:
    a, b = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
    return 0.5 * lengths(cross(a, b))


def _least_squares(samples: _Samples, apart: F64, count: int) -> F64:
    """Returns values (count, k) at the vertices whose interpolation at the samples is nearest to `apart`
    (n, k), weighted by area."""
    weights = samples.weights * samples.area[:, None]  # (n, 3)

    def gather(values: F64) -> F64:
        found = np.zeros((count, values.shape[1]))
        for k in range(3):
            for column in range(values.shape[1]):
                found[:, column] += np.bincount(
                    samples.corners[:, k], weights[:, k] * values[:, column], minlength=count
                )
        return found

    right = gather(apart)
    own = np.zeros(count)
    for k in range(3):
        own += np.bincount(samples.corners[:, k], weights[:, k] * samples.weights[:, k], minlength=count)
    regularization = _REGULARIZATION * own
    scale = np.where(own > 0, _DAMPING / np.maximum(own + regularization, 1e-300), 0.0)[:, None]
    found = np.zeros_like(right)
    for _ in range(_SWEEPS):
        mixed = _mixed(found, samples.corners, samples.weights)
        residual = right - gather(mixed) - regularization[:, None] * found
        found += scale * residual
    return found


def _unit(vectors: F64) -> F64:
    return np.asarray(vectors / np.maximum(lengths(vectors), 1e-30)[:, None])

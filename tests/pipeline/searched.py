"""How far a mesh reaches from its root, by a search of all pairs in float64: judges stages/sway.py."""

from __future__ import annotations

import heapq

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh
from paradize.stages.sway import ROOTED

F64 = npt.NDArray[np.float64]


def beyond(trees: list[int], points: F64) -> tuple[float, int, int] | None:
    """The shortest gap from the tree of point 0's set to any other: length, and both ends."""
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2)
    gaps[np.equal.outer(trees, trees)] = np.inf
    if not np.isfinite(gaps).any():
        return None
    a, b = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
    return float(gaps[a, b]), int(a), int(b)


def searched(mesh: Mesh) -> F64:
    """The distances from the root of all places: the shortest gap joins two parts, again and again (J. B.
    Kruskal, 1956), and then the nearest place not yet reached is reached (E. W. Dijkstra, 1959)."""
    points, number = np.unique(mesh.positions.astype(np.float64), axis=0, return_inverse=True)
    number = number.reshape(-1)
    edges = {tuple(sorted((int(t[k - 1]), int(t[k])))) for t in number[mesh.triangles] for k in range(3)}
    trees = list(range(len(points)))

    def join(a: int, b: int) -> None:
        old, new = trees[a], trees[b]
        trees[:] = [new if tree == old else tree for tree in trees]

    for a, b in edges:
        join(a, b)
    low, high = points[:, 1].min(), points[:, 1].max()
    roots = np.flatnonzero(points[:, 1] <= low + ROOTED * (high - low)).tolist()
    for root in roots:
        join(root, roots[0])
    while gap := beyond(trees, points):
        edges.add((gap[1], gap[2]))
        join(gap[1], gap[2])
    near: dict[int, list[int]] = {}
    for a, b in edges:
        near.setdefault(a, []).append(b)
        near.setdefault(b, []).append(a)
    found: dict[int, float] = {}
    queue = [(0.0, root) for root in roots]
    while queue:
        distance, at = heapq.heappop(queue)
        if at not in found:
            found[at] = distance
            for other in near.get(at, ()):
                heapq.heappush(queue, (distance + float(np.linalg.norm(points[at] - points[other])), other))
    return np.array([found[int(place)] for place in number])

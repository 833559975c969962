"""A simplified mesh on its original: each corner takes the nearest triangle that faces its way."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import numpy.typing as npt
import pytest

from paradize.kernels.mesh import project
from tests.sweeps import sample

Points = npt.NDArray[np.float64]
INSET, FACING = 0.05, 0.25  # as kernels/mesh/project.hpp promises: a little inside, facing the same way


def soup(count: int, side: float, seed: int) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]:
    """Triangles of about a side's length in the unit cube, each with vertices of its own."""
    random = np.random.default_rng(seed)
    corners = random.random((count, 1, 3)) + side * random.normal(size=(count, 3, 3))
    return corners.reshape(-1, 3).astype(np.float32), np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)


def unit(v: Points) -> Points:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def facing(corners: Points) -> Points:
    return unit(np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]))


def distances(p: Points, corners: Points) -> Points:
    """From a point to triangles (n, 3, 3): to the plane above the triangle, else to the nearest edge."""
    edges = np.roll(corners, -1, axis=1) - corners
    share = ((p - corners) * edges).sum(-1) / (edges * edges).sum(-1)
    on_edges = corners + np.clip(share, 0, 1)[..., None] * edges
    found = np.linalg.norm(on_edges - p, axis=2).min(axis=1)
    normal = facing(corners)
    sides = (np.cross(edges, p - corners) * normal[:, None]).sum(-1)
    height = np.abs(((p - corners[:, 0]) * normal).sum(-1))
    return np.where((sides >= 0).all(axis=1), height, found)


def nearest(p: Points, corners: Points, allowed: npt.NDArray[np.bool_]) -> int:
    """The nearest triangle of those allowed; of all, where none is."""
    apart = distances(p, corners)
    return int(np.where(allowed, apart, np.inf).argmin() if allowed.any() else apart.argmin())


@pytest.mark.parametrize("one_chart", [False, True])
@pytest.mark.parametrize("seed", sample(range(4), every=4))
def test_every_corner_takes_the_nearest_triangle_that_faces_its_way(seed: int, one_chart: bool) -> None:
    """Or, with one chart, the nearest of the chart under its triangle's middle. Corners of one vertex in one
    chart share the nearest of what they found."""
    source, source_triangles = soup(300, 0.06, seed)
    charts = np.random.default_rng(seed).integers(0, 5, 300).astype(np.uint32)
    positions = soup(20, 0.3, 100 + seed)[0]
    triangles = np.random.default_rng(seed + 200).permuted(np.tile(np.arange(60), (3, 1)), axis=1)
    triangles = np.ascontiguousarray(triangles.T, np.uint32)
    triangles = triangles[[len(set(t)) == 3 for t in triangles.tolist()]]
    found, weights = project(source, source_triangles, charts, positions, triangles, one_chart=one_chart)

    corners = source.astype(np.float64)[source_triangles]
    normals = facing(corners)
    shared = defaultdict(list)
    for t, vertices in enumerate(triangles.tolist()):
        own = positions[vertices].astype(np.float64)
        same_way = normals @ facing(own) >= FACING
        middle = own.mean(axis=0)
        under = charts == charts[nearest(middle, corners, same_way)]
        for k, vertex in enumerate(vertices):
            inside = own[k] + INSET * (middle - own[k])
            hit = nearest(own[k], corners, under) if one_chart else nearest(inside, corners, same_way)
            shared[vertex, int(charts[hit])].append(
                (float(distances(own[k], corners[[hit]])[0]), hit, t * 3 + k)
            )
    for (vertex, _), hits in shared.items():
        p = positions[vertex].astype(np.float64)
        apart, hit, _ = min(hits)
        for _, _, corner in hits:
            assert found[corner] == hit
            foot = weights[corner] @ corners[hit]
            assert np.linalg.norm(foot - p) == pytest.approx(apart, abs=1e-12)
            assert (weights[corner] >= 0).all() and weights[corner].sum() == pytest.approx(1)
    assert max(map(len, shared.values())) > 1

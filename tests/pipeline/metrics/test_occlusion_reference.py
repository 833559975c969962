"""Brute force of occlusion finds what view factors say, and a planted error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from paradize.kernels.reference.occlusion import open_shares
from paradize.metrics import occlusion
from paradize.metrics.occlusion import cast_errors
from paradize.stages.occlusion import RAYS, mesh_occlusion
from tests.pipeline.shapes import grid, sphere
from tests.sweeps import sample

UP = np.array([[0.0, 1.0, 0.0]])
FAR = 1e4


def openness(corners: np.ndarray, *, reach: float = 1e6, cells: int = 512) -> float:
    """Of a point at the origin that looks along +y."""
    return float(open_shares(np.zeros((1, 3)), UP, UP, corners, reach=reach, cells=cells)[0])


def disc(radius: float, height: float, parts: int = 720) -> np.ndarray:
    angles = np.linspace(0, 2 * np.pi, parts + 1)
    ring = np.stack([radius * np.cos(angles), np.full(parts + 1, height), radius * np.sin(angles)], axis=1)
    middle = np.broadcast_to([0.0, height, 0.0], (parts, 3))
    return np.stack([middle, ring[:-1], ring[1:]], axis=1)


def wall(distance: float, height: float) -> np.ndarray:
    """Upright, as wide as the world."""
    a, b, c, d = ([distance, y, z] for y in (0.0, height) for z in (-FAR, FAR))
    return np.array([[a, b, c], [b, d, c]])


@pytest.mark.parametrize(
    ("radius", "height"), sample([(1.0, 1.0), (0.3, 1.0), (5.0, 0.5), (0.05, 0.7)], every=2)
)
def test_a_disc_overhead_hides_its_view_factor(radius: float, height: float) -> None:
    assert openness(disc(radius, height)) == pytest.approx(1 - radius**2 / (radius**2 + height**2), abs=1e-3)


@pytest.mark.parametrize(("distance", "height"), [(1.0, 1.0), (0.1, 2.0), (3.0, 0.4)])
def test_a_wall_beside_a_floor_hides_its_view_factor(distance: float, height: float) -> None:
    hidden = 0.5 * (1 - distance / np.hypot(distance, height))
    assert openness(wall(distance, height)) == pytest.approx(1 - hidden, abs=1e-3)


def test_what_lies_beyond_the_reach_or_behind_hides_nothing() -> None:
    assert openness(disc(1.0, 1.0), reach=0.99) == 1.0
    assert openness(disc(1.0, -1.0)) == 1.0
    within = openness(disc(3.0, 1.0), reach=2.0)  # as far as a cap of half-angle 60 degrees: sin^2 = 3/4
    assert within == pytest.approx(0.25, abs=1e-3)


def test_a_triangle_that_passes_behind_the_point_hides_what_is_before_it() -> None:
    """It spans most of the sky, so that no cone holds it."""
    tilted = np.array([[[-FAR, 0.2 - FAR, -FAR], [-FAR, 0.2 - FAR, FAR], [FAR, 0.2 + FAR, 0.0]]])
    assert openness(tilted) == pytest.approx(0.5 * (1 - np.cos(np.pi / 4)), abs=2e-3)


def test_a_planted_error_is_found() -> None:
    mesh = grid(12, height=0.3)
    made = mesh_occlusion(mesh, mesh.triangles, mesh.triangles, height=48, width=48, reach=0.5, rays=256)
    args = (mesh, mesh.triangles, mesh.triangles)
    honest = cast_errors(made.values, *args, reach=0.5, samples=512)
    assert honest["cast_mean"] <= honest["cast_p99"] <= honest["cast_max"] < 0.05
    planted = cast_errors(made.values - np.float32(0.1), *args, reach=0.5, samples=256)
    assert planted["cast_mean"] == pytest.approx(0.1, abs=0.01)
    shifted = cast_errors(np.roll(made.values, 9, axis=1), *args, reach=0.5, samples=256)
    assert shifted["cast_p99"] > 3 * honest["cast_p99"]


def test_texels_of_triangles_that_cross_the_edge_of_the_map_are_judged_too() -> None:
    """As those of a layout that crosses none, of which the map is moved as far."""
    ground = grid(1)
    assert ground.uvs is not None
    moved = replace(ground, uvs=ground.uvs + np.float32(0.5))
    meshes = (ground, ground.triangles, ground.triangles), (moved, ground.triangles, ground.triangles)
    values = np.ones((32, 32), np.float32)
    assert cast_errors(values, *meshes[1], reach=0.5)["cast_max"] < 1e-3
    values[:16, :16] = 0.0  # beyond both edges
    values[:16, 16:] = 0.5  # beyond one of them
    whole, crossing = (
        cast_errors(shades, *mesh, reach=0.5)
        for shades, mesh in zip((np.roll(values, (16, 16), (0, 1)), values), meshes, strict=True)
    )
    assert crossing["cast_max"] > 0.99
    assert crossing["cast_mean"] == pytest.approx(whole["cast_mean"], abs=1e-6)


def test_many_layers_on_the_same_texels_are_sampled_within_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """All triangles of a mesh on one spot of the map: each texel has as many places."""
    mesh = sphere(10)
    assert mesh.uvs is not None
    spot = np.array([[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]], np.float32)
    corners = mesh.triangles.reshape(-1)
    assert mesh.normals is not None
    layers = replace(
        mesh,
        positions=mesh.positions[corners],
        normals=mesh.normals[corners],
        uvs=np.tile(spot, (len(mesh.triangles), 1)),
        triangles=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
    )
    counts = []

    def counted(points: np.ndarray, *more: np.ndarray, **settings: float) -> np.ndarray:
        counts.append(len(points))
        return open_shares(points, *more, **settings)  # type: ignore[arg-type]

    monkeypatch.setattr(occlusion, "open_shares", counted)
    errors = cast_errors(
        np.ones((32, 32), np.float32), layers, layers.triangles, layers.triangles, reach=0.5, samples=1200
    )
    assert errors["cast_max"] == 0.0 and 900 <= counts[0] <= 1200


@pytest.mark.deep
def test_tiers_are_in_the_order_of_their_errors() -> None:
    for mesh in (grid(12, height=0.3), sphere(8)):
        inside = replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))
        assert mesh.normals is not None
        inside = replace(inside, normals=-mesh.normals)
        found = []
        for rays in RAYS.values():
            made = mesh_occlusion(
                inside, inside.triangles, inside.triangles, height=48, width=48, reach=0.4, rays=rays
            )
            found.append(cast_errors(made.values, inside, inside.triangles, inside.triangles, reach=0.4))
        for name in ("cast_mean", "cast_p99"):
            values = [one[name] for one in found]
            assert values == sorted(values, reverse=True), (name, values)

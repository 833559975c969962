"""Occlusion of a mesh: dark in corners, light on what is round, and the same wherever the model stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.stages.occlusion import mesh_occlusion
from tests.pipeline.shapes import grid, sphere


def cast(mesh: Mesh, *, size: int = 32, reach: float = 1.0, blocking: Mesh | None = None) -> np.ndarray:
    by = (blocking or mesh).triangles
    return mesh_occlusion(mesh, mesh.triangles, by, height=size, width=size, reach=reach, rays=256).values


def corner() -> Mesh:
    """A floor (left half of the map) and a wall of the same size (right half) that stands on its edge."""
    floor = grid(4)
    assert floor.uvs is not None
    x, _, z = floor.positions.T
    upright = np.stack([np.zeros_like(x), x, z], axis=1)
    wall_normals = np.tile(np.array([1, 0, 0], np.float32), (len(x), 1))
    half = np.array([0.5, 1.0], np.float32)
    assert floor.normals is not None
    return replace(
        floor,
        positions=np.concatenate([floor.positions, upright]).astype(np.float32),
        normals=np.concatenate([floor.normals, wall_normals]),
        uvs=np.concatenate([floor.uvs * half, floor.uvs * half + [0.5, 0.0]]).astype(np.float32),
        triangles=np.concatenate([floor.triangles, floor.triangles[:, ::-1] + len(x)]).astype(np.uint32),
        groups=(),
    )


def test_what_is_flat_or_round_is_lit_all_over() -> None:
    for mesh in (grid(4), sphere(12)):
        assert (cast(mesh) == 1.0).all()


def test_a_corner_is_dark_where_floor_and_wall_meet() -> None:
    values = cast(corner())
    floor, wall = values[:, :16], values[:, 16:]
    assert np.abs(floor - wall).mean() < 0.01
    across = floor.mean(axis=0)
    assert (np.diff(across) > 0).all()
    assert 0.5 < across[0] < 0.6 and across[-1] > 0.8


def test_light_is_held_back_within_reach_alone() -> None:
    values = cast(corner(), reach=0.1)  # of a diagonal of 1.7
    assert (values[:, 8:16] == 1.0).all() and values[:, 0].max() < 0.75


def test_see_through_triangles_hold_back_no_light() -> None:
    mesh = corner()
    floor = replace(mesh, triangles=mesh.triangles[: len(mesh.triangles) // 2])
    assert (cast(mesh, blocking=floor)[:, :16] == 1.0).all()
    assert cast(mesh)[:, :16].min() < 0.6


@pytest.mark.parametrize("change", ["far", "small", "large"])
def test_neither_place_nor_size_of_the_model_matters(change: str) -> None:
    mesh = corner()
    scale, move = {"far": (1.0, 1024.0), "small": (2.0**-40, 0.0), "large": (2.0**60, 0.0)}[change]
    other = replace(mesh, positions=(mesh.positions * np.float32(scale) + np.float32(move)))
    assert np.abs(cast(other) - cast(mesh)).max() <= (0.02 if change == "far" else 0.0)


def test_mirrored_halves_on_the_same_texels_hold_the_mean_of_both() -> None:
    """The floor of a corner, and one without a wall, on the same texels."""
    mesh = corner()
    assert mesh.uvs is not None and mesh.normals is not None
    count = len(mesh.positions) // 2
    free = mesh.positions[:count] + np.array([5, 0, 0], np.float32)
    both = replace(
        mesh,
        positions=np.concatenate([mesh.positions, free]),
        normals=np.concatenate([mesh.normals, mesh.normals[:count]]),
        uvs=np.concatenate([mesh.uvs, mesh.uvs[:count]]),
        triangles=np.concatenate(
            [mesh.triangles, mesh.triangles[: len(mesh.triangles) // 2] + np.uint32(2 * count)]
        ),
    )
    made = mesh_occlusion(both, both.triangles, both.triangles, height=32, width=32, reach=0.3, rays=256)
    diagonal = np.linalg.norm(np.ptp(mesh.positions, axis=0)) / np.linalg.norm(np.ptp(both.positions, axis=0))
    alone = cast(mesh, reach=0.3 / diagonal)
    assert np.abs(made.values[:, :16] - (alone[:, :16] + 1.0) / 2).max() < 0.02
    assert 0.4 < made.shared <= 0.5


def test_a_model_turned_inside_out_is_said_to_be_dark() -> None:
    ball = sphere(12)
    assert ball.normals is not None
    turned = replace(ball, triangles=np.ascontiguousarray(ball.triangles[:, ::-1]), normals=-ball.normals)
    made = mesh_occlusion(turned, turned.triangles, turned.triangles, height=16, width=16, reach=1.0, rays=64)
    assert made.dark == 1.0


def test_uvs_that_repeat_are_refused() -> None:
    mesh = grid(4)
    assert mesh.uvs is not None
    many = replace(mesh, uvs=mesh.uvs * np.float32(30))
    with pytest.raises(BakeError, match="too often"):
        cast(many)


def test_light_comes_to_the_side_that_the_normals_are_on_whatever_the_winding() -> None:
    mesh = corner()
    turned = replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))
    assert np.abs(cast(turned) - cast(mesh)).max() < 0.05

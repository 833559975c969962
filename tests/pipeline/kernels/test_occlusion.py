"""The kernels that cast rays: no bit depends on threads or the CPU's width, and nothing leaks."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from paradize.kernels import maps
from paradize.kernels.occlusion import Blockers, has_width, places
from paradize.kernels.reference.occlusion import open_shares
from tests.pipeline.shapes import cube, grid, sphere

F32 = npt.NDArray[np.float32]
WIDTHS = [width for width in (1, 2, 3) if has_width(width)]


def soup(count: int, seed: int = 3) -> tuple[F32, npt.NDArray[np.uint32]]:
    """Triangles in the unit cube, each with vertices of its own."""
    random = np.random.default_rng(seed)
    corners = random.random((count, 1, 3)) + 0.1 * random.normal(size=(count, 3, 3)) - 0.5
    return corners.reshape(-1, 3).astype(np.float32), np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)


def points(count: int, seed: int = 7) -> tuple[F32, F32]:
    """Places in the unit cube and unit vectors."""
    random = np.random.default_rng(seed)
    ways = random.normal(size=(count, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return (random.random((count, 3)) - 0.5).astype(np.float32), ways.astype(np.float32)


def shares(blockers: Blockers, reach: float = 0.4, count: int = 300, **more: int) -> F32:
    at, ways = points(count)
    return blockers.open_shares(at, ways, ways, np.arange(count, dtype=np.uint32), 64, reach=reach, **more)


@pytest.mark.parametrize("rays", [16, 64, 256])
def test_every_width_and_number_of_threads_gives_the_same_bits(rays: int) -> None:
    blockers = Blockers(*soup(400), rays)
    wanted = shares(blockers, width=1, threads=1)
    assert 0.05 < wanted.mean() < 0.95
    for width in WIDTHS:
        for threads in (1, 5):
            assert np.array_equal(shares(blockers, width=width, threads=threads), wanted)


def test_the_tree_hides_no_triangle() -> None:
    """The order of triangles, which makes another tree, changes no ray."""
    positions, triangles = soup(2000)
    wanted = shares(Blockers(positions, triangles, 64))
    assert np.array_equal(shares(Blockers(positions, triangles[::-1], 64)), wanted)


def test_rays_find_what_brute_force_finds() -> None:
    positions, triangles = soup(400)
    at, ways = (rows.astype(np.float64) for rows in points(300))
    truth = open_shares(at, ways, ways, positions[triangles].astype(np.float64), reach=0.4, cells=128)
    off = [
        np.abs(shares(Blockers(positions, triangles, rays)) - truth).mean() for rays in (16, 64, 256, 1024)
    ]
    assert off == sorted(off, reverse=True)
    assert off[0] < 0.08 and off[-1] < 0.004


def test_from_inside_a_closed_surface_no_ray_gets_out() -> None:
    """Not along an edge, and not through a corner."""
    for mesh, scale in ((cube(), 1.0), (sphere(12), 0.5)):
        middle = mesh.positions.mean(axis=0)
        blockers = Blockers((mesh.positions - middle) * np.float32(scale), mesh.triangles, 1024)
        count = 64
        ways = np.eye(3, dtype=np.float32)[np.arange(count) % 3]
        inside = np.zeros((count, 3), np.float32)
        found = blockers.open_shares(inside, ways, ways, np.arange(count, dtype=np.uint32), 8, reach=9.0)
        assert not found.any()


def test_light_from_below_the_face_does_not_count() -> None:
    """Seen past its own triangle, all of the half of the sky that is left is open."""
    ground = grid(1)
    leaning = np.array([[1.0, 1.0, 0.0]], np.float32) / np.float32(np.sqrt(2.0))
    place, up = np.array([[0.5, 1e-5, 0.5]], np.float32), np.array([[0.0, 1.0, 0.0]], np.float32)
    blockers, first = Blockers(ground.positions, ground.triangles, 256), np.zeros(1, np.uint32)
    assert blockers.open_shares(place, leaning, up, first, 1, reach=1.0)[0] == 1.0
    assert blockers.open_shares(place, leaning, leaning, first, 1, reach=1.0)[0] < 0.9


def test_four_texels_together_know_more_than_one_with_as_many_rays() -> None:
    """A block of 8 x 8 texels shares a set of 64 times as many directions: the mean over it is far nearer."""
    wall = np.array([[0.1, -5, -5], [0.1, -5, 5], [0.1, 5, 0]], np.float32)
    blockers = Blockers(wall, np.array([[0, 1, 2]], np.uint32), 16)
    place, up = np.zeros((64, 3), np.float32), np.tile(np.array([[0, 1, 0]], np.float32), (64, 1))
    found = blockers.open_shares(place, up, up, np.arange(64, dtype=np.uint32), 8, reach=20.0).reshape(8, 8)
    truth = open_shares(
        place[:1].astype(float), up[:1].astype(float), up[:1].astype(float), wall[None].astype(float),
        reach=20.0, cells=1024,
    )[0]  # fmt: skip
    quads = found.reshape(4, 2, 4, 2).mean(axis=(1, 3))
    assert np.abs(found - truth).mean() > 1.5 * np.abs(quads - truth).mean()
    assert abs(found.mean() - truth) < 0.002


def test_a_texel_shows_the_triangle_under_its_centre_and_else_the_nearest_point_of_one_that_touches_it() -> (
    None
):
    mesh = sphere(6)
    assert mesh.uvs is not None
    ids = np.arange(len(mesh.triangles), dtype=np.int32)
    touched = maps.rasterise(mesh.uvs, mesh.triangles, ids, height=24, width=40)
    found = places(mesh.uvs, mesh.triangles, touched)
    assert {*found.texel.tolist()} == {*np.flatnonzero(touched >= 0).tolist()}
    assert (found.weights >= 0).all() and np.allclose(found.weights.sum(axis=1), 1.0)
    corners = mesh.uvs[mesh.triangles[found.triangle]].astype(np.float64) * [40, 24]
    at = (corners * found.weights[:, :, None]).sum(axis=1)
    centres = np.stack([found.texel % 40, found.texel // 40], axis=1) + 0.5
    assert np.abs(at - centres).max() < 1.0
    assert found.shared == 0


def test_texels_that_several_triangles_show_have_a_place_on_each_of_them() -> None:
    ground = grid(4)
    assert ground.uvs is not None
    twice = np.concatenate([ground.triangles, ground.triangles])
    touched = maps.rasterise(ground.uvs, twice, np.arange(len(twice), dtype=np.int32), height=16, width=16)
    found = places(ground.uvs, twice, touched)
    inside = np.bincount(found.texel, minlength=256)
    assert inside.min() == 2 and found.shared > 0.8 * 256 - 64
    thrice = np.concatenate([twice, ground.triangles])
    assert places(ground.uvs, thrice, touched).shared == found.shared  # texels, however many show them
    for shift in (-3, -1, 2):  # UVs repeat
        assert np.array_equal(places(ground.uvs + np.float32(shift), twice, touched).texel, found.texel)
    many = np.tile(ground.triangles, (40, 1))
    touched = np.zeros((16, 16), np.int32)
    with pytest.raises(ValueError, match="overlap"):
        places(ground.uvs, many, touched)

"""How far a texture slid: cases whose answer is known."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from paradize.data import Mesh
from paradize.kernels.reference import Shading, Surface
from paradize.metrics.mapped_normal import uv_shift
from paradize.stages.lod import simplify
from paradize.tiers import SEAM_SIMPLIFIERS
from tests.pipeline.shapes import grid, sphere
from tests.sweeps import sample


def uvs_of(mesh: Mesh) -> np.ndarray:
    assert mesh.uvs is not None
    return mesh.uvs


@pytest.mark.parametrize("slid", [0.0, 0.01, 0.2])
def test_a_texture_that_slid_is_told_by_how_far_on_the_surface(slid: float) -> None:
    """Half of a ground of 1 x 1 metres, so that what it shows is somewhere in the whole."""
    ground = grid(16)
    half = ground.triangles[ground.positions[ground.triangles][:, :, 0].max(axis=1) <= 0.5]
    uvs = (uvs_of(ground) + np.float32([slid, 0])).astype(np.float32)
    result = uv_shift(ground, replace(ground, uvs=uvs, triangles=half, groups=()))
    assert result["uv_shift_p99"] == pytest.approx(slid / np.sqrt(2), rel=0.01, abs=1e-6)
    assert result["uv_shift_max"] == pytest.approx(slid / np.sqrt(2), rel=0.01, abs=1e-6)


def test_a_surface_of_one_colour_of_a_palette_slides_nowhere() -> None:
    """Many places show the same texel: the nearest counts."""
    for corner in ((0.25, 0.75), (0.9, 0.1)):
        fine, coarse = (
            replace(ball, uvs=np.broadcast_to(np.float32(corner), (len(ball.positions), 2)).copy())
            for ball in (sphere(16), sphere(5))
        )
        assert uv_shift(fine, coarse)["uv_shift_max"] < 0.05  # what the surfaces themselves lie apart


def test_a_wrong_colour_of_a_palette_is_told() -> None:
    """Two halves show two texels; the level shows the other one."""
    ground = grid(8)
    left = ground.positions[:, :1] < 0.5
    two = np.where(left, np.float32([[0.1, 0.5]]), np.float32([[0.9, 0.5]])).astype(np.float32)
    other = np.where(left, np.float32([[0.9, 0.5]]), np.float32([[0.1, 0.5]])).astype(np.float32)
    result = uv_shift(replace(ground, uvs=two), replace(ground, uvs=other))
    assert result["uv_shift_p99"] > 0.3
    assert uv_shift(replace(ground, uvs=two), replace(ground, uvs=two))["uv_shift_max"] < 1e-6


@pytest.mark.parametrize("method", SEAM_SIMPLIFIERS)
def test_a_texture_that_is_held_slides_less_by_every_method(method: str) -> None:
    ball = sphere(32)
    loose, held = (
        uv_shift(ball, simplify(ball, len(ball.triangles) // 8, method, uv_weight=weight).mesh)[
            "uv_shift_p99"
        ]
        for weight in (1.0, 16.0)
    )
    assert held < 0.8 * loose


@pytest.mark.parametrize(
    ("unit", "texture"), sample(product([0.3, 40.0, 0.0], ["torn", "far", "smooth"]), every=9)
)
def test_the_search_finds_the_least_of_all_triangles(texture: str, unit: float) -> None:
    """To the bit, whatever the texture coordinates: the same as of each triangle alone."""
    random = np.random.default_rng(7)
    ball, coarse = sphere(8), sphere(5)
    uvs, wanted = uvs_of(ball), uvs_of(coarse)
    if texture == "torn":  # each triangle shows a part of its own
        ball = replace(
            ball,
            positions=ball.positions[ball.triangles.reshape(-1)],
            triangles=np.arange(ball.triangles.size, dtype=np.uint32).reshape(-1, 3),
        )
        uvs = random.random((len(ball.positions), 2), np.float32)
    if texture == "far":
        wanted = wanted + np.float32([3.0, -2.0])

    def shading(mesh: Mesh, uvs: np.ndarray, triangles: np.ndarray) -> Shading:
        return Shading(
            Surface(mesh.positions, triangles), np.zeros_like(mesh.positions), None, uvs, triangles
        )

    whole = shading(ball, uvs, ball.triangles)
    alone = [shading(ball, uvs, ball.triangles[k : k + 1]) for k in range(len(ball.triangles))]
    for k in range(0, len(coarse.triangles), 6):
        seen = shading(coarse, wanted, coarse.triangles[k : k + 1])
        least = min(seen.shift_from(one, unit=unit, samples=1, threads=1)[2] for one in alone)
        for threads in (1, 3):
            assert seen.shift_from(whole, unit=unit, samples=1, threads=threads)[2] == least

"""How far a texture slid: cases whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from paradize.data import Mesh
from paradize.metrics.mapped_normal import uv_shift
from paradize.stages.lod import METHODS, simplify
from tests.pipeline.shapes import grid, sphere


def uvs_of(mesh: Mesh) -> np.ndarray:
    assert mesh.uvs is not None
    return mesh.uvs


@pytest.mark.parametrize("slid", [0.0, 0.01, 0.2])
def test_a_texture_that_slid_is_told_by_how_far_on_the_surface(slid: float) -> None:
    """Half of a ground of 1 x 1 metres, so that what it shows is somewhere in the whole."""
    ground = grid(16)
    half = ground.triangles[ground.positions[ground.triangles][:, :, 0].max(axis=1) <= 0.5]
    uvs = (uvs_of(ground) + np.float32([slid, 0])).astype(np.float32)
    told = uv_shift(ground, replace(ground, uvs=uvs, triangles=half, groups=()))
    assert told["uv_shift_p99"] == pytest.approx(slid / np.sqrt(2), rel=0.01, abs=1e-6)
    assert told["uv_shift_max"] == pytest.approx(slid / np.sqrt(2), rel=0.01, abs=1e-6)


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
    told = uv_shift(replace(ground, uvs=two), replace(ground, uvs=other))
    assert told["uv_shift_p99"] > 0.3
    assert uv_shift(replace(ground, uvs=two), replace(ground, uvs=two))["uv_shift_max"] < 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_a_texture_that_is_held_slides_less_by_every_method(method: str) -> None:
    ball = sphere(32)
    loose, held = (
        uv_shift(ball, simplify(ball, len(ball.triangles) // 8, method, uv_weight=weight).mesh)[
            "uv_shift_p99"
        ]
        for weight in (1.0, 16.0)
    )
    assert held < 0.8 * loose

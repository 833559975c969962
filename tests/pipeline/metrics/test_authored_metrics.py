"""The reference of drawn normals: every level against numpy, islands, a known error found again, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from paradize.data import AuthoredNormals, Texture
from paradize.kernels.reference import maps as reference_maps
from paradize.metrics import levels
from tests.pipeline import map_truth as truth
from tests.pipeline.metrics.test_map_metrics import SHAPES, near
from tests.pipeline.stages.test_authored import hills


def some_normals(rows: int, columns: int) -> np.ndarray:
    v = np.random.default_rng(7).normal(size=(rows, columns, 3))
    v[:, :, 2] = np.abs(v[:, :, 2])
    return np.asarray(v / np.linalg.norm(v, axis=2, keepdims=True), np.float32)


def chain_of(normals: np.ndarray, count: int) -> list[np.ndarray]:
    """Means (h, w, 3) of unit vectors at every level."""
    wide = normals.astype(np.float64)
    wide /= np.linalg.norm(wide, axis=2, keepdims=True)
    return [truth.mean(wide, k) for k in range(count)]


@pytest.mark.parametrize("shape", SHAPES)
def test_drawn_normals_of_every_level_are_held_to_their_means(shape: tuple[int, int]) -> None:
    normals, texture = some_normals(*shape), truth.random_texture("BC5_SNORM", *shape)
    chain = [truth.normalised(level) for level in chain_of(normals, len(texture.levels))]
    near(levels.normal_levels(texture, AuthoredNormals(normals)), truth.angles(texture, chain))


def test_texels_whose_area_leaves_the_islands_are_not_measured() -> None:
    shape = (36, 52)
    normals, texture = some_normals(*shape), truth.random_texture("RG8_SNORM", *shape)
    islands = np.full(shape, -1, np.int32)
    islands[2:20, 3:22], islands[4:32, 22:40] = 0, 1
    chain = [truth.normalised(level) for level in chain_of(normals, len(texture.levels))]
    inside = (islands >= 0).astype(np.float64)[:, :, None]
    masks = [truth.mean(inside, k)[:, :, 0] > 1 - 1e-9 for k in range(len(texture.levels))]
    found = levels.normal_levels(texture, AuthoredNormals(normals, islands))
    near(found, truth.angles(texture, chain, masks))


@pytest.mark.parametrize("shape", [(16, 64), (37, 53)])
def test_gloss_beside_drawn_normals_is_wider_by_what_their_means_lose(shape: tuple[int, int]) -> None:
    normals, texture = some_normals(*shape), truth.random_texture("RG8_UNORM", *shape)
    gloss = np.random.default_rng(2).random((*shape, 2), np.float32)
    squared = (1.0 - gloss[:, :, 1:].astype(np.float64)) ** 4
    wanted = []
    for k, means in enumerate(chain_of(normals, len(texture.levels))):
        r = np.maximum(np.linalg.norm(means, axis=2, keepdims=True), 1e-6)
        lost = 2 * np.maximum(0, 1 - r * r) / (r * (3 - r * r)) if k else 0.0
        smooth = 1 - np.minimum(1.0, truth.mean(squared, k) + lost) ** 0.25
        exact = np.concatenate([truth.mean(gloss[:, :, :1].astype(np.float64), k), smooth], axis=2)
        wanted.append(truth.differences(truth.decode_texels(texture, k), exact))
    found = levels.gloss_levels(texture, gloss, AuthoredNormals(normals))
    near([{key: one[key] for key in ("psnr_db", "p99", "max")} for one in found], wanted)


def test_a_turn_of_one_degree_is_found_again() -> None:
    exact = hills(64, 64).astype(np.float64)
    side = np.cross(exact, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side, axis=2, keepdims=True)
    turned = np.cos(np.radians(1)) * exact + np.sin(np.radians(1)) * side
    codes = np.rint(turned[:, :, :2] * 32767).astype("<i2")
    texture = Texture("RG16_SNORM", 64, 64, (codes.tobytes(),))
    (found,) = levels.normal_levels(texture, AuthoredNormals(hills(64, 64)))
    assert found["mean_deg"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("vectors", "islands", "words"),
    [
        (np.zeros((2, 2), np.float32), None, "expected"),
        (np.full((2, 2, 3), np.nan, np.float32), None, "not finite"),
        (np.ones((2, 2, 3), np.float32), np.zeros((3, 2), np.int32), "islands of"),
    ],
)
def test_vectors_that_are_none_are_refused(
    vectors: np.ndarray, islands: np.ndarray | None, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        reference_maps.Vectors(vectors, islands=islands)


def test_vectors_beside_a_texture_of_another_size_are_refused() -> None:
    texture = truth.random_texture("BC5_SNORM", 8, 8)
    with pytest.raises(ValueError, match="beside"):
        levels.normal_levels(texture, AuthoredNormals(some_normals(8, 4)))

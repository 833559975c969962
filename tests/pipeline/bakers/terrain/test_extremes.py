"""Terrain at its ends: shapes that break meshers, heights and sizes of any scale, files of every kind."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from paradize.bakers.terrain.mesh import bake_terrain
from paradize.data import Heightfield
from paradize.errors import SourceError
from paradize.metrics.terrain import terrain_error
from paradize.readers.heightmap import read_heightmap
from paradize.scene.baker_settings import TerrainSettings
from paradize.stages.terrain import terrain_mesh
from tests.sweeps import CORPUS_DEEP, sample

F32 = npt.NDArray[np.float32]
TIERS = ("fast", "balanced", "exact")


def cone(side: int) -> npt.NDArray[np.float64]:
    z, x = np.mgrid[0:side, 0:side] - side // 2
    return np.asarray(np.maximum(0.0, 10.0 - np.hypot(x, z)))


def shapes() -> dict[str, npt.NDArray[np.float64]]:
    rng = np.random.default_rng(5)
    spikes = np.zeros((40, 50))
    spikes[0, 0] = spikes[39, 20] = spikes[17, 49] = spikes[20, 20] = 9.0
    return {
        "constant": np.full((33, 40), 5.0),
        "plane": np.add.outer(np.arange(37) * 0.5, np.arange(40) * -0.25),
        "spikes": spikes,
        "hole": -spikes,
        "step": np.repeat([[0.0] * 20 + [4.0] * 21], 30, axis=0),
        "slanted step": np.tri(45, 45) * 3.0,
        "cone": cone(41),
        "chess": np.indices((32, 33)).sum(axis=0) % 2 * 1.0,
        "2 x 2": np.array([[0.0, 1.0], [2.0, -1.0]]),
        "2 x N": rng.normal(size=(2, 70)),
        "N x 2": rng.normal(size=(70, 2)),
        "3 x N": rng.normal(size=(3, 200)),
        "noise": rng.normal(size=(50, 41)),
    }


def judged(field: Heightfield, bound_m: float, tier: str) -> float:
    """The true error of a mesh that has no hole, no flipped triangle and only finite numbers."""
    mesh = terrain_mesh(field, tolerance_m=bound_m, tier=tier)
    error = terrain_error(mesh, field)
    assert (error.holes, error.flipped) == (0, 0)
    for array in (mesh.positions, mesh.normals, mesh.tangents, mesh.uvs, mesh.uvs1):
        assert array is not None and np.isfinite(array).all()
    return error.max_m


@pytest.mark.parametrize("tier", TIERS)
@pytest.mark.parametrize("height", sample([1e-6, 1.0, 1e6], every=2))
@pytest.mark.parametrize("name", shapes())
def test_every_shape_keeps_its_bound_at_any_height(name: str, height: float, tier: str) -> None:
    """Whole-number spacing: x and z are exact, so only the mesh can err; 1e-13: the judge's own float64."""
    heights = (shapes()[name] * height).astype(np.float32)
    field = Heightfield(heights, heights.shape[1] - 1.0, heights.shape[0] - 1.0)
    for bound_m in (0.0, 0.01 * height, 0.3 * height):
        assert judged(field, bound_m, tier) <= bound_m + 1e-13 * height


@pytest.mark.parametrize("tier", TIERS)
@pytest.mark.parametrize("size_m", sample([1e-3, 1.0, 1e6], every=2))
@pytest.mark.parametrize("name", ["cone", "spikes", "noise", "2 x 2", "3 x N"])
def test_terrains_of_a_millimetre_and_of_1000_km_keep_their_bound(
    name: str, size_m: float, tier: str
) -> None:
    heights = (shapes()[name] * size_m * 1e-3).astype(np.float32)
    field = Heightfield(heights, size_m, size_m)
    bound_m = 1e-4 * size_m
    # A vertex's x is float32: a cliff between two pixels stands as far aside as that rounds.
    cliff = max(float(np.abs(np.diff(heights, axis=k)).max(initial=0.0)) for k in (0, 1))
    rounding = 2.0 * cliff * max(heights.shape) * 2.0**-24
    assert judged(field, bound_m, tier) <= bound_m + rounding


def heightmaps(sources: Path) -> list[Path]:
    names = [
        path for path in sorted((sources / "height").rglob("*")) if path.suffix in (".png", ".exr", ".tif")
    ]
    return [path for path in names if "rgb.png" not in path.name]


def falls(path: Path, field: Heightfield, tiers: tuple[str, ...]) -> None:
    reach = float(np.ptp(field.heights_m))
    for tier in tiers:
        errors = []
        for share in (0.1, 0.03, 0.01, 0.003, 0.0):
            error = judged(field, share * reach, tier)
            # The rounding of x and z to float32, at both ends of a slope of the whole reach between pixels.
            rounding = 2.1 * reach * max(field.heights_m.shape) * 2.0**-24
            assert error <= share * reach + rounding, (path, tier, share)
            errors.append(error)
        assert all(b <= a + rounding for a, b in itertools.pairwise(errors)), (path, tier, errors)


@pytest.mark.deep
def test_the_true_error_falls_with_the_asked_one_on_parts_of_heightmaps(sources: Path) -> None:
    paths = heightmaps(sources)
    assert len(paths) >= 6
    for path in paths:
        field, _ = read_heightmap(path, size_x_m=1024, size_z_m=1024, height_m=100)
        part = Heightfield(np.ascontiguousarray(field.heights_m[:120, :120]), 1024.0, 1024.0)
        falls(path, part, ("fast", "balanced"))


@pytest.mark.deep
def test_the_true_error_falls_with_the_asked_one_on_whole_heightmaps(sources: Path) -> None:
    for path in heightmaps(sources):
        field, _ = read_heightmap(path, size_x_m=1024, size_z_m=1024, height_m=100)
        falls(path, field, ("fast", "balanced"))


@CORPUS_DEEP
@pytest.mark.parametrize("tier", ["fast", "balanced"])
def test_every_heightmap_bakes_or_says_why_not(sources: Path, tier: str) -> None:
    """Greys and text grids bake, colours that encode heights are refused as such."""
    result = {"baked": 0, "refused": 0}
    for path in sorted((sources / "height").rglob("*")):
        if path.is_dir():
            continue
        settings = TerrainSettings(size_m=(1000, 1000), height_m=100, max_error_m=2.0)
        try:
            made = bake_terrain(path, settings, tier=tier)
        except SourceError as error:
            assert path.suffix == ".asc" or path.name.endswith("rgb.png"), error
            assert path.name in str(error)
            result["refused"] += 1
        else:
            assert made.max_error_m <= 2.0 and made.tier == tier
            result["baked"] += 1
    assert result["baked"] >= 6 and 1 <= result["refused"] <= 4

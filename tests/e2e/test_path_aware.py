"""The island's flight asks for less than half of what the bakers can make, and nobody sees the difference."""

from __future__ import annotations

from pathlib import Path

import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from tests.pipeline.full_bake import MOMENTS_S, frames_apart, full_bake, measure_sizes
from tests.places import ROOT


@pytest.mark.deep
def test_the_island_s_flight_looks_the_same_as_that_of_its_full_bake_and_takes_half(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = ROOT / "raw_assets" / "island.toml"
    assert not bake(scene, tmp_path / "path", BuildOptions()).errors
    assert not full_bake(scene, tmp_path / "full", BuildOptions()).errors
    sizes = measure_sizes(scene, tmp_path / "path", tmp_path / "full")
    assert sizes.share <= 0.5, sizes
    apart = frames_apart(tmp_path / "path", tmp_path / "full", MOMENTS_S, tmp_path)
    assert apart["flip_mean"] <= 1e-4, apart
    assert apart["flip_max"] <= 0.05, apart
    assert apart["psnr_db"] >= 60.0, apart

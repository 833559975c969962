"""The largest heightmap there may be goes into tiles within 6 GB of memory."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from tests.places import PEAK

BAKE = (
    PEAK
    + """
import json, sys
from dataclasses import asdict
from pathlib import Path
from paradize.bakers.terrain.tiles import bake_tiles
from paradize.scene.baker_settings import TileSettings
from paradize.scene.settings import EyePoint, Flight, TargetPoint
side = float(sys.argv[3])
ways = ((0.6, 0.0), (0.0, 0.6), (-0.6, 0.0), (0.0, -0.6))
eye = tuple(EyePoint(position=(a * side / 2, 0.18 * side, b * side / 2)) for a, b in ways)
target = tuple(TargetPoint(position=(b * side / 2, 0.1 * side, a * side / 2)) for a, b in ways)
flight = Flight(duration_s=240.0, fov_deg=52.0, near_m=1.0, far_m=2 * side, eye=eye, target=target)
sight = {"flight": asdict(flight), "viewport": [1920, 1080], "error_px": 1.0}
sight |= {"mirror_m": None, "water_m": None, "shadow": None, "sun": [0.0, 1.0, 0.0]}
made = bake_tiles(
    Path(sys.argv[1]), Path(sys.argv[2]),
    TileSettings(size_m=(side, side), height_m=0.2 * side, max_error_m=1.0, patch_px=256, sight=sight),
)
most = peak()
patches = made.tables["patches"]["level"]
sizes = [tile.file.stat().st_size for tile in made.tiles]
print(json.dumps({"peak": most, "patches": len(patches), "tiles": sizes}))
"""
)


def write_hills(path: Path, side: int) -> None:
    """A 16-bit picture of sums of smooth noise of many sizes, a band of rows at a time."""
    rng = np.random.default_rng(3)
    layers = []
    cells, share = 8, 1.0
    while cells <= side // 4:
        layers.append((cells, share, rng.standard_normal((cells + 2, cells + 2)).astype(np.float32)))
        cells, share = 2 * cells, 0.52 * share
    spec = oiio.ImageSpec(side, side, 1, "uint16")
    spec.attribute("png:compressionLevel", 1)
    out = oiio.ImageOutput.create(str(path))
    assert out and out.open(str(path), spec)
    for first in range(0, side, 256):
        last = min(first + 256, side)
        band = np.zeros((last - first, side), np.float32)
        for cells, share, noise in layers:
            (i, fi), (j, fj) = (
                _smooth(np.arange(*run) * cells / (side - 1), cells) for run in ((first, last), (0, side))
            )
            rows = noise[i] * (1 - fi[:, None]) + noise[i + 1] * fi[:, None]
            band += share * (rows[:, j] * (1 - fj) + rows[:, j + 1] * fj)
        codes = np.clip((band / 8 + 0.5) * 65535, 0, 65535).astype(np.uint16)
        assert out.write_scanlines(first, last, 0, np.ascontiguousarray(codes[:, :, None]))
    out.close()


def _smooth(at: np.ndarray, cells: int) -> tuple[np.ndarray, np.ndarray]:
    whole = np.minimum(at.astype(int), cells - 1)
    rest = (at - whole).astype(np.float32)
    return whole, rest * rest * (3 - 2 * rest)


@pytest.mark.parametrize(("side", "limit"), [(1025, 0.6e9), pytest.param(16385, 6e9, marks=pytest.mark.deep)])
def test_a_heightmap_goes_into_tiles_within_its_memory(tmp_path: Path, side: int, limit: float) -> None:
    write_hills(tmp_path / "hills.png", side)
    (tmp_path / "room").mkdir()
    call = [sys.executable, "-c", BAKE, tmp_path / "hills.png", tmp_path / "room", str(side - 1)]
    report = json.loads(subprocess.run(call, capture_output=True, check=True, timeout=1800).stdout)
    assert report["peak"] < limit, report
    assert max(report["tiles"]) <= 64_000_000
    assert report["patches"] > 30

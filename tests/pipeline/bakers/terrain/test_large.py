"""The largest heightmap there may be goes into tiles within 6 GB of memory."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.made.hills import write_hills
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
flight_views = {"flight": asdict(flight), "viewport": [1920, 1080], "error_px": 1.0}
flight_views |= {"mirror_m": None, "water_m": None, "shadow": None, "sun": [0.0, 1.0, 0.0]}
made = bake_tiles(
    Path(sys.argv[1]), Path(sys.argv[2]),
    TileSettings(
        size_m=(side, side), height_m=0.2 * side, max_error_m=1.0, patch_px=256,
        flight_views=flight_views,
    ),
)
most = peak()
patches = made.tables["patches"]["level"]
sizes = [tile.file.stat().st_size for tile in made.tiles]
print(json.dumps({"peak": most, "patches": len(patches), "tiles": sizes}))
"""
)


@pytest.mark.parametrize(("side", "limit"), [(1025, 0.6e9), pytest.param(16385, 6e9, marks=pytest.mark.deep)])
def test_a_heightmap_goes_into_tiles_within_its_memory(tmp_path: Path, side: int, limit: float) -> None:
    write_hills(tmp_path / "hills.png", side)
    (tmp_path / "room").mkdir()
    call = [sys.executable, "-c", BAKE, tmp_path / "hills.png", tmp_path / "room", str(side - 1)]
    report = json.loads(subprocess.run(call, capture_output=True, check=True, timeout=1800).stdout)
    assert report["peak"] < limit, report
    assert max(report["tiles"]) <= 64_000_000
    assert report["patches"] > 30

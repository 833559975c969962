"""`check` finds a sun of the scene that is not where the sky's is, and says where that is."""

from __future__ import annotations

import hashlib
import re
from dataclasses import replace
from math import acos, degrees, radians
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.checks.rules import Finding
from paradize.checks.skies import check_sky
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.scene.finest_views import sun_direction
from paradize.stages.cubemap import cube_mips, cut_faces, encode_cube
from tests.pipeline.bakers.test_panorama import panorama


def lit(*lights: tuple[list[float], float, float]) -> bytes:
    """A grey sky with discs: of each the direction to it, its light and its radius in degrees."""

    def paint(way: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        color = np.full((*way.shape[:-1], 3), 0.5)
        for toward, light, radius_deg in lights:
            color[way @ (np.array(toward) / np.linalg.norm(toward)) > np.cos(radians(radius_deg))] = light
        return color

    return encode_ktx2(encode_cube(cube_mips(cut_faces(panorama(paint, 256)))))


def sunny(toward: list[float], light: float = 20_000.0) -> bytes:
    return lit((toward, light, 0.75))


def finding(folder: Path, data: bytes, direction: list[float], **changes: Any) -> Finding | None:
    (folder / "sky.ktx2").write_bytes(data)
    entry = {"file": "sky.ktx2", "bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    sun = {"direction": direction, "color": [1.0, 0.9, 0.8], "intensity": 3.0}
    manifest = {"sun": sun, "sky": {"cubemap": "sky"}, "daytime": None, "artifacts": {"sky": entry}}
    found = list(check_sky(manifest | changes, folder, "scene.json"))
    assert len(found) <= 1
    return found[0] if found else None


def between_deg(a: list[float], b: list[float]) -> float:
    return degrees(acos(float(np.clip(np.dot(a, b), -1.0, 1.0))))


# Azimuth and elevation off the middles of all six faces; how far off the light of the scene is. Degrees.
PLACES = [
    (95.0, 25.0, 15.0), (-80.0, -20.0, 40.0), (20.0, 70.0, 90.0),
    (150.0, -60.0, 120.0), (170.0, 15.0, 170.0), (-25.0, -30.0, 60.0),
]  # fmt: skip


@pytest.mark.parametrize(("azimuth", "elevation", "turn"), PLACES)
def test_what_is_advised_points_at_the_sun_of_any_sky(
    tmp_path: Path, azimuth: float, elevation: float, turn: float
) -> None:
    toward = sun_direction(azimuth, elevation)
    sky = sunny(toward)
    axis = np.cross(toward, [0.3, 0.2, 0.9])
    axis /= np.linalg.norm(axis)
    elsewhere = np.cos(radians(turn)) * np.array(toward) + np.sin(radians(turn)) * np.cross(axis, toward)
    found = finding(tmp_path, sky, elsewhere.tolist())
    assert found and found.code == "PZ427" and found.artifact == "sky"
    assert float(found.what.split()[5]) == pytest.approx(turn, abs=2.0)
    advised = re.search(r"azimuth_deg = (\S+) and elevation_deg = (\S+) in \[sun\]", found.mend)
    assert advised
    assert between_deg(sun_direction(float(advised[1]), float(advised[2])), toward) < 1.0
    assert finding(tmp_path, sky, toward) is None


def test_skies_without_a_sun_and_scenes_without_one_are_left_alone(tmp_path: Path) -> None:
    west = sun_direction(270.0, 20.0)
    sky = sunny(sun_direction(90.0, 20.0))
    assert finding(tmp_path, sky, west)
    dark = {"direction": west, "color": [1.0, 1.0, 1.0], "intensity": 0.0}
    assert finding(tmp_path, sky, west, sun=dark) is None
    assert finding(tmp_path, sky, west, daytime={"keys": []}) is None
    assert finding(tmp_path, sky, west, sky=None) is None
    assert finding(tmp_path, sunny(west, light=1.0), sun_direction(90.0, 20.0)) is None
    assert finding(tmp_path, sky[:5000], west) is None
    texture = decode_ktx2(sky)
    assert texture.width > 64
    assert finding(tmp_path, encode_ktx2(replace(texture, levels=texture.levels[:1])), west) is None


def test_rooms_with_several_lamps_or_windows_have_no_sun(tmp_path: Path) -> None:
    west, north = sun_direction(270.0, 20.0), sun_direction(0.0, 40.0)
    lamp = (sun_direction(90.0, 20.0), 900.0, 3.0)
    assert finding(tmp_path, lit(lamp), west)
    assert finding(tmp_path, lit(lamp, (north, 400.0, 3.0)), west) is None
    assert finding(tmp_path, lit(lamp, (north, 45.0, 3.0)), west)  # 5 % as bright
    assert finding(tmp_path, lit(lamp, (sun_direction(93.0, 24.0), 400.0, 3.0)), west)  # of one lamp

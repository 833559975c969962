"""Distances along the camera's path, against samples of the surfaces and against turns by a matrix."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.checks.flights import _nearest_object, check_flight, distances, heights_at
from paradize.data import Heightfield, Lod, Mesh
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.tiles import TilePatch, encode_tiles
from paradize.placement import to_world
from paradize.scene.flight import plan_flight
from paradize.scene.motion import moved
from paradize.scene.settings import EyePoint, Flight, TargetPoint
from paradize.stages.terrain import terrain_mesh
from tests.pipeline.shapes import soup
from tests.player.synthetic import instance

F64 = npt.NDArray[np.float64]
FOV_DEG, WIDTH, HEIGHT = 60.0, 320, 180
MOMENTS = 240  # of a flight of 12 s


def samples(corners: F64, parts: int = 40) -> F64:
    """(n, 3): places spread over triangles (m, 3, 3)."""
    shares = [(i / parts, j / parts) for i in range(parts + 1) for j in range(parts + 1 - i)]
    b, c = np.array(shares).T[:, :, None, None]
    return ((1 - b - c) * corners[None, :, 0] + b * corners[None, :, 1] + c * corners[None, :, 2]).reshape(
        -1, 3
    )


def test_a_distance_is_that_of_the_nearest_sample() -> None:
    rng = np.random.default_rng(4)
    corners, places = rng.normal(size=(7, 3, 3)), 2.0 * rng.normal(size=(60, 3))
    corners[6, 2] = corners[6, 1]  # a triangle that is a line
    found = distances(places, corners)
    sampled = np.linalg.norm(places[:, None] - samples(corners)[None], axis=2).min(axis=1)
    assert (found <= sampled + 1e-12).all()
    assert np.allclose(found, sampled, atol=0.05)
    assert distances(np.zeros((1, 3)), np.array([[[-1.0, -1, 3], [2, -1, 3], [-1, 2, 3]]])) == pytest.approx(
        3.0
    )


def test_the_ground_at_a_place_is_the_highest_there_is() -> None:
    low = [(0.0, 1.0, 0.0), (0.0, 1.0, 8.0), (8.0, 9.0, 0.0)]  # y = 1 + x
    high = [(0.0, 5.0, 0.0), (0.0, 5.0, 2.0), (2.0, 5.0, 0.0)]
    mesh = soup(low + high, [(0, 1, 2), (3, 4, 5)])
    places = np.array([[0.5, 0.5], [3.0, 2.0], [2.0, 5.5], [7.0, 7.0], [-1.0, 3.0]])
    found = heights_at(mesh.positions.astype(np.float64), mesh.triangles, places)
    assert found[:3] == pytest.approx([5.0, 4.0, 3.0]) and np.isnan(found[3:]).all()


def flight_settings() -> Flight:
    eye = tuple(EyePoint(position=place) for place in ((9, 2, 0), (0, 2.5, 8), (-9, 3, 0), (0, 2, -8)))
    target = (TargetPoint(position=(0.0, 1.0, 0.0)),) * 4
    return Flight(duration_s=12.0, fov_deg=FOV_DEG, near_m=1.0, far_m=100.0, eye=eye, target=target)


def near_manifest(
    folder: Path, mesh: Mesh, *stands: dict[str, Any], motion: dict[str, Any] | None = None
) -> dict[str, Any]:
    glb = encode_glb((Lod(mesh, 0.0, 0.0),), "thing")
    (folder / "thing.glb").write_bytes(glb)
    return {
        "flight": plan_flight(flight_settings()).as_json(),
        "viewport": [WIDTH, HEIGHT],
        "terrain": None,
        "objects": [{"mesh": "thing_mesh", "materials": {}, "motion": motion, "instances": list(stands)}],
        "artifacts": {"thing_mesh": {"file": "thing.glb", "bytes": len(glb)}},
    }


def near_findings(
    folder: Path, mesh: Mesh, *stands: dict[str, Any], motion: dict[str, Any] | None = None
) -> list[str]:
    found = list(check_flight(near_manifest(folder, mesh, *stands, motion=motion), folder, "scene.json"))
    assert {finding.code for finding in found} <= {"PZ412"}
    return [f"{finding.count} times {finding.what} at {finding.place}" for finding in found]


@pytest.mark.parametrize("yaw_deg", [0.0, 70.0, -155.0])
@pytest.mark.parametrize("axes", [(0.25, 0.25, 0.25), (3.0, 3.0, 3.0), (-2.0, 1.0, 3.0)])
def test_an_object_comes_as_near_as_it_does_turned_scaled_and_moved(
    tmp_path: Path, yaw_deg: float, axes: tuple[float, float, float]
) -> None:
    """It stands aside of its own origin; the second instance is never near."""
    mesh = soup([(2.0, 0.0, 1.0), (2.1, 0.3, 1.0), (2.0, 0.1, 1.4)], [(0, 1, 2)])
    a = math.radians(yaw_deg)
    turn = np.array([[math.cos(a), 0, math.sin(a)], [0, 1, 0], [-math.sin(a), 0, math.cos(a)]])
    own = samples(mesh.positions.astype(np.float64)[mesh.triangles] * axes)
    position = np.array([-8.0, 2.2, 1.0]) - turn @ own.mean(axis=0)  # so that it lies beside the path
    stand = instance(position.tolist(), a) | {"scale": list(axes)}
    far = instance([0.0, 300.0, 0.0])
    planned = plan_flight(flight_settings())
    eyes = np.array([planned.view(12.0 * k / MOMENTS)[0] for k in range(MOMENTS)])
    apart = np.linalg.norm(eyes[:, None] - (own @ turn.T + position)[None], axis=2).min(axis=1)
    slope = math.tan(math.radians(FOV_DEG) / 2)
    reach = math.sqrt(1.0 + slope**2 * (1.0 + (WIDTH / HEIGHT) ** 2))
    assert np.abs(apart - reach).min() > 1e-3 and 5 < (apart < reach).sum() < 60
    (result,) = near_findings(tmp_path, mesh, stand, far)
    known = re.fullmatch(
        r"(\d+) times objects within ([\d.]+) m of the eye; the near plane reaches ([\d.]+) m"
        r" at flight at ([\d.]+) s, \(.*\)",
        result,
    )
    assert known is not None, result
    count, least, plane, second = map(float, known.groups())
    assert count == (apart < reach).sum()
    assert least == pytest.approx(apart.min(), rel=0.02)
    assert plane == pytest.approx(reach, rel=0.005)
    assert second == pytest.approx(12.0 * int(apart.argmin()) / MOMENTS, abs=0.051)


def test_of_a_path_under_ground_the_deepest_place_is_named(tmp_path: Path) -> None:
    """Ground that rises by 0.1 a metre along x: a plane, whose depth above the eye is known everywhere."""
    x = np.linspace(-20.0, 20.0, 5)
    field = Heightfield(np.tile(2.4 + 0.1 * x, (5, 1)).astype(np.float32), 40.0, 40.0)
    mesh = terrain_mesh(field, tolerance_m=0.0, sand_repeat=1.0, tier="exact")
    ((tile, _),) = encode_tiles([TilePatch(0, mesh, 0.0, finest=True)])
    (tmp_path / "ground.glb").write_bytes(tile)
    planned = plan_flight(flight_settings())
    manifest = {
        "flight": planned.as_json(),
        "viewport": [WIDTH, HEIGHT],
        "terrain": {"tiles": ["ground"]},
        "objects": [],
        "artifacts": {"ground": {"file": "ground.glb", "bytes": len(tile)}},
    }
    (found,) = (f for f in check_flight(manifest, tmp_path, "scene.json") if f.code == "PZ411")
    eyes = np.array([planned.view(12.0 * k / MOMENTS)[0] for k in range(MOMENTS)])
    depths = 2.4 + 0.1 * eyes[:, 0] - eyes[:, 1]
    deepest = int(depths.argmax())
    assert found.count == (depths > 0.0).sum() > 2
    assert found.what == f"the eye is {depths[deepest]:.3g} m under ground"
    assert found.place.startswith(f"flight at {12.0 * deepest / MOMENTS:.2f} s, ({eyes[deepest, 0]:.4g}, ")


def test_a_near_plane_that_would_do_is_named_where_depth_serves_it(tmp_path: Path) -> None:
    mesh = soup([(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.0, 0.1)], [(0, 1, 2)])
    x, y, z = plan_flight(flight_settings()).view(3.0)[0]
    for gap, named in ((0.5, True), (1e-3, False)):
        manifest = near_manifest(tmp_path, mesh, instance([x, y - gap, z]))
        (found,) = check_flight(manifest, tmp_path, "scene.json")
        words, *near = found.mend.split(", or write near_m = ")
        assert words == "move the waypoints of that second away" and bool(near) == named
        if near:
            manifest["flight"]["near_m"] = float(near[0])
            assert not list(check_flight(manifest, tmp_path, "scene.json"))


def test_what_stays_away_is_no_finding(tmp_path: Path) -> None:
    mesh = soup([(2.0, 0.0, 1.0), (2.1, 0.3, 1.0), (2.0, 0.1, 1.4)], [(0, 1, 2)])
    assert not near_findings(tmp_path, mesh, instance([0.0, 20.0, 0.0], 1.0, 2.0))


def test_an_object_that_moves_is_near_where_it_is_when_the_eye_comes(tmp_path: Path) -> None:
    """It goes round the eye's own way, half a round ahead; in step with the eye they would meet."""
    mesh = soup([(0.0, 0.0, 0.0), (0.1, 0.3, 0.0), (0.0, 0.1, 0.4)], [(0, 1, 2)])
    eye = plan_flight(flight_settings()).view(0.0)[0]
    still = {"rise_m": 0.0, "bank_rad": 0.0, "ahead": False, "pauses": 0, "pause_share": 0.0, "beat": None}
    round_it = still | {"laps": 1, "radius_m": [eye[0], 8.0]}
    middle = instance([0.0, eye[1], 0.0])
    (told,) = near_findings(tmp_path, mesh, middle, motion=round_it)
    assert "within 0" in told and "flight at " in told
    across = instance([-2.0 * eye[0], eye[1], 0.0])  # where it goes, the eye is elsewhere
    assert not near_findings(tmp_path, mesh, across, motion=round_it)


def test_a_moving_object_that_only_just_comes_within_reach_of_the_eye_is_found(tmp_path: Path) -> None:
    """A triangle goes round 5 m away from its position; its corner is 1 m farther out when it passes."""
    mesh = soup([(1.0, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)], [(0, 1, 2)])
    glb = encode_glb((Lod(mesh, 0.0, 0.0),), "thing")
    (tmp_path / "thing.glb").write_bytes(glb)
    motion = {"rise_m": 0.0, "bank_rad": 0.0, "ahead": False, "laps": 1, "radius_m": [5.0, 5.0], "pauses": 0}
    manifest = {
        "objects": [{"mesh": "thing_mesh", "motion": motion, "instances": [instance([0.0, 0.0, 0.0])]}],
        "artifacts": {"thing_mesh": {"file": "thing.glb", "bytes": len(glb)}},
    }
    for gap_m, wanted in ((0.2, 0.2), (0.6, np.inf)):
        eyes = np.tile([6.0 + gap_m, 0.0, 0.0], (8, 1))
        assert _nearest_object(manifest, tmp_path, eyes, 0.4).min() == pytest.approx(wanted, abs=1e-6)


def test_distances_are_those_of_all_triangles_of_all_instances_at_every_moment(tmp_path: Path) -> None:
    """Whatever boxes leave out: mirrored, turned and stretched instances, still and in motion."""
    rng = np.random.default_rng(6)
    x, y, z = 2.0 * rng.normal(size=(3, 30))
    mesh = soup(
        list(zip(x + 3.0, y, z + 1.0, strict=True)), [(3 * k, 3 * k + 1, 3 * k + 2) for k in range(10)]
    )
    glb = encode_glb((Lod(mesh, 0.0, 0.0),), "thing")
    (tmp_path / "thing.glb").write_bytes(glb)
    corners = mesh.positions.astype(np.float64)[mesh.triangles]
    stands = [
        instance([1.0, 0.0, 2.0], 1.0),
        instance([-2.0, 1.0, 0.0], 4.0) | {"scale": [-0.4, 4.0, 1.0]},
        instance([-13.0, 2.0, 0.0]) | {"scale": [3.0, -3.0, -0.3]},  # its corners reach far beyond its own
    ]
    motion = {"rise_m": 1.0, "bank_rad": 0.3, "ahead": True, "laps": 3, "radius_m": [4.0, 2.0]}
    motion |= {"pauses": 0, "pause_share": 0.0, "beat": None}
    item = {"mesh": "thing_mesh", "materials": {}, "instances": stands}
    manifest = {
        "objects": [item | {"motion": None}, item | {"motion": motion}],
        "artifacts": {"thing_mesh": {"file": "thing.glb", "bytes": len(glb)}},
    }
    eyes, reach = 5.0 * np.sin(np.cumsum(0.02 * rng.normal(size=(200, 3)) + 0.02, axis=0)), 0.4
    nearest = np.full(len(eyes), np.inf)
    for k, stand in enumerate(stands):
        for i, eye in enumerate(eyes):
            for now in (stand, moved(stand, motion, k, i / len(eyes))):
                world = np.stack(to_world(corners.transpose(2, 0, 1), now), axis=-1)
                nearest[i] = min(nearest[i], distances(eye[None], world)[0])
    wanted = np.where(nearest < reach, nearest, np.inf)
    assert 20 < np.isfinite(wanted).sum() < 180
    assert _nearest_object(manifest, tmp_path, eyes, reach) == pytest.approx(wanted, abs=1e-9)

"""Of errors whose distribution is known: means over area, the 99th of 100 and the largest are what it says,
whichever of two surfaces has the error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from paradize.data import Lod, Mesh
from paradize.formats.glb.encode import encode_glb
from paradize.metrics.flight import flight_error
from paradize.metrics.mapped_normal import normal_error, uv_shift
from paradize.metrics.picture import flip, flip_errors
from paradize.metrics.quantised import quantised_errors
from paradize.metrics.surface import Original
from paradize.metrics.tangent import frame_errors, frame_faults
from paradize.stages.quantise import mesh_grid, quantise
from paradize.stages.tangents import tangent_frames
from tests.pipeline.shapes import grid, sphere
from tests.sweeps import sweep

# (share of the whole that is off, whether that is more than one in a hundred)
SHARES = [(0.03, True), (0.005, False)]


def with_patch(mesh: Mesh, share: float, points: list[tuple[float, float, float]]) -> Mesh:
    """A square of side 1 and one more of two triangles, `share` of the area of both; points: its corners of
    side 1, about (0.5, 0, 0.5). Its normals are the plane's own."""
    side = (share / (1 - share)) ** 0.5
    corners = np.array(points) * [side, 1, side] + [0.5, 0, 0.5]
    count = len(mesh.positions)
    assert mesh.normals is not None
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    return Mesh(
        np.concatenate([mesh.positions, corners]).astype(np.float32),
        np.concatenate(
            [mesh.triangles, [[count, count + 1, count + 2], [count, count + 2, count + 3]]]
        ).astype(np.uint32),
        normals=np.concatenate([mesh.normals, [normal / np.linalg.norm(normal)] * 4]).astype(np.float32),
    )


@pytest.mark.parametrize("samples", [0, 20_000])
@pytest.mark.parametrize(("share", "seen"), SHARES)
def test_a_patch_that_only_one_surface_has_is_told_by_its_share_of_the_area(
    share: float, seen: bool, samples: int
) -> None:
    """0.25 above the ground; few samples are weighed by the area that each stands for."""
    ground, height = grid(8), 0.25
    around = [(-0.5, height, -0.5), (-0.5, height, 0.5), (0.5, height, 0.5), (0.5, height, -0.5)]
    lifted = with_patch(ground, share, around)
    for first, second, diagonal in ((ground, lifted, 2**0.5), (lifted, ground, (2 + height**2) ** 0.5)):
        found = Original(first).distance(second, samples)
        assert found["error_max_lower"] == pytest.approx(height / diagonal, rel=1e-5)
        assert found["error_max"] == pytest.approx(height / diagonal, rel=1.01e-3)
        assert found["error_rms"] == pytest.approx(height / diagonal * share**0.5, rel=1e-3)
        assert found["error_p99"] == pytest.approx(height / diagonal if seen else 0.0, rel=1e-5)


@pytest.mark.parametrize("size", sweep([0.01, 1.0, 10.0], test=[1.0]))
@pytest.mark.parametrize("share", [0.02, 0.03, 0.05])
def test_of_a_fin_whose_points_rise_evenly_the_99th_of_100_lies_where_a_hundredth_is_left(
    share: float, size: float
) -> None:
    ground, side = grid(8), (share / (1 - share)) ** 0.5
    fin = with_patch(ground, share, [(0, 0, -0.5), (0, 0, 0.5), (0, side, 0.5), (0, side, -0.5)])
    first, second = (replace(m, positions=m.positions * np.float32(size)) for m in (ground, fin))
    found = Original(first).distance(second)
    assert found["error_max_lower"] == pytest.approx(side / 2**0.5, rel=1e-5)
    assert found["error_max"] == pytest.approx(side / 2**0.5, rel=1.01e-3)
    assert found["error_p99"] == pytest.approx(side * (1 - 0.01 / share) / 2**0.5, rel=0.01)
    assert found["error_rms"] == pytest.approx(side * (share / 3) ** 0.5 / 2**0.5, rel=0.01)


def test_levels_of_the_same_triangles_and_vertices_that_none_uses_are_told_apart() -> None:
    ground = grid(4)
    far = np.concatenate([ground.positions, np.float32([[0, 1000, 0]])])
    judge = Original(Mesh(far, ground.triangles))
    for lift in (0.25, 0.5):
        level = replace(ground, positions=ground.positions + np.float32([0, lift, 0]))
        assert judge.distance(level)["error_max_lower"] == pytest.approx(lift / 2**0.5, rel=1e-5)


@pytest.mark.parametrize("samples", [0, 20_000])
@pytest.mark.parametrize(("share", "seen"), SHARES)
def test_a_fin_that_only_one_surface_has_is_lit_at_a_right_angle_on_its_share_of_the_area(
    share: float, seen: bool, samples: int
) -> None:
    """It stands on the ground; the ground's own normals are those of the other everywhere."""
    ground, side = grid(8), (share / (1 - share)) ** 0.5
    fin = with_patch(ground, share, [(0, 0, -0.5), (0, 0, 0.5), (0, side, 0.5), (0, side, -0.5)])
    for first, second in ((ground, fin), (fin, ground)):
        found = normal_error(first, second, samples)
        assert found["normal_max_deg"] == pytest.approx(90, rel=1e-5)
        assert found["normal_mean_deg"] == pytest.approx(90 * share, rel=1e-3)
        assert found["normal_p99_deg"] == pytest.approx(90 if seen else 0, rel=1e-5)


@pytest.mark.parametrize(("share", "seen"), [(0.03125, True), (0.0078125, False)])
def test_a_texture_that_slid_on_a_part_is_told_by_the_part(share: float, seen: bool) -> None:
    """A strip of the ground, with vertices of its own, shows what lies 0.2 beside it."""
    ground = grid(128)
    assert ground.uvs is not None
    strip = ground.positions[ground.triangles][:, :, 2].max(axis=1) <= share + 1e-6
    kept = ground.positions[ground.triangles][:, :, 0].max(axis=1) <= 0.5
    count = len(ground.positions)
    level = Mesh(
        np.concatenate([ground.positions] * 2),
        np.where(strip[:, None], ground.triangles + count, ground.triangles)[kept].astype(np.uint32),
        uvs=np.concatenate([ground.uvs, ground.uvs + np.float32([0.2, 0])]),
    )
    found = uv_shift(ground, level)
    assert found["uv_shift_max"] == pytest.approx(0.2 / 2**0.5, rel=1e-3)
    assert found["uv_shift_p99"] == pytest.approx(0.2 / 2**0.5 if seen else 0.0, rel=1e-3, abs=1e-5)


def test_tangents_that_are_turned_at_some_corners_are_told_by_their_number() -> None:
    """Of 6,000 corners 30 are turned by 40 degrees, 150 by 10, and of 60 the sign is the other one."""
    ground = tangent_frames(grid(100))
    assert ground.normals is not None and ground.uvs is not None and ground.tangents is not None
    corners = ground.triangles[:2000].reshape(-1)
    turn = np.zeros(6000)
    turn[:30], turn[100:250] = 40, 10
    tangents = ground.tangents[corners]
    tangents[:, 0], tangents[:, 2] = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    tangents[1000:1060, 3] *= -1
    mesh = Mesh(
        ground.positions[corners],
        np.arange(6000, dtype=np.uint32).reshape(-1, 3),
        normals=ground.normals[corners],
        tangents=tangents,
        uvs=ground.uvs[corners],
    )
    found = frame_errors(mesh)
    assert found["tangent_max_deg"] == pytest.approx(40, rel=1e-4)
    assert found["tangent_p99_deg"] == pytest.approx(10, rel=1e-4)
    assert found["tangent_mean_deg"] == pytest.approx((30 * 40 + 150 * 10) / 6000, rel=1e-4)
    assert found["tangent_turned"] == pytest.approx(0.01, rel=1e-5)
    # Triangles without area in the image have no frame: theirs are not counted.
    nowhere = ground.uvs[corners]
    nowhere[:750] = 0.5
    found = frame_errors(replace(mesh, uvs=nowhere))
    assert found["tangent_max_deg"] < 1e-4 and found["tangent_turned"] == pytest.approx(60 / 5250, rel=1e-5)


@pytest.mark.parametrize("longest", [1.25, 1.75])
def test_the_worst_frame_decides_whichever_way_it_is_off(longest: float) -> None:
    ground = tangent_frames(grid(4))
    assert ground.tangents is not None
    tangents = ground.tangents.copy()
    tangents[3, :3] *= longest
    tangents[5, :3] *= 0.5
    tangents[7, :3] = [np.cos(np.radians(30)), np.sin(np.radians(30)), 0]
    tangents[9:12, 3] = [0.5, 0, -2]
    assert frame_faults(replace(ground, tangents=tangents)) == {
        "tangent_length": max(0.5, longest - 1),
        "tangent_lean_deg": pytest.approx(30, rel=1e-4),
        "tangent_sign": 3.0,
    }


def test_a_flights_ripple_is_told_by_its_share_of_the_time() -> None:
    """1 m a second along a line for 100 s, but for 2 s at 1.2 and 2 s at 0.8, and half a second at 1.5 m."""
    rows, t, u = [], 0.0, 0.0
    for seconds, pace in ((40.0, 1.0), (2.0, 1.2), (2.0, 0.8), (0.5, 1.5), (0.5, 0.5), (55.0, 1.0)):
        rows += [[t, u, pace], [t + seconds, u + seconds * pace, pace]]
        t, u = t + seconds, u + seconds * pace
    eye = [[[float(k), 1.0, 0.0, 0.0], [0.0] * 4, [0.0] * 4] for k in range(100)]
    target = [[[0.0] * 4] * 3] * 100
    flight = {
        "segments": [{"eye": e, "target": s} for e, s in zip(eye, target, strict=True)],
        "waypoint_u": [0, 25, 50],
        "duration_s": 100.0,
        "time_table": rows,
    }
    waypoints = [(0.0, 0.0, 0.0), (25.0, 0.0, 0.0), (50.0, 0.0, 0.0)]
    aims = [(0.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 0.0)]
    found = flight_error(flight, waypoints, aims, [1.0] * 3)
    assert found["path_ripple_max"] == pytest.approx(0.5, rel=1e-5)
    assert found["path_ripple_p99"] == pytest.approx(0.2, rel=1e-5)
    assert found["path_miss_m"] == 3.0  # the target's, though the eye misses none
    assert found["path_jump_m"] == pytest.approx(100.0)  # from the end to the beginning
    off = [(0.0, 0.0, 2.0), *waypoints[1:]]
    assert flight_error(flight, off, [(0.0, 0.0, 0.0)] * 3, [1.0] * 3)["path_miss_m"] == 2.0
    shifted = {**flight, "time_table": [[at + 7.0, way, pace] for at, way, pace in rows]}
    assert flight_error(shifted, waypoints, aims, [1.0] * 3)["path_time_s"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("axis", range(3))
def test_vertices_and_directions_that_moved_are_told_by_their_number(axis: int) -> None:
    """Of the sources of 1,000 codes 20 lie 0.02 away and 5 lie 0.1, along an axis and half as far along the
    next; as many normals and tangents are turned by 4 and 20 degrees."""
    ball = tangent_frames(sphere(24))
    some = np.arange(1000)
    assert ball.normals is not None and ball.tangents is not None and ball.uvs is not None
    mesh = replace(
        ball,
        positions=ball.positions[some],
        normals=ball.normals[some],
        tangents=ball.tangents[some],
        uvs=ball.uvs[some],
        uvs1=ball.uvs[some],
        colors=np.full((1000, 4), 0.5, np.float32),
        triangles=np.arange(999, dtype=np.uint32).reshape(-1, 3),
        groups=(),
    )
    codes = quantise(mesh, mesh_grid([mesh]))
    glb = encode_glb([Lod(mesh, 0.0, 0.0, quantised=codes)], "ball")
    far = np.zeros(1000)
    far[100:105], far[400:420] = 0.1, 0.02
    off = np.zeros((1000, 3))
    off[:, axis], off[:, (axis + 1) % 3] = far, far / 2
    assert mesh.uvs is not None and mesh.uvs1 is not None and mesh.normals is not None
    assert mesh.tangents is not None and mesh.colors is not None
    angle = np.radians(200 * far)[:, None]  # turned about a direction at right angles
    turned = {}
    for name, values in (("normals", mesh.normals), ("tangents", mesh.tangents[:, :3])):
        aside = np.cross(values, np.roll(values, 1, axis=1) + np.float32([0, 0, 2]))
        aside /= np.linalg.norm(aside, axis=1)[:, None]
        turned[name] = values * np.cos(angle) + aside * np.sin(angle)
    source = replace(
        mesh,
        positions=(mesh.positions + off).astype(np.float32),
        normals=turned["normals"].astype(np.float32),
        tangents=np.concatenate([turned["tangents"], mesh.tangents[:, 3:]], axis=1).astype(np.float32),
        uvs=(mesh.uvs + np.float32([0.125, 0])).astype(np.float32),
        uvs1=(mesh.uvs1 + np.float32([0, 0.25])).astype(np.float32),
        colors=mesh.colors + np.float32([0, 0, 0.25, 0]),
    )
    (found,) = quantised_errors(glb, [source])
    used = source.positions[:999].astype(np.float64)
    across = float(np.linalg.norm(used.max(axis=0) - used.min(axis=0)))
    long = 1.25**0.5
    assert found["quantise_max_m"] == pytest.approx(0.1 * long, rel=1e-3)
    assert found["quantise_max"] == pytest.approx(0.1 * long / across, rel=1e-3)
    assert found["quantise_p99"] == pytest.approx(0.02 * long / across, rel=5e-3)
    mean_square = (20 * 0.02**2 + 5 * 0.1**2) / 1000
    assert found["quantise_rms"] == pytest.approx(long * mean_square**0.5 / across, rel=5e-3)
    for name in ("normal", "tangent"):
        message = [found[f"quantise_{name}_{part}_deg"] for part in ("max", "p99", "mean")]
        assert message == pytest.approx([20, 4, (20 * 4 + 5 * 20) / 1000], rel=2e-2), name
    assert found["quantise_uv_max"] == pytest.approx(0.25, rel=1e-3)
    assert found["quantise_color_max"] == pytest.approx(0.25, rel=2e-2)
    assert source.tangents is not None
    inside_out = source.tangents * np.where(some == 500, -1, 1)[:, None].astype(np.float32)
    inside_out[500, :3] *= -1
    (found,) = quantised_errors(glb, [replace(source, tangents=inside_out)])
    assert found["quantise_tangent_max_deg"] == 180


def test_pictures_of_several_sizes_are_told_pixel_by_pixel() -> None:
    rng = np.random.default_rng(9)
    pairs = [[rng.random((h, w, 3), np.float32) for _ in range(2)] for h, w in ((40, 50), (16, 20))]
    pairs[1][1] = pairs[1][0]  # of the smaller pair nothing differs
    errors = np.sort(np.concatenate([flip(a, b).ravel() for a, b in pairs]).astype(np.float64))
    found = flip_errors([a for a, _ in pairs], [b for _, b in pairs])
    assert found["mean"] == pytest.approx(errors.sum() / (40 * 50 + 16 * 20), rel=1e-6)
    assert found["max"] == errors[-1]
    assert errors[int(0.985 * len(errors))] < found["p99"] < errors[int(0.995 * len(errors))]

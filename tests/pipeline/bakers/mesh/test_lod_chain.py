"""The chain of levels: by ratio, by error, by what a flight sees; extremes; what must not matter does not."""

from __future__ import annotations

import itertools
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.mesh.bake import bake_mesh
from paradize.bakers.mesh.lods import NO_ERROR, MeasuredLevel, Plan, make_levels
from paradize.bakers.mesh.lods_from_path import bake_seen, plan_by_flight
from paradize.data import Group, Mesh
from paradize.metrics.surface import Original, diagonal
from paradize.scene.baker_settings import MeshSettings
from paradize.scene.flight import plan_flight, sightings_of
from paradize.scene.placement import placed
from paradize.scene.settings import load_scene
from paradize.stages.lod import simplify
from paradize.stages.validate import validate_mesh
from paradize.tiers import TIERS
from tests.pipeline.scenes import make_cove
from tests.pipeline.shapes import grid, sphere
from tests.sweeps import sweep


def counts(mesh: Mesh, plan: Plan, tier: str = "balanced") -> list[int]:
    return [len(step.mesh.triangles) for step in make_levels(mesh, plan, tier)[0]]


def turned(mesh: Mesh, scale: float = 1.0, move: tuple[float, float, float] = (0, 0, 0)) -> Mesh:
    """Turned by the rational rotation of (3, 4, 5) about Y, scaled and moved."""
    turn = np.array([[0.6, 0, 0.8], [0, 1, 0], [-0.8, 0, 0.6]])
    assert mesh.normals is not None
    return replace(
        mesh,
        positions=(mesh.positions.astype(float) @ turn.T * scale + np.array(move)).astype(np.float32),
        normals=(mesh.normals.astype(float) @ turn.T).astype(np.float32),
    )


@pytest.mark.parametrize("tier", sweep(TIERS, test=["balanced"]))
def test_a_ratio_sets_the_triangles_of_each_level(tier: str) -> None:
    mesh = sphere(20)
    found = counts(mesh, Plan(count=3, ratio=0.3), tier)
    assert len(found) == 3
    for before, after in itertools.pairwise(found):
        assert 0.2 * before < after < 0.34 * before


@pytest.mark.parametrize("tier", sweep(TIERS, test=["balanced"]))
def test_by_error_each_level_is_inside_its_bound_and_as_coarse_as_can_be(tier: str) -> None:
    mesh = sphere(20)
    bounds = (0.002, 0.01)
    steps, _ = make_levels(mesh, Plan(count=8, errors=bounds), tier)
    assert len(steps) == 3
    for step, bound in zip(steps[1:], bounds, strict=True):
        assert 0.4 * bound < step.errors["error_max"] <= bound


def test_by_error_the_bisection_ends_at_the_coarsest_that_is_inside(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of meshes that are off by 10 / triangles: 200 triangles are just inside one twentieth."""
    ball = sphere(20)

    def made(judge: Original, before: Mesh, target: int, *_: object) -> tuple[MeasuredLevel, str, None]:
        mesh = replace(ball, triangles=ball.triangles[:target], groups=())
        return (
            MeasuredLevel(
                mesh, NO_ERROR | {"error_max": 10 / target, "uv_shift_p99": 0.0, "uv_shift_max": 0.0}
            ),
            "",
            None,
        )

    monkeypatch.setattr("paradize.bakers.mesh.lods._simplified", made)
    steps, _ = make_levels(ball, Plan(errors=(0.05,)), "balanced")
    assert 200 <= len(steps[1].mesh.triangles) <= 210


@pytest.mark.parametrize(("off", "slid"), [(0.01, 0.05), (0.05, 0.01)])
def test_no_level_follows_one_that_is_off_or_slid_as_far_as_the_flight_sees(
    monkeypatch: pytest.MonkeyPatch, off: float, slid: float
) -> None:
    def nearest(judge: Original, before: Mesh, target: int, *_: object) -> tuple[MeasuredLevel, str]:
        errors = NO_ERROR | {"error_max": off, "uv_shift_p99": slid, "uv_shift_max": slid}
        return MeasuredLevel(simplify(before, target).mesh, errors), ""

    monkeypatch.setattr("paradize.bakers.mesh.lods._nearest", nearest)
    steps, notes = make_levels(sphere(16), Plan(count=4, farthest=0.03), "balanced")
    assert len(steps) == 2 and any("the flight never is farther away" in note for note in notes)
    assert len(make_levels(sphere(16), Plan(count=4, farthest=0.06), "balanced")[0]) == 4


def test_a_bound_that_gets_no_level_is_told() -> None:
    steps, notes = make_levels(sphere(12), Plan(count=2, errors=(0.01, 0.02, 0.05)), "balanced")
    assert len(steps) == 2 and any("2 of 3 bounds have no level" in note for note in notes)
    steps, notes = make_levels(sphere(12), Plan(count=4, errors=(0.01, 0.02, 0.05)), "balanced")
    assert len(steps) == 4 and not any("have no level" in note for note in notes)


def test_a_level_that_a_coarser_one_beats_is_left_out_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    made = iter((0.05, 0.02, 0.03))

    def nearest(judge: Original, before: Mesh, target: int, *_: object) -> tuple[MeasuredLevel, str]:
        off = next(made)
        return MeasuredLevel(simplify(before, target).mesh, NO_ERROR | {"error_max": off}), ""

    monkeypatch.setattr("paradize.bakers.mesh.lods._nearest", nearest)
    steps, notes = make_levels(sphere(16), Plan(count=4), "balanced")
    assert [step.errors["error_max"] for step in steps] == [0, 0.02, 0.03]
    assert any("left out" in note and "nearer to the source" in note for note in notes)


def test_two_levels_of_one_shape_are_measured_each() -> None:
    ball = sphere(8)
    judge = Original(ball)
    for away in (0.1, 0.3, 0.1):
        level = replace(ball, positions=ball.positions + np.float32([away, 0, 0]))
        assert judge.distance(level, 1000) == Original(ball).distance(level, 1000)


def test_what_stops_several_levels_is_said_once() -> None:
    _, notes = make_levels(grid(1), Plan(count=4, errors=(1e-6, 1e-6, 1e-6)), "balanced")
    assert len(notes) == len(set(notes)) >= 1


def test_a_bound_above_the_limit_that_nobody_asked_for_counts(tmp_path: Path) -> None:
    """Without --max-error a level may be a tenth of the diagonal off, but where a larger bound is asked."""
    path = tmp_path / "cube.obj"
    rows = [f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
    path.write_text("\n".join(rows + [f"f {face}" for face in faces]))
    last = bake_mesh(path, lod_errors=(0.3,)).report["lods"][-1]
    assert last["triangles"] < 12 and 0.1 < last["error_max"] <= 0.3
    assert len(bake_mesh(path, lod_errors=(0.3,), max_error=0.2).report["lods"]) == 1


@pytest.mark.deep
def test_a_better_tier_is_nearer_to_the_source() -> None:
    mesh = grid(40, height=0.05)
    at = {tier: make_levels(mesh, Plan(count=3, ratio=0.25), tier)[0] for tier in TIERS}
    rms = {tier: [step.errors["error_rms"] for step in steps[1:]] for tier, steps in at.items()}
    assert rms["exact"][0] <= rms["balanced"][0] and rms["exact"][1] < 0.95 * rms["balanced"][1]
    assert rms["balanced"] == rms["fast"]


@given(st.integers(2, 10), st.sampled_from([*TIERS]), st.floats(0.3, 0.9), st.booleans())
@settings(max_examples=4, deadline=None)
def test_no_level_has_more_triangles_or_less_error_than_the_one_before(
    size: int, tier: str, ratio: float, closed: bool
) -> None:
    mesh = sphere(size) if closed else grid(size, height=0.2)
    steps, _ = make_levels(mesh, Plan(count=6, ratio=ratio), tier)
    for before, after in itertools.pairwise(steps):
        assert len(after.mesh.triangles) < len(before.mesh.triangles)
        assert after.errors["error_max"] >= before.errors["error_max"] - 1e-6


def test_a_power_of_two_changes_no_error_at_all() -> None:
    mesh = grid(24, height=0.1)
    want = make_levels(mesh, Plan(count=3), "balanced")[0]
    for scale in (2.0**-20, 1024.0):
        larger = replace(mesh, positions=mesh.positions * np.float32(scale))
        found = make_levels(larger, Plan(count=3), "balanced")[0]
        assert [step.errors for step in found] == [step.errors for step in want]


def test_turning_and_moving_change_errors_by_less_than_half() -> None:
    """Rounding turns choices between collapses that cost alike; a regular grid has many."""
    mesh = grid(24, height=0.1)
    want = make_levels(mesh, Plan(count=3), "balanced")[0]
    for other in (turned(mesh), turned(mesh, 1000.0, (3.0, -7.0, 1.0))):
        found = make_levels(other, Plan(count=3), "balanced")[0]
        assert len(found) == len(want)
        for a, b in zip(found[1:], want[1:], strict=True):
            assert abs(len(a.mesh.triangles) - len(b.mesh.triangles)) <= 2
            assert a.errors["error_rms"] == pytest.approx(b.errors["error_rms"], rel=0.5)


def test_the_order_of_faces_changes_no_error_by_more_than_half() -> None:
    mesh = grid(24, height=0.1)
    want = make_levels(mesh, Plan(count=3), "balanced")[0]
    order = np.random.default_rng(5).permutation(len(mesh.triangles))
    found = make_levels(replace(mesh, triangles=mesh.triangles[order]), Plan(count=3), "balanced")[0]
    for a, b in zip(found[1:], want[1:], strict=True):
        assert a.errors["error_rms"] == pytest.approx(b.errors["error_rms"], rel=0.5)


# --- by sight ---


def cove(tmp_path: Path, **instance: object) -> tuple[dict, list[dict], float]:
    scene = load_scene(make_cove(tmp_path))
    seen = {
        "flight": asdict(scene.flight),
        "viewport": list(scene.head.viewport),
        "error_px": scene.head.lod_error_px,
        "far_error_px": scene.head.lod_error_px,
    }
    stands = replace(scene.objects[0].instances[0], **instance)
    return seen, [stands], np.tan(np.radians(scene.flight.fov_deg) / 2) * 2 / scene.head.viewport[1]


@pytest.mark.parametrize("tier", sweep(["balanced", "exact"], test=["balanced"]))
def test_by_sight_nothing_finer_than_a_pixel_at_the_nearest_view_is_baked(tmp_path: Path, tier: str) -> None:
    seen, stands, pixel = cove(tmp_path, position=(0.0, 0.0, 0.0))
    mesh = sphere(20, radius=0.5)
    plan = plan_by_flight(seen, [placed(one) for one in stands])(mesh, Plan(count=8))
    flight = plan_flight(load_scene(tmp_path / "cove.toml").flight)
    met = sightings_of(flight, 50.0, 1280 / 720, [((0.0, 0.0, 0.0), diagonal(mesh) / 2)])[0]
    assert plan.finest == pytest.approx(met.nearest_m * pixel / diagonal(mesh), rel=1e-6)
    steps, notes = make_levels(mesh, plan, tier)
    assert len(steps[0].mesh.triangles) < 0.9 * len(mesh.triangles)
    assert 0 < steps[0].errors["error_max"] <= plan.finest
    assert any("nothing finer is seen" in note for note in notes)
    # Each level but the last is drawn at some distance of the flight.
    assert plan.farthest is not None
    assert all(step.errors["error_max"] < plan.farthest for step in steps[:-1])


def test_by_sight_the_nearest_and_the_farthest_of_all_instances_count(tmp_path: Path) -> None:
    """A mesh beside its own origin, turned by a matrix, scaled and moved; in metres of the mesh."""
    seen, stands, pixel = cove(tmp_path)
    stands = [
        replace(stands[0], position=(6.0, 0.5, 1.5), yaw_deg=35.0, scale=2.0),
        replace(stands[0], position=(2.0, 0.0, -3.0), yaw_deg=-110.0, scale=0.5),
        replace(stands[0], position=(0.0, 900.0, 0.0), yaw_deg=0.0, scale=1.0),
    ]
    middle, mesh = np.array([2.0, 0.5, 1.5]), sphere(8, radius=0.25, offset=(2.0, 0.5, 1.5))
    spheres = []
    for stand in stands:
        a, s = np.radians(stand.yaw_deg), stand.scale
        turn = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
        x, y, z = (s * turn @ middle + stand.position).tolist()
        spheres.append(((x, y, z), s * diagonal(mesh) / 2))
    met = sightings_of(plan_flight(load_scene(tmp_path / "cove.toml").flight), 50.0, 1280 / 720, spheres)
    assert [one.seen for one in met] == [True, True, False]
    share = pixel / diagonal(mesh)
    near, far = (
        [getattr(one, key) / stand.scale for one, stand in zip(met[:2], stands, strict=False)]
        for key in ("nearest_m", "farthest_seen_m")
    )
    assert abs(near[0] - near[1]) > 0.5 and abs(far[0] - far[1]) > 0.5
    plan = plan_by_flight(seen, [placed(one) for one in stands])(mesh, Plan(limit=1.0))
    assert plan.finest == pytest.approx(share * min(near), rel=1e-4)
    assert plan.farthest == pytest.approx(share * max(far), rel=1e-4)
    unseen = plan_by_flight(seen, [placed(one) for one in stands[2:]])(mesh, Plan(count=5, limit=0.03))
    assert (unseen.count, unseen.finest, unseen.farthest) == (1, 0.03, None)


def test_by_sight_what_the_camera_touches_keeps_its_source(tmp_path: Path) -> None:
    seen, stands, _ = cove(tmp_path, position=(9.0, 2.0, 0.0))
    mesh = sphere(16)
    plan = plan_by_flight(seen, [placed(one) for one in stands])(mesh, Plan())
    assert plan.finest == 0
    assert np.array_equal(make_levels(mesh, plan, "balanced")[0][0].mesh.positions, mesh.positions)


def test_a_scene_keeps_the_layout_that_its_maps_are_painted_for(tmp_path: Path) -> None:
    """Two squares that show the same image: an author's choice, and no reason for another layout."""
    rows = ["v 0 0 0", "v 1 0 0", "v 1 1 0", "v 0 1 0", "v 2 0 0", "v 3 0 0", "v 3 1 0", "v 2 1 0"]
    rows += ["vt 0.1 0.1", "vt 0.9 0.1", "vt 0.9 0.9", "vt 0.1 0.9"]
    rows += ["f 1/1 2/2 3/3 4/4", "f 5/1 6/2 7/3 8/4"]
    path = tmp_path / "twice.obj"
    path.write_text("\n".join(rows) + "\n")
    made = {
        painted: bake_seen(path, MeshSettings(atlas=True, painted=painted), tier="balanced")
        for painted in (True, False)
    }
    assert not made[True].report["atlas"] and made[False].report["atlas"]
    uvs = made[True].lods[0].mesh.uvs
    assert uvs is not None and sorted(set(uvs[:, 0].tolist())) == pytest.approx([0.1, 0.9])


# --- extremes ---


def cards(count: int) -> Mesh:
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    places = np.random.default_rng(1).random((count, 1, 3)).astype(np.float32) * 300
    first = 4 * np.arange(count, dtype=np.uint32)[:, None, None]
    return Mesh(
        (corner[None] + places).reshape(-1, 3),
        (first + np.array([[0, 1, 2], [0, 2, 3]], np.uint32)).reshape(-1, 3),
        normals=np.tile(np.array([0, 0, 1], np.float32), (4 * count, 1)),
        uvs=np.tile(corner[:, :2], (count, 1)),
        groups=(Group("leaves", "leaf", 0, 2 * count),),
    )


def strip(count: int, twists: int) -> Mesh:
    """A band of 2 `count` triangles with `twists` half turns; 1: a Moebius strip, which has no outside."""
    at = 2 * np.pi * np.arange(count + 1) / count
    lean = at * twists / 2
    side = np.array([-0.2, 0.2])[None, :]
    radius = 1 + side * np.cos(lean)[:, None]
    points = np.stack(
        [radius * np.cos(at)[:, None], radius * np.sin(at)[:, None], side * np.sin(lean)[:, None]], -1
    )
    a = 2 * np.arange(count, dtype=np.uint32)[:, None, None]
    faces = (a + np.array([[0, 2, 1], [1, 2, 3]], np.uint32)).reshape(-1, 3)
    normal = np.tile(np.array([0, 0, 1], np.float32), (2 * count + 2, 1))
    uv = np.stack([np.repeat(at / 7, 2), np.tile([0.0, 1.0], count + 1)], -1)
    return Mesh(
        points.reshape(-1, 3).astype(np.float32), faces, normals=normal, uvs=uv.astype(np.float32),
        groups=(Group("band", "band", 0, 2 * count),),
    )  # fmt: skip


@pytest.mark.parametrize("tier", sweep(["balanced", "exact"], test=["balanced"]))
@pytest.mark.parametrize(
    "mesh",
    [
        pytest.param(
            replace(sphere(8), positions=sphere(8).positions * np.float32(1e-30)),
            id="1e-30",
            marks=pytest.mark.deep,
        ),
        pytest.param(
            replace(sphere(8), positions=sphere(8).positions * np.float32(1e30)),
            id="1e30",
            marks=pytest.mark.deep,
        ),
        pytest.param(replace(sphere(8), positions=sphere(8).positions * np.float32(1e37)), id="1e37"),
        pytest.param(
            replace(sphere(8), uvs=np.full((len(sphere(8).positions), 2), 0.5, np.float32)), id="uv"
        ),
        pytest.param(replace(grid(12), positions=grid(12).positions + np.float32(1e5)), id="far"),
        pytest.param(strip(60, 1), id="moebius"),
        pytest.param(cards(500), id="cards"),
    ],
)
def test_extremes_give_a_chain_or_a_reason(mesh: Mesh, tier: str) -> None:
    mesh, _ = validate_mesh(mesh)
    steps, notes = make_levels(mesh, Plan(), tier)
    assert len(steps) == 4 or notes
    for step in steps:
        assert np.isfinite(list(step.errors.values())).all()
        assert np.isfinite(step.mesh.positions).all()
        assert step.errors["error_max"] <= 0.1


def test_an_offset_of_a_million_diagonals_is_measured_without_harm() -> None:
    ball = sphere(8, radius=0.5)
    far = replace(ball, positions=ball.positions + np.float32(1e6))
    mesh, _ = validate_mesh(far)
    steps, _ = make_levels(mesh, Plan(), "balanced")
    assert all(np.isfinite(list(step.errors.values())).all() for step in steps)


@pytest.mark.deep
@pytest.mark.parametrize("rows", [254, 255, 256])
def test_vertex_counts_around_16_bits_pass(rows: int) -> None:
    mesh = grid(255, height=0.05)
    extra = rows - 255
    if extra > 0:  # one triangle more beside the grid
        more = np.array([[2, 0, 0]], np.float32)
        assert mesh.normals is not None and mesh.uvs is not None
        mesh = replace(
            mesh,
            positions=np.concatenate([mesh.positions, more]),
            normals=np.concatenate([mesh.normals, mesh.normals[:1]]),
            uvs=np.concatenate([mesh.uvs, mesh.uvs[:1]]),
            triangles=np.concatenate([mesh.triangles, [[0, 1, 65536]]]).astype(np.uint32),
            groups=(Group("ground", "sand", 0, len(mesh.triangles) + 1),),
        )
    elif extra < 0:  # one corner less
        kept = ~(mesh.triangles == 65535).any(axis=1)
        mesh = replace(
            mesh,
            triangles=np.ascontiguousarray(mesh.triangles[kept]),
            groups=(Group("ground", "sand", 0, int(kept.sum())),),
        )
    mesh, _ = validate_mesh(mesh)
    assert len(mesh.positions) == 65536 + extra
    steps, _ = make_levels(mesh, Plan(count=2), "fast")
    assert len(steps) == 2 and steps[1].errors["error_max"] < 0.01


@pytest.mark.parametrize("tier", sweep(TIERS, test=["balanced"]))
def test_any_number_of_threads_gives_the_same_levels(monkeypatch: pytest.MonkeyPatch, tier: str) -> None:
    mesh = sphere(16)
    found = []
    for threads in ("1", "3"):
        monkeypatch.setenv("PARADIZE_THREADS", threads)
        steps, _ = make_levels(mesh, Plan(), tier)
        found.append([(step.mesh.positions.tobytes(), step.errors) for step in steps])
    assert found[0] == found[1]

"""Tangent frames: what may not change them, what must, and how their errors are told."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.mesh.bake import bake_mesh
from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.kernels.mesh import split_tangents
from paradize.kernels.reference import angles_deg, mikktspace_tangents
from paradize.metrics.tangent import frame_errors, frame_faults, sample_of
from paradize.readers.obj import read_obj
from paradize.stages.normals import complete_normals
from paradize.stages.split import split_by
from paradize.stages.tangents import METHODS, method_of, tangent_frames
from paradize.stages.validate import validate_mesh
from tests.bench import meshes
from tests.pipeline.shapes import corner_tangents, grid, sphere
from tests.sweeps import tries

Corners = npt.NDArray[np.float32]
DENSE = meshes.sphere(3_000, mirrored=True)


def degrees(a: Corners, b: Corners) -> float:
    return float(angles_deg(a[..., :3].reshape(-1, 3), b[..., :3].reshape(-1, 3)).max())


def noise(mesh: Mesh, seed: int) -> Mesh:
    """The mesh under an image without sense: mirrored, sheared and squeezed at every vertex."""
    assert mesh.uvs is not None
    return replace(mesh, uvs=np.random.default_rng(seed).random(mesh.uvs.shape, np.float32))


def soup_of(count: int, seed: int) -> Mesh:
    """Triangles over few vertices, many at an edge, some without area in space or in the image."""
    random = np.random.default_rng(seed)
    faces = random.integers(0, 12, (count, 3)).astype(np.uint32)
    return Mesh(
        random.integers(0, 3, (12, 3)).astype(np.float32),
        faces,
        normals=np.tile(np.array([0.6, 0.0, 0.8], np.float32), (12, 1)),
        uvs=random.integers(0, 3, (12, 2)).astype(np.float32),
    )


@pytest.mark.parametrize(
    "mesh", [DENSE, meshes.torus(3_000), noise(DENSE, 1), sphere(8), soup_of(40, 2), soup_of(300, 3)]
)
def test_frames_are_those_of_the_float64_reference(mesh: Mesh) -> None:
    assert mesh.normals is not None and mesh.uvs is not None
    truth = mikktspace_tangents(mesh.positions, mesh.normals, mesh.uvs, mesh.triangles)
    found = corner_tangents(mesh)
    assert np.array_equal(found[..., 3], truth[..., 3])
    assert degrees(found, truth) < 2e-3


@pytest.mark.parametrize("seed", range(12))
def test_whatever_the_faces_signs_are_those_of_the_reference(seed: int) -> None:
    mesh = soup_of(20 + 10 * seed, 10 + seed)
    assert mesh.normals is not None and mesh.uvs is not None
    truth = mikktspace_tangents(mesh.positions, mesh.normals, mesh.uvs, mesh.triangles)
    assert np.array_equal(corner_tangents(mesh)[..., 3], truth[..., 3])


def corner_frames(
    positions: npt.ArrayLike, uvs: npt.ArrayLike, triangles: npt.ArrayLike, method: str
) -> npt.NDArray[np.float64]:
    """(m, 3, 4) tangents of a mesh whose normals all point along +Z."""
    points = np.asarray(positions, np.float32)
    up = np.tile(np.float32([0, 0, 1]), (len(points), 1))
    index, _, tangents = split_tangents(
        points, up, np.asarray(uvs, np.float32), np.asarray(triangles, np.uint32), method=method
    )
    return tangents[index].astype(np.float64)


def test_by_vertex_the_directions_of_large_and_small_faces_count_alike() -> None:
    """At the corner that they share u grows along +X on the large face and along +Y on the small one."""
    positions = [[0, 0, 0], [10, 0, 0], [0, 10, 0], [-1, 0, 0], [0, -1, 0]]
    uvs = [[0, 0], [1, 0], [0, 1], [0, 1], [-1, 0]]
    found = corner_frames(positions, uvs, [[0, 1, 2], [0, 3, 4]], "vertex")
    assert np.allclose(found[:, 0, :3], np.sqrt([0.5, 0.5, 0]), atol=1e-6)


def test_two_fans_that_touch_at_one_vertex_keep_frames_of_their_own() -> None:
    """Two cones with one tip, whose images are turned against each other."""
    positions, uvs, faces = [[0.0, 0, 0]], [[0.0, 0]], []
    for depth, turn in ((0.25, 0.0), (0.5, 0.7)):
        angles = turn + np.arange(6) * np.pi / 3
        first = len(positions)
        positions += [[np.cos(a), np.sin(a), -depth] for a in angles]
        uvs += [[np.cos(a - turn), np.sin(a - turn)] for a in angles]
        faces += [[0, first + k, first + (k + 1) % 6] for k in range(6)]
    found = corner_frames(positions, uvs, faces, "mikktspace")[:, 0, :3]
    assert np.allclose(found[:6], [1, 0, 0], atol=1e-6)
    assert np.allclose(found[6:], [np.cos(0.7), np.sin(0.7), 0], atol=1e-6)


def test_faces_folded_onto_each_other_keep_frames_of_their_own() -> None:
    """v grows along +Y on the one and along -Y on the other; along their common edge u and v grow alike."""
    positions = [[0, 0, 0], [1, 0, 0], [0.25, 1, 0], [0.5, 0.75, 0]]
    uvs = [[0, 0], [1, 1], [0.25, 2.25], [0.5, -1]]
    found = corner_frames(positions, uvs, [[0, 1, 2], [1, 0, 3]], "mikktspace")
    wanted = np.array([[2, -1, 0], [2, 1, 0]]) / np.sqrt(5)
    assert np.allclose(found[..., :3], wanted[:, None], atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("mesh", [meshes.torus(60_000, mirrored=True), noise(DENSE, 4), soup_of(200, 5)])
def test_the_number_of_threads_changes_no_byte(mesh: Mesh, method: str) -> None:
    assert mesh.normals is not None and mesh.uvs is not None
    surface = (mesh.positions, mesh.normals, mesh.uvs, mesh.triangles)
    once = split_tangents(*surface, method=method, threads=1)
    for threads in (2, 5):
        again = split_tangents(*surface, method=method, threads=threads)
        assert [a.tobytes() for a in again] == [a.tobytes() for a in once]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("mesh", [DENSE, noise(DENSE, 6), soup_of(100, 7), sphere(6)])
def test_the_split_mesh_has_the_corners_frames(mesh: Mesh, method: str) -> None:
    found = corner_tangents(mesh, method)
    framed, plain = tangent_frames(mesh, method), split_by(mesh, tangents=found)
    for name in ("positions", "triangles", "normals", "uvs", "tangents"):
        assert np.array_equal(getattr(framed, name), getattr(plain, name)), name
    assert framed.groups == mesh.groups


def turned(
    mesh: Mesh, angles: tuple[float, float, float], scale: float
) -> tuple[Mesh, npt.NDArray[np.float64]]:
    a, b, c = angles
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    turn = x @ y @ z
    assert mesh.normals is not None
    positions = (mesh.positions.astype(np.float64) @ turn.T * scale).astype(np.float32)
    normals = (mesh.normals.astype(np.float64) @ turn.T).astype(np.float32)
    return replace(mesh, positions=positions, normals=normals), turn


@given(st.tuples(*[st.floats(-3, 3)] * 3), st.sampled_from([1e-20, 1e-3, 1.0, 250.0, 1e20]))
@settings(max_examples=25, deadline=None)
def test_turning_and_scaling_a_mesh_turns_its_frames(
    angles: tuple[float, float, float], scale: float
) -> None:
    moved, turn = turned(DENSE, angles, scale)
    before, after = corner_tangents(DENSE), corner_tangents(moved)
    assert np.array_equal(before[..., 3], after[..., 3])
    assert degrees(after, (before[..., :3].astype(np.float64) @ turn.T).astype(np.float32)) < 0.01


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("mesh", [DENSE, noise(DENSE, 8), soup_of(100, 9)])
def test_the_length_of_normals_changes_no_frame(mesh: Mesh, method: str) -> None:
    assert mesh.normals is not None
    lengths = np.random.default_rng(1).choice(np.array([0.25, 1, 8], np.float32), (len(mesh.positions), 1))
    # By position, so that vertices that are one stay one.
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    scaled = replace(mesh, normals=mesh.normals * lengths[place.reshape(-1)])
    before, after = corner_tangents(mesh, method), corner_tangents(scaled, method)
    assert np.array_equal(after[..., 3], before[..., 3])
    assert degrees(after, before) < 1e-4


@given(st.integers(0, 2**32 - 1), st.sampled_from(METHODS))
@settings(max_examples=20, deadline=None)
def test_the_order_of_faces_and_of_their_corners_does_not_matter(seed: int, method: str) -> None:
    random = np.random.default_rng(seed)
    order = random.permutation(len(DENSE.triangles))
    shift = random.integers(0, 3, len(order))
    places = (np.arange(3) + shift[:, None]) % 3
    triangles = np.take_along_axis(DENSE.triangles[order], places, axis=1)
    after = corner_tangents(replace(DENSE, triangles=np.ascontiguousarray(triangles)), method)
    before = np.take_along_axis(corner_tangents(DENSE, method)[order], places[:, :, None], axis=1)
    assert np.array_equal(after[..., 3], before[..., 3])
    assert degrees(after, before) < 1e-4


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("axis", [0, 1])
def test_mirroring_the_image_turns_the_signs(method: str, axis: int) -> None:
    assert DENSE.uvs is not None
    uvs = DENSE.uvs.copy()
    uvs[:, axis] = -uvs[:, axis]  # exact, so that no area changes by rounding
    before, after = corner_tangents(DENSE, method), corner_tangents(replace(DENSE, uvs=uvs), method)
    assert np.array_equal(after[..., 3], -before[..., 3])
    expected = before[..., :3] * np.float32(-1 if axis == 0 else 1)
    assert degrees(after, expected) < 1e-4


@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 1e-30, 1e-7, 1.0, 1e7, 1e30]),
    st.sampled_from([0.0, 1e-30, 1e-6, 1.0, 1e30]),
    st.sampled_from(METHODS),
)
@settings(max_examples=tries(150), deadline=None)
def test_slivers_of_any_size_have_frames(seed: int, squeeze: float, image: float, method: str) -> None:
    """Squeezed along an axis, in space and in the image; normals anywhere, along the surface too."""
    random = np.random.default_rng(seed)
    mesh = grid(4)
    positions, normals = random.normal(size=(25, 3)), random.normal(size=(25, 3))
    positions[:, 0] *= squeeze
    normals[:5] = [1, 0, 0]
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    uvs = random.integers(0, 4, (25, 2)) * [1.0, image]
    made = Mesh(
        positions.astype(np.float32),
        random.integers(0, 25, mesh.triangles.shape).astype(np.uint32),
        normals=normals.astype(np.float32),
        uvs=uvs.astype(np.float32),
    )
    framed = tangent_frames(made, method)
    faults = frame_faults(framed)
    assert framed.tangents is not None and np.isfinite(framed.tangents).all()
    assert faults["tangent_length"] < 1e-6 and faults["tangent_lean_deg"] < 1e-4
    assert faults["tangent_sign"] == 0


def test_errors_grow_from_tier_to_tier_and_are_told() -> None:
    mesh = meshes.sphere(20_000)
    errors = {method: frame_errors(tangent_frames(mesh, method)) for method in METHODS}
    for name in ("tangent_max_deg", "tangent_p99_deg", "tangent_mean_deg"):
        assert errors["vertex"][name] > 1000 * errors["mikktspace"][name], name
    assert errors["mikktspace"]["tangent_max_deg"] < 1e-4
    assert method_of("face") == "vertex"


def test_the_metric_tells_a_known_error() -> None:
    mesh = tangent_frames(grid(8))
    assert mesh.tangents is not None
    tangents = mesh.tangents.copy()
    tangents[:, :3] = [np.cos(0.1), 0, np.sin(0.1)]
    tangents[mesh.triangles[:4].reshape(-1), 3] *= -1
    message = frame_errors(replace(mesh, tangents=tangents))
    assert message["tangent_max_deg"] == pytest.approx(np.degrees(0.1), rel=1e-5)
    assert message["tangent_mean_deg"] == pytest.approx(np.degrees(0.1), rel=1e-5)
    turned = (tangents[mesh.triangles][..., 3] < 0).mean()
    assert turned > 0 and message["tangent_turned"] == pytest.approx(turned, rel=1e-5)


def test_a_part_of_a_large_mesh_tells_what_the_whole_does() -> None:
    framed = tangent_frames(meshes.torus(40_000, mirrored=True), "vertex")
    part, whole = frame_errors(framed, 6_000), frame_errors(framed)
    assert part["tangent_mean_deg"] == pytest.approx(whole["tangent_mean_deg"], rel=0.2)
    assert 0.3 * whole["tangent_max_deg"] < part["tangent_max_deg"] <= whole["tangent_max_deg"]
    exact = tangent_frames(meshes.torus(40_000, mirrored=True))
    assert frame_errors(exact, 6_000)["tangent_max_deg"] < 1e-4


@pytest.mark.parametrize("method", METHODS)
def test_frames_made_of_a_part_have_the_errors_of_the_whole(method: str) -> None:
    mesh = meshes.torus(40_000, mirrored=True)
    part, counted = sample_of(mesh, 6_000)
    assert len(part.triangles) < 8_000
    alone = frame_errors(tangent_frames(part, method), valid=counted)
    assert alone == pytest.approx(frame_errors(tangent_frames(mesh, method), 6_000), abs=1e-9)


def test_a_report_states_the_error_of_every_tier(tmp_path: Path) -> None:
    path, result = tmp_path / "a.obj", {}
    meshes.write_obj(sphere(24), path)
    for method in METHODS:
        report = bake_mesh(path, lods=1, tangents=method).report
        assert report["tangents"] == method
        result[method] = report["lods"][0]["tangent_mean_deg"]
    tiers = report["tangent_tiers"]
    assert list(tiers) == list(METHODS)
    assert {tier: tiers[tier]["tangent_mean_deg"] for tier in tiers} == pytest.approx(
        result, rel=1e-3, abs=1e-6
    )
    assert tiers["vertex"]["tangent_p99_deg"] > 0
    report = bake_mesh(path, lods=1, tangents="face").report
    assert report["tangents"] == "vertex" and any(
        "'vertex', which is used" in text for text in report["warnings"]
    )


def test_meshes_without_tangents_have_no_errors() -> None:
    assert set(frame_errors(grid(2)).values()) == {0.0}


def test_an_unknown_tier_is_refused() -> None:
    with pytest.raises(BakeError, match="no tangent frames 'best'"):
        tangent_frames(grid(1), "best")


@pytest.mark.deep
def test_a_mesh_is_baked_with_the_frames_asked_for(
    tmp_path: Path, paradize: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    meshes.write_obj(meshes.sphere(2_000), tmp_path / "ball.obj")
    found = {}
    for method in ("face", "vertex", "mikktspace"):
        options = ("--tangents", method, "--lods", 2, "--json")
        made = paradize("mesh", tmp_path / "ball.obj", "-o", tmp_path / "ball.glb", *options)
        assert made.returncode == 0, made.stderr
        found[method] = [level["tangent_p99_deg"] for level in json.loads(made.stdout)["lods"]]
        assert len(found[method]) == 2
    for face, vertex, exact in zip(found["face"], found["vertex"], found["mikktspace"], strict=True):
        assert face == vertex > 0 and exact < 1e-4


@pytest.mark.parametrize(
    ("name", "scale"), [("near the largest float", 3.4e38), ("below the least normal float", 1e-39)]
)
def test_coordinates_at_the_ends_of_float32_have_frames(name: str, scale: float) -> None:
    largest = np.abs(DENSE.positions).max()
    positions = (DENSE.positions.astype(np.float64) / largest * scale).astype(np.float32)
    for method in METHODS:
        faults = frame_faults(tangent_frames(replace(DENSE, positions=positions), method))
        assert faults["tangent_length"] < 1e-6 and faults["tangent_lean_deg"] < 1e-4, name
        assert faults["tangent_sign"] == 0


@pytest.mark.deep
def test_every_model_has_the_references_frames(sources: Path) -> None:
    seen = 0
    for path in sorted([*(sources / "obj-kits").rglob("*.obj"), *(sources / "tangent").rglob("*.obj")]):
        mesh = complete_normals(validate_mesh(read_obj(path).mesh)[0], crease_deg=45.0)[0]
        if mesh.uvs is None or mesh.normals is None:
            continue
        truth = mikktspace_tangents(mesh.positions, mesh.normals, mesh.uvs, mesh.triangles)
        found = corner_tangents(mesh)
        assert (found[..., 3] != truth[..., 3]).mean() <= 4e-5, path
        angles = angles_deg(found[..., :3].reshape(-1, 3), truth[..., :3].reshape(-1, 3))
        assert (angles > 1).mean() <= 1e-4, path
        seen += 1
    assert seen > 5

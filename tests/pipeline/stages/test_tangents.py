"""Tangent frames: those of MikkTSpace where the image has area, and frames all the same where it has none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.data import Group, Mesh
from paradize.errors import BakeError
from paradize.metrics.tangent import frame_errors, frame_faults
from paradize.readers.obj import read_obj
from paradize.stages.normals import complete_normals
from paradize.stages.tangents import tangent_frames
from tests.pipeline.shapes import corner_tangents, cube, grid, sphere
from tests.sweeps import tries

Corners = npt.NDArray[np.float64]


def assert_frames(mesh: Mesh) -> None:
    faults = frame_faults(mesh)
    assert faults["tangent_length"] < 1e-6 and faults["tangent_lean_deg"] < 1e-4
    assert faults["tangent_sign"] == 0 and mesh.tangents is not None
    assert np.isfinite(mesh.tangents).all()


def test_ground_has_t_along_u_and_b_up_the_image() -> None:
    """Row 0 of the image at -Z: T = +X, B = w * cross(N, T) = -Z, w = +1."""
    mesh = tangent_frames(grid(3))
    assert mesh.tangents is not None and mesh.normals is not None
    assert np.allclose(mesh.tangents, [1, 0, 0, 1], atol=1e-6)
    bitangent = mesh.tangents[:, 3:] * np.cross(mesh.normals, mesh.tangents[:, :3])
    assert np.allclose(bitangent, [0, 0, -1], atol=1e-6)
    assert len(mesh.positions) == 16


def test_a_mirrored_image_turns_the_sign_and_splits_the_vertices_between() -> None:
    mesh = grid(2)
    assert mesh.uvs is not None
    uvs = mesh.uvs.copy()
    uvs[:, 0] = np.abs(uvs[:, 0] - 0.5)
    framed = tangent_frames(replace(mesh, uvs=uvs))
    assert framed.tangents is not None
    assert len(framed.positions) == 12
    left = framed.positions[:, 0] < 0.25
    right = framed.positions[:, 0] > 0.75
    assert np.allclose(framed.tangents[left], [-1, 0, 0, -1], atol=1e-6)
    assert np.allclose(framed.tangents[right], [1, 0, 0, 1], atol=1e-6)


def test_tangents_follow_second_coordinates_where_a_material_s_normal_map_lies_on_them() -> None:
    """Two materials share vertices and both sets; where they meet, vertices are split."""
    mesh = grid(2)
    assert mesh.uvs is not None
    half = len(mesh.triangles) // 2
    groups = (Group("a", "stone", 0, half), Group("b", "moss", half, len(mesh.triangles) - half))
    mesh = replace(mesh, uvs1=np.ascontiguousarray(mesh.uvs[:, ::-1]), groups=groups)
    framed = tangent_frames(replace(mesh, second_frames=frozenset({"moss"})))
    assert framed.tangents is not None and framed.uvs is not None and framed.uvs1 is not None
    corners = framed.tangents[framed.triangles]
    assert np.allclose(corners[:half], [1, 0, 0, 1], atol=1e-6)
    assert np.allclose(corners[half:], [0, 0, 1, -1], atol=1e-6)  # u runs along Z there
    for name in ("positions", "uvs", "uvs1"):
        assert np.array_equal(getattr(framed, name)[framed.triangles], getattr(mesh, name)[mesh.triangles])
    assert len(framed.positions) == sum(len(np.unique(part)) for part in np.split(mesh.triangles, [half]))
    assert frame_errors(framed)["tangent_max_deg"] < 1e-3 and frame_errors(framed)["tangent_turned"] == 0.0
    assert frame_errors(replace(framed, second_frames=frozenset()))["tangent_max_deg"] > 80.0
    assert frame_errors(framed, 6)["tangent_max_deg"] < 1e-3  # of a sample


def test_positions_and_triangles_keep_their_values() -> None:
    mesh = sphere(12)
    framed = tangent_frames(mesh)
    assert np.array_equal(framed.positions[framed.triangles], mesh.positions[mesh.triangles])
    assert framed.uvs is not None and mesh.uvs is not None
    assert np.array_equal(framed.uvs[framed.triangles], mesh.uvs[mesh.triangles])
    assert_frames(framed)


def test_a_turned_and_scaled_mesh_has_the_turned_frames() -> None:
    mesh = sphere(10)
    turn = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], np.float32)
    assert mesh.normals is not None
    before = corner_tangents(mesh)
    after = corner_tangents(
        replace(mesh, positions=mesh.positions @ turn * np.float32(1024), normals=mesh.normals @ turn)
    )
    assert np.allclose(after[:, :, :3], before[:, :, :3] @ turn, atol=1e-6)
    assert np.array_equal(after[:, :, 3], before[:, :, 3])


def per_corner(path: Path) -> tuple[Corners, npt.NDArray[np.float32]]:
    """The stored tangents of a reference, and ours, per corner (m, 3, 4)."""
    stored = np.loadtxt(path.with_suffix(".tangents.txt"))
    faces = [
        [int(corner.split("/")[0]) - 1 for corner in line.split()[1:4]]
        for line in path.read_text().splitlines()
        if line.startswith("f ")
    ]
    mesh = complete_normals(read_obj(path).mesh, crease_deg=45.0)[0]
    return stored[np.array(faces)], corner_tangents(mesh)


@pytest.mark.parametrize(
    ("name", "off", "signs"),
    # The first comes from MikkTSpace; of the others up to 30 % of the corners lie over 1 degree from it.
    [
        ("NormalTangentMirrorTest", 0.0, 0.0),
        ("Avocado", 0.15, 0.002),
        ("BoomBox", 0.1, 0.0),
        ("Corset", 0.31, 0.0),
    ],
)
def test_frames_agree_with_published_models(corpus: Path, name: str, off: float, signs: float) -> None:
    stored, ours = per_corner(corpus / "tangent" / name / f"{name}.obj")
    known = np.isfinite(stored).all(axis=-1)
    a, b = stored[known], ours[known].astype(float)
    angle = np.degrees(
        np.arctan2(np.linalg.norm(np.cross(a[:, :3], b[:, :3]), axis=1), (a[:, :3] * b[:, :3]).sum(1))
    )
    assert known.sum() > 1000
    assert (angle > 1).mean() <= off
    assert (a[:, 3] != b[:, 3]).mean() <= signs


def test_frames_of_a_vase_are_those_of_its_formula(made: Path) -> None:
    """Its image goes round it, mirrored half-way: T lies along the turn, within half a column's angle."""
    mesh = read_obj(made / "tangent/made/vase.obj").mesh
    found = corner_tangents(mesh)
    places = mesh.positions[mesh.triangles].astype(float)
    middle = places.mean(axis=1)
    half = np.where(middle[:, 2] > 0, 1.0, -1.0)  # u rises along the turn in one half, and falls in the other
    turn = np.stack([places[:, :, 2], 0 * places[:, :, 0], -places[:, :, 0]], axis=2) * half[:, None, None]
    turn /= np.linalg.norm(turn, axis=2, keepdims=True)
    angles = np.degrees(np.arccos(np.clip((found[:, :, :3] * turn).sum(axis=2), -1, 1)))
    assert angles.max() < 360 / 32 / 2
    assert (found[:, :, 3] == found[:, :1, 3]).all() and set(found[:, 0, 3]) == {-1.0, 1.0}
    assert len(set(zip(half, found[:, 0, 3], strict=True))) == 2


@pytest.mark.parametrize("name", ["equal", "line", "tiny", "huge"])
def test_images_without_area_give_frames_all_the_same(name: str) -> None:
    mesh = sphere(6)
    assert mesh.uvs is not None
    uvs = {
        "equal": np.full_like(mesh.uvs, 0.25),
        "line": mesh.uvs * np.array([1, 0], np.float32),
        "tiny": mesh.uvs * np.float32(1e-30),
        "huge": mesh.uvs * np.float32(1e30),
    }[name]
    assert_frames(tangent_frames(replace(mesh, uvs=uvs)))


def test_a_tangent_along_the_normal_gives_a_frame() -> None:
    mesh = grid(2)
    steep = replace(mesh, normals=np.tile(np.array([1, 0, 0], np.float32), (9, 1)))
    assert_frames(tangent_frames(steep))


@pytest.mark.parametrize("scale", [1e-30, 1e30])
def test_size_does_not_matter(scale: float) -> None:
    mesh = sphere(6)
    big = tangent_frames(replace(mesh, positions=(mesh.positions * np.float32(scale)).astype(np.float32)))
    plain = tangent_frames(mesh)
    assert big.tangents is not None and plain.tangents is not None
    assert np.allclose(big.tangents[big.triangles], plain.tangents[plain.triangles], atol=1e-5)


def test_a_huge_fan_costs_bounded_time() -> None:
    count = 60_000
    angle = np.linspace(0, 6, count)
    rim = np.stack([np.cos(angle), np.zeros(count), np.sin(angle)], axis=1)
    positions = np.concatenate([[[0, 0, 0]], rim]).astype(np.float32)
    k = np.arange(1, count)
    mesh = Mesh(
        positions,
        np.stack([np.zeros(count - 1), k + 1, k], axis=1).astype(np.uint32),
        normals=np.tile(np.array([0, 1, 0], np.float32), (count + 1, 1)),
        uvs=positions[:, [0, 2]].copy(),
    )
    assert_frames(tangent_frames(mesh))


@given(
    st.lists(st.floats(-1, 1, width=32), min_size=16, max_size=16),
    st.lists(st.tuples(*[st.integers(0, 7)] * 3).filter(lambda f: len(set(f)) == 3), min_size=1, max_size=30),
)
@settings(max_examples=tries(150), deadline=None)
def test_any_image_over_any_faces_gives_frames(uvs: list[float], faces: list[tuple[int, int, int]]) -> None:
    mesh = replace(cube(), triangles=np.array(faces, np.uint32), uvs=np.array(uvs, np.float32).reshape(8, 2))
    assert_frames(tangent_frames(complete_normals(mesh, crease_deg=45.0)[0]))


def test_without_normals_or_uvs_there_is_an_error() -> None:
    with pytest.raises(BakeError, match="normals"):
        tangent_frames(replace(grid(1), normals=None))
    with pytest.raises(BakeError, match="texture coordinates"):
        tangent_frames(replace(grid(1), uvs=None))

"""The angle between mapped normals: cases whose answer is known, and its way into a scene's report."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from paradize.bakers.maps.bake import bake_maps
from paradize.bakers.mesh.bake import bake_mesh
from paradize.build.bake import bake
from paradize.build.measurements.lod_normal_error import MAPPED, measure_lod_normal_error
from paradize.data import Mesh
from paradize.kernels.reference import Shading, Surface
from paradize.material import REPEATED, Wrap
from paradize.metrics.mapped_normal import normal_error
from paradize.stages.tangents import tangent_frames
from tests.pipeline.bakers.mesh.test_extremes import write
from tests.pipeline.scenes import make_cove, make_free_cove, write_image
from tests.pipeline.shapes import grid, sphere
from tests.sweeps import sample, sweep


def tilted(degrees: np.ndarray) -> np.ndarray:
    """(h, w, 3) unit normals that lean along +u by (h, w) degrees."""
    angle = np.radians(degrees)
    return np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], -1).astype(np.float32)


def turned_frames(mesh: Mesh, degrees: float) -> Mesh:
    """Tangents of the ground turned about its normal."""
    assert mesh.tangents is not None
    tangents = mesh.tangents.copy()
    tangents[:, :3] = [np.cos(np.radians(degrees)), 0, np.sin(np.radians(degrees))]
    return replace(mesh, tangents=tangents)


@pytest.mark.parametrize("lean", sweep([0.0, 5.0, 40.0], test=[40.0]))
@pytest.mark.parametrize("turn", [0.0, 30.0, 180.0])
def test_a_frame_that_is_turned_turns_what_the_map_leans(lean: float, turn: float) -> None:
    """Two normals that lean by a, turned by t apart, enclose 2 asin(sin a sin(t / 2))."""
    ground = tangent_frames(grid(6))
    message = normal_error(ground, turned_frames(ground, turn), normal_map=tilted(np.full((4, 4), lean)))
    known = np.degrees(2 * np.arcsin(np.sin(np.radians(lean)) * np.sin(np.radians(turn / 2))))
    for key in MAPPED:
        assert message[key] == pytest.approx(known, abs=1e-3), key
    assert message["normal_max_deg"] == 0


@pytest.mark.parametrize("slid", [0.0, 0.125])
def test_a_texture_that_slid_shows_the_lean_of_another_place(slid: float) -> None:
    """A map that leans by 40 degrees per width, seen `slid` widths beside where it was."""
    ground = tangent_frames(grid(6))
    assert ground.uvs is not None
    inside = ground.uvs * np.float32(0.5) + np.float32(0.2)  # no sample meets the map's rim
    ground = replace(ground, uvs=inside)
    level = replace(ground, uvs=(inside + np.float32([slid, 0])).astype(np.float32))
    u = (np.arange(256) + 0.5) / 256
    leans = np.broadcast_to(40 * u, (4, 256))
    message = normal_error(ground, level, normal_map=tilted(leans), wrap=("clamp", "clamp"))
    assert message["mapped_mean_deg"] == pytest.approx(40 * slid, abs=0.01)
    assert message["mapped_max_deg"] == pytest.approx(40 * slid, abs=0.01)


def test_a_mirrored_sign_turns_the_bitangent_over() -> None:
    ground = tangent_frames(grid(4))
    assert ground.tangents is not None
    tangents = ground.tangents * np.float32([1, 1, 1, -1])
    lean = np.radians(20)
    up = np.tile(np.float32([0, np.sin(lean), np.cos(lean)]), (2, 2, 1))
    message = normal_error(ground, replace(ground, tangents=tangents), normal_map=up)
    assert message["mapped_mean_deg"] == pytest.approx(40, abs=1e-3)


def test_green_leans_up_the_image_whichever_way_a_frame_lies() -> None:
    """The level's normals lean to +X by as much as its map leans them back: its image's up is -X."""
    ground, lean = tangent_frames(grid(4)), np.radians(25)
    count = len(ground.positions)
    level = replace(
        ground,
        normals=np.tile(np.float32([np.sin(lean), np.cos(lean), 0]), (count, 1)),
        tangents=np.tile(np.float32([0, 0, -1, 1]), (count, 1)),
    )
    up = np.tile(np.float32([0, np.sin(lean), np.cos(lean)]), (2, 2, 1))
    for value in normal_error(ground, level, normal_map=up).values():
        assert value == pytest.approx(25, rel=1e-4)


@pytest.mark.parametrize(
    ("place", "wrap", "share"),
    sample(
        [
            (0.375, "clamp", 1.0),
            (0.5, "clamp", 0.5),
            (0.25, "repeat", 0.5),
            (1.375, "repeat", 1.0),
            (-0.625, "repeat", 1.0),
            (1.375, "clamp", 0.0),
            (-0.625, "clamp", 0.0),
            (1.375, "mirror", 0.0),
            (1.625, "mirror", 1.0),
            (-0.375, "mirror", 1.0),
            (-0.25, "mirror", 0.5),
            (2.375, "mirror", 1.0),
        ],
        every=3,
    ),
)
@pytest.mark.parametrize("axis", [0, 1])
def test_a_map_is_read_between_the_middles_of_its_texels(
    axis: int, place: float, wrap: Wrap, share: float
) -> None:
    """Of four texels the second leans; between it and its neighbour the normal lies in their middle."""
    ground = tangent_frames(grid(2))
    assert ground.uvs is not None
    uvs = np.full_like(ground.uvs, 0.5)
    uvs[:, axis] = place
    flat = uvs.copy()
    flat[:, axis] = 0.875
    line = tilted(np.array([[0.0, 30.0, 0.0, 0.0]]))
    message = normal_error(
        replace(ground, uvs=uvs),
        replace(ground, uvs=flat),
        normal_map=line if axis == 0 else line.reshape(4, 1, 3),
        wrap=(wrap, "clamp") if axis == 0 else ("clamp", wrap),
    )
    assert message["mapped_max_deg"] == pytest.approx(30 * share, abs=1e-3)


def test_a_flat_map_leaves_the_error_of_the_surface() -> None:
    source, level = (tangent_frames(sphere(rings)) for rings in (24, 8))
    flat = normal_error(source, level, normal_map=tilted(np.zeros((2, 2))))
    alone = normal_error(source, level)
    assert {key: flat[key] for key in alone} == alone  # found in the same search
    for key, value in alone.items():
        assert flat[key.replace("normal", "mapped")] == pytest.approx(value, rel=1e-4), key
    assert flat["normal_mean_deg"] > 0.1


@pytest.mark.parametrize(("share", "degrees"), [(5e-4, 0.0), (5e-3, 180.0)])
def test_the_side_that_is_meant_may_lie_a_thousandth_behind_the_other(share: float, degrees: float) -> None:
    """Two sheets, the upper one facing up, and the same with the lower one facing up."""
    ground = grid(4)
    assert ground.normals is not None
    low = ground.positions - np.float32([0, share * 2**0.5, 0])
    count = len(low)
    both = np.concatenate([ground.positions, low])
    turned = ground.triangles[:, ::-1]
    up, down = ground.normals, -ground.normals
    plank = Mesh(both, np.concatenate([ground.triangles, turned + count]), np.concatenate([up, down]))
    inside_out = Mesh(both, np.concatenate([turned, ground.triangles + count]), np.concatenate([down, up]))
    for value in normal_error(plank, inside_out, surface_error=0.0).values():
        assert value == pytest.approx(degrees, abs=1e-4)


def test_the_side_that_is_meant_may_lie_twice_as_far_as_the_other() -> None:
    """A plank a thousandth thick and the same a twentieth below: the nearer side is not the one that is
    meant."""
    ground = grid(4)
    assert ground.normals is not None
    sheets = [ground.positions - np.float32([0, depth, 0]) for depth in (0.0, 0.001, 0.05, 0.051)]
    faces = np.concatenate([ground.triangles, ground.triangles[:, ::-1] + len(ground.positions)])
    normals = np.concatenate([ground.normals, -ground.normals])
    planks = [Mesh(np.concatenate(pair), faces, normals) for pair in (sheets[:2], sheets[2:])]
    for value in normal_error(*planks, surface_error=0.0).values():
        assert value == pytest.approx(0, abs=1e-4)


@pytest.mark.parametrize("turn", range(3))
def test_beyond_an_edge_the_nearest_place_of_the_edge_is_what_shows(turn: int) -> None:
    """A triangle whose normals differ at every corner, and a square beside it that goes on from its edge."""
    leans = np.radians([40.0, 0.0, 25.0])
    normals = np.stack([np.sin(leans), np.cos(leans), 0 * leans], axis=1)
    points = np.array([(0, 0, 0.3), (1, 0, 1), (1, 0, 0)])
    order = np.roll(np.arange(3), turn)
    truth = Shading(Surface(points, [order]), normals, None, None)
    square = np.array([(1, 0, 0), (1, 0, 1), (2, 0, 1), (2, 0, 0)])
    faces = np.array([(0, 1, 2), (0, 2, 3)])
    seen = Shading(Surface(square, faces), normals[[2, 1, 1, 2]], None, None)
    (_, _, largest), _ = seen.angles_to(truth, near=0.0, samples=1000)
    assert largest < 1e-4


def test_without_normals_there_is_no_error() -> None:
    ball = tangent_frames(sphere(8))
    for pair in ((ball, replace(ball, normals=None)), (replace(ball, normals=None), ball)):
        assert set(normal_error(*pair, normal_map=tilted(np.full((2, 2), 9.0))).values()) == {0.0}


def test_without_tangents_a_map_turns_nothing() -> None:
    source, level = sphere(12), sphere(6)
    message = normal_error(tangent_frames(source), level, normal_map=tilted(np.full((2, 2), 30.0)))
    assert message["normal_max_deg"] > 0.1
    for key in MAPPED:
        assert message[key] == message[key.replace("mapped", "normal")]


def ridges(path: Path, grain: int) -> Path:
    """64 x 64 texels of ridges that stand `grain` codes about the middle."""
    pixels = 128 + grain * np.round(np.sin(np.arange(64) / 3))
    write_image(path, np.ascontiguousarray(np.broadcast_to(pixels[None, :, None], (64, 64, 3)), np.uint8))
    return path


def test_levels_are_judged_with_their_bumps_and_the_finest_has_no_error(tmp_path: Path) -> None:
    made = bake_mesh(write(tmp_path / "ball.obj", sphere(12)), lods=3)
    result = {}
    for grain in (0, 100):
        maps = bake_maps(
            ridges(tmp_path / f"{grain}.png", grain), only=("normal",), wrap="repeat", strength=1.0
        )
        used = {group.material for group in made.lods[0].mesh.groups}
        result[grain] = measure_lod_normal_error(
            made.glb, maps["normal"].data, name="ball", wrap=REPEATED, materials=used
        )
    plain = made.report["lods"]
    assert len(plain) == 3 and [result[100][0][key] for key in MAPPED] == [0, 0, 0]
    for level, smooth, bumpy in zip(plain[1:], result[0][1:], result[100][1:], strict=True):
        assert smooth["mapped_mean_deg"] == pytest.approx(level["normal_mean_deg"], rel=0.02)
        assert bumpy["mapped_mean_deg"] > 1.2 * smooth["mapped_mean_deg"]
        assert bumpy["mapped_mean_deg"] <= bumpy["mapped_p99_deg"] <= bumpy["mapped_max_deg"]


def test_a_scene_tells_the_mapped_error_of_every_level_and_budgets_know_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cove_store: Callable[[Path], Path]
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    scene = make_free_cove(tmp_path)
    scene.write_text(scene.read_text() + "[budget]\nlod_mapped_p99_deg = 1e-9\n")
    report = bake(scene, tmp_path / "out")
    assert any("lod_mapped_p99_deg" in text and "post_mesh" in text for text in report.warnings)
    result = json.loads((tmp_path / "out/scene.json").read_text())["artifacts"]["post_mesh"]
    first, *others = result["levels"]
    assert [first[key] for key in MAPPED] == [0, 0, 0]
    assert others and all(level["mapped_p99_deg"] >= level["mapped_mean_deg"] > 0 for level in others)
    assert result["errors"]["lod_mapped_p99_deg"] == max(level["mapped_p99_deg"] for level in others)
    (row,) = (row for row in report.rows if row["name"] == "post_mesh")
    assert row["errors"] == result["errors"] and any("lod_mapped_p99_deg" in text for text in row["over"])
    again = bake(scene, tmp_path / "elsewhere")
    assert again.warnings == report.warnings and again.count("baked") == 0
    (same,) = (row for row in again.rows if row["name"] == "post_mesh")
    assert same["levels"] == row["levels"]


@pytest.mark.parametrize("tier", ["vertex", "mikktspace"])
def test_a_scene_chooses_its_tangent_frames(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cove_store: Callable[[Path], Path], tier: str
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    scene = make_cove(tmp_path)
    scene.write_text(scene.read_text().replace('name = "post"', f'name = "post"\ntangents = "{tier}"'))
    row = next(row for row in bake(scene, tmp_path / "out").rows if row["name"] == "post_mesh")
    off = row["errors"]["tangent_mean_deg"]
    assert off > 0.05 if tier == "vertex" else off < 1e-3

"""A level of detail takes over only where it looks like the finest, and is not baked where that never is."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.artifact import SEEN, Artifact
from paradize.build.bake import bake
from paradize.build.manifest import MeshFacts
from paradize.build.measurements.lods_seen import measure_lods_seen
from paradize.build.measurements.switches import with_levels_seen
from paradize.build.options import BuildOptions
from paradize.build.trim import levels_never_drawn
from paradize.build.verify import verify
from paradize.data import Lod, Mesh, Texture
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.metrics import seen, switch
from paradize.scene.settings import load_scene
from paradize.stages.tangents import tangent_frames
from tests.pipeline.scenes import make_cove, make_free_cove
from tests.pipeline.shapes import sphere
from tests.pipeline.small_scenes import make_free_post, make_post
from tests.sweeps import sweep

LIMITS = {"normal_deg": 5.0, "silhouette": 0.05}
BARE = {"normal": None, "alpha": None, "cutoff": 0.0, "wrap": None, "two_sided": False}
BARE |= {"color": None, "color_factor": [0.5, 0.5, 0.5], "emission": None, "emission_factor": [0.0, 0.0, 0.0]}


@pytest.fixture(autouse=True)
def _few_directions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Levels are compared from 6 sides, and in one picture: tests/pipeline/metrics/ takes all of them."""
    monkeypatch.setattr(seen, "DIRECTIONS", 6)
    monkeypatch.setattr(switch, "_PIXELS", 0.0)
    monkeypatch.setattr(switch, "_LEAST_DIRECTIONS", 1)


def ball(*meshes: Mesh) -> bytes:
    return encode_glb([Lod(mesh, 1e-3 * k, 0.0) for k, mesh in enumerate(meshes)], "ball")


def measured(
    glb: bytes,
    errors_m: list[float],
    flip: float = 1.0,
    skin: dict[str, Any] = BARE,
    textures: dict[str, bytes] | None = None,
    **limits: float,
) -> list[dict[str, Any]]:
    return measure_lods_seen(
        glb,
        textures or {},
        name="ball",
        materials={"skin": skin},
        errors_m=errors_m,
        error_px=1.0,
        limits=LIMITS | limits,
        flip=flip,
    )


def turned(mesh: Mesh, degrees: float) -> Mesh:
    """Its normals turned about the X axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    assert mesh.normals is not None
    return replace(mesh, normals=(mesh.normals @ turn.T).astype(np.float32))


def test_a_level_whose_normals_lie_takes_over_nowhere_however_near_its_surface_is() -> None:
    fine = sphere(12)
    true, lies = (measured(ball(fine, level), [0.0, 0.05]) for level in (fine, turned(fine, 30.0)))
    assert true[1]["switch_m"] == 0.05 and true[1]["seen_p99_deg"] == 0
    assert lies[1]["switch_m"] is None and lies[1]["seen_mean_deg"] > 10
    assert measured(ball(fine, turned(fine, 30.0)), [0.0, 0.05], normal_deg=180.0)[1]["switch_m"] == 0.05


def test_a_level_that_looks_alike_from_afar_takes_over_there_and_no_coarser_one_before_it() -> None:
    """Of a ball with bumps that the levels lack."""
    fine = sphere(24)
    assert fine.normals is not None
    tilt = 0.3 * np.sin(40.0 * fine.positions) * [1.0, 0.0, 1.0]
    bumpy = fine.normals + tilt
    bumpy /= np.linalg.norm(bumpy, axis=1, keepdims=True)
    levels = measured(
        ball(replace(fine, normals=bumpy.astype(np.float32)), sphere(16), sphere(12)), [0.0, 5e-3, 5e-3]
    )
    for level in levels[1:]:
        assert level["switch_m"] > 5e-3 and level["seen_p99_deg"] <= 5
        assert level["switch_m"] * level["seen_px"] == pytest.approx(2 * np.sqrt(3), rel=0.02)
    assert levels[1]["seen_px"] >= levels[2]["seen_px"]
    assert levels[0] == dict.fromkeys(levels[0], 0.0)


@pytest.mark.parametrize("role", ["painted", "glows"])
def test_a_level_that_shows_another_colour_takes_over_nowhere(role: str) -> None:
    """Its surface and normals are those of the finest; its texture lies the other way round."""
    fine = sphere(12)
    assert fine.uvs is not None
    slid = replace(fine, uvs=1.0 - fine.uvs)
    texels = np.zeros((16, 16, 4), np.uint8)
    texels[:, :, 3], texels[:8, :, 0], texels[8:, :, 2] = 255, 200, 200
    map_of = {"painted": "color", "glows": "emission"}[role]
    black = {"color_factor": [0.0, 0.0, 0.0], "emission_factor": [1.0, 1.0, 1.0]} if role == "glows" else {}
    skin = BARE | black | {map_of: "skin_map"}
    textures = {"skin_map": encode_ktx2(Texture("RGBA8_SRGB", 16, 16, (texels.tobytes(),)))}
    alike = measured(ball(fine, fine), [0.0, 0.05], 0.01, skin, textures)[1]
    other = measured(ball(fine, slid), [0.0, 0.05], 0.01, skin, textures)[1]
    assert alike["switch_m"] == 0.05 and alike["seen_flip"] == 0
    assert other["switch_m"] is None and other["seen_flip"] > 0.05
    assert (other["seen_p99_deg"], other["seen_silhouette"]) == (0, 0)
    assert measured(ball(fine, slid), [0.0, 0.05], 1.0, skin, textures)[1]["switch_m"] == 0.05


@pytest.mark.parametrize("tilt_deg", sweep([20.0, 40.0], test=[40.0]))
def test_a_level_whose_normal_map_leans_the_other_way_is_off_by_twice_its_tilt(tilt_deg: float) -> None:
    """All texels lean along +X of the texture, which lies the other way round on the level."""
    fine = sphere(24)
    assert fine.uvs is not None
    mirrored = replace(fine, uvs=fine.uvs * np.float32([-1.0, 1.0]) + np.float32([1.0, 0.0]))
    texels = np.zeros((4, 4, 2), np.int8)
    texels[:, :, 0] = round(127 * np.sin(np.radians(tilt_deg)))
    textures = {"skin_map": encode_ktx2(Texture("RG8_SNORM", 4, 4, (texels.tobytes(),)))}
    levels = ball(tangent_frames(fine), tangent_frames(mirrored))
    level = measured(levels, [0.0, 0.05], 1.0, BARE | {"normal": "skin_map"}, textures)[1]
    assert level["seen_p99_deg"] == pytest.approx(2.0 * tilt_deg, abs=1.0)


def two_levels(scene: Path) -> Path:
    scene.write_text(scene.read_text().replace("lods = 3", "lods = 2"))
    return scene


def baked(top: Path, **head: float) -> dict[str, Any]:
    scene = two_levels(make_free_post(top / "scene"))
    words = "".join(f"{key} = {value}\n" for key, value in head.items())
    scene.write_text(scene.read_text().replace('name = "cove"\n', f'name = "cove"\n{words}'))
    report = bake(scene, top / "out", BuildOptions(jobs=1))
    assert not report.errors, report.errors
    found: dict[str, Any] = json.loads((top / "out/scene.json").read_text())
    return found


def test_a_scene_draws_its_levels_where_they_look_alike(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    any_of_them = baked(tmp_path / "any", lod_error_deg=180.0, lod_silhouette=1.0, lod_flip=1.0)
    strict = baked(tmp_path / "strict", lod_error_deg=3.0, lod_silhouette=0.02)
    item, other = any_of_them["objects"][0], strict["objects"][0]
    mesh, less = (found["artifacts"]["post_mesh"] for found in (any_of_them, strict))
    file = (tmp_path / "any/out" / mesh["file"]).read_bytes()
    nodes = json.loads(file[20 : 20 + int.from_bytes(file[12:16], "little")])["nodes"]
    assert [lod["error_m"] for lod in item["lods"]] == [node["extras"]["error_m"] for node in nodes]
    assert len(other["lods"]) == len(less["levels"])
    for lod, easy, level in zip(other["lods"][1:], item["lods"][1:], less["levels"][1:], strict=False):
        assert lod["error_m"] >= easy["error_m"]
        assert lod["error_m"] >= item["radius_m"] or level["seen_p99_deg"] <= 3.0
        assert lod["error_m"] >= item["radius_m"] or level["seen_silhouette"] <= 0.02
    assert less["errors"]["lod_seen_p99_deg"] <= 3.0
    assert less["sha256"] == mesh["sha256"]


def test_levels_that_no_view_of_the_flight_draws_are_not_published(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    free = baked(tmp_path / "free")
    scene = two_levels(make_post(tmp_path / "flown"))
    report = bake(scene, tmp_path / "flown/out", BuildOptions(jobs=1))
    assert not report.errors, report.errors
    flown = json.loads((tmp_path / "flown/out/scene.json").read_text())
    lods, all_of_them = flown["objects"][0]["lods"], free["objects"][0]["lods"]
    mesh, whole = flown["artifacts"]["post_mesh"], free["artifacts"]["post_mesh"]
    gone = mesh["required_detail"]["coarser_left_out"]
    assert gone == len(all_of_them) - len(lods) >= 1
    assert "coarser_left_out" not in whole["required_detail"]
    assert lods == all_of_them[: len(lods)] and mesh["levels"] == whole["levels"][: len(lods)]
    assert mesh["required_detail"]["saved_bytes"] == whole["bytes"] - mesh["bytes"] > 0
    drawn = decode_glb((tmp_path / "flown/out" / mesh["file"]).read_bytes())
    assert [len(lod.mesh.triangles) for lod in drawn] == [level["triangles"] for level in mesh["levels"]]
    worst = max(level["error_max"] for level in mesh["levels"])
    assert mesh["errors"]["surface_max"] == worst < whole["errors"]["surface_max"]


def test_a_level_is_selected_by_no_less_than_its_own_error(tmp_path: Path) -> None:
    """Level 0 of quantised vertices has an error, too; a level that looks alike nowhere may be off by more
    than the pixel in which it is drawn."""
    nodes = (("lod0", 0.002), ("lod1", 0.003), ("lod2", 9.0))
    facts = MeshFacts((-1.0,) * 3, (1.0,) * 3, nodes, {}, (0.002, 0.003, 9.0))
    found = [dict.fromkeys(SEEN, 0.0) | {"switch_m": switch_m} for switch_m in (0.0, 0.5, None)]
    post = Artifact("post_mesh", levels=[{}, {}, {}])
    _, selected = with_levels_seen(load_scene(make_post(tmp_path)), post, facts, found)
    assert selected.switch_m == (0.002, 0.5, 9.0)


@pytest.mark.deep  # of levels that are too fine: tests/pipeline/visibility/test_required_detail.py
def test_levels_that_are_not_published_are_derived_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = two_levels(make_post(tmp_path / "flown"))
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
    mesh = json.loads((tmp_path / "out/scene.json").read_text())["artifacts"]["post_mesh"]
    assert mesh["required_detail"]["coarser_left_out"] == 1
    _, errors = verify(scene, report, percent=100.0, options=BuildOptions(jobs=1))
    assert not report.errors and not errors


@pytest.mark.parametrize(
    ("switch_m", "pixel_m", "never"),
    [
        ((0.0, 0.1, 0.2), 0.1, 0),
        ((0.0, 0.1, 0.31), 0.1, 1),  # 3 pixels at most, in the player's quality `fast`
        ((0.0, 0.31, 0.31), 0.1, 2),
        ((0.5, 0.6, 0.7), 0.1, 2),  # one stays
        ((0.0, 0.4, 0.5), None, 0),
    ],
)
def test_a_level_is_drawn_where_the_farthest_view_has_its_size(
    switch_m: tuple[float, ...], pixel_m: float | None, never: int, tmp_path: Path
) -> None:
    facts = MeshFacts((0.0,) * 3, (1.0,) * 3, (), {}, switch_m)
    assert levels_never_drawn(load_scene(make_cove(tmp_path)), facts, pixel_m) == never
    assert levels_never_drawn(load_scene(make_free_cove(tmp_path)), facts, pixel_m) == 0

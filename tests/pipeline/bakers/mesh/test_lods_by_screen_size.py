"""Levels by how they look: each may take over at its size on the screen and is as coarse as may be there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers.mesh.lods import Plan, make_levels
from paradize.bakers.mesh.lods_by_screen_size import ScreenSize
from paradize.build.materials.map_sets import find_map_sets
from paradize.data import Group, Mesh
from paradize.material import Material
from paradize.metrics.seen import Limits, largest_size, seen_difference, seen_mesh
from paradize.metrics.surface import Original
from paradize.scene.baker_settings import MeshSettings
from paradize.scene.requirements import require
from paradize.scene.settings import load_scene
from paradize.stages.lod import simplify
from tests.pipeline.scenes import make_cove
from tests.pipeline.shapes import sphere


def levels_of(mesh: Mesh, plan: Plan) -> list[Mesh]:
    return [step.mesh for step in make_levels(mesh, plan, "balanced")[0]]


def alike(mesh: Mesh, level: Mesh, size_px: float, limits: Limits) -> bool:
    return seen_difference(seen_mesh(mesh, {}), seen_mesh(level, {}), size_px).inside(limits)


def test_each_level_looks_alike_at_its_size_and_one_of_fewer_triangles_does_not() -> None:
    ball, limits = sphere(10), Limits(normal_deg=5.0, silhouette=0.02)
    size = ScreenSize(16.0, limits.normal_deg, limits.silhouette, flip=1.0)
    levels = levels_of(ball, Plan(count=3, screen_size=size))
    assert len(levels) == 3
    for before, level, size_px in zip(levels, levels[1:], (16.0, 8.0), strict=False):
        assert alike(ball, level, size_px, limits)
        fewer = simplify(before, int(0.85 * len(level.triangles)), original=ball).mesh
        assert not alike(ball, fewer, size_px, limits)


def test_a_model_whose_half_is_drawn_nowhere_gets_a_level_that_is_drawn() -> None:
    """A low ball: half of its triangles change its silhouette at any size."""
    ball, limits = sphere(5), Limits()
    finest = seen_mesh(ball, {})
    half = levels_of(ball, Plan(count=2))[1]
    assert largest_size(finest, seen_mesh(half, {}), limits, 64.0) is None
    lax = ScreenSize(16.0, 180.0, 0.02, flip=1.0)
    found = levels_of(ball, Plan(count=2, screen_size=lax))
    assert len(half.triangles) < len(found[1].triangles) < len(ball.triangles)
    assert alike(ball, found[1], 16.0, Limits(180.0, 0.02))


def test_a_refined_level_that_no_longer_looks_alike_stays_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    def halved(judge: Original, before: Mesh, level: Mesh, errors: Any, *_: object) -> tuple[Mesh, Any]:
        return simplify(level, len(level.triangles) // 2, original=judge.mesh).mesh, errors

    monkeypatch.setattr("paradize.bakers.mesh.lods.refine_level", halved)
    plan = Plan(count=2, screen_size=ScreenSize(16.0, 180.0, 0.02, flip=1.0))
    balanced, exact = (make_levels(sphere(5), plan, tier)[0][1] for tier in ("balanced", "exact"))
    assert len(exact.mesh.triangles) == len(balanced.mesh.triangles)


@pytest.mark.deep
def test_where_no_level_looks_alike_the_note_says_what_is_off_and_what_is_allowed() -> None:
    ball = sphere(5)
    levels, notes = make_levels(ball, Plan(count=2, screen_size=ScreenSize(64.0, 0.001, 0.0001)), "balanced")
    assert len(levels) == 1
    assert "no level after lod0: " in notes[0] and "look unlike the source at 64 pixels" in notes[0]
    assert "degrees, limit 0.001, silhouette by " in notes[0] and "limit 0.0001" in notes[0]
    _, notes = make_levels(ball, Plan(count=2, screen_size=ScreenSize(64.0, 0.001, 1.0)), "balanced")
    assert "degrees, limit 0.001" in notes[0] and "silhouette" not in notes[0]  # which is within its limit


@pytest.mark.deep
@pytest.mark.parametrize(
    "plan",
    [
        Plan(count=4, screen_size=ScreenSize(64.0, 0.001, 0.0001)),
        Plan(count=4, errors=(1e-7, 2e-7, 3e-7)),
    ],
)
def test_a_model_that_gets_no_level_is_told_once_however_many_were_tried(plan: Plan) -> None:
    levels, notes = make_levels(sphere(5), plan, "balanced")
    assert len(levels) == 1
    (result,) = [text for text in notes if text.startswith("no level after lod0: ")]
    assert ("at 16 pixels" if plan.screen_size else "limit 3e-07") in result


def test_a_sheet_that_lost_a_part_was_bent_or_turned_over_looks_unlike() -> None:
    leaf = Mesh(
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.uint32),
        np.tile(np.float32([0, 0, 1]), (4, 1)),
        groups=(Group("leaf", "leaf", 0, 2),),
    )
    judge = ScreenSize(32.0, 10.0, 0.01, flip=1.0).judge(leaf, 1, leaf)
    assert judge.accepts(leaf) and judge.fault(leaf) == ""
    half = replace(leaf, triangles=leaf.triangles[:1], groups=(Group("leaf", "leaf", 0, 1),))
    assert "silhouette" in judge.fault(half)
    over = replace(leaf, triangles=np.ascontiguousarray(leaf.triangles[:, ::-1]))
    assert "silhouette" in judge.fault(over)
    bent = replace(leaf, normals=np.tile(np.float32([0.6, 0, 0.8]), (4, 1)))
    assert judge.fault(bent).endswith(": normals by 36.9 degrees, limit 10")


def test_a_level_whose_switch_shows_more_than_the_limit_is_refused() -> None:
    """A leaf turned by 8 degrees towards the light: within the limits of normals and silhouette."""
    leaf = Mesh(
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.uint32),
        np.tile(np.float32([0, 0, 1]), (4, 1)),
        groups=(Group("leaf", "leaf", 0, 2),),
    )
    lit = replace(leaf, normals=np.tile(np.float32([0, 0.139173, 0.990268]), (4, 1)))
    assert ScreenSize(32.0, 10.0, 0.01, flip=1.0).judge(leaf, 1, leaf).accepts(lit)
    strict = ScreenSize(32.0, 10.0, 0.01).judge(leaf, 1, leaf)
    assert not strict.accepts(lit) and "of FLIP, limit 0.0056" in strict.fault(lit)


def test_sizes_are_halved_and_never_smaller_than_what_can_be_told_apart() -> None:
    size = ScreenSize(20.0)
    assert [size.of_level(level) for level in range(1, 6)] == [20.0, 10.0, 5.0, 4.0, 4.0]


def test_a_scene_passes_its_limits_to_the_levels_that_ask_for_them(tmp_path: Path) -> None:
    def settings_of(words: str, head: str = "", material: str = "") -> Any:
        path = make_cove(tmp_path)
        text = path.read_text().replace("lods = 3", f"lods = 3\n{words}")
        text = text.replace("specular = 0.2", f"specular = 0.2\n{material}")
        path.write_text(text.replace('name = "cove"\n', f'name = "cove"\n{head}'))
        scene = load_scene(path)
        jobs = require(scene, find_map_sets(scene, path).maps).jobs
        return next(job for job in jobs if job.name == "post mesh").settings["screen_size"]

    assert settings_of("") is None
    assert settings_of('lods_by = "screen_size"') == {
        "size_px": 256.0, "normal_deg": 10.0, "silhouette": 0.004, "flip": 0.01, "two_sided": [],
    }  # fmt: skip
    head = "lod_error_deg = 5\nlod_silhouette = 0.01\nlod_flip = 0.02\n"
    assert settings_of('lods_by = "screen_size"\nlod_size_px = 64', head) == {
        "size_px": 64.0, "normal_deg": 5.0, "silhouette": 0.01, "flip": 0.02, "two_sided": [],
    }  # fmt: skip
    by_size = 'lods_by = "screen_size"'
    assert settings_of(by_size, material="two_sided = true")["two_sided"] == ["wood"]


def test_the_judge_draws_back_faces_of_two_sided_materials_alone() -> None:
    """Half of a leaf's triangles turned round: unlike where back faces are not drawn, the same where they
    are."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    group = (Group("leaf", "leaf", 0, 2),)
    leaf = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), groups=group)
    turned = replace(leaf, triangles=np.array([[0, 1, 2], [3, 2, 0]], np.uint32))
    for two_sided, accepted in ((("leaf",), True), ((), False), (("bark",), False)):
        judge = ScreenSize(16.0, two_sided=two_sided).judge(leaf, 1, leaf)
        assert judge.accepts(turned) is accepted
        assert (judge.fault(turned) == "") is accepted


def test_a_model_says_which_materials_are_two_sided_where_no_scene_does() -> None:
    materials = {name: Material(name, two_sided=name == "leaf") for name in ("leaf", "bark")}
    for screen_size, names in (
        ({"size_px": 8.0}, ("leaf",)),
        ({"size_px": 8.0, "two_sided": ["bark"]}, ["bark"]),
    ):
        plan = Plan.of(MeshSettings(screen_size=screen_size), materials)
        assert plan.screen_size is not None and plan.screen_size.two_sided == names
    assert Plan.of(MeshSettings(), materials) == Plan()

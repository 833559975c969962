"""Which stage spends the frame's error, by the player's own pictures of a small scene."""

from __future__ import annotations

from pathlib import Path

import pytest

from paradize.build.bake import bake
from paradize.build.materials.map_sets import find_map_sets
from paradize.build.options import BuildOptions
from paradize.errors import BakeError
from paradize.scene.requirements import require
from paradize.scene.settings import load_scene
from paradize.tradeoff import attribution
from paradize.tradeoff.attribution import attribute, swaps
from tests.conftest import RENDER_ENVIRONMENT
from tests.pipeline.scenes import make_cove
from tests.places import ROOT

PLAYER = ROOT / "build/bin/paradize-player"


@pytest.mark.deep
def test_a_swapped_stage_changes_the_picture_and_none_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    for name, value in RENDER_ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(attribution, "SIZE", "160x90")
    monkeypatch.setattr(attribution, "MOMENTS", 1)
    path = make_cove(tmp_path / "cove")
    scene = load_scene(path)
    used = bake(path, tmp_path / "used", BuildOptions(tier="fast"))
    assert not used.errors
    jobs = require(scene, find_map_sets(scene, path).maps).jobs
    stages = swaps(jobs, {row["name"]: row["tier"] for row in used.rows})
    names = [stage for stage, _ in stages]
    assert names[:3] == ["levels of detail", "terrain", "colour textures"]
    colors = next(tasks for stage, tasks in stages if stage == "colour textures")
    assert set(colors) == {"sand colour", "effect colour", "post colour"}

    parts = [("colour textures", colors), ("nothing", [])]
    found = attribute(path, scene, parts, tmp_path / "used", "fast", PLAYER, tmp_path)
    assert [bar["stage"] for bar in found] == ["colour textures", "nothing"]
    assert 0.0 < found[0]["flip_mean"] <= found[0]["flip_max"] <= 1.0
    assert (found[1]["flip_mean"], found[1]["flip_p99"], found[1]["flip_max"]) == (0.0, 0.0, 0.0)


def test_what_is_exact_already_is_not_swapped(tmp_path: Path) -> None:
    path = make_cove(tmp_path)
    scene = load_scene(path)
    jobs = require(scene, find_map_sets(scene, path).maps).jobs
    wanted = {output.artifact: "exact" for job in jobs for output in job.outputs}
    assert swaps(jobs, wanted) == []
    assert [stage for stage, _ in swaps(jobs, wanted | {"terrain_mesh": "balanced"})] == ["terrain"]


def test_a_player_that_draws_nothing_is_told(tmp_path: Path) -> None:
    scene = load_scene(make_cove(tmp_path))
    with pytest.raises(BakeError, match="drew nothing"):
        attribute(tmp_path / "cove.toml", scene, [], tmp_path, None, Path("/bin/false"), tmp_path)

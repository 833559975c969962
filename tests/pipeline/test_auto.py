"""Tiers task by task: each is baked in the tier that is asked of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from paradize.bake import bake
from paradize.bake_tasks import How
from paradize.errors import BakeError
from tests.pipeline.scenes import make_cove


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    return make_cove(tmp_path / "scene")


def test_a_task_bakes_in_its_own_tier_and_the_others_are_reused(scene: Path, tmp_path: Path) -> None:
    base = bake(scene, tmp_path / "base", How(jobs=2, tier="fast"))
    for name in ("post maps", "post_gloss"):  # by the task's name, or one of its artifacts'
        other = bake(scene, tmp_path / "other", How(jobs=2, tier="fast", tiers={name: "exact"}))
        tiers = {row["name"]: row["tier"] for row in other.artifacts}
        changed = {row["name"] for row in base.artifacts if row["tier"] != tiers[row["name"]]}
        assert changed == {"post_normal", "post_height", "post_gloss"}
        assert tiers["post_normal"] == "exact"
    again = bake(scene, tmp_path / "base", How(jobs=2, tier="fast"))
    assert {row["name"]: row["sha256"] for row in again.artifacts} == {
        row["name"]: row["sha256"] for row in base.artifacts
    }


def test_a_tier_of_what_is_not_there_is_refused(scene: Path, tmp_path: Path) -> None:
    with pytest.raises(BakeError, match=r"no task 'pots mesh'.*post mesh"):
        bake(scene, tmp_path / "out", How(tiers={"pots mesh": "fast"}))

"""Tier `auto` turns the terrain's bound before it makes every pixel a vertex."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.build.single_file import bake_single
from paradize.build.tiers.tuned_settings import (
    STEPS,
    by_cost,
    next_label,
    next_value,
    split_label,
    tuned_label,
)
from paradize.build.verify import verify
from paradize.errors import ParadizeError
from paradize.explain.facts import explain
from paradize.explain.words import render
from paradize.scene.baker_settings import TerrainSettings
from paradize.tiers import FINER_FORMAT
from tests.pipeline.heights import save, waves
from tests.pipeline.scenes import make_cove
from tests.sweeps import sweep

TERRAIN = TerrainSettings(size_m=(400.0, 400.0), height_m=60.0, max_error_m=2.0)


def rough(path: Path) -> Path:
    """Hills with grain: no two of its bounds give the same mesh."""
    grain = np.random.default_rng(7).normal(size=(97, 97))
    codes = (waves(97, 97, 5, 30.0) * 4000 + 1200 * grain + 30000).clip(0, 65535).astype(np.uint16)
    return save(path, codes[:, :, None], oiio.UINT16)


def baked(path: Path, tier: str, budget: dict[str, float], **more: Any) -> dict[str, Any]:
    return bake_single("terrain", path, replace(TERRAIN, **more), tier=tier, budget=budget).report


@pytest.mark.parametrize(
    ("metric", "limit"),
    sweep(
        [("terrain_rms_m", 0.25), ("terrain_max_m", 0.8), ("terrain_rms_m", 0.05)],
        test=[("terrain_max_m", 0.8)],
    ),
)
def test_a_bound_between_the_tiers_keeps_the_budget_with_fewer_triangles(
    tmp_path: Path, metric: str, limit: float
) -> None:
    path = rough(tmp_path / "h.png")
    made, exact = baked(path, "auto", {metric: limit}), baked(path, "exact", {})
    key = {"terrain_rms_m": "rms_error_m", "terrain_max_m": "max_error_m"}[metric]
    taken = made["tried"]["taken"]
    tier, tuned = split_label(taken)
    assert tier == "balanced" and 0.0 < tuned["max_error_m"] == made["bound_m"] < 2.0
    assert made[key] <= limit and made["triangles"] < exact["triangles"]
    assert "exact" not in made["tried"]["errors"] and len(made["tried"]["errors"]) <= 2 + STEPS
    looser = baked(path, "balanced", {}, max_error_m=1.1 * tuned["max_error_m"])
    assert looser[key] > 0.95 * limit, "a looser bound would have kept it"
    assert baked(path, "auto", {metric: limit}) == made, "the same again"


def test_what_no_bound_keeps_is_every_pixel_and_what_a_tier_keeps_is_that_tier(tmp_path: Path) -> None:
    path = rough(tmp_path / "h.png")
    assert baked(path, "auto", {"terrain_rms_m": 1e-5})["tried"]["taken"] == "exact"
    with pytest.raises(ParadizeError, match=r"no tier keeps the budget: .* \(tier exact\)"):
        baked(path, "auto", {"terrain_rms_m": 0.0})
    assert baked(path, "auto", {"terrain_rms_m": 5.0})["tried"]["taken"] == "fast"
    assert "tried" not in baked(path, "balanced", {"terrain_rms_m": 0.25})


def test_values_halve_until_one_is_inside_and_then_close_in() -> None:
    tried: dict[float, bool] = {}
    while (value := next_value(8.0, tried)) is not None:
        tried[value] = value <= 0.7
    assert list(tried)[:5] == [4.0, 2.0, 1.0, 0.5, 0.707]
    best = max(value for value, good in tried.items() if good)
    assert 0.65 < best <= 0.7 and len(tried) <= STEPS
    assert next_value(8.0, {8.0 / 2**k: False for k in range(1, STEPS + 1)}) is None


def test_labels_hold_their_setting_exactly_and_stand_in_order_of_cost() -> None:
    from paradize.build.tiers.tuned_settings import TUNED_SETTINGS

    tuned = [tuned_label(TUNED_SETTINGS["terrain"], value) for value in (0.125, 3.39, 1e-07)]
    assert [split_label(label)[1]["max_error_m"] for label in tuned] == [0.125, 3.39, 1e-07]
    order = ["fast", "balanced", tuned[1], tuned[0], tuned[2], "exact", *FINER_FORMAT]
    assert by_cost(reversed(order)) == order
    assert next_label("mesh", ("fast", "balanced"), 1.0, {"fast": False, "balanced": False}) is None


@pytest.mark.deep
def test_a_scenes_terrain_is_turned_too_told_and_derived_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene, out = make_cove(tmp_path / "scene"), tmp_path / "out"
    rough(scene.parent / "height.png")
    options = BuildOptions(jobs=1, tier="auto")
    plain = bake(scene, out, BuildOptions(jobs=1, tier="balanced"))
    assert not plain.errors
    result = json.loads((out / "scene.json").read_text())["artifacts"]
    worst = max(one["errors"].get("terrain_rms_m", 0.0) for one in result.values())
    scene.write_text(scene.read_text() + f"[budget]\nterrain_rms_m = {0.4 * worst}\n")
    report = bake(scene, out, options)
    assert not report.errors
    (row,) = [row for row in report.rows if row["name"] == "terrain_mesh"]
    taken = row["tried"]["taken"]
    assert split_label(taken)[1] and row["tier"] == "balanced"
    assert 0.0 < row["errors"]["terrain_rms_m"] <= 0.4 * worst
    assert f"auto took tier {taken}" in render(explain(scene, out=out))
    assert {row["status"] for row in bake(scene, out, options).rows} == {"reused"}
    checked, errors = verify(scene, report, percent=100.0, options=options)
    assert "terrain_mesh" in checked and not errors

"""Levels brought nearer to their source: the fit finds what is known, and nothing measured becomes worse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from paradize.bakers.mesh.lods import Plan, make_levels
from paradize.bakers.mesh.refine import RefinedLevel
from paradize.data import Mesh
from paradize.metrics.mapped_normal import normal_error, uv_shift
from paradize.metrics.surface import Original
from paradize.stages.lod import simplify
from paradize.stages.refine import fit_normals, fit_positions
from tests.pipeline.shapes import grid, sphere
from tests.sweeps import sweep

SAMPLES = 20_000
METRICS = ("error_max", "error_rms", "normal_p99_deg", "normal_mean_deg", "uv_shift_p99", "uv_shift_max")


def errors_of(judge: Original, level: Mesh) -> dict[str, float]:
    found = judge.distance(level, SAMPLES)
    return (
        found
        | uv_shift(judge, level, SAMPLES)
        | normal_error(judge, level, SAMPLES, surface_error=found["error_max"])
    )


def test_a_moved_surface_is_fitted_back_to_its_place() -> None:
    """A flat sheet, every vertex off by 1 cm along the normal: the fit knows where it was."""
    sheet = grid(12)
    above = replace(sheet, positions=sheet.positions + np.float32([0, 0.01, 0]))
    found = fit_positions(sheet, above, reach_m=0.1)
    inner = np.abs(sheet.positions[:, [0, 2]]).max(axis=1) < 0.4 * np.ptp(sheet.positions[:, 0])
    assert np.abs(found - sheet.positions)[inner].max() < 2e-4


def test_what_is_farther_than_the_reach_pulls_at_nothing() -> None:
    sheet = grid(12)
    above = replace(sheet, positions=sheet.positions + np.float32([0, 0.01, 0]))
    assert (fit_positions(sheet, above, reach_m=0.005) == above.positions).all()


def test_a_level_that_lies_on_its_source_stays_there() -> None:
    sheet = grid(12)
    level = simplify(sheet, 40).mesh
    assert np.abs(fit_positions(sheet, level, reach_m=1.0) - level.positions).max() < 1e-5


def test_tilted_normals_are_fitted_back() -> None:
    ball = sphere(16)
    assert ball.normals is not None
    tilted = ball.normals + np.float32([0.2, 0, 0])
    level = replace(ball, normals=(tilted / np.linalg.norm(tilted, axis=1)[:, None]).astype(np.float32))
    dots = (fit_normals(ball, level) * ball.normals).sum(axis=1)
    assert np.degrees(np.arccos(np.clip(dots, -1, 1))).max() < 1.0


MESHES = {
    "small ball": sphere(12),
    "ball": sphere(20),
    "ground": grid(40, height=0.05),
}


@pytest.mark.parametrize("name", sweep(MESHES, test=["small ball"]))
def test_exact_is_behind_balanced_by_no_metric_and_nearer_with_as_many_triangles(name: str) -> None:
    mesh, plan = MESHES[name], Plan(count=3, ratio=0.25)
    balanced, exact = (make_levels(mesh, plan, tier)[0] for tier in ("balanced", "exact"))
    judge = Original(mesh)
    for before, after in zip(balanced[1:], exact[1:], strict=True):
        assert len(after.mesh.triangles) <= len(before.mesh.triangles)
        old, new = errors_of(judge, before.mesh), errors_of(judge, after.mesh)
        assert all(new[key] <= 1.03 * old[key] + 1e-9 for key in METRICS)  # other samples than the tier's own
    assert new["error_rms"] < 0.95 * old["error_rms"]


@pytest.mark.parametrize("worse", METRICS)
def test_a_candidate_that_is_worse_by_any_one_metric_is_not_taken(
    worse: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    ball = sphere(6)
    base = dict.fromkeys(METRICS, 1.0)
    found = dict.fromkeys(METRICS, 0.5) | {worse: 1.05}

    def some(*names: str) -> dict[str, float]:
        return {key: value for key, value in found.items() if key.startswith(names)}

    judge = Original(ball)
    monkeypatch.setattr(judge, "distance", lambda *_: some("error"))
    monkeypatch.setattr("paradize.bakers.mesh.refine.uv_shift", lambda *_: some("uv"))
    monkeypatch.setattr("paradize.bakers.mesh.refine.normal_error", lambda *_, **__: some("normal"))
    best = RefinedLevel(judge, base, ball, SAMPLES)
    assert not best.accept_if_better(replace(ball)) and best.mesh is ball
    found[worse] = 0.5
    assert best.accept_if_better(replace(ball)) and best.errors["error_rms"] == 0.5


def test_fast_is_balanced_and_says_so() -> None:
    ball = sphere(10)
    levels = [make_levels(ball, Plan(count=3), tier)[0] for tier in ("fast", "balanced")]
    for one, other in zip(*levels, strict=True):
        assert (one.mesh.positions == other.mesh.positions).all() and one.errors == other.errors

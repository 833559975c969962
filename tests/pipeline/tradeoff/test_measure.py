"""Curves of tiers against brute force, and `paradize measure` on files and a scene."""

from __future__ import annotations

import itertools
import json
import math
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.color import bake_color
from paradize.build import trim
from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.errors import BakeError, SourceError
from paradize.jobs.limits import cores
from paradize.kernels import openmesh
from paradize.report.tradeoff.page import tradeoff_page
from paradize.scene.budget import METRICS
from paradize.tradeoff.curve import (
    Group,
    Point,
    Seconds,
    cheapest,
    inside,
    knee,
    loss,
    main_front,
    mark,
    series_of,
    spread,
)
from paradize.tradeoff.plan import FileOptions, file_groups, file_rows
from paradize.tradeoff.scene import measure_scene
from paradize.tradeoff.tiers import measure_file, parts, run_groups, within
from paradize.tradeoff.timing import LEAST_RUNS, MOST_RUNS, timed
from paradize.tradeoff.words import advice, compared, conclude, disagreements
from tests.pipeline.readers.test_height_tile import colors_of
from tests.pipeline.scenes import ball, make_cove, write_image
from tests.sweeps import sweep, tries


def point(
    tier: str, seconds: float, value: float, size: int | None = 100, series: str = "one", used: bool = False
) -> Point:
    result = {"median": seconds, "low": 0.99 * seconds, "high": 1.01 * seconds, "runs": 10}
    return {
        "tier": tier, "seconds": result,  # type: ignore[typeddict-item]
        "error": {"value": value}, "bytes": size, "in_use": used, "dominated": False, "on_front": False,
        "series": series,
    }  # fmt: skip


def group(points: list[Point], budget: float | None = None, *, less: bool = True) -> Group:
    return {
        "name": "palm colour", "stage": "block compression", "kind": "bake", "artifact": "palm_color",
        "metric": "normal_p99_deg" if less else "color_psnr_db", "unit": "degrees" if less else "dB",
        "less_is_better": less, "time": "bake", "points": points, "budget": budget, "sentence": "",
        "declared": [one["tier"] for one in points],
    }  # fmt: skip


@st.composite
def clouds(draw: st.DrawFn) -> list[Point]:
    """Tiers on a small grid, so that equal times, errors and sizes are common."""
    few = st.integers(1, 4)
    result = draw(
        st.lists(st.tuples(few, st.integers(0, 4), few, st.sampled_from("ab")), min_size=1, max_size=9)
    )
    return [point(str(k), t, float(e), size, series) for k, (t, e, size, series) in enumerate(result)]


# Of clouds, which take long to draw.
FEWER = settings(max_examples=tries(120))


@FEWER
@given(clouds())
def test_a_point_is_dominated_exactly_where_another_is_no_worse_and_somewhere_better(
    cloud: list[Point],
) -> None:
    mark(cloud, less_is_better=True)
    for b in cloud:
        worse = False
        for a in cloud:
            pairs = [
                (a["seconds"]["median"], b["seconds"]["median"]),
                (a["error"]["value"], b["error"]["value"]),
            ]
            if a["series"] != b["series"]:
                pairs.append((a["bytes"] or 0, b["bytes"] or 0))
            worse = worse or (all(p <= q for p, q in pairs) and any(p < q for p, q in pairs))
        assert b["dominated"] == worse
        assert b["on_front"] != worse


@FEWER
@given(clouds())
def test_every_cloud_has_a_front_and_along_it_more_time_buys_less_error(cloud: list[Point]) -> None:
    mark(cloud, less_is_better=True)
    assert any(one["on_front"] for one in cloud)
    front = main_front(cloud, less_is_better=True)
    assert all(a.seconds <= b.seconds and a.loss >= b.loss for a, b in itertools.pairwise(front))
    assert len({series_of(place.point) for place in front}) <= 1


@given(st.lists(st.tuples(st.floats(1e-6, 1e3), st.floats(1e-6, 1e3)), min_size=1, max_size=8))
def test_the_knee_is_the_point_farthest_from_the_chord(places: list[tuple[float, float]]) -> None:
    cloud = [point(str(k), t, e) for k, (t, e) in enumerate(places)]
    mark(cloud, less_is_better=True)
    front = sorted(
        {(math.log(t), math.log(e)) for one, (t, e) in zip(cloud, places, strict=True) if one["on_front"]}
    )
    found = knee(cloud, less_is_better=True)
    away: list[float] = []
    if len(front) > 2:
        (t0, e0), (t1, e1) = front[0], front[-1]
        along = (t1 - t0, e1 - e0)
        length = math.hypot(*along)
        # The way from the chord's nearest point, positive towards less time and less error.
        away = [((t - t0) * along[1] - (e - e0) * along[0]) / length for t, e in front]
    if found is None:
        assert not away or max(away) < 1e-9
    else:
        at = math.log(found["seconds"]["median"]), math.log(found["error"]["value"])
        assert away[front.index(at)] == pytest.approx(max(away), abs=1e-9)


def test_a_known_curve_bends_where_it_does() -> None:
    cloud = [point("fast", 1.0, 1.0), point("balanced", 2.0, 0.01), point("exact", 100.0, 0.008)]
    mark(cloud, less_is_better=True)
    found = knee(cloud, less_is_better=True)
    assert found is not None
    assert found["tier"] == "balanced"


@FEWER
@given(clouds(), st.integers(0, 4))
def test_the_cheapest_is_the_quickest_of_the_smallest_series_inside_the_budget(
    cloud: list[Point], limit: int
) -> None:
    found = cheapest(cloud, float(limit), less_is_better=True)
    passing = [one for one in cloud if one["error"]["value"] <= limit]
    if not passing:
        assert found is None
        return
    assert found in passing
    size = {
        s: min(one["bytes"] or 0 for one in cloud if one["series"] == s)
        for s in "ab"
        if any(one["series"] == s for one in cloud)
    }
    least = min(size[one["series"]] for one in passing)
    quickest = min(one["seconds"]["median"] for one in passing if size[one["series"]] == least)
    assert (size[found["series"]], found["seconds"]["median"]) == (least, quickest)


@given(st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=30))
def test_the_spread_is_that_of_numpy(seconds: list[float]) -> None:
    result = spread(seconds)
    low, median, high = np.quantile(seconds, [0.25, 0.5, 0.75])
    assert (result["low"], result["median"], result["high"]) == pytest.approx((low, median, high))
    assert result["runs"] == len(seconds)


def test_decibels_are_errors_of_the_amplitude() -> None:
    assert loss(20.0, less_is_better=False) == pytest.approx(0.1)
    assert loss(40.0, less_is_better=False) / loss(46.0206, less_is_better=False) == pytest.approx(
        2.0, rel=1e-4
    )
    assert loss(120.0, less_is_better=False) == 0.0
    assert inside(36.5, 36.0, less_is_better=False)
    assert not inside(35.5, 36.0, less_is_better=False)


def test_the_sentence_tells_time_error_and_bytes_as_ratios() -> None:
    fast, balanced = point("fast", 1.0, 1.0), point("balanced", 3.0, 0.5, 200)
    text = compared(fast, balanced, group([fast, balanced]))
    assert (
        text == "balanced costs 3 x the time of fast and halves the error (1 to 0.5 degrees) at 2 x the bytes"
    )


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (1.04, "takes 4 % longer than fast"), (1.9, "takes 90 % longer than fast"),
        (2.0, "costs 2 x the time of fast"), (0.97, "takes 3 % less time than fast"),
        (0.5, "takes 0.5 x the time of fast"),
    ],
)  # fmt: skip
def test_no_sentence_says_once_the_time(seconds: float, words: str) -> None:
    """A ratio near 1 is told as a share."""
    fast, other = point("fast", 1.0, 1.0), point("exact", seconds, 0.5)
    assert compared(fast, other, group([fast, other])).startswith(f"exact {words} and ")


def test_times_within_each_others_spread_are_called_equal() -> None:
    slow, quick = point("fast", 1.0, 1.0), point("balanced", 1.01, 1.0)
    assert (
        compared(slow, quick, group([slow, quick]))
        == "balanced takes about as long as fast and has the same error"
    )


def test_a_tier_that_is_quicker_or_errs_more_than_declared_is_told() -> None:
    result = disagreements(group([point("fast", 2.0, 0.1), point("balanced", 1.0, 0.2)]))
    assert len(result) == 2
    assert "declared slower than fast, but takes 1 s against 2 s" in result[0]
    assert (
        "declared more exact than fast, but its normal_p99_deg is 0.2 degrees against 0.1 degrees"
        in result[1]
    )
    assert disagreements(group([point("fast", 1.0, 0.2), point("balanced", 2.0, 0.1)])) == []


def test_smaller_files_may_err_more_and_larger_ones_may_be_quicker() -> None:
    small = point("fast", 1.0, 0.2, 100, "small")
    large = point("balanced", 0.5, 0.1, 400, "large")
    assert disagreements(group([small, large])) == []
    assert disagreements(group([large, small])) == []


def test_advice_keeps_the_budget_and_says_when_nothing_does() -> None:
    tiers = [point("fast", 1.0, 3.0, used=True), point("balanced", 2.0, 1.0), point("exact", 9.0, 0.5)]
    assert advice(group(tiers, budget=1.0)) == {
        "tier": "balanced", "why": "budget",
        "text": "Balanced is the cheapest inside the budget of 1 degrees; fast, in use, exceeds it.",
    }  # fmt: skip
    result = advice(group(tiers, budget=0.25))
    assert result is not None
    assert result["tier"] is None
    assert "exact, has 0.5 degrees" in result["text"]


def test_a_tier_that_keeps_one_budget_and_breaks_another_is_not_the_cheapest() -> None:
    tiers = [point("fast", 1.0, 1.0), point("balanced", 2.0, 0.9)]
    tiers[0]["passes"] = False
    result = advice(group(tiers, budget=1.5))
    assert result is not None
    assert result["tier"] == "balanced"
    assert within("alpha_psnr_db", 36.0, {"alpha_psnr_db": 36.0})
    assert not within("alpha_psnr_db", 35.0, {"alpha_psnr_db": 36.0})


def test_times_within_each_others_spread_dominate_nothing() -> None:
    cloud = [point("fast", 1.0, 1.0), point("balanced", 1.01, 1.0), point("exact", 1.01, 0.5)]
    mark(cloud[:2], less_is_better=True)
    assert [one["dominated"] for one in cloud[:2]] == [False, False]
    mark(cloud, less_is_better=True)
    assert [one["dominated"] for one in cloud] == [True, True, False]


@pytest.mark.parametrize(("runs", "told"), [(1, False), (2, False), (3, True)])
def test_times_of_one_or_two_runs_differ_only_by_more_than_twice(runs: int, told: bool) -> None:
    def once(tier: str, seconds: float) -> Point:
        exact: Seconds = {"median": seconds, "low": seconds, "high": seconds, "runs": runs}
        return {**point(tier, seconds, 1.0), "seconds": exact}

    near = [once("fast", 1.0), once("balanced", 0.55)]
    mark(near, less_is_better=True)
    assert near[0]["dominated"] is told
    assert bool(disagreements(group(near))) is told
    far = [once("fast", 1.0), once("balanced", 0.45)]
    mark(far, less_is_better=True)
    assert far[0]["dominated"] and disagreements(group(far))


def test_without_a_budget_advice_is_the_knee_or_the_quickest_of_equals() -> None:
    bent = group([point("fast", 1.0, 1.0), point("balanced", 2.0, 0.1), point("exact", 9.0, 0.09)])
    flat = group([point("fast", 1.0, 1.0), point("balanced", 2.0, 0.99), point("exact", 9.0, 0.985)])
    for tiers in (bent, flat):
        conclude(tiers)
    assert (bent["advice"] or {})["why"] == "knee"
    assert (bent["advice"] or {})["tier"] == "balanced"
    assert (flat["advice"] or {})["why"] == "flat"
    assert (flat["advice"] or {})["tier"] == "fast"


def test_what_a_metric_tells_beside_its_value_is_its_own() -> None:
    errors = {"normal_p99_deg": 2.0, "normal_mean_deg": 1.0, "normal_max_deg": 3.0, "lod_normal_max_deg": 9.0}
    assert parts("normal_p99_deg", errors) == {"value": 2.0, "p99": 2.0, "mean": 1.0, "max": 3.0}
    assert parts("color_psnr_db", {"color_psnr_db": 40.0, "color_max": 0.1}) == {"value": 40.0, "max": 0.1}


@pytest.mark.deep
def test_quick_work_is_run_often_and_as_often_as_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_THREADS", "1")
    calls: list[int] = []
    seconds, last = timed(lambda: calls.append(1) or len(calls), None)
    assert len(seconds) == MOST_RUNS
    assert last == MOST_RUNS + 1  # one before did not count
    assert len(timed(lambda: None, 4)[0]) == 4
    assert LEAST_RUNS < MOST_RUNS


def test_kernels_use_one_thread_while_work_is_timed_whatever_ran_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("PARADIZE_THREADS", "1")
    assert {timed(lambda: os.environ["PARADIZE_THREADS"], 2)[1] for _ in range(2)} == {"1"}
    assert os.environ["PARADIZE_THREADS"] == str(cores())  # for the metrics


def hold_to_the_form(tradeoff: dict[str, Any]) -> None:
    """tradeoff.json as formats/FORMAT.md has it."""
    assert tradeoff["version"] == 1
    assert tradeoff["groups"]
    json.dumps(tradeoff, allow_nan=False)
    for one in tradeoff["groups"]:
        assert one["kind"] in ("bake", "frame")
        for key in ("name", "stage", "artifact", "metric", "sentence"):
            assert one[key], key
        if one["metric"] in METRICS:
            assert one["unit"] == METRICS[one["metric"]].unit
        assert sum(tier["in_use"] for tier in one["points"]) <= 1
        assert any(tier["on_front"] for tier in one["points"])
        for tier in one["points"]:
            seconds = tier["seconds"]
            assert 0.0 < seconds["low"] <= seconds["median"] <= seconds["high"]
            assert seconds["runs"] >= 1
            assert tier["error"]["value"] >= 0.0
            assert tier["bytes"] is None or tier["bytes"] > 0
    page = tradeoff_page(tradeoff)
    curves = [one for one in tradeoff["groups"] if len(one["points"]) > 1]  # one tier makes no curve
    assert page.count('<svg viewBox="0 0 420') == len(curves)
    assert page.count('<section class="card"') == len(tradeoff["groups"])
    assert "http" not in page
    assert "<script" not in page


def named(tradeoff: dict[str, Any], name: str) -> dict[str, Any]:
    (found,) = [one for one in tradeoff["groups"] if one["name"] == name]
    return dict(found)


def tiers(one: dict[str, Any]) -> dict[str, Any]:
    return {result["tier"]: result for result in one["points"]}


@pytest.mark.deep
def test_a_model_is_measured_in_every_tier_of_its_stages(tmp_path: Path) -> None:
    (tmp_path / "post.obj").write_text(ball(16))
    report = measure_file(tmp_path / "post.obj", FileOptions(), runs=2)
    hold_to_the_form(report)
    assert [one["stage"] for one in report["groups"]] == [
        "levels of detail", "tangent frames", "quantisation", "draw order",
    ]  # fmt: skip
    frames = tiers(named(report, "post tangent frames"))
    assert frames["mikktspace"]["error"]["max"] < 0.01 < frames["vertex"]["error"]["max"]
    assert frames["mikktspace"]["in_use"]
    codes = tiers(named(report, "post vertices"))
    assert codes["16 bit, directions 8"]["bytes"] < codes["16 bit"]["bytes"] < codes["float32"]["bytes"]
    assert codes["16 bit"]["error"]["value"] < codes["16 bit, directions 8"]["error"]["value"]
    levels = tiers(named(report, "post levels of detail"))
    libraries = {"meshoptimizer", "fast-simplification"} | ({"openmesh"} if openmesh.BUILT else set())
    assert set(levels) == {"balanced", "exact"} | libraries, "fast is balanced there"
    assert [name for name, one in levels.items() if one["in_use"]] == ["balanced"]
    assert all(one["seconds"]["runs"] == 2 for one in levels.values())


@pytest.mark.deep
def test_a_model_without_coordinates_has_an_atlas_to_be_measured(tmp_path: Path) -> None:
    lines = [line for line in ball().splitlines() if not line.startswith("vt")]
    bare = "\n".join(" ".join(part.partition("/")[0] for part in line.split(" ")) for line in lines)
    (tmp_path / "bare.obj").write_text(bare + "\n")
    report = measure_file(tmp_path / "bare.obj", FileOptions(), runs=1)
    hold_to_the_form(report)
    atlas = named(report, "bare atlas")
    assert atlas["metric"] == "atlas_seam_length"
    assert set(tiers(atlas)) == {"fast", "balanced", "exact", "xatlas"}


@pytest.fixture(scope="module")
def measured_rock(
    tmp_path_factory: pytest.TempPathFactory,
    paradize_here: Callable[..., subprocess.CompletedProcess[str]],
) -> tuple[Path, dict[str, Any]]:
    """A folder with rock.png, and what `measure` prints of it in tier exact, whose files are in out/deep."""
    folder = tmp_path_factory.mktemp("rock")
    noise = np.random.default_rng(3).integers(0, 255, (36, 36, 3), np.uint8)
    write_image(folder / "rock.png", noise)
    words = ("measure", folder / "rock.png", "-o", folder / "out" / "deep", "--runs", 1, "--tier", "exact")
    done = paradize_here(*words, "--json")
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout)


def test_a_colour_map_is_measured_in_every_format_and_tier(
    measured_rock: tuple[Path, dict[str, Any]],
) -> None:
    _, report = measured_rock
    hold_to_the_form(report)
    color = tiers(named(report, "rock colour"))
    assert list(color) == [
        "fast", "balanced", "exact BC1", "fast BC7", "balanced BC7", "exact", "RGBA8",
    ]  # fmt: skip
    assert [name for name, one in color.items() if one["in_use"]] == ["exact"]
    assert color["balanced"]["error"]["value"] < color["balanced BC7"]["error"]["value"]
    assert color["RGBA8"]["loss"] == 0.0
    assert 2 * color["balanced"]["bytes"] == pytest.approx(color["balanced BC7"]["bytes"], rel=0.2)
    assert {"rock slopes", "rock normal", "rock height", "rock gloss", "rock dudv"} < {
        one["name"] for one in report["groups"]
    }


@pytest.mark.parametrize("apart", sweep([False, True], test=[True]))
def test_measure_shows_of_a_picture_with_alpha_the_formats_that_the_bake_takes(
    apart: bool, tmp_path: Path
) -> None:
    """BC7 in tier exact where alpha is an edge, BC3 where it is faint noise of its own."""
    rng = np.random.default_rng(2)
    y, x = np.mgrid[:64, :64]
    alpha = rng.integers(100, 108, (64, 64)) if apart else np.where((x // 9 + y // 7) % 2, 255, 0)
    color = np.stack([x * 3, y * 3, x + y], axis=2) + rng.normal(0, 12, (64, 64, 3))
    write_image(tmp_path / "leaf.png", np.dstack([color, alpha]).clip(0, 255).astype(np.uint8))
    groups = [one for one in file_groups(tmp_path / "leaf.png", FileOptions()) if one.name == "leaf colour"]
    (result,), _ = run_groups(groups, file_rows(groups, "exact"), {}, 1, None)
    found = tiers(result)
    baked = bake_color(tmp_path / "leaf.png", tier="exact")
    assert baked.format == ("BC3_SRGB" if apart else "BC7_SRGB")
    assert ("exact BC7" in found, "exact BC3" in found) == (apart, not apart)
    assert found["exact"]["in_use"]
    assert found["exact"]["error"]["value"] == baked.errors["color_psnr_db"]


def test_a_heightmap_is_measured_as_terrain_under_the_bound(tmp_path: Path) -> None:
    z, x = np.mgrid[0:33, 0:33] / 32.0
    hills = 0.5 + 0.3 * np.sin(7.0 * x) * np.cos(5.0 * z)
    write_image(tmp_path / "hills.png", (hills * 65535).astype(np.uint16)[:, :, None])
    options = FileOptions(size_m=(64.0, 64.0), height_m=10.0, max_error_m=0.05)
    groups = [one for one in file_groups(tmp_path / "hills.png", options) if one.name == "hills terrain"]
    (result,), _ = run_groups(groups, file_rows(groups, "balanced"), {}, 1, None)
    terrain = tiers(dict(result))
    assert terrain["exact"]["error"]["value"] < 1e-5
    for tier in ("fast", "balanced"):
        assert 0.0 < terrain[tier]["error"]["value"] <= 0.05
        assert terrain[tier]["bytes"] < terrain["exact"]["bytes"]


def test_a_tile_is_measured_as_terrain_alone_in_its_own_metres(
    tmp_path: Path, paradize_here: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    z, x = np.mgrid[0:17, 0:17] / 16.0
    colors = colors_of(900.0 + 40.0 * np.sin(7.0 * x) * np.cos(5.0 * z), "terrarium")
    write_image(tmp_path / "tile.png", colors.astype(np.uint8))
    ran = paradize_here(
        "measure",
        tmp_path / "tile.png",
        "-o",
        tmp_path / "m",
        "--encoding",
        "terrarium",
        "--runs",
        "1",
        "--json",
    )
    (group,) = json.loads(ran.stdout)["groups"]
    terrain = tiers(group)
    assert group["name"] == "tile terrain" and terrain["exact"]["error"]["value"] < 1e-5
    assert all(0.0 < terrain[tier]["error"]["value"] <= 0.08 for tier in ("fast", "balanced"))
    with pytest.raises(BakeError, match="is a colour map"):
        file_groups(tmp_path / "tile.png", FileOptions("color", encoding="terrarium"))


def test_options_that_do_not_fit_the_file_and_broken_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "post.obj").write_text(ball())
    with pytest.raises(BakeError, match="is a model"):
        file_groups(tmp_path / "post.obj", FileOptions(height_m=2.0))
    write_image(tmp_path / "rock.png", np.zeros((8, 8, 3), np.uint8))
    with pytest.raises(BakeError, match="is a colour map"):
        file_groups(tmp_path / "rock.png", FileOptions(max_error_m=0.0))
    (tmp_path / "broken.obj").write_text("v 0 0\nf 1 2 3\n")
    with pytest.raises(SourceError):
        measure_file(tmp_path / "broken.obj", FileOptions())


@pytest.mark.deep
def test_a_scene_is_measured_in_what_it_uses_and_by_its_budget(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = make_cove(tmp_path / "cove")
    scene.write_text(scene.read_text() + "[budget]\nterrain_max_m = 0.05\ncolor_psnr_db = 20.0\n")
    heard: list[tuple[str, int, int]] = []
    report = measure_scene(scene, runs=1, on_progress=lambda *words: heard.append(words))
    hold_to_the_form(report)
    assert report["attribution"] == []  # nobody drew
    stages = {one["stage"] for one in report["groups"]}
    assert {
        "levels of detail",
        "terrain",
        "block compression",
        "slope filter",
        "cube map",
        "camera path",
    } <= stages
    color = named(report, "post colour")
    assert color["budget"] == 20.0
    assert (color["advice"] or {})["why"] == "budget"
    for one in report["groups"]:
        if len(one["points"]) > 1:
            assert any(tier["in_use"] for tier in one["points"]), one["name"]
    legend = {point.get("series") for one in report["groups"] for point in one["points"]}
    assert "paradize" in legend and "one" not in legend
    assert heard[-1][1] == heard[-1][2] == sum(len(one["points"]) for one in report["groups"])


def test_the_command_writes_both_files_and_refuses_what_it_cannot_measure_or_write(
    tmp_path: Path,
    measured_rock: tuple[Path, dict[str, Any]],
    paradize_here: Callable[..., subprocess.CompletedProcess[str]],
) -> None:
    folder, report = measured_rock
    assert json.loads((folder / "out/deep/tradeoff.json").read_text()) == report
    assert (folder / "out/deep/tradeoff.html").read_text().startswith("<!doctype html>")
    for wrong, text in (
        (("nothing.obj", "-o", tmp_path / "new"), "nothing.obj: there is no such file"),
        ((folder / "rock.png", "-o", folder / "rock.png"), "rock.png: looks like the name of a file"),
    ):
        refused = paradize_here("measure", *wrong)
        assert refused.returncode == 1
        assert refused.stderr.startswith("paradize: error: ")
        assert text in refused.stderr
        assert "Traceback" not in refused.stderr
    assert not (tmp_path / "new").exists()


@pytest.mark.deep
def test_what_pictures_are_held_against_has_no_blocks_and_leaves_nothing_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = make_cove(tmp_path / "cove")
    views_of: list[str] = []  # the bakes that asked what the views need

    def find(*arguments: Any, **more: Any) -> trim.RequiredDetail:
        views_of.append(name)
        return trim.find_required_detail(*arguments, **more)

    monkeypatch.setattr("paradize.build.publish.find_required_detail", find)
    formats = {}
    for name, options in (
        ("used", BuildOptions()),
        ("truth", BuildOptions(tier="exact", uncompressed=True, whole=True)),
    ):
        report = bake(scene, tmp_path / name, options)
        assert not report.errors
        formats[name] = {row["format"] for row in report.rows if row["format"]}
    assert views_of == ["used"]
    assert any(fmt.startswith("BC") for fmt in formats["used"])
    assert formats["truth"] <= {
        "RGBA8_SRGB",
        "R16_UNORM",
        "RG16_UNORM",
        "RG16_SNORM",
        "RG8_SNORM",
        "RGBA16F",
    }
    # Neither is taken for the other in the same folder.
    name = "again"
    again = bake(scene, tmp_path / "truth", BuildOptions(tier="exact"))
    assert any(row["format"].startswith("BC") for row in again.rows if row["format"])

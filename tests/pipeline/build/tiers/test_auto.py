"""Tiers task by task: the one that is asked of each, or the cheapest whose errors are inside the budget."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.build.single_file import bake_single
from paradize.build.tasks import Task
from paradize.build.tiers import auto_tier
from paradize.build.tiers.tier_choice import cheapest, misses
from paradize.build.tiers.tuned_settings import split_label
from paradize.cli.main import main
from paradize.errors import BakeError, ParadizeError
from paradize.explain.facts import explain
from paradize.explain.words import render
from paradize.scene.baker_settings import BakerSettings, MapSettings, MeshSettings, TerrainSettings
from paradize.scene.budget import METRICS, is_beyond
from paradize.scene.jobs import BakeJob
from paradize.scene.schema import Limits
from paradize.scene.settings import load_scene
from paradize.store.local import Store
from paradize.tiers import FINER_FORMAT, TIERS
from tests.pipeline.scenes import write_image
from tests.pipeline.small_scenes import make_free_post
from tests.sweeps import sweep

Truth = dict[str, dict[str, float]]  # by tier: what it measures of the post's mesh


@pytest.fixture(scope="module")
def brute_force(tmp_path_factory: pytest.TempPathFactory) -> tuple[Truth, Path]:
    """The errors of each tier, and the store of those bakes."""
    top = tmp_path_factory.mktemp("brute")
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(top / "store"))
        for tier in TIERS:
            report = bake(with_levels(top / "scene"), top / "out", BuildOptions(jobs=1, tier=tier))
            assert not report.errors, report.errors
            errors = rows(report)["post_mesh"]["errors"]
            found[tier] = {metric: errors[metric] for metric in ("surface_max", "surface_rms")}
    assert found["fast"]["surface_rms"] > found["exact"]["surface_rms"], "tiers must differ"
    return found, top / "store"


@pytest.fixture
def truth(brute_force: tuple[Truth, Path], scene: Path, tmp_path: Path) -> Truth:
    shutil.copytree(brute_force[1], tmp_path / "store")
    return brute_force[0]


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("PARADIZE_REPORT", "")
    return with_levels(tmp_path / "scene")


def with_levels(folder: Path, count: int = 2) -> Path:
    """Of its object: each tier measures all."""
    scene = make_free_post(folder)
    scene.write_text(scene.read_text().replace("lods = 3", f"lods = {count}"))
    return scene


def with_budget(scene: Path, lods: int = 2, **limits: Any) -> Path:
    lines = [f"{metric} = {limit}" for metric, limit in limits.items()]
    scene.write_text("\n".join([with_levels(scene.parent, lods).read_text(), "[budget]", *lines, ""]))
    return scene


def rows(report: BakeReport) -> dict[str, dict[str, Any]]:
    return {row["name"]: row for row in report.rows}


def test_a_task_bakes_in_its_own_tier_and_the_others_are_reused(scene: Path, tmp_path: Path) -> None:
    base = bake(scene, tmp_path / "base", BuildOptions(jobs=1, tier="fast"))
    for name in ("post maps", "post_gloss"):  # by the task's name, or one of its artifacts'
        other = bake(scene, tmp_path / "other", BuildOptions(jobs=1, tier="fast", tiers={name: "exact"}))
        tiers = {row["name"]: row["tier"] for row in other.rows}
        changed = {row["name"] for row in base.rows if row["tier"] != tiers[row["name"]]}
        assert changed == {"post_normal", "post_height", "post_gloss"}
        assert tiers["post_normal"] == "exact"
    again = bake(scene, tmp_path / "base", BuildOptions(jobs=1, tier="fast"))
    assert {row["name"]: row["sha256"] for row in again.rows} == {
        row["name"]: row["sha256"] for row in base.rows
    }


def test_a_tier_of_what_is_not_there_is_refused(scene: Path, tmp_path: Path) -> None:
    with pytest.raises(BakeError, match=r"no task 'pots mesh'.*post mesh"):
        bake(scene, tmp_path / "out", BuildOptions(tiers={"pots mesh": "fast"}))


def test_the_command_lines_tier_comes_before_the_scenes(scene: Path) -> None:
    scene.write_text(scene.read_text().replace('name = "cove"', 'name = "cove"\ntier = "fast"'))
    read = load_scene(scene)
    job = BakeJob("post mesh", "mesh", {}, {}, ())
    assert BuildOptions().tier_of(job, read) == "fast"
    assert BuildOptions(tier="exact").tier_of(job, read) == "exact"
    assert BuildOptions(tier="exact", tiers={job.name: "balanced"}).tier_of(job, read) == "balanced"


@pytest.mark.deep
def test_a_scene_names_its_own_tier_and_the_command_line_another(scene: Path, tmp_path: Path) -> None:
    scene.write_text(scene.read_text().replace('name = "cove"', 'name = "cove"\ntier = "fast"'))
    assert rows(bake(scene, tmp_path / "out", BuildOptions(jobs=1)))["post_color"]["tier"] == "fast"
    assert (
        rows(bake(scene, tmp_path / "out", BuildOptions(jobs=1, tier="exact")))["post_color"]["tier"]
        == "exact"
    )


def test_auto_takes_the_cheapest_tier_inside_the_budget_and_tells_what_each_measured(
    truth: Truth, scene: Path, tmp_path: Path, capsys: Any
) -> None:
    values = {tier: truth[tier]["surface_rms"] for tier in TIERS}
    limit = 0.5 * (values["fast"] + min(values.values()))
    with_budget(scene, surface_rms=limit)
    assert main(["bake", str(scene), "-o", str(tmp_path / "out"), "--tier", "auto", "-j", "1", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    row = next(row for row in report["artifacts"] if row["name"] == "post_mesh")
    wanted = next(tier for tier in TIERS if values[tier] <= limit)
    assert wanted != "fast" and row["tried"]["taken"] == wanted
    assert row["errors"]["surface_max"] == truth[wanted]["surface_max"]
    tried = list(TIERS[: TIERS.index(wanted) + 1])
    assert row["tried"]["errors"] == {tier: {"surface_rms": values[tier]} for tier in tried}
    others = [row for row in report["artifacts"] if row["name"] != "post_mesh"]
    assert {row["tried"]["taken"] for row in others} == {"fast"}, "no budget: the cheapest"
    text = render(explain(scene, "post_mesh", tmp_path / "out"))
    assert f"auto took tier {wanted}" in text and all(
        f"{tier}: surface_rms {values[tier]:g}" in text for tier in tried
    )


def test_a_second_bake_tries_no_tier_again(
    truth: Truth, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_budget(scene, surface_rms=min(errors["surface_rms"] for errors in truth.values()))
    first = bake(scene, tmp_path / "out", BuildOptions(jobs=1, tier="auto"))
    scene.write_text(scene.read_text() + "# looked at again\n")
    ran: list[str] = []
    run = auto_tier.run_tasks

    def counted(store: Store, room: Path, tasks: list[Task], *rest: Any) -> None:
        ran.extend(task.job.name for task in tasks)
        run(store, room, tasks, *rest)

    monkeypatch.setattr(auto_tier, "run_tasks", counted)
    second = bake(scene, tmp_path / "out", BuildOptions(jobs=1, tier="auto"))
    assert not first.errors and not second.errors and ran == [] and second.count("baked") == 0
    assert rows(second)["post_mesh"]["tried"] == rows(first)["post_mesh"]["tried"]
    assert bake(scene, tmp_path / "out", BuildOptions(jobs=1, tier="auto")).count("baked") == 0


def test_a_budget_that_nothing_meets_is_an_error_that_says_by_how_much(
    truth: Truth, scene: Path, tmp_path: Path
) -> None:
    best = min(errors["surface_max"] for errors in truth.values())
    with_budget(scene, surface_max=0.5 * best)
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1, tier="auto"))
    (error,) = report.errors
    assert f"surface_max is {best:g} of the diagonal at best" in str(error)
    assert f"{0.5 * best:.3g} of the diagonal beyond" in str(error) and "post_mesh" in str(error)
    assert "or ask for fewer or finer levels of detail where there are several" in str(error)
    assert report.count("failed") == 1 and not (tmp_path / "out" / "scene.json").exists()
    plain = bake(scene, tmp_path / "out", BuildOptions(jobs=1, tier="balanced"))
    assert not plain.errors and any("surface_max" in text for text in plain.warnings)


@pytest.mark.deep
def test_what_only_mesh_and_map_show_together_moves_the_choice_too(
    truth: Truth, scene: Path, tmp_path: Path
) -> None:
    with_budget(scene, 3, lod_mapped_mean_deg=1e-6)
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1, tier="auto"))
    (error,) = report.errors
    assert "post_mesh" in str(error) and "no tier keeps the budget: lod_mapped_mean_deg is" in str(error)
    assert not (tmp_path / "out" / "scene.json").exists()
    with_budget(scene, 3, lod_mapped_mean_deg="{ soft = 1e-6 }")
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1, tier="auto"))
    tried = rows(report)["post_mesh"]["tried"]
    values = {tier: tried["errors"][tier]["lod_mapped_mean_deg"] for tier in TIERS}
    assert not report.errors and tried["taken"] == "fast", "a soft limit that no tier keeps changes nothing"
    best = min(values.values())
    assert values["fast"] > best
    with_budget(scene, 3, lod_mapped_mean_deg=best)
    for force in (False, True):
        report = bake(scene, tmp_path / "out", BuildOptions(jobs=1, tier="auto", force=force))
        row = rows(report)["post_mesh"]
        assert not report.errors and row["tried"]["taken"] == next(t for t in TIERS if values[t] <= best)
        assert row["errors"]["lod_mapped_mean_deg"] == best
    assert report.count("baked") == len(report.rows)


def test_a_soft_limit_is_aimed_at_and_the_hard_one_accepted(
    truth: Truth, scene: Path, tmp_path: Path
) -> None:
    values = {tier: truth[tier]["surface_rms"] for tier in TIERS}
    best = min(values.values())
    for soft, wanted in ((best, next(t for t in TIERS if values[t] <= best)), (0.5 * best, "fast")):
        with_budget(scene, surface_rms=f"{{ soft = {soft}, hard = {2.0 * max(values.values())} }}")
        report = bake(scene, tmp_path / "out", BuildOptions(jobs=1, tier="auto"))
        assert not report.errors and rows(report)["post_mesh"]["tried"]["taken"] == wanted


def test_limits_that_tiers_keep_by_turns_but_never_together_are_told() -> None:
    measured = {
        "fast": {"normal": {"normal_p99_deg": 1.0}, "gloss": {"gloss_psnr_db": 30.0}},
        "exact": {"normal": {"normal_p99_deg": 3.0}, "gloss": {"gloss_psnr_db": 50.0}},
    }
    budget = Limits({"normal_p99_deg": 2.0, "gloss_psnr_db": 40.0})
    assert cheapest(measured, budget) is None
    (error,) = misses(measured, budget)
    assert (
        "all of the budget at once" in str(error)
        and "fast: gloss" in str(error)
        and "exact: normal" in str(error)
    )


@pytest.mark.parametrize("kind", sweep(["mesh", "maps", "terrain"], test=["maps", "terrain"]))
def test_single_files_take_auto_and_a_budget_too(tmp_path: Path, capsys: Any, kind: str) -> None:
    make_free_post(tmp_path)
    settings = {"mesh": ["post.obj", "-o", "a.glb", "--lods", "2"], "maps": ["wood.png", "-o", "maps"]}
    settings["terrain"] = [
        "height.png",
        "-o",
        "t.glb",
        "--size",
        "20",
        "20",
        "--height",
        "4",
        "--max-error",
        "0.1",
    ]
    metric = {"mesh": "surface_rms", "maps": "normal_p99_deg", "terrain": "terrain_rms_m"}[kind]
    words = [
        str(tmp_path / word) if word[-4:] in (".obj", ".png", ".glb", "maps") else word
        for word in settings[kind]
    ]
    words = [kind, *words, "--json"]
    assert (
        main([*words, "--tier", "auto", "--budget", f"{metric}=180" if kind == "maps" else f"{metric}=1"])
        == 0
    )
    report = json.loads(capsys.readouterr().out)
    assert report["tried"]["taken"] == "fast" and list(report["tried"]["errors"]) == ["fast"]
    assert main([*words, "--tier", "auto", "--budget", f"{metric}=0"]) in (0, 1)
    report = json.loads(capsys.readouterr().out)
    assert "tried" in report or metric in report["error"][0]
    assert main([*words, "--budget", "nothing=1"]) == 2
    assert "is no metric of a budget" in capsys.readouterr().out


# --- against brute force ------------------------------------------------------------------------------------

MAPS = MapSettings(only=["normal", "height"], source="color", strength=4.0)
MESH = MeshSettings(lods=3, max_error=0.5)
TERRAIN = TerrainSettings(size_m=(200.0, 200.0), height_m=20.0, max_error_m=0.5)


def crop(source: Path, folder: Path) -> Path:
    """The middle of a picture, 64 x 64 at most: tiers differ there as anywhere, in no time."""
    from paradize.readers.image import read_image

    values = read_image(source).values
    y, x = (max(0, (size - 64) // 2) for size in values.shape[:2])
    path = folder / f"{source.stem}.png"
    part = values[y : y + 64, x : x + 64]
    if part.dtype == np.float32:
        part = (np.clip(part, 0.0, 1.0) * 65535).astype(np.uint16)
    write_image(path, part)
    return path


TEXTURES = {
    "made": ["photo.png", "beach.jpg", "leaf.png", "planks.jpg"],
    "corpus": [
        *("BeachStones.jpg", "coast_sand_rocks_02_diff_1k.jpg", "gras_02.png", "leaf.png"),
        *("rocky_trail_diff_1k.jpg", "grass_billboard.png"),
        *("../obj-large/spot_texture.png", "../water/waveNM.png"),
    ],
}
HEIGHTS = {
    "made": ["hills_16.png", "ridge_16.png", "steps_8.png", "islands_16.png"],
    "corpus": [
        *("fuji_512_16.png", "srtm_coast_513.png", "srtm_archipelago_257.png", "ogre_terrain2_513.png"),
        *("hugo_site_16.png", "west_bijou_gully_16.png"),
    ],
}


def assets(where: str, files: Path, folder: Path) -> Iterator[tuple[str, Path, BakerSettings, str]]:
    """(kind, file, settings, metric) of pictures, heights, terrains and models."""
    for name in TEXTURES[where]:
        yield "maps", crop(files / "textures" / name, folder), MAPS, "height_psnr_db"
    for name in HEIGHTS[where]:
        yield "maps", crop(files / "height" / name, folder), replace(MAPS, source="height"), "normal_p99_deg"
    for name in HEIGHTS[where][:2]:
        yield "terrain", crop(files / "height" / name, folder), TERRAIN, "terrain_rms_m"
    meshes = sorted(
        path for path in (files / "obj-kits").rglob("*.obj") if 4_000 < path.stat().st_size < 60_000
    )
    for path in meshes[:: max(1, len(meshes) // 4)][:4]:
        yield "mesh", path, MESH, "surface_rms"


def grown(path: Path, settings: BakerSettings, metric: str, limit: float) -> dict[str, float]:
    """The errors of each tier in the first format that keeps a limit, else in the finest."""
    found = {}
    for tier, label in zip(TIERS, FINER_FORMAT, strict=True):
        errors = bake_single("maps", path, settings, tier=tier, budget={metric: limit}).errors
        found[label] = next(one[metric] for one in errors.values() if metric in one)
    return found


def test_auto_takes_a_finer_format_in_the_tier_that_keeps_the_budget_in_it(tmp_path: Path) -> None:
    """Where neither a tier's own format nor a finer one of the cheapest tier's filter is near enough."""
    path = tmp_path / "waves.png"
    y, x = np.mgrid[0:64, 0:64] * (2 * np.pi / 7.5)
    noise = np.random.default_rng(4).random((64, 64))
    write_image(path, (20000 * (2 + np.sin(x) * np.cos(y) + 0.2 * noise)).astype(np.uint16)[:, :, None])
    settings, budget = replace(MAPS, source="height", only=["normal"]), {"normal_p99_deg": 0.5}
    alone = {
        tier: bake_single("maps", path, settings, tier=tier, budget={}).errors["normal"] for tier in TIERS
    }
    assert all(errors["normal_p99_deg"] > 0.5 for errors in alone.values())
    assert alone["fast"]["normal_filter_p99_deg"] > 0.5
    made = bake_single("maps", path, settings, tier="auto", budget=budget)
    assert made.report["tried"]["taken"] == FINER_FORMAT[1]
    assert made.errors["normal"]["normal_p99_deg"] <= 0.5


def brute(kind: str, path: Path, settings: BakerSettings, metric: str) -> dict[str, float]:
    """The errors of each tier, the worst of its products."""
    found = {}
    for tier in TIERS:
        errors = bake_single(kind, path, settings, tier=tier, budget={}).errors
        worst = max if METRICS[metric].less_is_better else min
        found[tier] = worst(one[metric] for one in errors.values() if metric in one)
    return found


@pytest.mark.deep
@pytest.mark.parametrize("where", ["made", "corpus"])
@pytest.mark.parametrize("count", [4, 20])
def test_auto_is_brute_force_over_assets_and_three_budgets(
    source: Callable[[str], Path], tmp_path: Path, where: str, count: int
) -> None:
    every = list(assets(where, source(f"{where}/"), tmp_path))
    differing = 0
    for kind, path, settings, metric in every[:: max(1, round(len(every) / count))]:
        values = brute(kind, path, settings, metric)
        less = METRICS[metric].less_is_better
        best, worst = (min, max) if less else (max, min)
        middle = 0.5 * (best(values.values()) + worst(values.values()))
        impossible = 0.5 * best(values.values()) if less else 1000.0
        differing += len(set(values.values())) > 1
        for limit in (middle, best(values.values()), impossible):
            every_value = values | (grown(path, settings, metric, limit) if kind == "maps" else {})
            inside = [name for name, value in every_value.items() if not is_beyond(metric, value, limit)]
            if inside:
                made = bake_single(kind, path, settings, tier="auto", budget={metric: limit})
                taken = made.report["tried"]["taken"]
                if (
                    kind == "terrain" and split_label(taken)[1]
                ):  # a bound between the tiers: tests/pipeline/build/tiers/test_tuned_settings.py
                    assert inside[0] == "exact" and made.errors["terrain"][metric] <= limit
                    continue
                assert taken == inside[0], (path, metric, limit, every_value)
                continue
            with pytest.raises(ParadizeError, match="no tier keeps the budget") as caught:
                bake_single(kind, path, settings, tier="auto", budget={metric: limit})
            assert f" {abs(best(every_value.values()) - limit):.3g} " in str(caught.value)
    assert differing >= count // 3, "tiers that measure alike prove nothing"

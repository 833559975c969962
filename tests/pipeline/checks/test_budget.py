"""A scene says which errors it accepts, and for how long it lets a finding pass."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.checks import CheckOptions, Finding, check_paths, render
from paradize.checks.against import growth
from paradize.checks.budgets import check_budget, device_bytes
from paradize.checks.verdicts import apply_scene
from paradize.cli.main import main
from paradize.data import Lod, Texture
from paradize.errors import ParadizeError
from paradize.formats.glb.encode import encode_glb
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.scene.budget import METRICS, Excess, excesses
from paradize.scene.schema import Limits
from paradize.scene.settings import load_scene
from tests.pipeline.bakes import bake_apart
from tests.pipeline.scenes import make_cove
from tests.pipeline.shapes import cube


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]) -> Path:
    """A folder with `scene` and its bake `out`, with all levels of detail."""
    top = tmp_path_factory.mktemp("cove")
    cove_store(top / "store")
    bake_apart(make_cove(top / "scene"), top, whole=True)
    return top


@pytest.fixture
def cove(baked: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the same, with its store."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "cove" / "store"))
    monkeypatch.setenv("PARADIZE_REPORT", "")
    shutil.copytree(baked, tmp_path / "cove")
    return tmp_path / "cove"


def with_toml(cove: Path, text: str) -> Path:
    path = cove / "scene" / "cove.toml"
    path.write_text(path.read_text() + text)
    return path


def rebaked(cove: Path, text: str, tier: str = "fast") -> Path:
    report = bake(with_toml(cove, text), cove / "out", BuildOptions(jobs=1, tier=tier))
    assert not report.errors, report.errors
    return cove / "out"


def change(out: Path, edit: Callable[[dict[str, Any]], Any]) -> Path:
    tree = json.loads((out / "scene.json").read_text())
    edit(tree)
    (out / "scene.json").write_text(json.dumps(tree))
    return out


def codes(findings: list[Finding]) -> list[str]:
    return [finding.code for finding in findings]


def test_a_limit_is_a_number_or_a_soft_and_a_hard_one(cove: Path) -> None:
    text = "[budget]\nsurface_max = 0.1\ncolor_psnr_db = { soft = 40, hard = 36 }\n"
    text += "normal_p99_deg = { soft = 3 }\n"
    budget = load_scene(with_toml(cove, text)).budget
    assert budget == Limits(
        {"surface_max": 0.1, "color_psnr_db": 36}, {"color_psnr_db": 40, "normal_p99_deg": 3}
    )
    assert budget.aim == {"surface_max": 0.1, "color_psnr_db": 40, "normal_p99_deg": 3}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[budget]\ncolor_psnr_db = { soft = 30, hard = 36 }",
            "budget.color_psnr_db.soft: is 30; must be at least",
        ),
        (
            "[budget]\nsurface_max = { soft = 0.2, hard = 0.1 }",
            "budget.surface_max.soft: is 0.2; must be at most",
        ),
        ("[budget]\nsurface_max = { firm = 0.2 }", "budget.surface_max.firm: is not a key of a limit"),
        ("[budget]\nsurface_max = { hard = -1 }", "budget.surface_max.hard: is -1; allowed: 0 to 1"),
        ("[budget]\nsurface_mux = 1", "did you mean surface_max?"),
        ('[check]\nPZ104 = "loud"', "check.PZ104: is 'loud'; allowed: error, warning, off"),
        ('[check]\nnothing = "off"', "check.nothing: is not a code of a rule"),
        ('[[waiver]]\nrule = "PZ401"\nuntil = 2026-12-31', r"waiver[0].reason: is missing"),
        ('[[waiver]]\nrule = "PZ401"\nreason = "x"\nuntil = "soon"', "waiver[0].until: is 'soon', not a day"),
        ('[[waiver]]\nrule = "401"\nreason = "x"\nuntil = 2026-12-31', "waiver[0].rule: is '401'"),
        (
            '[[waiver]]\nrule = "PZ401"\nmetric = "b"\nreason = "x"\nuntil = 2026-12-31',
            "waiver[0].metric: is 'b'",
        ),
    ],
)
def test_a_limit_or_waiver_that_makes_no_sense_is_refused_by_its_place(
    baked: Path, tmp_path: Path, text: str, message: str
) -> None:
    shutil.copytree(baked / "scene", tmp_path / "scene")
    with pytest.raises(ParadizeError) as caught:
        load_scene(with_toml(tmp_path, text))
    assert message in str(caught.value)


@pytest.mark.parametrize("metric", sorted(METRICS))
def test_every_metric_is_worse_in_its_own_direction(metric: str) -> None:
    worse = 1.5 if METRICS[metric].less_is_better else 0.5
    better = 2.0 - worse
    limits = Limits({metric: 1.0}, {metric: better})
    assert excesses(limits, {metric: better}) == []
    assert excesses(limits, {metric: 1.0}) == [Excess(metric, 1.0, better, hard=False)]
    assert excesses(limits, {metric: worse}) == [Excess(metric, worse, 1.0, hard=True)]
    assert excesses(limits, {}) == []


def test_beyond_hard_fails_beyond_soft_warns_and_both_name_artifact_value_limit_and_tier(cove: Path) -> None:
    out = rebaked(
        cove, "[budget]\ncolor_psnr_db = { soft = 100 }\nterrain_max_m = { soft = 0.05, hard = 0.06 }\n"
    )
    found = {finding.artifact: finding for finding in check_paths([out]) if finding.metric == "color_psnr_db"}
    assert found and {finding.code for finding in found.values()} == {"PZ406"}
    assert not any(finding.fails for finding in found.values())
    tree = json.loads((out / "scene.json").read_text())
    value = tree["artifacts"]["post_color"]["errors"]["color_psnr_db"]
    text = str(found["post_color"])
    assert f"color_psnr_db is {value:g} dB, soft budget 100" in text and "level 0" in text
    tried = tree["check"]["tried"]["post_color"]
    assert tried["requested"] == tried["taken"] == "fast" and set(tried["errors"]) == {
        "fast",
        "balanced",
        "exact",
    }
    between = sorted(tried["errors"][tier]["color_psnr_db"] for tier in tried["errors"])[1]
    change(out, lambda m: m["budget"]["hard"].update(color_psnr_db=between))
    (hard,) = [f for f in check_paths([out]) if f.artifact == "post_color"]
    assert hard.code == "PZ401" and hard.fails
    first = next(t for t in ("fast", "balanced", "exact") if tried["errors"][t]["color_psnr_db"] >= between)
    assert f"tier {first} would pass: {tried['errors'][first]['color_psnr_db']:g} dB" in str(hard)
    change(out, lambda m: m["budget"]["hard"].update(color_psnr_db=900))
    (hard,) = [f for f in check_paths([out]) if f.artifact == "post_color"]
    assert "no tier passes" in str(hard)


def test_the_level_and_the_patch_that_are_worst_are_named(cove: Path) -> None:
    out = change(cove / "out", lambda m: m["budget"]["hard"].update(surface_max=1e-9, terrain_max_m=1e-9))
    places = {finding.artifact: finding.place for finding in check_paths([out])}
    assert places["post_mesh"] == "artifacts.post_mesh lod2"
    assert (
        places["terrain_mesh"].startswith("artifacts.terrain_mesh patch ")
        and " at (" in places["terrain_mesh"]
    )


def test_files_and_what_the_device_holds_have_budgets_too(cove: Path) -> None:
    tree = json.loads((cove / "out" / "scene.json").read_text())
    total = sum(entry["bytes"] for entry in tree["artifacts"].values()) / 1e6
    out = change(cove / "out", lambda m: m["budget"]["hard"].update(folder_mb=total, gpu_mb=2.0 * total))
    assert check_paths([out]) == []
    change(out, lambda m: m["budget"]["hard"].update(folder_mb=0.99 * total, gpu_mb=0.5 * total))
    found = check_paths([out])
    assert [(f.code, f.metric) for f in found] == [("PZ401", "folder_mb"), ("PZ401", "gpu_mb")]
    largest = max(tree["artifacts"], key=lambda name: tree["artifacts"][name]["bytes"])
    assert f"the largest: {largest} " in str(found[0])


WAIVER = '\n[[waiver]]\nrule = "PZ401"\nartifact = "terrain_mesh"\nmetric = "terrain_max_m"\n'
WAIVER += 'reason = "the new sand comes in June"\nuntil = 2026-06-30\n'


def test_the_device_holds_what_is_inflated_and_the_buffers_of_meshes() -> None:
    levels = tuple(bytes(4 * side * side) for side in (16, 8, 4, 2, 1))
    texture = Texture("RGBA8_UNORM", 16, 16, levels)
    for zstd_level in (None, 3):
        assert device_bytes(encode_ktx2(texture, zstd_level=zstd_level)) == sum(map(len, levels))
    mesh = cube()
    rows = len(mesh.positions) * 12 + mesh.triangles.size * 2
    assert rows <= device_bytes(encode_glb((Lod(mesh, 0.0, 0.0),), "cube")) < rows + 32
    assert [device_bytes(data) for data in (b"", b"OggS" * 9, b"glTF\2\0")] == [0, 0, 0]


def test_of_the_finest_patches_of_a_tile_the_worst_is_named() -> None:
    """Not a coarse one that is worse, and not one of another tile."""
    none: dict[str, Any] = {"hard": {}, "soft": {}}
    patches = {"tile": [0, 0, 0, 0, 1], "diamond": [0, -1, -1, -1, -1], "error_m": [9.0, 0.1, 0.3, 0.2, 5.0]}
    patches["center"] = [[float(k), 0.0, -1.5] for k in range(5)]
    entry = {"kind": "mesh", "errors": {"terrain_max_m": 0.3}, "levels": [], "file": "a", "bytes": 1}
    manifest = {
        "budget": none | {"hard": {"terrain_max_m": 0.2}},
        "artifacts": {"ground": entry},
        "terrain": {"tiles": ["ground", "ground_1"], "patches": patches},
        "flight": {"errors": {}},
        "check": {"tried": {}},
    }
    (found,) = check_budget(manifest, Path(), "scene.json")
    assert found.place == "artifacts.ground patch 2 at (2, 0, -1.5)"
    manifest["budget"] = {"hard": {"surface_max": 0.01}, "soft": {}}
    levels = [{"error_max": error} for error in (0.0, 0.05, 0.02)]
    manifest["artifacts"] = {"post": entry | {"errors": {"surface_max": 0.05}, "levels": levels}}
    (found,) = check_budget(manifest, Path(), "scene.json")
    assert found.place == "artifacts.post lod1"


def test_of_several_waivers_the_one_that_holds_longest_counts() -> None:
    days = ("2026-06-30", "2026-01-31", "2026-03-31")
    waivers = [
        {"rule": "PZ104", "artifact": None, "metric": None, "reason": day, "until": day} for day in days
    ]
    for order in (waivers, waivers[::-1]):
        result = {"severity": {}, "waivers": order}
        for day, holds in ((date(2026, 6, 30), True), (date(2026, 7, 1), False)):
            (found,) = apply_scene([Finding("PZ104", "a", "b")], result, "scene.json", day)
            assert bool(found.waived) is holds and "2026-06-30" in str(found)


def test_a_waiver_of_no_artifact_is_told_with_the_one_that_is_meant() -> None:
    waiver = {
        "rule": "PZ401",
        "artifact": "post_clor",
        "metric": None,
        "reason": "old",
        "until": "2026-06-30",
    }
    verdict = {"severity": {}, "waivers": [waiver]}
    names = ("sky", "post_color", "post_normal")
    (found,) = apply_scene([], verdict, "scene.json", date(2026, 6, 1), names)
    assert found.code == "PZ407" and "did you mean post_color?" in str(found)
    waiver["artifact"] = "post_color"
    (found,) = apply_scene([], verdict, "scene.json", date(2026, 6, 1), names)
    assert "did you mean" not in str(found)


def test_a_waiver_of_the_flight_or_the_scene_is_not_taken_for_a_misspelt_one(cove: Path) -> None:
    waivers = [
        {"rule": "PZ401", "artifact": name, "metric": None, "reason": "old", "until": "2099-01-01"}
        for name in ("flight", "scene", "terrain_mash")
    ]
    out = change(cove / "out", lambda m: m["check"].update(waivers=waivers))
    change(out, lambda m: m["artifacts"]["terrain_mesh"].update(also=["flights", "scenes"]))
    found = [str(one) for one in check_paths([out]) if one.code == "PZ407"]
    assert ["did you mean" in text for text in found] == [False, False, True]
    assert "did you mean terrain_mesh?" in found[2]


def test_a_waived_finding_passes_up_to_its_day_and_fails_after_it(cove: Path, capsys: Any) -> None:
    out = rebaked(cove, "[budget]\nterrain_max_m = 1e-6\n" + WAIVER)
    (held,) = check_paths([out], CheckOptions(today=date(2026, 6, 30)))
    assert not held.fails and held.severity == "error"
    assert "waived PZ401" in str(held) and "until 2026-06-30: the new sand comes in June" in str(held)
    assert "0 errors, 0 warnings, 1 waived" in render([held], "text")
    (result,) = json.loads(render([held], "sarif"))["runs"][0]["results"]
    assert "new sand" in result["suppressions"][0]["justification"]
    assert 'skipped="1"' in render([held], "junit") and 'failures="0"' in render([held], "junit")
    (late,) = check_paths([out], CheckOptions(today=date(2026, 7, 1)))
    assert late.fails and "its waiver ended on 2026-06-30" in str(late)
    # By the command line, whose exit code follows.
    assert main(["check", str(out), "--today", "2026-01-01"]) == 0
    assert main(["check", str(out), "--today", "2027-01-01"]) == 1
    capsys.readouterr()


def test_a_check_says_where_no_error_is_judged(cove: Path, capsys: Any) -> None:
    out = str(cove / "out")
    assert main(["check", out]) == 0
    note = f"{out}/scene.json: the scene sets no [budget], so errors are recorded and none is judged"
    assert note in capsys.readouterr().out.splitlines()
    for kind in ("hard", "soft"):
        limits = {"hard": {}, "soft": {}} | {kind: {"color_psnr_db": 1.0}}
        change(cove / "out", lambda m, limits=limits: m.update(budget=limits))
        main(["check", out])
        assert "[budget]" not in capsys.readouterr().out


def test_a_waiver_of_another_artifact_or_metric_does_not_cover_and_is_told(cove: Path) -> None:
    for old, new in (('"terrain_mesh"', '"post_mesh"'), ('"terrain_max_m"', '"surface_max"')):
        out = change(
            cove / "out",
            lambda m, old=old, new=new: (
                m["budget"]["hard"].update(terrain_max_m=1e-6),
                m["check"].update(
                    waivers=[
                        {"rule": "PZ401", "artifact": "terrain_mesh", "metric": "terrain_max_m"}
                        | {"artifact" if "mesh" in old else "metric": new.strip('"')}
                        | {"reason": "x", "until": "2999-01-01"}
                    ]
                ),
            ),
        )
        found = check_paths([out])
        assert codes(found) == ["PZ401", "PZ407"] and found[0].fails and not found[1].fails


def test_a_scene_sets_severities(cove: Path) -> None:
    (cove / "out" / "sky-00000000.ktx2").write_bytes(b"x")
    assert [f.severity for f in check_paths([cove / "out"])] == ["warning"]
    for word, fails in (("error", [True]), ("off", []), ("warning", [False])):
        change(cove / "out", lambda m, word=word: m["check"].update(severity={"PZ104": word}))
        assert [f.fails for f in check_paths([cove / "out"])] == fails
    change(cove / "out", lambda m: m["check"].update(severity={"PZ104": "off", "PZ999": "off"}))
    assert codes(check_paths([cove / "out"])) == ["PZ407"]
    for word, fails in (("error", [True]), ("off", [])):
        change(cove / "out", lambda m, word=word: m["check"]["severity"].update(PZ407=word))
        assert [f.fails for f in check_paths([cove / "out"])] == fails


def test_a_waiver_of_a_rule_that_there_is_not_is_told(cove: Path) -> None:
    waiver = {"rule": "PZ998", "artifact": None, "metric": None, "reason": "x", "until": "2999-01-01"}
    change(cove / "out", lambda m: m["check"].update(waivers=[waiver]))
    (result,) = check_paths([cove / "out"])
    assert result.code == "PZ407" and result.what == "there is no rule PZ998"


def test_a_scene_is_held_to_an_earlier_bake(cove: Path) -> None:
    before = cove / "before"
    shutil.copytree(cove / "out", before)
    look = CheckOptions(against=before)
    assert check_paths([cove / "out"], look) == []
    normal = {"normal_p99_deg": 1.04}

    def grow(tree: dict[str, Any], share: float) -> None:
        tree["artifacts"]["post_normal"]["errors"]["normal_p99_deg"] *= share
        tree["artifacts"]["post_color"]["errors"]["color_psnr_db"] -= 20.0 * (share - 1.0) * 0.43

    change(cove / "out", lambda m: grow(m, 1.04))
    assert check_paths([cove / "out"], look) == [], normal
    change(cove / "out", lambda m: grow(m, 1.04))
    found = check_paths([cove / "out"], look)
    assert codes(found) == ["PZ421", "PZ421"]
    assert {f.metric for f in found} == {"normal_p99_deg", "color_psnr_db"} and all(f.fails for f in found)
    assert check_paths([cove / "out"], CheckOptions(against=before, worse_by=0.1)) == []


def test_of_each_metric_the_level_that_got_worst_is_told(cove: Path) -> None:
    """Each metric has a line of its own. The finest level's errors are the artifact's own, and are told there
    or not at all."""
    before = cove / "before"
    shutil.copytree(cove / "out", before)

    def grow(tree: dict[str, Any], level: int, metric: str, share: float) -> None:
        tree["artifacts"]["post_mesh"]["levels"][level][metric] *= share

    change(cove / "out", lambda m: m["artifacts"]["post_normal"]["levels"][0].update(p99_deg=90.0))
    assert check_paths([cove / "out"], CheckOptions(against=before)) == []
    for share, level, metric in ((1.5, 1, "error_rms"), (3.0, 1, "normal_mean_deg"), (2.0, 2, "error_rms")):
        change(cove / "out", lambda m, s=share, k=level, key=metric: grow(m, k, key, s))
    found = check_paths([cove / "out"], CheckOptions(against=before))
    places = ["artifacts.post_mesh level 2", "artifacts.post_mesh level 1"]
    assert [(one.metric, one.count, one.place) for one in found] == [
        ("error_rms", 2, places[0]),
        ("normal_mean_deg", 1, places[1]),
    ]
    assert [one.what.partition(" is ")[0] for one in found] == [
        "error_rms of level 2",
        "normal_mean_deg of level 1",
    ]
    assert found[1].what.endswith("200 % worse") and {one.code for one in found} == {"PZ421"}


def test_what_is_new_gone_or_larger_is_a_warning(cove: Path) -> None:
    before = cove / "before"
    shutil.copytree(cove / "out", before)
    size = json.loads((before / "scene.json").read_text())["artifacts"]["sky"]["bytes"]
    for share, result in ((1.04, []), (1.06, ["PZ423"]), (1.9, ["PZ423"])):
        change(before, lambda m, share=share: m["artifacts"]["sky"].update(bytes=round(size / share)))
        assert codes(check_paths([cove / "out"], CheckOptions(against=before))) == result
    change(before, lambda m: m["artifacts"]["sky"].update(bytes=size))
    change(before, lambda m: (m["artifacts"].update(old=m["artifacts"].pop("sound")), m.update(sounds=[])))
    change(before, lambda m: m.update(streaming=[n for n in m["streaming"] if n in m["artifacts"]]))
    change(before, lambda m: m["artifacts"]["post_mesh"].update(bytes=1000))
    found = check_paths([cove / "out"], CheckOptions(against=before))
    assert sorted(codes(found)) == ["PZ422", "PZ422", "PZ423"] and not any(f.fails for f in found)
    assert {f.artifact for f in found} == {"sound", "old", "post_mesh"}


def test_an_earlier_bake_that_is_not_there_is_told(cove: Path) -> None:
    (result,) = check_paths([cove / "out"], CheckOptions(against=cove / "gone"))
    assert result.code == "PZ101" and "--against" in str(result)
    (cove / "bad").mkdir()
    (cove / "bad" / "scene.json").write_text("{}")
    assert codes(check_paths([cove / "out"], CheckOptions(against=cove / "bad"))) == ["PZ102"]


def test_an_earlier_bake_is_named_by_its_scene_file_too(cove: Path) -> None:
    before = Path(shutil.copytree(cove / "out", cove / "before"))
    change(cove / "out", lambda m: m["artifacts"]["terrain_mesh"]["errors"].update(terrain_max_m=5.0))
    for against in (before, before / "scene.json"):
        assert "PZ421" in codes(check_paths([cove / "out"], CheckOptions(against=against)))


def test_files_without_a_scene_cannot_be_held_to_an_earlier_bake(cove: Path) -> None:
    alone = next((cove / "out").glob("post_mesh-*.glb"))
    assert check_paths([alone]) == []
    (result,) = check_paths([alone], CheckOptions(against=cove / "out"))
    assert result.code == "PZ101" and result.fails and "--against" in str(result)


def test_of_several_earlier_bakes_the_one_of_the_same_name_counts(cove: Path) -> None:
    shutil.copytree(cove / "out", cove / "all" / "out")
    assert check_paths([cove / "out"], CheckOptions(against=cove / "all")) == []


@pytest.mark.parametrize(
    ("metric", "was", "now", "share"),
    [
        ("normal_p99_deg", 2.0, 2.5, 0.25),
        ("normal_p99_deg", 2.5, 2.0, 0.0),
        ("normal_p99_deg", 1e-9, 5e-4, 0.0),  # both are rounding
        ("normal_p99_deg", 5e-4, 1.0, 1999.0),  # it was, and is no more
        ("surface_max", 0.0, 0.5, float("inf")),
        ("color_psnr_db", 40.0, 20.0, 9.0),
        ("color_psnr_db", 40.0, 41.0, 0.0),
        ("triangles", 10.0, 20.0, 0.0),
    ],
)
def test_errors_grow_by_a_share_of_what_they_were(metric: str, was: float, now: float, share: float) -> None:
    assert growth(metric, was, now) == pytest.approx(share)

"""`paradize explain` says who asked, when it is needed, and which number limits it."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from paradize.build.bake import bake
from paradize.build.job_inputs import _changes, views_of_job
from paradize.build.options import BuildOptions
from paradize.explain.economy import economy, economy_words, textures_by_owner
from paradize.explain.facts import explain
from paradize.explain.gutters import decides
from paradize.explain.words import render
from paradize.formats.ktx2.layout import IDENTIFIER
from paradize.scene.jobs import BakeJob
from paradize.scene.settings import load_scene
from tests.pipeline.bakes import bake_apart
from tests.pipeline.layouts import make_atlas_scene, two_tone
from tests.pipeline.scenes import make_cove

RED, GREEN = (200, 40, 30), (40, 180, 60)
Run = Callable[..., Any]


@pytest.fixture(scope="module")
def close(tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]) -> tuple[Path, Path]:
    """(scene, its bake): two islands of two colours, four texels apart, with more parallax than that
    allows."""
    top = tmp_path_factory.mktemp("close")
    cove_store(top / "store")
    scene = make_atlas_scene(
        top / "scene", *two_tone(4, RED, GREEN), parallax_scale=0.4, viewport="[320, 180]"
    )
    bake_apart(scene, top)
    return scene, top / "out"


def explained(scene: Path, out: Path, name: str) -> dict[str, Any]:
    (artifact,) = explain(scene, name, out).artifacts
    return artifact


def test_every_artifact_is_explained_and_nothing_else(close: tuple[Path, Path]) -> None:
    scene, out = close
    explanation = explain(scene, out=out)
    manifest = json.loads((out / "scene.json").read_text())
    assert {artifact["name"] for artifact in explanation.artifacts} == manifest["artifacts"].keys()
    for artifact in explanation.artifacts:
        assert artifact["reason"]
        assert artifact["passes"] or artifact["kind"] == "sound"
        assert artifact["first_needed_s"] == manifest["artifacts"][artifact["name"]]["first_needed_s"]
    assert explanation.baked
    for artifact in explanation.artifacts:
        if artifact["name"] in ("post_mesh", "post_color", "terrain_mesh"):
            assert explained(scene, out, artifact["name"]) == artifact


def test_an_artifact_names_the_passes_of_its_own_scene(tmp_path: Path) -> None:
    scene = make_cove(tmp_path)
    whole = explained(scene, tmp_path / "none", "post_mesh")
    assert whole["passes"] == ["objects", "shadow", "reflection", "refraction"]
    scene.write_text(scene.read_text().replace("[reflection]\n[refraction]\n", ""))
    assert explained(scene, tmp_path / "none", "post_mesh")["passes"] == ["objects", "shadow"]


def test_the_reason_names_only_views_that_the_scene_has(tmp_path: Path) -> None:
    scene = make_cove(tmp_path)
    out = tmp_path / "out"
    assert explained(scene, out, "sky")["reason"] == "the sky and the water's mirror"
    assert explained(scene, out, "terrain_mesh")["reason"] == "the terrain, its shadow and its mirror image"
    text = scene.read_text().replace("[reflection]\n", "")
    scene.write_text(text[: text.index("[water]")] + text[text.index("[[object]]") :])
    assert explained(scene, out, "sky")["reason"] == "the sky"
    assert explained(scene, out, "terrain_mesh")["reason"] == "the terrain and its shadow"


def test_the_deciding_number_is_in_the_words(close: tuple[Path, Path]) -> None:
    gutter = explained(*close, "post_color")["gutter"]
    assert gutter["width_texels"] == 2.0
    assert gutter["needed_texels"] > gutter["width_texels"]
    assert gutter["max_level"] < gutter["levels"] - 1
    text = render(explain(close[0], "post_color", close[1]))
    assert "2 islands, 2 texels at the narrowest" in text
    assert f"level {gutter['max_level']} of {gutter['levels'] - 1} is the last that is sampled" in text
    after = gutter["max_level"] + 1
    assert f"{gutter['bleed_p99'][after]:.3g}" in text or f"{gutter['bleed_max'][after]:.3g}" in text
    assert f"{gutter['bound']:g} is accepted" in text


def test_parallax_asked_and_given_are_told(close: tuple[Path, Path]) -> None:
    parallax = explained(*close, "post_height")["gutter"]["parallax"]["wood"]
    assert parallax["requested"] == [0.4, 0.0]
    assert parallax["given"][0] == pytest.approx(2 * parallax["limit"])
    assert "limited" in render(explain(close[0], out=close[1]))


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        ({"width_texels": None}, ["one island"]),
        ({"level_by_width": 3}, ["the width alone is enough for level 3"]),
        ({"level_by_width": 1}, ["enough for level 1 at most; the colours"]),
        ({"level_by_width": -1}, ["enough for no level; the colours"]),
        ({"max_level": None}, ["at every level at most 0.4 bleeds in", "0.125 is accepted"]),
        (
            {},
            ["level 3 would bleed by 0.2 ", "level 2 of 4 is the last", "would use level 3: the object may"],
        ),
        ({"max_level": 1}, ["at level 2 a sample would be off by 0.9 (none may be by more than 0.3125)"]),
    ],
)
def test_the_words_of_a_gutter_follow_from_its_numbers(facts: dict[str, Any], words: list[str]) -> None:
    gutter = {"width_texels": 4.0, "level_by_width": 0, "level_in_use": 3, "max_level": 2, "bound": 0.125}
    gutter |= {"bleed_p99": [0.0, 0.01, 0.1, 0.2, 0.4], "bleed_max": [0.1, 0.2, 0.9, 1.0, 1.0]}
    text = "; ".join(decides(gutter | facts))
    assert all(word in text for word in words), text
    assert "shimmer" not in "; ".join(decides(gutter | {"level_in_use": 2}))


def test_a_level_that_looks_alike_at_no_size_is_told_with_a_mend() -> None:
    level = {
        "size_px": 40.0,
        "seen_px": 40.0,
        "seen_p99_deg": 9.0,
        "seen_silhouette": 0.002,
        "seen_flip": 0.004,
    }
    never = {"size_px": 1.0, "seen_px": 4.0, "seen_p99_deg": 24.0, "seen_silhouette": 0.037}
    never |= {"seen_flip": 0.021}
    facts = {"view": None, "limit": None, "maps": {}, "left_out": 0, "seen": [level, never], "levels_s": []}
    _, drawn, not_drawn = economy_words(facts, "mesh")
    assert "level 1 is drawn where the object is up to 40 pixels" in drawn and "already" not in drawn
    assert "level 2 is drawn where the object is up to 1 pixels" in not_drawn
    changes = (
        "3.70% and the picture by 0.021 of FLIP over its box at 4 pixels already, more than the scene allows"
    )
    assert changes in not_drawn
    assert 'lods_by = "screen_size"' in not_drawn


def test_it_says_when_each_level_is_first_needed() -> None:
    facts = {"view": "camera", "texels": 2.0, "second_s": 7.5, "limit": None, "maps": {}, "left_out": 0}
    facts |= {"seen": [], "levels_s": [None, 7.5, 2.0, 2.0]}
    assert economy_words(facts, "mesh")[1] == (
        "needed: level 0 never, level 1 from second 7.5 on, levels 2 to 3 from second 2 on"
    )
    assert len(economy_words(facts | {"levels_s": [0.0, 0.0]}, "mesh")) == 1
    less = facts | {"levels_s": [0.0], "coarser_left_out": 2, "saved_bytes": 4_000}
    assert economy_words(less, "mesh")[1].startswith(
        "2 coarser levels are left out, which no view of the flight is far enough away to draw: 4"
    )


def test_maps_that_were_not_made_are_reckoned_in_the_size_that_the_picture_has(tmp_path: Path) -> None:
    """Two finer levels of 8 x 4 texels were left out: of heights, 8 bytes a block, from 32 x 16 down."""
    (tmp_path / "post_color.ktx2").write_bytes(IDENTIFIER + struct.pack("<8I", 0, 1, 8, 4, 0, 0, 1, 4))
    detail = {"left_out": 2, "saved_bytes": 9, "texels": 4.0, "second_s": 0.0, "view": "camera"}
    entry = {"kind": "texture", "file": "post_color.ktx2", "required_detail": detail}
    manifest = {"artifacts": {"post_color": entry}}
    found = economy(manifest, tmp_path, "post_color", textures_by_owner(manifest))
    blocks = 8 * 4 + 4 * 2 + 2 * 1 + 1 + 1 + 1
    assert found is not None and found["maps"]["height"] == 8 * blocks
    assert found["maps"]["dudv"] == 2 * (32 * 16 + 16 * 8 + 8 * 4 + 4 * 2 + 2 * 1 + 1)


def test_before_a_bake_it_tells_what_it_can_and_says_so(tmp_path: Path) -> None:
    explanation = explain(make_cove(tmp_path), out=tmp_path / "none")
    assert not explanation.baked
    assert all(artifact["first_needed_s"] is None for artifact in explanation.artifacts)
    assert render(explanation).endswith("are not known before")


def test_a_bake_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "scene.json").write_text("{}")
    explanation = explain(make_cove(tmp_path / "scene"), out=tmp_path / "out")
    assert not explanation.baked
    assert "bake it again" in explanation.why_not


def test_the_command_prints_text_and_json(close: tuple[Path, Path], paradize_here: Run) -> None:
    scene, out = close
    done = paradize_here("explain", scene, "-o", out, "--details")
    assert done.returncode == 0, done.stderr
    assert "post_color: the object post" in done.stdout
    done = paradize_here("explain", scene, "post_color", "-o", out, "--json")
    assert done.returncode == 0, done.stderr
    tree = json.loads(done.stdout)
    assert tree["scene"] == "cove"
    assert [artifact["name"] for artifact in tree["artifacts"]] == ["post_color"]
    assert tree["artifacts"][0]["decides"]


def test_an_unknown_artifact_is_an_error_that_names_those_there_are(
    tmp_path: Path, paradize_here: Run
) -> None:
    scene = make_cove(tmp_path)
    done = paradize_here("explain", scene, "post_colour")
    assert done.returncode == 1
    assert "no artifact 'post_colour'" in done.stderr
    assert "did you mean post_color?" in done.stderr
    assert "water_dudv" in done.stderr
    assert "Traceback" not in done.stderr


def test_explaining_imports_no_numpy(tmp_path: Path) -> None:
    import subprocess

    scene = make_cove(tmp_path)
    code = (
        "import sys; from paradize.cli.main import main; "
        f"main(['explain', {str(scene)!r}, '-o', 'none']); sys.exit('numpy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.fixture
def cove(
    tmp_path: Path, cove_store: Callable[[Path], Path], monkeypatch: pytest.MonkeyPatch
) -> tuple[Path, Path]:
    """(scene, its bake), of the cove."""
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    scene = make_cove(tmp_path / "scene")
    assert not bake(scene, tmp_path / "out", BuildOptions(jobs=1)).errors
    return scene, tmp_path / "out"


def stale(scene: Path, out: Path) -> dict[str, list[str]]:
    """The reason why each artifact is stale, if it is."""
    return {one["name"]: one["stale"] for one in explain(scene, out=out).artifacts if one["stale"] != []}


def replace(scene: Path, old: str, new: str) -> None:
    text = scene.read_text()
    assert old in text
    scene.write_text(text.replace(old, new, 1))


@pytest.mark.deep
def test_without_an_artifact_each_has_one_short_line_and_the_sums_follow(
    cove: tuple[Path, Path], paradize_here: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    scene, out = cove
    entries = json.loads((out / "scene.json").read_text())["artifacts"]
    head, _, *rows = paradize_here("explain", scene, "-o", out).stdout.splitlines()
    assert head.split()[0] == "artifact" and [row.split()[0] for row in rows[: len(entries)]] == list(entries)
    for row, (name, entry) in zip(rows, entries.items(), strict=False):
        assert row.split()[-1] == str(entry["bytes"]) and len(row) <= 120, name
        assert f"second {entry['first_needed_s']:g}" in row
    sums = rows[len(entries) :]
    assert sums[0].startswith(f"{len(entries)} artifacts, ") and sums[-1].startswith("more: paradize explain")
    assert len(sums) == 2
    whole = paradize_here("explain", scene, "-o", out, "--details").stdout
    assert len(whole.splitlines()) > 5 * len(entries) and max(map(len, whole.splitlines())) < 300
    replace(scene, "sand_strength = 0.5", "sand_strength = 0.4")
    stale_row = paradize_here("explain", scene, "-o", out).stdout.splitlines()[-2]
    assert stale_row == "stale: sources, settings or Paradize itself changed since the bake: sand_normal"
    before = paradize_here("explain", scene, "-o", scene.parent / "nothing").stdout.splitlines()
    assert before[2].split()[-2:] == ["-", "-"] and "there is no bake in" in before[-2]


def test_a_changed_setting_or_picture_is_named_by_what_it_makes_stale(cove: tuple[Path, Path]) -> None:
    scene, out = cove
    replace(scene, "sand_strength = 0.5", "sand_strength = 0.4")
    wood = scene.parent / "wood.png"
    held = wood.read_bytes()
    wood.write_bytes((scene.parent / "sand.png").read_bytes())
    changed = stale(scene, out)
    wood.write_bytes(held)
    replace(scene, "sand_strength = 0.4", "sand_strength = 0.5")
    assert changed.pop("sand_normal") == ["setting strength 0.5 -> 0.4"]
    assert changed.keys() == {"post_color", "post_normal", "post_height", "post_gloss"}
    assert all(len(texts) == 1 and texts[0].endswith("wood.png changed") for texts in changed.values())


def test_the_settings_of_a_texture_hold_the_budget_that_limits_it(tmp_path: Path) -> None:
    scene = make_cove(tmp_path)
    scene.write_text(f"{scene.read_text()}\n[budget]\ncolor_psnr_db = 30.0\n")
    said = render(explain(scene, "post_color"))
    assert "budget = color_psnr_db 30" in said and "(-o names another folder)" in said


def test_an_instance_that_moved_is_named_for_the_jobs_of_its_object(tmp_path: Path) -> None:
    path, job = make_cove(tmp_path), BakeJob("post_mesh", "mesh", {}, {}, (), objects=("post",))
    before = views_of_job(load_scene(path), job)
    replace(path, "[1.0, 0.0, 2.0]", "[1.0, 0.0, 3.0]")
    changes = list(_changes(before, views_of_job(load_scene(path), job)))
    assert changes == ["instance[0].position [1.0, 0.0, 2.0] -> [1.0, 0.0, 3.0]"]


@pytest.mark.deep
def test_after_a_change_it_names_the_input_that_made_each_artifact_stale(
    cove: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, out = cove
    assert stale(scene, out) == {}
    assert "up to date" in render(explain(scene, "sky", out))
    scene.write_text(f"# a comment\n{scene.read_text()}")
    assert stale(scene, out) == {}

    replace(scene, "sand_strength = 0.5", "sand_strength = 0.4")
    assert stale(scene, out) == {"sand_normal": ["setting strength 0.5 -> 0.4"]}
    assert "stale: setting strength 0.5 -> 0.4" in render(explain(scene, out=out))
    replace(scene, "sand_strength = 0.4", "sand_strength = 0.5")

    wood = scene.parent / "wood.png"
    held = wood.read_bytes()
    wood.write_bytes((scene.parent / "sand.png").read_bytes())
    changed = stale(scene, out)
    assert changed.keys() == {"post_color", "post_normal", "post_height", "post_gloss"}
    assert all(len(texts) == 1 and texts[0].endswith("wood.png changed") for texts in changed.values())
    wood.write_bytes(held)
    assert stale(scene, out) == {}

    replace(scene, "[9, 2, 0]", "[9, 3, 0]")
    changed = stale(scene, out)
    assert "flight.eye[0].position [9.0, 2.0, 0.0] -> [9.0, 3.0, 0.0]" in changed["post_color"]
    assert "sound" not in changed
    replace(scene, "[9, 3, 0]", "[9, 2, 0]")

    from paradize.build import job_inputs

    known = job_inputs.library_versions()
    newer = [text.replace("numpy-", "numpy-99.") for text in known]
    monkeypatch.setattr(job_inputs, "library_versions", lambda: tuple(newer))
    (text,) = stale(scene, out)["sound"]
    assert text.startswith("library numpy ") and "-> 99." in text


def test_changed_code_is_named(cove: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    from paradize.build import job_inputs

    scene, out = cove
    true_code = job_inputs.code_of

    def other_code(module: str, *alone: str) -> dict[str, str]:
        code = dict(true_code(module, *alone))
        return code | {name: "0" * 64 for name in code if name == "paradize.stages.normal"}

    monkeypatch.setattr(job_inputs, "code_of", other_code)
    found = stale(scene, out)
    assert found["post_normal"] == ["code of paradize.stages.normal changed"]
    assert "sky" not in found and "sound" not in found


def test_who_asked_for_the_finest_level_and_what_was_saved_are_told(cove: tuple[Path, Path]) -> None:
    scene, out = cove
    found = {one["name"]: one for one in explain(scene, out=out).artifacts}
    detail = found["effect_color"]["required_detail"]
    assert detail["view"] == "camera" and 0.0 <= detail["second_s"] < 8.0
    # 32 x 32 texels: heights of BC4, gloss of BC5, du/dv of two bytes a texel, each down to 1 x 1.
    blocks = 64 + 16 + 4 + 1 + 1 + 1
    texels = sum(4**k for k in range(6))
    assert detail["maps"] == {"height": 8 * blocks, "gloss": 16 * blocks, "dudv": 2 * texels}
    assert found["effect_normal"]["required_detail"]["maps"] == {}
    assert found["sound"]["required_detail"] is None
    text = render(explain(scene, "effect_color", out))
    assert f"needed at second {detail['second_s']:g} by the camera" in text
    assert "maps of its picture that no pass reads are not baked: height" in text


@pytest.mark.deep
def test_at_the_end_stands_what_all_artifacts_together_saved(cove: tuple[Path, Path]) -> None:
    scene, out = cove
    whole = explain(scene, out=out)
    manifest = json.loads((out / "scene.json").read_text())
    entries = manifest["artifacts"].values()
    levels = sum(entry["required_detail"]["saved_bytes"] for entry in entries if entry["required_detail"])
    maps = sum(
        sum(one["required_detail"]["maps"].values()) for one in whole.artifacts if one["required_detail"]
    )
    patches = manifest["terrain"]["demand"]["left_out_bytes"]
    assert whole.saved == {"levels": levels, "patches": patches, "maps": maps} and maps > 0
    last = render(whole).splitlines()[-1]
    assert last.startswith(f"{len(entries)} artifacts, ") and "could give and no pass reads (" in last
    assert explain(scene, "effect_color", out).saved is None

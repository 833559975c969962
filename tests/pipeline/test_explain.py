"""`paradize explain` says who asked, when it is needed, and which number limits it."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from paradize.bake import bake
from paradize.bake_tasks import How
from paradize.explain import explain, render
from tests.pipeline.layouts import make_atlas_scene, two_tone
from tests.pipeline.scenes import make_cove

RED, GREEN = (200, 40, 30), (40, 180, 60)
Run = Callable[..., Any]


@pytest.fixture(scope="module")
def close(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """(scene, its bake): two islands of two colours, four texels apart, with more parallax than that
    allows."""
    top = tmp_path_factory.mktemp("close")
    scene = make_atlas_scene(
        top / "scene", *two_tone(4, RED, GREEN), parallax_scale=0.4, viewport="[320, 180]"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(top / "store"))
        assert not bake(scene, top / "out", How(jobs=2)).errors
    return scene, top / "out"


def told(scene: Path, out: Path, name: str) -> dict[str, Any]:
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


def test_an_artifact_names_the_passes_of_its_own_scene(tmp_path: Path) -> None:
    scene = make_cove(tmp_path)
    whole = told(scene, tmp_path / "none", "post_mesh")
    assert whole["passes"] == ["objects", "shadow", "reflection", "refraction"]
    scene.write_text(scene.read_text().replace("[reflection]\n[refraction]\n", ""))
    assert told(scene, tmp_path / "none", "post_mesh")["passes"] == ["objects", "shadow"]


def test_the_reason_names_only_views_that_the_scene_has(tmp_path: Path) -> None:
    scene = make_cove(tmp_path)
    out = tmp_path / "out"
    assert told(scene, out, "sky")["reason"] == "the sky and the water's mirror"
    assert told(scene, out, "terrain_mesh")["reason"] == "the terrain, its shadow and its mirror image"
    text = scene.read_text().replace("[reflection]\n", "")
    scene.write_text(text[: text.index("[water]")] + text[text.index("[[object]]") :])
    assert told(scene, out, "sky")["reason"] == "the sky"
    assert told(scene, out, "terrain_mesh")["reason"] == "the terrain and its shadow"


def test_the_deciding_number_is_in_the_words(close: tuple[Path, Path]) -> None:
    gutter = told(*close, "post_color")["gutter"]
    assert gutter["width_texels"] == 2.0
    assert gutter["needed_texels"] > gutter["width_texels"]
    assert gutter["max_level"] < gutter["levels"] - 1
    text = render(explain(close[0], "post_color", close[1]), details=True)
    assert "2 islands, 2 texels at the narrowest" in text
    assert f"level {gutter['max_level']} of {gutter['levels'] - 1} is the last that is sampled" in text
    after = gutter["max_level"] + 1
    assert f"{gutter['bleed_p99'][after]:.3g}" in text or f"{gutter['bleed_max'][after]:.3g}" in text
    assert f"{gutter['bound']:g} is accepted" in text


def test_parallax_asked_and_given_are_told(close: tuple[Path, Path]) -> None:
    parallax = told(*close, "post_height")["gutter"]["parallax"]["wood"]
    assert parallax["asked"] == [0.4, 0.0]
    assert parallax["given"][0] == pytest.approx(2 * parallax["limit"])
    assert "asked, given" in render(explain(close[0], out=close[1]), details=False)


def test_before_a_bake_it_tells_what_it_can_and_says_so(tmp_path: Path) -> None:
    explanation = explain(make_cove(tmp_path), out=tmp_path / "none")
    assert not explanation.baked
    assert all(artifact["first_needed_s"] is None for artifact in explanation.artifacts)
    assert render(explanation, details=False).endswith("are not known before")


def test_a_bake_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "scene.json").write_text("{}")
    explanation = explain(make_cove(tmp_path / "scene"), out=tmp_path / "out")
    assert not explanation.baked
    assert "bake it again" in explanation.why_not


def test_the_command_prints_text_and_json(close: tuple[Path, Path], paradize: Run) -> None:
    scene, out = close
    done = paradize("explain", scene, "-o", out)
    assert done.returncode == 0, done.stderr
    assert "post_color: the object post" in done.stdout
    done = paradize("explain", scene, "post_color", "-o", out, "--json")
    assert done.returncode == 0, done.stderr
    tree = json.loads(done.stdout)
    assert tree["scene"] == "cove"
    assert [artifact["name"] for artifact in tree["artifacts"]] == ["post_color"]
    assert tree["artifacts"][0]["decides"]


def test_an_unknown_artifact_is_an_error_that_names_those_there_are(tmp_path: Path, paradize: Run) -> None:
    scene = make_cove(tmp_path)
    done = paradize("explain", scene, "post_colour")
    assert done.returncode == 1
    assert "no artifact 'post_colour'" in done.stderr
    assert "did you mean post_color?" in done.stderr
    assert "water_dudv" in done.stderr
    assert "Traceback" not in done.stderr


def test_explaining_imports_no_numpy(tmp_path: Path) -> None:
    import subprocess

    scene = make_cove(tmp_path)
    code = (
        "import sys; from paradize.cli import main; "
        f"main(['explain', {str(scene)!r}, '-o', 'none']); sys.exit('numpy' in sys.modules)"
    )
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr

"""The player as a program: command line, pictures, errors."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from tests.conftest import RENDER_ENVIRONMENT, ROOT
from tests.player.synthetic import identity, write_scene
from tests.sweeps import sweep

Player = Callable[..., "subprocess.CompletedProcess[str]"]
CHECKED = ("--debug", "--check-finite")


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scene(tmp_path_factory.mktemp("scene") / "full")


def pixels(path: Path) -> Any:
    picture = oiio.ImageBuf(str(path))
    assert not picture.has_error, picture.geterror()
    return picture.get_pixels(oiio.UINT8)


def refused(result: subprocess.CompletedProcess[str], code: int, *parts: str) -> None:
    assert result.returncode == code, (result.returncode, result.stderr)
    assert result.stdout == ""
    for part in parts:
        assert part in result.stderr
    assert "terminate called" not in result.stderr


def test_a_screenshot_has_the_scene_s_size_and_is_not_empty(
    player: Player, scene: Path, tmp_path: Path
) -> None:
    out = tmp_path / "new folder" / "a.png"
    result = player(scene, "--screenshot", out, "--json", *CHECKED)
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert (report["width"], report["height"], report["frames"]) == (96, 54, 1)
    assert report["resident_bytes"] == report["total_bytes"] > 0
    assert report["peak_rss_bytes"] > report["resident_bytes"]
    assert report["screenshots"] == [str(out)]
    assert report["gl_renderer"]
    assert report["program_bytes"] == (ROOT / "build/bin/paradize-player").stat().st_size < 2_000_000
    assert any(name.startswith("libepoxy.so") for name in report["shared_libraries"])
    picture = pixels(out)
    assert picture.shape == (54, 96, 3)
    assert picture.std() > 10  # more than one colour
    assert [path.name for path in out.parent.iterdir()] == ["a.png"]


def test_a_scene_without_optional_passes_shows_its_object(player: Player, tmp_path: Path) -> None:
    bare = write_scene(tmp_path / "bare", bare=True)
    result = player(bare, "--time", 2.5, "--screenshot", tmp_path / "a.png", *CHECKED)
    assert result.returncode == 0, result.stderr
    middle = pixels(tmp_path / "a.png")[20:34, 40:56].astype(int)
    assert (middle[..., 0] > middle[..., 2] + 20).any()  # the box's red squares


def test_frames_are_numbered_and_a_thirtieth_of_a_second_apart(
    player: Player, scene: Path, tmp_path: Path
) -> None:
    result = player(scene, "--time", 1, "--frames", 4, "--screenshot", tmp_path / "f.png", "--json")
    assert result.returncode == 0, result.stderr
    names = ["f_0000.png", "f_0001.png", "f_0002.png", "f_0003.png"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    assert json.loads(result.stdout)["frames"] == 4
    third = player(scene, "--time", 1.1, "--screenshot", tmp_path / "third.png")
    assert third.returncode == 0, third.stderr
    # The same second gives the same frame however it is reached; the last bits of the time may differ.
    difference = np.abs(pixels(tmp_path / "f_0003.png").astype(int) - pixels(tmp_path / "third.png"))
    assert (difference > 2).mean() < 0.001


def test_the_same_moment_is_the_same_picture_every_time(player: Player, scene: Path, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        assert player(scene, "--time", 3.25, "--screenshot", tmp_path / name).returncode == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_the_picture_a_flight_later_differs_only_where_the_sea_and_the_sparkle_moved(
    player: Player, tmp_path: Path
) -> None:
    bare = write_scene(tmp_path / "bare", bare=True)
    for name, second in (("a.png", 3.0), ("b.png", 13.0), ("c.png", 10003.0)):
        assert player(bare, "--time", second, "--screenshot", tmp_path / name).returncode == 0
    assert np.array_equal(pixels(tmp_path / "a.png"), pixels(tmp_path / "b.png"))
    assert np.array_equal(pixels(tmp_path / "a.png"), pixels(tmp_path / "c.png"))


PASSES = ["environment", "shadow", "reflection", "refraction", "terrain", "objects", "sky", "water"]
PASSES += ["blended", "beams", "particles", "shafts", "post"]
ALL_PASSES = ",".join(PASSES)


def test_help_names_the_passes(player: Player) -> None:
    assert f"leave passes out: {', '.join(PASSES)}\n" in player("--help").stdout


@pytest.mark.parametrize(
    "disabled", sweep([*PASSES, ALL_PASSES], test=["shadow", "terrain", "objects", ALL_PASSES])
)
def test_every_pass_can_be_disabled_alone_and_all_at_once(
    player: Player, scene: Path, tmp_path: Path, disabled: str
) -> None:
    result = player(scene, "--disable", disabled, "--screenshot", tmp_path / "a.png", *CHECKED)
    assert result.returncode == 0, result.stderr


def test_a_folder_may_be_given_as_its_scene_json(player: Player, scene: Path, tmp_path: Path) -> None:
    pictures = [tmp_path / name for name in ("folder.png", "file.png")]
    for given, picture in zip((scene, scene / "scene.json"), pictures, strict=True):
        assert player(given, "--screenshot", picture, *CHECKED).returncode == 0
    assert pictures[0].read_bytes() == pictures[1].read_bytes()
    refused(player(scene / "scene.jsn"), 1, "there is no such file")


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ([], "no scene folder; give"),
        (["--nonsense"], "--nonsense"),
        (["--benchmark"], "not expected: --benchmark"),
        (["--disable", "sky,ocean"], "ocean: is not a pass"),
        (["--size", "12"], "must be WxH"),
        (["--frames", "0"], "--frames 0"),
        (["--time", "soon"], "--time soon"),
        (["--screenshot", "a.jpg"], ".png"),
        (["--time"], "--time: 1 required S missing"),
    ],
)
def test_wrong_usage_exits_2_with_one_message(
    player: Player, scene: Path, arguments: list[str], part: str
) -> None:
    refused(player(*([] if arguments == [] else [scene]), *arguments), 2, part, "--help")


def test_a_folder_without_a_scene_is_rejected(player: Player, tmp_path: Path) -> None:
    refused(player(tmp_path / "none"), 1, "scene.json", "paradize bake")
    (tmp_path / "scene.json").write_text("{")
    refused(player(tmp_path), 1, "scene.json", "is not valid JSON")
    (tmp_path / "scene.json").write_text('{"format": "paradize-scene", "version": 99}')
    refused(player(tmp_path), 1, "version: is 99")


def test_truncated_foreign_and_missing_artifacts_are_rejected_by_name(player: Player, tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene", bare=True)
    mesh = scene / "box_mesh.glb"
    whole = mesh.read_bytes()
    mesh.write_bytes(whole[:-8])
    refused(player(scene), 1, "box_mesh.glb", "scene.json says")
    foreign = b"x" * len(whole)
    mesh.write_bytes(foreign)
    refused(player(scene), 1, "box_mesh.glb", "is damaged or was replaced")
    manifest = json.loads((scene / "scene.json").read_text())
    manifest["artifacts"]["box_mesh"] |= identity(foreign)
    (scene / "scene.json").write_text(json.dumps(manifest))
    refused(player(scene), 1, "box_mesh.glb", "is not a GLB file")
    mesh.unlink()
    refused(player(scene), 1, "box_mesh.glb", "No such file")


def test_a_picture_that_cannot_be_written_is_an_error(player: Player, scene: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    refused(player(scene, "--screenshot", tmp_path / "file" / "a.png"), 1, "cannot write")


def test_a_file_that_grows_too_large_is_an_error_with_its_mend_and_leaves_nothing(
    scene: Path, tmp_path: Path
) -> None:
    words = [str(ROOT / "build/bin/paradize-player"), str(scene), "--headless", "--screenshot", "a.png"]
    limited = f"ulimit -f 1; exec {shlex.join(words)}"  # 1 KB
    result = subprocess.run(
        ["bash", "-c", limited], cwd=tmp_path, env={**os.environ, **RENDER_ENVIRONMENT},
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    refused(result, 1, "cannot write: File too large; allow larger files (`ulimit -f`), or name")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("arguments", "code"), [(["--frob"], 2), (["--time", "x"], 2), ([], 1)])
def test_with_json_an_error_is_one_object_too(
    player: Player, tmp_path: Path, arguments: list[str], code: int
) -> None:
    result = player(tmp_path / 'no "scene"', "--json", *arguments)
    assert result.returncode == code
    (message,) = json.loads(result.stdout)["error"]
    assert f"paradize-player: {message}\n" in result.stderr


@pytest.mark.parametrize("arguments", [["--json"], ["--help"]])
def test_standard_output_that_is_full_is_an_error(scene: Path, arguments: list[str]) -> None:
    command = [str(ROOT / "build/bin/paradize-player"), str(scene), "--headless", *arguments]
    with Path("/dev/full").open("w") as full:
        pipes = {"stdout": full, "stderr": subprocess.PIPE, "text": True}
        result = subprocess.run(command, timeout=300, env={**os.environ, **RENDER_ENVIRONMENT}, **pipes)
    assert result.returncode == 1
    assert "standard output: cannot write" in result.stderr


def test_invalid_scene_paths_give_the_player_s_own_message(player: Player, tmp_path: Path) -> None:
    refused(player("a" * 5000), 1, "scene.json: File name too long")
    (tmp_path / "scene.json").mkdir()
    refused(player(tmp_path), 1, "scene.json: is a folder; move it away")
    (tmp_path / "scene.json").rmdir()
    (tmp_path / "scene.json").write_text('{"format" 1}')
    result = player(tmp_path)
    refused(result, 1, "is not valid JSON")
    assert "exception" not in result.stderr


def test_missing_shaders_are_reported(player: Player, scene: Path, tmp_path: Path) -> None:
    refused(player(scene, env={"PARADIZE_SHADERS": str(tmp_path / "no")}), 1, "PARADIZE_SHADERS")


def test_without_a_display_and_without_headless_the_message_says_what_to_add(scene: Path) -> None:
    environment = {k: v for k, v in os.environ.items() if k not in {"DISPLAY", "WAYLAND_DISPLAY"}}
    command = [str(ROOT / "build/bin/paradize-player"), str(scene)]
    result = subprocess.run(
        command, capture_output=True, text=True, timeout=300, env=environment | RENDER_ENVIRONMENT
    )
    refused(result, 1, "--headless")


def test_a_nan_in_the_picture_is_reported_with_its_pixel(player: Player, scene: Path, tmp_path: Path) -> None:
    shaders = tmp_path / "shaders"
    for source in sorted((ROOT / "shaders").rglob("*.*")):
        text = source.read_text()
        if source.name == "sky.frag":
            last = text.rindex("}")
            output = text.split("out vec4 ")[1].split(";")[0]
            nan = f"{output} = vec4(sqrt(-abs({output}.x) - 1.0));"
            text = f"{text[:last]}\nif (gl_FragCoord.y > 30.0) {{ {nan} }}\n}}\n"
        target = shaders / source.relative_to(ROOT / "shaders")
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text)
    options = ("--check-finite", "--size", "64x36", "--disable", "reflection")
    result = player(scene, *options, env={"PARADIZE_SHADERS": str(shaders)})
    refused(result, 1, "pixel (0, 5)", "nan")  # from the left and from above; of GL's rows it is the 31st


def test_bench_measures_the_given_number_of_frames(player: Player, scene: Path) -> None:
    result = player(scene, "--bench", "--frames", 7, "--size", "32x18", "--json")
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert report["frames"] == 7
    assert report["resident_bytes"] == report["total_bytes"] > 0
    assert 0 < report["bench"]["median_ms"] <= report["bench"]["p95_ms"]
    line = player(scene, "--bench", "--frames", 2, "--size", "32x18").stdout
    assert re.fullmatch(r"2 frames of 32 x 18: median [\d.]+ ms, 95th percentile [\d.]+ ms, .+\n", line)
    assert "bench" not in json.loads(player(scene, "--size", "32x18", "--json").stdout)
    refused(player(scene, "--bench", "--check-finite"), 2, "--bench only measures frames")

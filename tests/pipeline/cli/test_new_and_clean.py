"""`paradize new` and `paradize clean` as a user calls them."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from paradize.cli.main import main
from paradize.cli.values import age, size
from paradize.store.local import Store
from tests.conftest import RENDER_ENVIRONMENT
from tests.pipeline.scenes import make_cove, tone
from tests.pipeline.small_scenes import sky_and_sound
from tests.places import ROOT
from tests.sweeps import sweep


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Store:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("PARADIZE_REPORT", "")
    return Store(tmp_path / "store")


def test_a_new_scene_says_how_to_go_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", str(tmp_path / "mine")]) == 0
    assert f" bake {tmp_path}/mine/scene.toml" in capsys.readouterr().out
    assert main(["new", str(tmp_path / "mine")]) == 1
    assert "not empty" in capsys.readouterr().err
    assert main(["new", str(tmp_path / "other"), "--from", str(tmp_path / "none.obj"), "--json"]) == 1
    assert "none.obj" in json.loads(capsys.readouterr().out)["error"][0]


@pytest.mark.parametrize("on_path", sweep([True, False], test=[False]))
def test_the_commands_that_new_prints_bake_and_show_the_scene_as_they_stand(
    tmp_path: Path,
    on_path: bool,
    cove_store: Callable[[Path], Path],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """In any folder, whatever the scene's own is called, and where the programs are not on the path. A sky
    with a sound takes the place of the scene it wrote, which test_new.py bakes; the store has the sky."""
    programs = f"{ROOT}/build/venv/bin:{ROOT}/build/bin"
    environment = {**os.environ, **RENDER_ENVIRONMENT, "PARADIZE_STORE": str(cove_store(tmp_path / "store"))}
    environment["PATH"] = f"{programs if on_path else ''}:/usr/bin:/bin"
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        environment.pop(name, None)
    output = subprocess.run(
        [f"{ROOT}/build/venv/bin/paradize", "new", "my scenes/-it's mine"],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=True,
    ).stdout.splitlines()  # fmt: skip
    smaller = make_cove(tmp_path / "my scenes/-it's mine")
    text = smaller.read_text().replace('name = "cove"', 'name = "it_s_mine"')
    smaller.with_name("scene.toml").write_text(text[: text.index("[shadow]")] + text[text.index("[sound]") :])
    (smaller.parent / "sea.ogg").write_bytes(tone(220.0))
    lines = [line.partition(":")[2] for line in output[1:]]
    assert [shlex.split(line)[0] in ("paradize", "paradize-player") for line in lines] == [on_path] * 2
    for line in lines:
        ran = subprocess.run(
            ["sh", "-euc", line], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "it_s_mine.png").stat().st_size > 1000
    monkeypatch.chdir(tmp_path)
    capsys.readouterr()
    assert main(["explain", "my scenes/-it's mine/scene.toml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)


def test_a_folder_of_too_long_a_name_is_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", str(tmp_path / ("n" * 300))]) == 1
    output = capsys.readouterr().err
    assert "cannot be written: File name too long" in output and "internal error" not in output


def test_cleaning_tells_what_went_and_what_stays(
    tmp_path: Path, own_store: Store, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = sky_and_sound(make_cove(tmp_path / "mine"))
    assert main(["bake", str(scene), "-o", str(tmp_path / "out")]) == 0
    capsys.readouterr()
    assert main(["clean", "--older-than", "1d", "--json"]) == 0
    kept = json.loads(capsys.readouterr().out)
    assert kept["dropped"] == 0 and kept["kept_bytes"] > 0
    assert main(["clean", "--to-size", "0"]) == 0
    assert f"{kept['kept_bytes']} bytes freed, 0 bytes stay" in capsys.readouterr().out
    assert not any(path.is_file() for path in (own_store.root / "blobs").rglob("*"))
    assert main(["bake", str(scene), "-o", str(tmp_path / "out"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["failed"] == 0 and report["baked"] == len(report["artifacts"])


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("30d", 2_592_000.0), ("2", 172_800.0), ("1.5h", 5400.0), ("10m", 600.0), ("0s", 0.0)],
)
def test_ages_have_units(text: str, seconds: float) -> None:
    assert age(text) == seconds


@pytest.mark.parametrize(
    ("text", "count"), [("12", 12), ("2G", 2_000_000_000), ("1Ki", 1024), ("1.5M", 1_500_000), ("7B", 7)]
)
def test_sizes_have_units(text: str, count: int) -> None:
    assert size(text) == count


@pytest.mark.parametrize(
    "word",
    [
        "--older-than=3x",
        "--older-than=-1d",
        "--older-than=inf",
        "--to-size=nan",
        "--to-size=G",
        "--to-size=1Mim",
        "--older-than=1_0d",
        "--to-size=1_0G",
    ],
)
def test_other_words_are_wrong_usage(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["clean", word]) == 2
    assert word.partition("=")[2] in capsys.readouterr().err

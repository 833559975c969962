"""Sounds and music of a scene: what a TOML may say, and what is baked of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import soundfile

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.checks import check_paths
from paradize.scene.json_schema import scene_schema
from paradize.scene.settings import sound_files
from tests.pipeline.scene.test_settings import LEAST, faults, load

SHORE = """
[[sound]]
name = "shore"
file = "waves.ogg"
line = [[0, 0, 0], [5, 0, 5], [9, 0, 5]]
radius_m = 3.0
falloff = 0.5
[[sound]]
name = "pier"
file = "waves.ogg"
volume = 0.25
position = [4, 1, 2]
on_s = 200.0
off_s = 20.0
fade_s = 5.0
[[sound]]
name = "insects"
file = "insects.ogg"
on_s = 165.0
off_s = 238.0
[music]
files = ["a.ogg", "b.ogg"]
volume = 0.3
"""


def write_loop(path: Path, channels: int = 1, hertz: float = 220.0, size: float = 0.2) -> None:
    tone = size * np.sin(2.0 * np.pi * hertz * np.arange(8000) / 8000.0)
    samples = np.stack([tone] * channels, 1).astype(np.float32)
    soundfile.write(path, samples, 8000, format="OGG", subtype="VORBIS")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for k, name in enumerate(("waves", "insects", "a", "b")):
        write_loop(tmp_path / f"{name}.ogg", channels=2 if name in ("a", "b") else 1, hertz=200.0 + 20.0 * k)
    return tmp_path


def test_one_table_is_a_sound_and_many_are_many(folder: Path) -> None:
    (one,) = load(folder, LEAST + '[sound]\nfile = "waves.ogg"\nvolume = 0.8\n').sounds
    assert one.name is None and one.volume == 0.8 and one.places == () and one.artifact == "sound"
    scene = load(folder, LEAST + SHORE)
    assert [one.artifact for one in scene.sounds] == ["shore_sound", "pier_sound", "insects_sound"]
    assert [len(one.places) for one in scene.sounds] == [3, 1, 0]
    assert scene.music and scene.music.playing == 0
    schema = scene_schema()["properties"]["sound"]
    assert [one["type"] for one in schema["anyOf"]] == ["array", "object"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('name = "pier"', 'name = "shore"', "sound[1].name: 'shore' is already sound[0]"),
        ('name = "pier"\n', "", ""),
        ("position = [4, 1, 2]", "position = [4, 1, 2]\nline = [[0, 0, 0], [1, 1, 1]]", "line: stands"),
        ("on_s = 200.0\n", "", "sound[1].off_s: stands without on_s"),
        ("off_s = 238.0", "off_s = 241.0", "sound[2].off_s: is 241"),
        ("off_s = 238.0", "off_s = 165.0", "sound[2].off_s: is 165, as on_s"),
        ("[5, 0, 5]", "[5, 0]", "sound[0].line[1]: is [5, 0]"),
        ("line = [[0, 0, 0], [5, 0, 5], [9, 0, 5]]", "line = [[0, 0, 0]]", "sound[0].line: has 1 points"),
        ("radius_m = 3.0", "radius_m = 0.0", "sound[0].radius_m: is 0.0, out of range"),
        ('["a.ogg", "b.ogg"]', "[]", "music.files: is []"),
        ("volume = 0.3", "volume = 0.3\nplaying = 3", "music.playing: is 3"),
        ('file = "insects.ogg"', 'file = "gone.ogg"', "sound[2].file: there is no file"),
    ],
)  # fmt: skip
def test_a_fault_is_told_with_its_place(folder: Path, old: str, new: str, told: str) -> None:
    text = LEAST + SHORE.replace(old, new, 1)
    if not told:  # one sound may be without a name
        assert load(folder, text).sounds[1].artifact == "sound"
        return
    (found,) = faults(folder, text)
    assert told in found


@pytest.mark.parametrize(("on_s", "off_s", "first_s"), [(165.0, 238.0, 165.0), (200.0, 20.0, 0.0)])
def test_a_sound_is_needed_from_its_first_second_on(
    folder: Path, on_s: float, off_s: float, first_s: float
) -> None:
    """Hours that go on past the end of the flight begin at its start."""
    text = SHORE.replace("on_s = 165.0\noff_s = 238.0", f"on_s = {on_s}\noff_s = {off_s}")
    scene = load(folder, LEAST + text)
    assert sound_files(scene.sounds, scene.music)[folder / "insects.ogg"].first_s == first_s


def test_several_sounds_without_a_name_are_refused(folder: Path) -> None:
    text = LEAST + '[[sound]]\nfile = "waves.ogg"\n[[sound]]\nfile = "insects.ogg"\n'
    (told,) = faults(folder, text)
    assert "sound[1].name: is missing" in told and "a name of its own" in told


def test_sounds_are_baked_once_for_each_file_and_a_placed_one_with_two_channels_is_warned_about(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(folder / "store"))
    for name in ("waves", "insects"):  # insects have no place
        write_loop(folder / f"{name}.ogg", channels=2)
    (folder / "scene.toml").write_text(LEAST + SHORE)
    report = bake(folder / "scene.toml", folder / "out", BuildOptions(jobs=1))
    assert not report.errors
    (warning,) = report.warnings
    assert "waves.ogg" in warning and "mono" in warning
    manifest = json.loads((folder / "out/scene.json").read_text())
    artifacts = manifest["artifacts"]
    assert artifacts.keys() == {"shore_sound", "insects_sound", "music_1", "music_2"}
    shore, pier, insects = manifest["sounds"]
    assert shore["artifact"] == pier["artifact"] == "shore_sound"
    assert shore["places"] == [[0, 0, 0], [5, 0, 5], [9, 0, 5]] and pier["places"] == [[4, 1, 2]]
    assert pier["hours"] == {"on_s": 200.0, "off_s": 20.0, "fade_s": 5.0} and shore["hours"] is None
    assert insects["places"] == []
    assert manifest["music"] == {"artifacts": ["music_1", "music_2"], "volume": 0.3, "playing": 0}
    # what is heard late is needed late; where the hours go on past the end of the flight, at once
    assert artifacts["insects_sound"]["first_needed_s"] == 165.0
    assert artifacts["shore_sound"]["first_needed_s"] == 0.0
    assert [one.code for one in check_paths([folder / "out"])] == ["PZ503"]

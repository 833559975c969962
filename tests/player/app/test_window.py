"""The player in a window on a virtual display (Xvfb): picture, keys, mouse."""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import soundfile

from tests.conftest import RENDER_ENVIRONMENT, ROOT
from tests.pictures import load
from tests.player.app.test_sound import tone
from tests.player.boxes import row_of_boxes
from tests.player.synthetic import identity, sound, texture, write_scene
from tests.processes import started
from tests.sweeps import sweep

Player = Callable[..., "subprocess.CompletedProcess[str]"]
PLAYER = ROOT / "build/bin/paradize-player"
PRESS = ROOT / "tests/player/press.py"

pytestmark = pytest.mark.skipif(
    shutil.which("xvfb-run") is None, reason="no xvfb-run: `make setup-test` brings it"
)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A box on an empty background, so that only the camera changes the picture."""
    return write_scene(tmp_path_factory.mktemp("window") / "bare", bare=True)


def on_a_display(*command: object, **more: str) -> subprocess.CompletedProcess[str]:
    """more: variables of the environment. A window draws as often as it can: one thread is enough."""
    environment = {k: v for k, v in os.environ.items() if k not in {"DISPLAY", "WAYLAND_DISPLAY"}}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    environment |= RENDER_ENVIRONMENT | {"LP_NUM_THREADS": "0"} | more
    words = ["xvfb-run", "-a", *command]
    with started(words, env=environment, **pipes) as process:
        out, errors = process.communicate(timeout=300)
    return subprocess.CompletedProcess(words, process.returncode, out, errors)


def test_a_window_s_picture_is_the_headless_one(player: Player, bare: Path, tmp_path: Path) -> None:
    arguments = [bare, "--time", 2, "--frames", 2, "--wait-resident", "--json", "--debug", "--screenshot"]
    result = on_a_display(PLAYER, "--panel", *arguments, tmp_path / "window.png")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["frames"] == 2
    assert player(*arguments, tmp_path / "headless.png").returncode == 0
    for name in ("_0000.png", "_0001.png"):
        assert (tmp_path / f"window{name}").read_bytes() == (tmp_path / f"headless{name}").read_bytes()


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> subprocess.CompletedProcess[str]:
    """Playback of a scene whose sound is invalid, until a key is pressed."""
    scene = write_scene(tmp_path_factory.mktemp("played") / "scene", bare=True)
    manifest = json.loads((scene / "scene.json").read_text())
    noise = b"OggS, or so it says"
    manifest["artifacts"]["ocean"] = {"file": "ocean.ogg", "kind": "sound", **identity(noise)}
    manifest["sounds"] = [sound("ocean")]
    (scene / "scene.json").write_text(json.dumps(manifest))
    (scene / "ocean.ogg").write_bytes(noise)
    return on_a_display(sys.executable, PRESS, "Left", "end", "--", PLAYER, scene, "--json")


def test_any_key_ends_playback(played: subprocess.CompletedProcess[str]) -> None:
    assert played.returncode == 0, played.stderr
    assert json.loads(played.stdout)["frames"] > 0


def test_an_invalid_sound_does_not_stop_playback(played: subprocess.CompletedProcess[str]) -> None:
    assert played.returncode == 0, played.stderr
    assert "no sound" in played.stderr


@pytest.mark.parametrize(("count", "edge"), sweep([(250, 128), (1, 2048)], test=[(250, 128)]))
def test_frames_in_a_window_keep_to_the_bytes_and_milliseconds_of_uploads(
    player: Player, tmp_path: Path, count: int, edge: int
) -> None:
    """22 MB are needed at once: small maps, whose textures take time, or one large map of many bytes.
    Without a window only bytes count."""
    maps = (texture("RGBA8_SRGB", np.full((edge, edge, 4), i, np.uint8)) for i in range(count))
    scene = row_of_boxes(tmp_path / "scene", maps, spacing_m=0.0, seconds=6.0)
    manifest = json.loads((scene / "scene.json").read_text())
    manifest["flight"]["fov_rad"] = 0.005  # so near that the finest mip is needed
    (scene / "scene.json").write_text(json.dumps(manifest))
    # With post: without it 200 frames may be over before a busy disk has given 22 MB.
    options = ("--size", "64x36", "--disable", "objects,shadow", "--mute", "--json", "--frames")
    # The first touch of a large page, which other tests' players take, is milliseconds of a frame.
    window = on_a_display(PLAYER, scene, *options, 200, GLIBC_TUNABLES="")
    for result in (window, player(scene, *options, 8)):
        assert result.returncode == 0, result.stderr
        frames = json.loads(result.stdout)["streaming"]["frames"]
        totals = [0, *(total for *_, total in frames)]
        sizes = [b - a for a, b in pairwise(totals)]
        first, *later = [(size, ms) for size, (_, _, ms, _) in zip(sizes, frames, strict=True) if size > 0]
        assert first[0] <= 16 << 20
        assert totals[-1] > 20e6 and max(size for size, _ in later) <= 4 << 20
        if result is window:
            assert first[1] < 50.0 + 20.0  # the last piece may begin just before the end
            assert statistics.median(ms for _, ms in later) < 2.0 + 2.0
        else:
            assert first[0] > 4 << 20


@pytest.mark.deep
def test_n_starts_the_music_and_m_mutes_it(tmp_path: Path) -> None:
    """OpenAL Soft writes what its device plays into a file."""
    scene = write_scene(tmp_path / "scene", bare=True)
    manifest = json.loads((scene / "scene.json").read_text())
    piece = tone(400.0, 2)
    manifest["artifacts"]["piece"] = {"file": "piece.wav", "kind": "sound", **identity(piece)}
    manifest["music"] = {"artifacts": ["piece"], "volume": 1.0, "playing": 0}
    (scene / "scene.json").write_text(json.dumps(manifest))
    (scene / "piece.wav").write_bytes(piece)
    (tmp_path / "alsoft.conf").write_text(f"drivers = wave\n[wave]\nfile = {tmp_path / 'heard.wav'}\n")
    steps = ["still", "n", "still", "still", "m", "still", "Escape", "end"]
    command = (sys.executable, PRESS, *steps, "--", PLAYER, scene, "--interactive")
    result = on_a_display(*command, ALSOFT_DRIVERS="wave", ALSOFT_CONF=str(tmp_path / "alsoft.conf"))
    assert result.returncode == 0, result.stderr
    samples, rate = soundfile.read(tmp_path / "heard.wav", always_2d=True)
    size = np.abs(samples).max(axis=1)
    heard = np.flatnonzero(size > 0.2)  # of 0.25
    assert len(heard) and (size[: rate // 2] == 0.0).all()
    begins, ends = heard[0], heard[-1]
    assert ends - begins > 0.5 * rate and (size[ends + rate // 10 : ends + rate // 2] == 0.0).all()


@pytest.mark.deep
def test_in_interactive_mode_keys_and_mouse_move_the_camera_and_only_escape_ends(bare: Path) -> None:
    steps = [
        "still",
        "hold:w",
        "moved",
        "mouse",
        "moved",
        "hold:z",
        "moved",
        "hold:space",
        "still",
        "Escape",
        "end",
    ]
    result = on_a_display(sys.executable, PRESS, *steps, "--", PLAYER, bare, "--interactive", "--mute")
    assert result.returncode == 0, result.stderr


@pytest.fixture(scope="module")
def session(bare: Path) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """A window is resized and minimised. Returns the file of the resized window's picture, and the result: 0
    if each step did as the tests below say."""
    saved = bare.parent / "window.bgrx"
    steps = ["size:416x272", "still", f"save:{saved}", "minimise", "idle", "Escape", "end"]
    command = [PLAYER, bare, "--interactive", "--mute", "--size", "320x180", "--debug"]
    return saved, on_a_display(sys.executable, PRESS, *steps, "--", *command)


def test_a_window_that_is_resized_shows_what_a_picture_of_its_size_does(
    player: Player, bare: Path, session: tuple[Path, subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    saved, result = session
    assert result.returncode == 0, result.stderr
    shown = np.frombuffer(saved.read_bytes(), np.uint8).reshape(272, 416, 4)
    assert player(bare, "--size", "416x272", "--screenshot", tmp_path / "a.png").returncode == 0
    assert np.array_equal(shown[:, :, 2::-1], np.rint(255.0 * load(tmp_path / "a.png")))


def test_a_minimised_window_draws_nothing_and_still_takes_keys(
    session: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    _, result = session
    assert result.returncode == 0, result.stderr


@pytest.mark.deep
def test_a_key_that_is_down_when_the_window_loses_the_keyboard_is_let_go_and_a_restored_one_draws(
    bare: Path,
) -> None:
    let_go = ["unfocus", "moved", "still"]
    restored = ["minimise", "idle", "restore", "still", "minimise", "idle", "Escape", "end"]
    command = [PLAYER, bare, "--interactive", "--mute", "--size", "320x180", "--debug"]
    result = on_a_display(sys.executable, PRESS, "still", *let_go, *restored, "--", *command)
    assert result.returncode == 0, result.stderr


@pytest.mark.deep
@pytest.mark.parametrize("shift", ["Shift_R", "Shift_L"])
def test_either_shift_makes_the_camera_fast(bare: Path, tmp_path: Path, shift: str) -> None:
    """12 m after 2.4 m, each in the time that the key is down; the box is 9.5 m away."""
    slow, fast = tmp_path / "slow.bgrx", tmp_path / "fast.bgrx"
    steps = ["still", "hold:w", "still", f"save:{slow}", shift, "hold:w", "still", f"save:{fast}"]
    command = [PLAYER, bare, "--interactive", "--mute"]
    result = on_a_display(sys.executable, PRESS, *steps, "Escape", "end", "--", *command)
    assert result.returncode == 0, result.stderr
    shown = [np.frombuffer(file.read_bytes(), np.uint8).reshape(-1, 4) for file in (slow, fast)]
    assert [bool((picture == picture[0]).all()) for picture in shown] == [False, True]

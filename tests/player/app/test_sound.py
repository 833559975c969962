"""The sound of a flight: the WAV file of `--audio`."""

from __future__ import annotations

import io
import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import soundfile

from tests.player.synthetic import EYE, identity, sound, write_scene

Player = Callable[..., "subprocess.CompletedProcess[str]"]
Stereo = npt.NDArray[np.float64]  # (frames, 2), full scale 1
RATE_HZ = 44100
LOOP_S = 0.5
SIZE = 0.25
RIGHT, LEFT = [90.0, 0.0, EYE[2]], [-90.0, 0.0, EYE[2]]  # of the eye, which looks north


def tone(hertz: float, channels: int = 1) -> bytes:
    """A loop of a sine with a whole number of periods, as a WAV file."""
    wave = SIZE * np.sin(2.0 * np.pi * hertz * np.arange(round(LOOP_S * RATE_HZ)) / RATE_HZ)
    held = io.BytesIO()
    soundfile.write(held, np.stack([wave] * channels, 1), RATE_HZ, format="WAV", subtype="PCM_16")
    return held.getvalue()


class Flight:
    """A scene whose eye flies from x = -2 to 2 in five seconds and back; tones of 400, 500 ... Hz."""

    def __init__(self, folder: Path, player: Player) -> None:
        self.folder, self.player = write_scene(folder / "scene", bare=True), player
        self.file = folder / "heard.wav"

    def heard(
        self, *sounds: dict[str, Any], music: dict[str, Any] | None = None, options: tuple[object, ...] = ()
    ) -> Stereo:
        """The sound that the player writes. The k-th tone has 400 + 100 k Hz; 2 in its name: two channels."""
        manifest = json.loads((self.folder / "scene.json").read_text())
        names = [one["artifact"] for one in sounds] + (music["artifacts"] if music else [])
        for k, name in enumerate(dict.fromkeys(names)):
            data = tone(400.0 + 100.0 * k, 2 if "2" in name else 1)
            (self.folder / f"{name}.wav").write_bytes(data)
            manifest["artifacts"][name] = {"file": f"{name}.wav", "kind": "sound", **identity(data)}
        manifest |= {"sounds": list(sounds), "music": music}
        (self.folder / "scene.json").write_text(json.dumps(manifest))
        result = self.player(self.folder, "--audio", self.file, *options)
        assert result.returncode == 0, result.stderr
        assert not result.stderr, result.stderr
        samples, rate = soundfile.read(self.file, dtype="float64", always_2d=True)
        assert rate == RATE_HZ and samples.shape[1] == 2
        return samples


@pytest.fixture
def flight(tmp_path: Path, player: Player) -> Flight:
    return Flight(tmp_path, player)


def level(samples: Stereo, hertz: float, second: float) -> npt.NDArray[np.float64]:
    """(left, right): the amplitude of a tone in the half second after `second`."""
    part = samples[round(second * RATE_HZ) : round((second + LOOP_S) * RATE_HZ)]
    turn = np.exp(-2j * np.pi * hertz * np.arange(len(part)) / RATE_HZ)
    return 2.0 * np.abs(turn @ part) / len(part)


def loud(samples: Stereo, second: float, hertz: float = 400.0) -> float:
    """The level of both ears together, dB."""
    return float(10.0 * np.log10((level(samples, hertz, second) ** 2).sum()))


def test_the_whole_flight_is_written_as_it_was_recorded_and_loops_without_a_click(flight: Flight) -> None:
    samples = flight.heard(sound("a"))
    assert len(samples) == 10 * RATE_HZ
    wave = SIZE * np.sin(2.0 * np.pi * 400.0 * np.arange(len(samples)) / RATE_HZ)
    assert np.abs(samples - wave[:, None])[RATE_HZ // 10 :].max() < 0.002
    steps = np.abs(np.diff(samples[RATE_HZ // 10 :], axis=0)).max()
    assert steps < 1.01 * SIZE * 2.0 * np.pi * 400.0 / RATE_HZ


def test_the_same_flight_has_the_same_bytes(flight: Flight) -> None:
    sounds = [sound("a", places=[RIGHT]), sound("b", places=[LEFT, [0.0, 0.0, -9.0]], falloff=0.5)]
    flight.heard(*sounds, options=("--frames", 60))
    first = flight.file.read_bytes()
    flight.heard(*sounds, options=("--frames", 60))
    assert flight.file.read_bytes() == first


def look(flight: Flight, eye: list[list[float]], target: list[list[float]]) -> None:
    """Gives both halves of the flight the same cubics."""
    manifest = json.loads((flight.folder / "scene.json").read_text())
    for segment in manifest["flight"]["segments"]:
        segment |= {"eye": eye, "target": target}
    (flight.folder / "scene.json").write_text(json.dumps(manifest))


def test_a_sound_is_louder_when_near_and_on_the_side_where_it_is(flight: Flight) -> None:
    still = [0.0, 0.0, 0.0, 0.0]
    look(flight, [[-8.0, 16.0, 0.0, 0.0], still, still], [[-8.0, 16.0, 0.0, 0.0], still, [-5.0, 0, 0, 0]])
    samples = flight.heard(sound("a", places=[[10.0, 0.0, 0.0]]), sound("b", places=[[-10.0, 0.0, 0.0]]))
    for hertz, side, near_s, far_s in ((400.0, 1, 4.4, 0.0), (500.0, 0, 0.05, 4.3)):  # halves of seconds
        for second in (near_s, far_s):
            ears = level(samples, hertz, second)
            assert 4.0 < ears[side] / ears[1 - side] < 12.0
        # from 16.9 m away to 3.0 m
        assert loud(samples, near_s, hertz) - loud(samples, far_s, hertz) == pytest.approx(15.1, abs=0.7)


def test_the_balance_turns_with_the_camera(flight: Flight) -> None:
    still = [0.0, 0.0, 0.0, 0.0]
    # in five seconds the camera turns from north over east to south
    look(flight, [still, still, still], [[0.0, 4.0, -4.0, 0.0], still, [-1.0, 2.0, 0.0, 0.0]])
    samples = flight.heard(sound("a", places=[[30.0, 0.0, 0.0]], falloff=0.0))
    right_first, ahead, left_last = (level(samples, 400.0, second) for second in (0.0, 2.25, 4.4))
    assert right_first[1] > 4.0 * right_first[0]
    assert ahead[0] == pytest.approx(ahead[1], rel=0.1)
    assert left_last[0] > 4.0 * left_last[1]
    sides = [float(np.subtract(*level(samples, 400.0, 0.25 * k))) for k in range(18)]
    assert np.abs(np.diff(sides)).max() < 0.4 * SIZE  # it does not jump
    steps = np.abs(np.diff(samples[RATE_HZ // 10 :], axis=0)).max()
    assert steps < 1.1 * SIZE * 2.0 * np.pi * 400.0 / RATE_HZ  # and does not click


def test_a_line_is_heard_from_all_of_it(flight: Flight) -> None:
    still = [0.0, 0.0, 0.0, 0.0]
    look(flight, [still, still, still], [still, still, [-1.0, 0.0, 0.0, 0.0]])
    ahead = [[-500.0, 0.0, -8.0], [500.0, 0.0, -8.0]]
    samples = flight.heard(sound("a", places=ahead, falloff=0.5), options=("--frames", 30))
    left, right = level(samples, 400.0, 0.3)
    assert left == pytest.approx(right, rel=0.02)
    assert 20.0 * np.log10(left / SIZE) == pytest.approx(-10.0 * np.log10(8.0), abs=4.0)
    along = [[8.0, 0.0, -500.0], [8.0, 0.0, 500.0]]  # spread: less to one side than a point
    samples = flight.heard(sound("a", places=along, falloff=0.5), options=("--frames", 30))
    left, right = level(samples, 400.0, 0.3)
    assert 1.5 < right / left < 4.5


def test_a_sound_is_heard_in_its_hours_and_fades(flight: Flight) -> None:
    hours = {"on_s": 8.0, "off_s": 3.0, "fade_s": 1.0}
    samples = flight.heard(sound("a", hours=hours))
    assert np.abs(samples[round(3.05 * RATE_HZ) : 8 * RATE_HZ]).max() == 0.0
    size = np.abs(samples).max(axis=1).reshape(-1, RATE_HZ // 10).max(axis=1)  # of tenths of a second
    assert size[1:20].min() > 0.9 * SIZE and size[91:].min() > 0.9 * SIZE
    assert (np.diff(size[20:31]) < 0.0).all() and (np.diff(size[80:90]) > 0.0).all()


def test_two_channels_keep_their_sides_everywhere_and_are_one_at_a_place(flight: Flight) -> None:
    samples = flight.heard(sound("a2", places=[RIGHT], falloff=0.0), options=("--frames", 30))
    left, right = level(samples, 400.0, 0.3)
    assert right > 4.0 * left
    samples = flight.heard(sound("a2"), options=("--frames", 30))
    assert level(samples, 400.0, 0.3) == pytest.approx([SIZE, SIZE], rel=0.01)


def test_music_plays_where_the_scene_says_so_and_from_its_place_in_the_loop(flight: Flight) -> None:
    music = {"artifacts": ["a2", "b2"], "volume": 0.5, "playing": 0}
    assert np.abs(flight.heard(music=music, options=("--frames", 15))).max() == 0.0
    samples = flight.heard(music=music | {"playing": 2}, options=("--frames", 30, "--time", 3.125))
    assert level(samples, 500.0, 0.3) == pytest.approx([0.5 * SIZE] * 2, rel=0.01)
    assert level(samples, 400.0, 0.3).max() < 0.001
    phase = np.sin(2.0 * np.pi * 500.0 * (3.125 + np.arange(len(samples)) / RATE_HZ))
    assert np.abs(samples[:, 0] - 0.5 * SIZE * phase)[RATE_HZ // 10 :].max() < 0.01


def test_sounds_that_are_too_loud_together_are_cut_off_and_told(tmp_path: Path, player: Player) -> None:
    flight = Flight(tmp_path, player)
    with pytest.raises(AssertionError, match=r"heard\.wav: \d+ samples were cut off at full scale"):
        flight.heard(*[sound("a")] * 5, options=("--frames", 30))
    samples, _ = soundfile.read(flight.file)
    assert np.abs(samples).max() <= 1.0


def test_pictures_and_sound_of_the_same_frames(flight: Flight, tmp_path: Path) -> None:
    samples = flight.heard(
        sound("a"), options=("--frames", 3, "--screenshot", tmp_path / "a.png", "--headless")
    )
    assert len(samples) == 3 * RATE_HZ // 30
    assert len(list(tmp_path.glob("a_*.png"))) == 3


def test_a_sound_that_cannot_be_played_leaves_no_file(flight: Flight) -> None:
    flight.heard(sound("a"), options=("--frames", 1))
    flight.file.unlink()
    (flight.folder / "a.wav").write_bytes(b"RIFF, or so it says")
    result = flight.player(flight.folder, "--audio", flight.file)
    assert result.returncode == 1 and "a.wav" in result.stderr
    assert not flight.file.exists()

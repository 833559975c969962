"""The island's sounds: made again by their scripts, no click where they loop, each with its own spectrum."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import soundfile

from paradize.checks.loudness import loudness_lufs
from paradize.scene.settings import load_scene
from tests.pipeline.raw_assets.test_pictures import RAW, script
from tests.sweeps import sample

Samples = npt.NDArray[np.float64]
# by file: seconds, channels, the least and largest middle of its spectrum's power, Hz
FILES = {
    "sound/surf_a": (20.0, 1, 150.0, 1000.0),
    "sound/surf_b": (16.0, 1, 150.0, 1000.0),
    "sound/fronds": (15.0, 1, 900.0, 6000.0),
    "sound/crickets": (12.0, 1, 3500.0, 6000.0),
    "sound/hum": (4.0, 1, 90.0, 400.0),
    "music/strings": (32.0, 2, 120.0, 700.0),
    "music/stars": (32.0, 2, 100.0, 700.0),
}
LIMIT_BYTES = 1_500_000


@cache
def kept(name: str) -> tuple[Samples, int]:
    samples, rate = soundfile.read(RAW / f"{name}.ogg", dtype="float64", always_2d=True)
    return samples, rate


def test_all_sounds_together_stay_below_1_5_megabytes() -> None:
    assert 0 < sum(path.stat().st_size for path in RAW.rglob("*.ogg")) <= LIMIT_BYTES


@pytest.mark.parametrize("name", sample(FILES, every=4))
def test_a_loop_has_its_length_level_and_spectrum_and_no_click(name: str) -> None:
    seconds, channels, low_hz, high_hz = FILES[name]
    samples, rate = kept(name)
    assert samples.shape == (seconds * rate, channels)
    assert 0.2 < np.abs(samples).max() < 0.9
    assert -32.0 < loudness_lufs(samples, rate) < -14.0
    power = (np.abs(np.fft.rfft(samples, axis=0)) ** 2).sum(axis=1)
    middle_hz = np.fft.rfftfreq(len(samples), 1.0 / rate)[np.searchsorted(power.cumsum(), 0.5 * power.sum())]
    assert low_hz < middle_hz < high_hz
    around = np.roll(samples, len(samples) // 2, axis=0)  # the seam is now in the middle
    seam = len(samples) // 2
    for order in (1, 2, 3):  # a click stands out in the differences, the higher the sharper
        step = np.abs(np.diff(around, order, axis=0)).max(axis=1)
        near = np.r_[step[seam - rate // 4 : seam - 32], step[seam + 32 : seam + rate // 4]]
        assert step[seam - 8 : seam + 8].max() <= 1.1 * near.max()


def test_music_is_in_tune_and_in_its_key() -> None:
    """Most of the power lies within 15 cents of the notes of D major, and of A minor."""
    for name, notes in (("music/strings", "D E F# G A B C#"), ("music/stars", "A B C D E F G")):
        samples, rate = kept(name)
        power = (np.abs(np.fft.rfft(samples.mean(axis=1))) ** 2)[1:]
        hertz = np.fft.rfftfreq(len(samples), 1.0 / rate)[1:]
        heard = (hertz > 100.0) & (hertz < 1200.0)
        cents = 1200.0 * np.log2(hertz[heard] / 440.0)
        steps = [script("music").NOTES[note[0]] + note.count("#") - 9 for note in notes.split()]
        away = np.min([np.abs((cents - 100.0 * step + 600.0) % 1200.0 - 600.0) for step in steps], axis=0)
        assert power[heard][away < 15.0].sum() > 0.85 * power[heard].sum(), name


@pytest.mark.deep
@pytest.mark.parametrize("maker", ["nearby", "music"])
def test_scripts_make_the_same_sounds_again(maker: str, tmp_path: Path) -> None:
    script(maker).make(tmp_path)
    made = sorted(tmp_path.rglob("*.ogg"))
    assert len(made) == {"nearby": 5, "music": 2}[maker]
    for path in made:
        samples, _ = soundfile.read(path, dtype="float64", always_2d=True)
        wanted, _ = kept(path.relative_to(tmp_path).with_suffix("").as_posix())
        assert np.abs(samples - wanted).max() <= 1.0 / 32768.0, path


def test_the_island_hears_the_shore_along_its_waterline() -> None:
    """Every point of a line of surf lies where the ground meets the sea."""
    import OpenImageIO as oiio

    scene = load_scene(RAW / "island.toml")
    assert scene.terrain
    picture = oiio.ImageInput.open(str(scene.terrain.heightmap)).read_image("uint16")[:, :, 0]
    heights = picture / 65535.0 * scene.terrain.height_m + scene.terrain.base_m
    surf = [one for one in scene.sounds if one.file.stem.startswith("surf")]
    assert surf
    side: Any = heights.shape[0] - 1
    for x, y, z in (place for one in surf for place in one.places):
        row, column = (side * (value / scene.terrain.size_m[0] + 0.5) for value in (z, x))
        assert abs(heights[round(row), round(column)]) < 0.5 and math.isclose(y, 0.0)


def test_the_island_hears_wind_where_palms_stand_and_crickets_and_lamps_by_night() -> None:
    scene = load_scene(RAW / "island.toml")
    sounds = {one.name: one for one in scene.sounds}
    assert set(sounds) == {"sea", "coast", "lagoon", "palm_wind", "grove_wind", "crickets", "lamp_hum"}
    assert scene.music and len(scene.music.files) == 2

    def away_m(sound: str, objects: tuple[str, ...]) -> float:
        """From the farthest of the sound's places to the nearest of these objects, on the ground."""
        items = [item for item in scene.objects if item.name in objects]
        stand = [instance.position for item in items for instance in item.instances]
        return max(min(math.dist(place[::2], at[::2]) for at in stand) for place in sounds[sound].places)

    assert away_m("palm_wind", ("palm",)) < 4.0  # its crown leans out
    assert away_m("grove_wind", ("tall", "leaning", "young")) < 4.0
    assert away_m("lamp_hum", ("lamp",)) < 2.0
    sunset_s = next(one.at_s for one in scene.daytime if one.sun.elevation_deg < 0.0)
    for name in ("crickets", "lamp_hum"):
        assert sunset_s - 5.0 < sounds[name].on_s < sounds[name].off_s < scene.flight.duration_s

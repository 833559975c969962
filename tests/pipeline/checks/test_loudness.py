"""Loudness: the values that BS.1770 and EBU Tech 3341 publish."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from paradize.checks.loudness import loudness_lufs
from tests.sweeps import sample, sweep


def tone(
    hertz: float, *parts: tuple[float, float], rate: int = 48000, channels: int = 2
) -> npt.NDArray[np.float64]:
    """A sine in all channels; parts: (dB below full scale, seconds)."""
    size = np.concatenate([np.full(round(s * rate), 10.0 ** (level / 20.0)) for level, s in parts])
    wave = size * np.sin(2.0 * np.pi * hertz * np.arange(len(size)) / rate)
    return np.stack([wave] * channels, 1)


def test_a_tone_of_997_hz_at_full_scale_in_one_channel_has_minus_3_01() -> None:
    """ITU-R BS.1770-4, annex 1."""
    assert loudness_lufs(tone(997.0, (0.0, 5.0), channels=1), 48000) == pytest.approx(-3.01, abs=0.01)


@pytest.mark.parametrize("rate", sweep([48000, 22050, 44100, 32000, 96000], test=[22050]))
@pytest.mark.parametrize(
    ("parts", "lufs"),
    sample(
        [
            (((-23.0, 8.0),), -23.0),
            (((-33.0, 8.0),), -33.0),
            (((-36.0, 3.0), (-23.0, 18.0), (-36.0, 3.0)), -23.0),
            (((-72.0, 2.0), (-36.0, 3.0), (-23.0, 18.0), (-36.0, 3.0), (-72.0, 2.0)), -23.0),
        ],
        every=3,
    ),
)
def test_the_signals_of_ebu_tech_3341(parts: tuple[tuple[float, float], ...], lufs: float, rate: int) -> None:
    """EBU Tech 3341, "Loudness Metering: 'EBU mode'", 2016, table 1: signals 1 to 4, within 0.1 LU."""
    assert loudness_lufs(tone(1000.0, *parts, rate=rate), rate) == pytest.approx(lufs, abs=0.1)


def test_high_tones_count_more_and_deep_ones_less() -> None:
    """The shelf of BS.1770 lifts by 4 dB; its high pass takes what is hardly heard."""
    middle = loudness_lufs(tone(500.0, (-20.0, 2.0)), 48000)
    assert loudness_lufs(tone(10000.0, (-20.0, 2.0)), 48000) - middle == pytest.approx(4.0, abs=0.3)
    assert loudness_lufs(tone(20.0, (-20.0, 2.0)), 48000) - middle < -10.0


def test_silence_has_no_loudness() -> None:
    assert loudness_lufs(np.zeros((48000, 1)), 48000) == float("-inf")
    assert loudness_lufs(np.zeros((10, 1)), 48000) == float("-inf")

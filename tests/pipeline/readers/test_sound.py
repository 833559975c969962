"""Sounds are decoded as a whole before they are accepted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

from paradize.errors import SourceError
from paradize.readers.sound import read_sound


@pytest.mark.parametrize("heard", [2000, 0])
def test_a_sound_with_a_long_silent_end_is_read_and_only_silence_is_refused(
    tmp_path: Path, heard: int
) -> None:
    """It is decoded in blocks of 65,536 frames, of which the last is silent."""
    samples = np.zeros(heard + 70_000, np.float32)
    samples[:heard] = np.random.default_rng(1).uniform(-0.5, 0.5, heard)
    path = tmp_path / "wave.ogg"
    soundfile.write(path, samples, 8000, format="OGG", subtype="VORBIS")
    if heard:
        assert read_sound(path).frames == len(samples)
    else:
        with pytest.raises(SourceError, match="silent throughout"):
            read_sound(path)


@pytest.mark.parametrize(
    ("frames", "rate", "subtype", "says"),
    [
        (9000, 48_000, "OPUS", "is Ogg Opus, not Ogg Vorbis; save it as Ogg Vorbis"),
        (9000, 7000, "VORBIS", "has 7000 samples a second; allowed: 8,000 to 192,000; resample it to 48,000"),
        (0, 8000, "VORBIS", "holds no samples; save it again"),
    ],
)
def test_a_sound_is_refused_with_what_is_wrong_and_what_helps(
    frames: int, rate: int, subtype: str, says: str, tmp_path: Path
) -> None:
    path = tmp_path / "wave.ogg"
    samples = np.random.default_rng(1).uniform(-0.5, 0.5, frames).astype(np.float32)
    soundfile.write(path, samples, rate, format="OGG", subtype=subtype)
    with pytest.raises(SourceError, match=says):
        read_sound(path)

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

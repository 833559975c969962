"""The video that `make run` leaves where there is no display."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import av
import numpy as np
import pytest
import soundfile

from tests.pictures import save


def test_the_video_shows_every_frame_a_thirtieth_of_a_second_apart_and_has_the_flight_s_sound(
    root: Path, tmp_path: Path
) -> None:
    spec = importlib.util.spec_from_file_location("record", root / "player/record.py")
    assert spec is not None and spec.loader is not None
    record = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(record)
    greys = np.linspace(0.1, 0.9, 15)
    frames = [tmp_path / f"f_{k:04d}.png" for k in range(len(greys))]
    for path, grey in zip(frames, greys, strict=True):
        save(path, np.full((360, 640, 3), grey, np.float32))
    tone = 0.3 * np.sin(2.0 * np.pi * 441.0 * np.arange(22050) / 44100)
    soundfile.write(tmp_path / "flight.wav", np.stack([tone, 0.2 * tone], 1), 44100, subtype="PCM_16")
    record.encode(frames, tmp_path / "flight.mp4", tmp_path / "flight.wav")
    with av.open(str(tmp_path / "flight.mp4")) as video:
        heard = np.concatenate([frame.to_ndarray() for frame in video.decode(audio=0)], axis=1)
        left, right = (20.0 * np.log10(np.sqrt(2.0 * np.square(side[4410:17640]).mean())) for side in heard)
        assert left == pytest.approx(20.0 * np.log10(0.3), abs=0.5)
        assert left - right == pytest.approx(14.0, abs=1.0)
        assert heard.shape[1] == pytest.approx(22050, abs=2 * 1024)
    record.encode(frames, tmp_path / "flight.mp4")
    with av.open(str(tmp_path / "flight.mp4")) as video:
        shown = [
            (frame.time, frame.to_ndarray(format="gray").mean() / 255) for frame in video.decode(video=0)
        ]
        assert video.duration is not None
        assert video.duration / av.time_base == pytest.approx(len(greys) / 30, abs=1e-3)
    assert [time for time, _ in shown] == pytest.approx([k / 30 for k in range(len(greys))], abs=1e-4)
    assert (np.diff([grey for _, grey in shown]) > 0.02).all()

"""The video that `make run` leaves where there is no display."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import av
import numpy as np
import pytest

from tests.pictures import save


def test_the_video_shows_every_frame_a_thirtieth_of_a_second_apart(root: Path, tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("record", root / "player/record.py")
    assert spec is not None and spec.loader is not None
    record = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(record)
    greys = np.linspace(0.1, 0.9, 15)
    frames = [tmp_path / f"f_{k:04d}.png" for k in range(len(greys))]
    for path, grey in zip(frames, greys, strict=True):
        save(path, np.full((360, 640, 3), grey, np.float32))
    record.encode(frames, tmp_path / "flight.mp4")
    with av.open(str(tmp_path / "flight.mp4")) as video:
        shown = [
            (frame.time, frame.to_ndarray(format="gray").mean() / 255) for frame in video.decode(video=0)
        ]
        assert video.duration is not None
        assert video.duration / av.time_base == pytest.approx(len(greys) / 30, abs=1e-3)
    assert [time for time, _ in shown] == pytest.approx([k / 30 for k in range(len(greys))], abs=1e-4)
    assert (np.diff([grey for _, grey in shown]) > 0.02).all()

"""The video that `make run` leaves where there is no display."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
import soundfile

from tests.pictures import load, save


def script(root: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(root / "player"))
    return importlib.import_module(name)


def test_a_sheet_holds_every_picture_at_its_place_with_its_second(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sheets = script(root, "contact_sheet", monkeypatch)
    greys = np.linspace(0.1, 0.9, 5)
    pictures = [tmp_path / f"{k}.png" for k in range(len(greys))]
    for path, grey in zip(pictures, greys, strict=True):
        save(path, np.full((120, 160, 3), grey, np.float32))
    sheets.join(pictures, [0.0, 2.5, 5.0, 7.5, 10.0], 3, 2, tmp_path / "sheet.png")
    sheet = load(tmp_path / "sheet.png")
    assert sheet.shape == (2 * 60, 3 * 80, 3)
    for k, grey in enumerate([*greys, 0.0]):
        tile = sheet[60 * (k // 3) :, 80 * (k % 3) :][:60, :80]
        assert tile[30:].mean() == pytest.approx(grey, abs=0.01)
        assert (np.ptp(tile[:20]) > 0.5) == (k < len(greys)), "white words with a dark rim"


def test_the_video_shows_every_frame_a_thirtieth_of_a_second_apart_and_has_the_flight_s_sound(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = script(root, "record", monkeypatch)
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

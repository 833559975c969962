"""Reads an Ogg Vorbis file and decodes all of it as a check."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import soundfile

from paradize.errors import SourceError, unread
from paradize.files import read_file
from paradize.kinds import SOUND, expecting

MAX_BYTES = 64 << 20
MAX_SECONDS = 3600.0
_BLOCK = 1 << 16  # frames decoded at a time


@dataclass(frozen=True)
class Sound:
    """data: the file's bytes. frames: samples per channel. channels: 1 or 2. rate_hz: 8,000 to 192,000."""

    data: bytes
    frames: int
    channels: int
    rate_hz: int


def read_sound(path: Path) -> Sound:
    """Reads and checks an Ogg Vorbis file.

    Raises SourceError for a file that is missing, larger than MAX_BYTES, not Ogg Vorbis, truncated or silent,
    has more than two channels, is longer than MAX_SECONDS, or holds samples that are not finite.
    """
    with expecting(SOUND, path):
        return _read_sound(path)


def _read_sound(path: Path) -> Sound:
    mend = "save it as Ogg Vorbis, mono or stereo"
    try:
        data = read_file(path, MAX_BYTES)
    except OSError as error:
        raise unread(error, path) from None
    if data[:4] != b"OggS":
        raise SourceError("is not an Ogg file", file=path, mend=mend)
    try:
        with soundfile.SoundFile(io.BytesIO(data)) as stream:
            if stream.subtype != "VORBIS":
                raise SourceError(f"is Ogg {stream.subtype.title()}, not Ogg Vorbis", file=path, mend=mend)
            if stream.channels not in (1, 2):
                raise SourceError(f"has {stream.channels} channels", file=path, mend=mend)
            if not 8000 <= stream.samplerate <= 192_000:
                what = f"has {stream.samplerate} samples a second; allowed: 8,000 to 192,000"
                raise SourceError(what, file=path, mend="resample it to 48,000")
            seconds = stream.frames / stream.samplerate
            if seconds == 0.0:
                raise SourceError("holds no samples", file=path, mend="save it again")
            if seconds > MAX_SECONDS:
                what = f"lasts {seconds:g} s; allowed: up to {MAX_SECONDS:g} s"
                raise SourceError(what, file=path, mend="cut it")
            expected, decoded, loudest = stream.frames, 0, 0.0
            while len(block := stream.read(_BLOCK, dtype="float32")):
                if not np.isfinite(block).all():
                    raise SourceError("holds samples that are not finite", file=path, mend=mend)
                decoded += len(block)
                loudest = max(loudest, float(np.abs(block).max()))
            channels, rate = stream.channels, stream.samplerate
    except soundfile.LibsndfileError as error:
        raise SourceError(f"cannot be decoded: {error.error_string}", file=path, mend=mend) from None
    if decoded != expected:
        raise SourceError(f"is truncated: {decoded} of {expected} samples", file=path, mend="save it again")
    if loudest == 0.0:
        raise SourceError("is silent throughout", file=path, mend="leave it out")
    return Sound(data, decoded, channels, rate)

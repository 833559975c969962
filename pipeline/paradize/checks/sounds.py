"""Rules for a sound. The player loops it, so its end must continue into its start."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from paradize.checks.loudness import loudness_lufs
from paradize.checks.rules import Finding

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]

# A step at the seam is heard if it is _STEPS times the usual step (99.9 of 100 samples) and above _HEARD of
# full scale.
_STEPS = 8.0
_HEARD = 0.02
_MAX_S = 3600  # the decoded sound is many times the size of the file
_QUIETEST_LUFS, _LOUDEST_LUFS = -60.0, -9.0  # below, the noise of 16 bits is near; above, nothing is left
_LEAST_S = 0.4  # a shorter sound has no loudness: BS.1770 measures blocks of this length


def check_sound(data: bytes, file: str, *, placed: bool = False) -> Iterator[Finding]:
    """The findings in an Ogg Vorbis file's bytes. placed: a sound of the scene plays it at a place."""
    if data[:4] != b"OggS":
        yield Finding("PZ102", file, "is not an Ogg file", "byte 0")
        return
    import soundfile  # here: only a scene with a sound needs it

    try:
        with soundfile.SoundFile(io.BytesIO(data)) as stream:
            if stream.frames > _MAX_S * stream.samplerate:
                yield Finding(
                    "PZ102", file, f"lasts {stream.frames / stream.samplerate:.0f} s, limit {_MAX_S}"
                )
                return
            samples, rate = stream.read(dtype="float32", always_2d=True), stream.samplerate
    except (soundfile.SoundFileError, RuntimeError) as error:
        yield Finding("PZ102", file, f"does not decode: {error}")
        return
    if len(samples) < 3:
        return
    yield from _seam(samples, rate, file)
    yield from _level(samples, rate, file)
    if placed and samples.shape[1] > 1:
        yield Finding("PZ503", file, f"has {samples.shape[1]} channels, a sound with a place has 1")


def _seam(samples: F32, rate: int, file: str) -> Iterator[Finding]:
    steps = np.abs(np.diff(samples, axis=0))
    usual = np.partition(steps, int(0.999 * (len(steps) - 1)), axis=0)[int(0.999 * (len(steps) - 1))]
    seam = np.abs(samples[0] - samples[-1])
    for channel in range(samples.shape[1]):
        if seam[channel] > max(_HEARD, _STEPS * float(usual[channel])):
            what = f"channel {channel} jumps by {seam[channel]:.3f} from its end to its start, "
            what += f"inside by {usual[channel]:.3f} at most (99.9 of 100 samples)"
            yield Finding("PZ501", file, what, f"second {len(samples) / rate:.3f}")


def _level(samples: F32, rate: int, file: str) -> Iterator[Finding]:
    size = np.abs(samples).max(axis=1)
    over = size > 1.0
    if over.any():
        first = int(over.argmax())
        what = f"{int(over.sum())} samples lie beyond full scale, the largest at {float(size.max()):.3f}"
        yield Finding("PZ502", file, what, f"second {first / rate:.3f}")
    if len(samples) < _LEAST_S * rate:
        return
    lufs = loudness_lufs(samples.astype(np.float64), rate)
    if not _QUIETEST_LUFS <= lufs <= _LOUDEST_LUFS:
        limits = f"{_QUIETEST_LUFS:g} to {_LOUDEST_LUFS:g}"
        yield Finding("PZ504", file, f"has a loudness of {lufs:.1f} LUFS, usual: {limits}")

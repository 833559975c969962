"""Rules for a sound. The player loops it, so its end must continue into its start."""

from __future__ import annotations

import io
from collections.abc import Iterator

import numpy as np

from paradize.checks.rules import Finding

# A step at the seam is heard if it is _STEPS times the usual step (99.9 of 100 samples) and above _HEARD of
# full scale.
_STEPS = 8.0
_HEARD = 0.02
_MAX_S = 3600  # the decoded sound is many times the size of the file


def check_sound(data: bytes, file: str) -> Iterator[Finding]:
    """The findings in an Ogg Vorbis file's bytes."""
    if data[:4] != b"OggS":
        yield Finding("PZ102", file, "is no Ogg file", "byte 0")
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
    steps = np.abs(np.diff(samples, axis=0))
    usual = np.partition(steps, int(0.999 * (len(steps) - 1)), axis=0)[int(0.999 * (len(steps) - 1))]
    seam = np.abs(samples[0] - samples[-1])
    for channel in range(samples.shape[1]):
        if seam[channel] > max(_HEARD, _STEPS * float(usual[channel])):
            what = f"channel {channel} jumps by {seam[channel]:.3f} from its end to its start, "
            what += f"inside by {usual[channel]:.3f} at most (99.9 of 100 samples)"
            yield Finding("PZ501", file, what, f"second {len(samples) / rate:.3f}")

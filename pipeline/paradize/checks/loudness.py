"""How loud a loop is: integrated loudness, after ITU-R BS.1770-4, "Algorithms to measure audio programme
loudness and true-peak audio level", 2015.

The sound is weighted in the frequency domain: of a loop, whose end goes on at its start, that is exact.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]

# The two filters of table 1 and table 2, as b0 b1 b2, a1 a2 at 48 kHz.
_SHELF = (1.53512485958697, -2.69169618940638, 1.19839281085285, -1.69065929318241, 0.73248077421585)
_HIGH_PASS = (1.0, -2.0, 1.0, -1.99004745483398, 0.99007225036621)
_RATE_HZ = 48000.0
_OFFSET = -0.691  # so that a tone of 997 Hz at full scale in one channel has -3.01 LUFS
_BLOCK_S, _STEP_S = 0.4, 0.1
_ABSOLUTE, _RELATIVE = -70.0, -10.0  # gates: LUFS, and LU below the mean of what passes the first


def loudness_lufs(samples: F64, rate_hz: int) -> float:
    """Returns the integrated loudness of a loop, LUFS; -inf where nothing passes the gates.

    samples : (frames, channels) of front channels, full scale 1
    """
    weighted = _weighted(samples, rate_hz)
    size, step = round(_BLOCK_S * rate_hz), round(_STEP_S * rate_hz)
    power = np.concatenate([[0.0], np.cumsum((weighted * weighted).sum(axis=1))])
    starts = np.arange(0, max(len(samples) - size, 0) + 1, step)
    ends = np.minimum(starts + size, len(samples))
    blocks = (power[ends] - power[starts]) / (ends - starts)
    blocks = blocks[blocks > _power(_ABSOLUTE)]
    if len(blocks):
        blocks = blocks[blocks > _power(_lufs(blocks.mean()) + _RELATIVE)]
    return _lufs(blocks.mean()) if len(blocks) else float("-inf")


def _weighted(samples: F64, rate_hz: int) -> F64:
    """The samples behind both filters, whose response at a frequency is that at 48 kHz."""
    frequency = np.fft.rfftfreq(len(samples), 1.0 / rate_hz)
    z = np.exp(-2j * np.pi * np.minimum(frequency, 0.5 * _RATE_HZ) / _RATE_HZ)
    response = np.ones_like(z)
    for b0, b1, b2, a1, a2 in (_SHELF, _HIGH_PASS):
        response = response * (b0 + z * (b1 + z * b2)) / (1.0 + z * (a1 + z * a2))
    spectrum = np.fft.rfft(samples, axis=0) * response[:, None]
    return np.fft.irfft(spectrum, len(samples), axis=0)


def _lufs(power: float) -> float:
    return float(_OFFSET + 10.0 * np.log10(power))


def _power(lufs: float) -> float:
    return float(10.0 ** ((lufs - _OFFSET) / 10.0))

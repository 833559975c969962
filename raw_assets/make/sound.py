"""sound/ocean.ogg: small waves on a sand beach, a stereo loop of 24 s without a seam.

Everything is periodic: noise is generated in the frequency domain over the whole loop, and its envelopes are
sums of pulses on a circle of time. The spectrum follows the wave: a constant low rumble, a broad hiss when it
breaks, a thin fizz when it drains back through the sand.
"""

from __future__ import annotations

import io
from functools import cache
from pathlib import Path

import numpy as np
import soundfile

from noise import Array, normal, uniform

RATE_HZ = 44100
SECONDS = 24
SAMPLES = RATE_HZ * SECONDS
VORBIS_QUALITY = 0.4
WAVES = 4  # swells in the loop
PEAK = 0.5


def shaped_noise(seed: int, low_hz: float, high_hz: float, tilt: float) -> Array:
    """Periodic noise between two frequencies with soft edges and power f**-tilt; standard deviation 1."""
    frequency = np.fft.rfftfreq(SAMPLES, 1.0 / RATE_HZ)
    f = np.maximum(frequency, 1.0)
    shape = f ** (-0.5 * tilt) / np.sqrt((1.0 + (low_hz / f) ** 4) * (1.0 + (f / high_hz) ** 4))
    shape[0] = 0.0
    noise = np.fft.irfft(np.fft.rfft(normal((SAMPLES,), seed)) * shape, SAMPLES)
    return np.asarray(noise / np.sqrt(np.mean(noise * noise)))


def bump(centre_s: float, rise_s: float, fall_s: float) -> Array:
    """Envelope of one wave on the circle of time: 0..1, rises quickly, falls slowly, smooth."""
    t = np.arange(SAMPLES) / RATE_HZ
    away = (t - centre_s + SECONDS / 2) % SECONDS - SECONDS / 2
    return np.asarray(
        np.where(away < 0.0, np.exp(-((away / rise_s) ** 2)), 1.0 / (1.0 + (away / fall_s) ** 2) ** 1.5)
    )


@cache
def loop() -> Array:
    """The loop: (1058400, 2) float64, within -0.5..0.5."""
    channels = []
    pick = uniform((WAVES, 6), 501)
    far = sum(
        (bump(i * SECONDS / 6 + 1.3 * uniform((6,), 507)[i], 1.5, 1.9) for i in range(6)),
        np.zeros(SAMPLES),
    )
    for side in (0, 1):
        seed = 520 + 40 * side
        rumble = shaped_noise(seed, 40.0, 160.0, 0.6)
        body = shaped_noise(seed + 3, 140.0, 900.0, 1.0)
        wash = shaped_noise(seed + 7, 350.0, 3200.0, 0.9)
        hiss = shaped_noise(seed + 11, 1800.0, 9000.0, 0.5)
        air = shaped_noise(seed + 17, 250.0, 2200.0, 1.2)
        signal = 0.10 * rumble + 0.055 * air + 0.06 * far * body
        for i, (a, b, c, d, e, f) in enumerate(pick):
            time = (i + 0.15 + 0.55 * a) * SECONDS / WAVES
            lag = (0.10 + 0.20 * b) * (side if f < 0.5 else 1 - side)  # the wave runs along the beach
            pan = 0.80 + 0.35 * abs(side - e)
            loud = (0.65 + 0.5 * c) * pan
            signal = signal + loud * 0.16 * bump(time + lag, 1.7, 0.9) * rumble
            signal = signal + loud * 0.17 * bump(time + lag, 1.1, 0.8) * body
            signal = signal + loud * 0.16 * bump(time + 0.25 + lag, 0.75, 0.9) * wash
            signal = signal + loud * 0.068 * bump(time + 0.6 + lag, 0.7, 1.2 + 0.5 * d) * hiss
            signal = signal + loud * 0.026 * bump(time + 2.4 + lag, 1.1, 1.3) * hiss  # draining back
        channels.append(signal)
    stereo = np.stack(channels, -1)
    # the loop starts at its quietest moment
    power = np.fft.irfft(np.fft.rfft((stereo**2).sum(-1)) * np.fft.rfft(bump(0.0, 0.6, 0.35)), SAMPLES)
    stereo = np.roll(stereo, -int(np.argmin(power)), 0)
    return np.asarray(stereo * (PEAK / np.max(np.abs(stereo))))


def fixed_serial(stream: bytes, serial: int = 1) -> bytes:
    """Sets a fixed serial number in every page of an Ogg stream. The encoder takes it from the clock.

    Pages and their checksum after S. Pfeiffer, "The Ogg Encapsulation Format Version 0", RFC 3533, 2003.
    """
    table = []
    for byte in range(256):
        crc = byte << 24
        for _ in range(8):
            crc = ((crc << 1) ^ (0x04C11DB7 if crc & 0x80000000 else 0)) & 0xFFFFFFFF
        table.append(crc)
    pages, start = bytearray(), 0
    while start < len(stream):
        segments = stream[start + 26]
        end = start + 27 + segments + sum(stream[start + 27 : start + 27 + segments])
        page = bytearray(stream[start:end])
        page[14:18] = serial.to_bytes(4, "little")
        page[22:26] = bytes(4)
        crc = 0
        for byte in page:
            crc = ((crc << 8) & 0xFFFFFFFF) ^ table[(crc >> 24) ^ byte]
        page[22:26] = crc.to_bytes(4, "little")
        pages += page
        start = end
    return bytes(pages)


def make(out: Path) -> None:
    """Writes sound/ocean.ogg under out."""
    buffer = io.BytesIO()
    with soundfile.SoundFile(
        buffer, "w", RATE_HZ, 2, format="OGG", subtype="VORBIS", compression_level=1.0 - VORBIS_QUALITY
    ) as stream:
        samples = loop().astype(np.float32)
        for start in range(0, SAMPLES, RATE_HZ):  # one large block overflows the stack of libsndfile's Vorbis
            stream.write(samples[start : start + RATE_HZ])
    path = out / "sound/ocean.ogg"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(fixed_serial(buffer.getvalue()))

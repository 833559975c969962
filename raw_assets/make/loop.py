"""Sounds that loop without a seam: everything is periodic. Noise is made in the frequency domain over the
whole loop, envelopes lie on a circle of time, and what is added beyond the end goes on at the start."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import soundfile

from noise import Array, normal


@dataclass(frozen=True)
class Loop:
    """A circle of time."""

    seconds: float
    rate_hz: int = 32000

    @property
    def samples(self) -> int:
        return round(self.seconds * self.rate_hz)

    @property
    def times_s(self) -> Array:
        return np.arange(self.samples) / self.rate_hz

    def noise(self, seed: int, low_hz: float, high_hz: float, tilt: float) -> Array:
        """Periodic noise between two frequencies with soft edges and power f**-tilt; standard deviation 1."""
        frequency = np.fft.rfftfreq(self.samples, 1.0 / self.rate_hz)
        f = np.maximum(frequency, 1.0)
        shape = f ** (-0.5 * tilt) / np.sqrt((1.0 + (low_hz / f) ** 4) * (1.0 + (f / high_hz) ** 4))
        shape[0] = 0.0
        noise = np.fft.irfft(np.fft.rfft(normal((self.samples,), seed)) * shape, self.samples)
        return np.asarray(noise / np.sqrt(np.mean(noise * noise)))

    def bump(self, centre_s: float, rise_s: float, fall_s: float) -> Array:
        """Envelope of one wave on the circle of time: 0..1, rises quickly, falls slowly, smooth."""
        t = self.times_s
        away = (t - centre_s + self.seconds / 2) % self.seconds - self.seconds / 2
        return np.asarray(
            np.where(away < 0.0, np.exp(-((away / rise_s) ** 2)), 1.0 / (1.0 + (away / fall_s) ** 2) ** 1.5)
        )

    def add(self, signal: Array, part: Array, at_s: float) -> None:
        """Adds a part from a second on; what reaches beyond the end goes on at the start."""
        start = round(at_s * self.rate_hz)
        np.add.at(signal, (start + np.arange(len(part))) % self.samples, part)

    def echo(self, signal: Array, seed: int, decay_s: float, brightness_hz: float) -> Array:
        """The signal in a room: convolved, on the circle, with noise that decays by 60 dB in decay_s.
        J. A. Moorer, "About This Reverberation Business", Computer Music Journal 3 (2), 1979."""
        tail = self.noise(seed, 150.0, brightness_hz, 0.5) * np.exp(-6.9 * self.times_s / decay_s)
        tail[: round(0.012 * self.rate_hz)] = 0.0
        tail /= np.sqrt(np.sum(tail * tail))
        return np.asarray(np.fft.irfft(np.fft.rfft(signal) * np.fft.rfft(tail), self.samples))

    def from_the_quietest(self, signal: Array) -> Array:
        """The loop, begun at its quietest moment. signal: (samples,) or (samples, channels)."""
        power = signal**2 if signal.ndim == 1 else (signal**2).sum(-1)
        near = np.fft.rfft(self.bump(0.0, 0.6, 0.35))
        return np.roll(signal, -int(np.argmin(np.fft.irfft(np.fft.rfft(power) * near, self.samples))), 0)


def to_peak(signal: Array, peak: float) -> Array:
    """The signal with its largest sample at `peak`."""
    return np.asarray(signal * (peak / np.max(np.abs(signal))))


def write_ogg(path: Path, signal: Array, rate_hz: int, quality: float) -> None:
    """Writes Ogg Vorbis. signal: (samples,) or (samples, channels). quality: of Vorbis, 0 to 1."""
    samples = signal.astype(np.float32).reshape(len(signal), -1)
    buffer = io.BytesIO()
    kind = {"format": "OGG", "subtype": "VORBIS", "compression_level": 1.0 - quality}
    with soundfile.SoundFile(buffer, "w", rate_hz, samples.shape[1], **kind) as stream:
        for start in range(0, len(samples), rate_hz):  # one large block overflows libsndfile's stack
            stream.write(samples[start : start + rate_hz])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(fixed_serial(buffer.getvalue()))


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

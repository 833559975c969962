"""music/strings.ogg, stars.ogg: two quiet pieces of 32 s, stereo loops without a seam.

Strings: plucked strings in D major, by day. Stars: soft chords and a few bells in A minor, by night.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from loop import Loop, to_peak, write_ogg
from noise import Array, normal, uniform

LOOP = Loop(32.0, 44100)
VORBIS_QUALITY = 0.15
BEAT_S = 1.0  # 60 beats a minute: 8 bars of 4

NOTES = {"C": 0, "D": 2, "E": 4, "F": 5, "G": 7, "A": 9, "B": 11}


def pitch_hz(name: str) -> float:
    """The frequency of a note such as "F#4", in equal temperament with A4 at 440 Hz."""
    step = NOTES[name[0]] + name.count("#") + 12 * (int(name[-1]) - 4) - NOTES["A"]
    return float(440.0 * 2.0 ** (step / 12.0))


def pluck(name: str, seed: int, seconds: float, softness: float) -> Array:
    """A plucked string: the harmonics of a burst of noise, each of which decays as the loop of K. Karplus and
    A. Strong, "Digital Synthesis of Plucked-String and Drum Timbres", Computer Music Journal 7 (2), 1983,
    damps it: in each period by the cosine of half its phase step. The sum of them is in tune at every pitch,
    which their delay line of whole samples is not. softness: of the finger, seconds."""
    f = pitch_hz(name)
    t = np.arange(round(seconds * LOOP.rate_hz)) / LOOP.rate_hz
    out = np.zeros(len(t))
    harmonics = np.arange(1, int(min(7000.0, 16.0 * f) / f) + 1)
    size = np.abs(normal((len(harmonics),), seed)) * 0.4 + 0.6
    phase = 2.0 * np.pi * uniform((len(harmonics),), seed + 1)
    for k, a, p in zip(harmonics, size, phase, strict=True):
        damping = -np.log(np.cos(np.pi * k * f / LOOP.rate_hz)) * f + 0.9  # per second; air takes the rest
        comb = np.abs(np.sin(np.pi * k * 0.23)) + 0.1  # plucked at 0.23 of its length
        body = 1.0 / (1.0 + (k * f * softness) ** 2)
        out += a * comb * body * np.exp(-damping * t) * np.sin(2.0 * np.pi * k * f * t + p)
    out *= np.minimum(t / 0.004, 1.0) * np.minimum((seconds - t) / 0.25, 1.0)
    return np.asarray(out / np.sqrt(np.mean(out[: LOOP.rate_hz // 4] ** 2)))


def pad(name: str, seed: int, seconds: float, fade_s: float) -> Array:
    """A soft chord tone: three detuned voices of a few harmonics, that swells and fades."""
    t = np.arange(round(seconds * LOOP.rate_hz)) / LOOP.rate_hz
    out = np.zeros(len(t))
    for voice, cents in enumerate((-5.0, 0.0, 6.0)):
        f = pitch_hz(name) * 2.0 ** (cents / 1200.0)
        phase = 2.0 * np.pi * uniform((6,), seed + voice)
        for k in range(1, 6):
            out += np.sin(2.0 * np.pi * k * f * t + phase[k]) / k**2.2
    swell = np.minimum(np.minimum(t, seconds - t) / fade_s, 1.0)
    return np.asarray(0.33 * out * swell * swell * (3.0 - 2.0 * swell))


def bell(name: str, seconds: float) -> Array:
    """A small bell by frequency modulation with a falling index.
    J. Chowning, "The Synthesis of Complex Audio Spectra by Means of Frequency Modulation", 1973."""
    t = np.arange(round(seconds * LOOP.rate_hz)) / LOOP.rate_hz
    f = pitch_hz(name)
    index = 1.1 * np.exp(-2.5 * t)
    out = np.sin(2.0 * np.pi * f * t + index * np.sin(2.0 * np.pi * 3.5 * f * t)) * np.exp(-1.6 * t)
    return np.asarray(out * np.minimum(t / 0.003, 1.0) * np.minimum((seconds - t) / 0.25, 1.0))


# A bar: the bass, and the notes that are picked over it in eighths; "-": a rest.
STRINGS = (
    ("D3", "A3 F#4 D4 F#4 A4 F#4 D4 A3"), ("D3", "A3 E4 D4 F#4 B4 A4 F#4 D4"),
    ("B2", "F#3 D4 B3 D4 F#4 D4 B3 F#3"), ("B2", "F#3 E4 D4 F#4 A4 F#4 E4 D4"),
    ("G2", "D3 B3 G3 D4 G4 D4 B3 G3"), ("G2", "D3 B3 A3 D4 F#4 E4 D4 B3"),
    ("A2", "E3 A3 C#4 E4 A4 E4 C#4 A3"), ("A2", "E3 D4 C#4 E4 G4 E4 - -"),
)  # fmt: skip
SONG = ((3.0, "F#5"), (6.0, "A5"), (7.5, "F#5"), (11.0, "E5"), (14.0, "D5"), (15.5, "E5"), (19.0, "D5"),
        (21.5, "B4"), (23.0, "D5"), (26.5, "C#5"), (28.5, "E5"))  # fmt: skip
CHORDS = ("A2 E3 C4 G4", "F2 C3 A3 E4", "D2 A2 F3 C4", "E2 B2 G3 D4")  # eight seconds each
# The first one hides what the encoder leaves of the seam.
BELLS = ((0.0, "E6"), (3.5, "B5"), (9.0, "C6"), (12.5, "A5"), (14.0, "E6"), (18.0, "F5"), (20.5, "C6"),
         (26.0, "B5"), (27.5, "D6"), (30.0, "G5"))  # fmt: skip


def strings() -> Array:
    """(samples, 2): the picked chords a little to the left, the melody to the right."""
    picked, song = np.zeros(LOOP.samples), np.zeros(LOOP.samples)
    late = 0.016 * uniform((200,), 801)  # no player is a clock
    for bar, (bass, notes) in enumerate(STRINGS):
        LOOP.add(picked, 0.045 * pluck(bass, 810 + bar, 4.0, 0.0011), 4.0 * bar * BEAT_S)
        for i, name in enumerate(notes.split()):
            if name != "-":
                n = 8 * bar + i
                at_s = (4.0 * bar + 0.5 * i) * BEAT_S + late[n] + 0.008
                loud = 0.036 * (1.15 if i % 4 == 0 else 0.85)
                LOOP.add(picked, loud * pluck(name, 830 + 3 * n, 2.5, 0.0007), at_s)
    for n, (at_s, name) in enumerate(SONG):
        LOOP.add(song, 0.045 * pluck(name, 1050 + 3 * n, 3.5, 0.0005), at_s + late[100 + n])
    return _in_a_room(0.85 * picked + 0.45 * song, 0.55 * picked + 0.9 * song, 0.20, 1.8, 4500.0)


def stars() -> Array:
    """(samples, 2): chords on both sides, bells to and fro."""
    sides = np.zeros((2, LOOP.samples))
    for bar, chord in enumerate(CHORDS):
        for i, name in enumerate(chord.split()):
            for side in (0, 1):
                tone = pad(name, 1200 + 50 * bar + 10 * i + 5 * side, 11.0, 3.2)
                LOOP.add(sides[side], (0.030 if i == 0 else 0.045) * tone, 8.0 * bar - 1.5)
    for n, (at_s, name) in enumerate(BELLS):
        to_left = 0.25 + 0.5 * uniform((1,), 1400 + n)[0]
        for side, share in enumerate((to_left, 1.0 - to_left)):
            LOOP.add(sides[side], 0.075 * share * bell(name, 4.0), at_s)
    return _in_a_room(sides[0], sides[1], 0.40, 3.5, 3500.0)


def _in_a_room(left: Array, right: Array, share: float, decay_s: float, brightness_hz: float) -> Array:
    """Both sides with the echo of a room, (samples, 2)."""
    both = [
        side + share * LOOP.echo(side, 1500 + k, decay_s, brightness_hz)
        for k, side in enumerate((left, right))
    ]
    return to_peak(np.stack(both, -1), 0.5)


@cache
def loops() -> dict[str, Array]:
    """The samples by file name, (samples, 2)."""
    return {"strings": strings(), "stars": stars()}


def make(out: Path) -> None:
    """Writes both files under out/music."""
    for name, signal in loops().items():
        write_ogg(out / f"music/{name}.ogg", signal, LOOP.rate_hz, VORBIS_QUALITY)

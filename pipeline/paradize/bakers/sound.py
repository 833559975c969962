"""A sound file -> the same file, checked: sounds are published as they are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from paradize.readers.sound import read_sound


@dataclass(frozen=True)
class SoundProduct:
    """data: the file's bytes. suffix: "ogg". seconds: its length."""

    data: bytes
    suffix: str
    seconds: float


def bake_sound(path: Path) -> SoundProduct:
    """Checks that the whole file decodes. Raises SourceError where it does not."""
    sound = read_sound(path)
    return SoundProduct(sound.data, "ogg", sound.frames / sound.rate_hz)

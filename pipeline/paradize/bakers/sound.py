"""A sound file -> the same file, checked: sounds are published as they are."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from paradize.readers.sound import read_sound
from paradize.scene.baker_settings import SoundSettings


@dataclass(frozen=True)
class SoundProduct:
    """data: the file's bytes. suffix: "ogg". seconds: its length."""

    data: bytes
    suffix: str
    seconds: float
    warnings: list[str] = field(default_factory=list)


def bake_sound(path: Path, settings: SoundSettings) -> SoundProduct:
    """Checks that the whole file decodes. Raises SourceError where it does not."""
    sound = read_sound(path)
    warnings = []
    if settings.placed and sound.channels > 1:
        warnings.append(
            f"{path}: has {sound.channels} channels, but a place in the scene: the player plays their mean; "
            "mix it down to mono, or leave out its position or line"
        )
    return SoundProduct(sound.data, "ogg", sound.frames / sound.rate_hz, warnings)

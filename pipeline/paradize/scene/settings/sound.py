# ruff: noqa: RUF009 (the calls in the dataclasses make their fields)
"""Sounds and music of a scene, and the names of their artifacts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from paradize.scene.schema import FAR, Faults, identifier, number, point, points, source, sources, whole

MOST_SOUNDS = 64
_DAY_S = 86_400.0


@dataclass(frozen=True, kw_only=True)
class Sound:
    """position, line: where it is heard from; without both it is heard everywhere alike."""

    name: str | None = identifier(None, meaning="names it; needed where the scene has several sounds")
    file: Path = source(meaning="Ogg Vorbis file, played in a loop; mono where the sound has a place")
    volume: float = number(1.0, low=0.0, high=1.0, meaning="1: as recorded")
    position: tuple[float, float, float] | None = point(None, meaning="where it comes from")
    line: tuple[tuple[float, float, float], ...] | None = points(
        None, least=2, most=256, meaning="a line that it comes from, such as a shore"
    )
    radius_m: float = number(
        1.0, low=0.001, high=FAR, unit="m", meaning="up to this distance it has its full volume"
    )
    falloff: float = number(
        1.0,
        low=0.0,
        high=4.0,
        meaning="beyond, each doubling of the distance takes 6 dB times this: 1 as from a point, 0.5 as from "
        "a line",
    )
    on_s: float | None = number(
        None, low=0.0, high=_DAY_S, unit="s", meaning="second of the flight at which it begins to fade in"
    )
    off_s: float | None = number(
        None, low=0.0, high=_DAY_S, unit="s", meaning="second at which it has faded out; may be below on_s"
    )
    fade_s: float = number(2.0, low=0.01, high=_DAY_S, unit="s", meaning="duration of each fade")

    @property
    def places(self) -> tuple[tuple[float, float, float], ...]:
        """The points of its line, or its position, or nothing."""
        return self.line or ((self.position,) if self.position else ())

    @property
    def artifact(self) -> str:
        """The name of its artifact, unless another sound has the same file."""
        return f"{self.name}_sound" if self.name else "sound"


@dataclass(frozen=True, kw_only=True)
class Music:
    files: tuple[Path, ...] = sources(
        size=1, most=16, meaning="Ogg Vorbis files, each played in a loop; a key goes from one to the next"
    )
    volume: float = number(0.5, low=0.0, high=1.0, meaning="1: as recorded")
    playing: int = whole(0, low=0, high=16, meaning="the piece that plays at first; 0: none")


@dataclass(frozen=True)
class NeededSound:
    """A file that sounds need. placed: one of them has a place. first_s: when the first of them begins."""

    artifact: str
    reason: str
    placed: bool
    first_s: float


def sound_files(sounds: tuple[Sound, ...], music: Music | None) -> dict[Path, NeededSound]:
    """Returns the files of all sounds and of the music. Sounds with the same file share an artifact."""
    found: dict[Path, NeededSound] = {}
    for sound in sounds:
        known = found.get(sound.file, NeededSound(sound.artifact, _reason(sound), False, _DAY_S))
        placed, first_s = known.placed or bool(sound.places), min(known.first_s, _first_s(sound))
        found[sound.file] = NeededSound(known.artifact, known.reason, placed, first_s)
    for k, path in enumerate(music.files if music else (), 1):
        known = found.get(path, NeededSound(f"music_{k}", f"piece {k} of the music", False, 0.0))
        found[path] = NeededSound(known.artifact, known.reason, known.placed, 0.0)
    return found


def check_sounds(sounds: tuple[Sound, ...], music: Music | None, duration_s: float, faults: Faults) -> None:
    """Adds the faults that concern more than one field. duration_s: of the flight."""
    first: dict[str | None, int] = {}
    for i, sound in enumerate(sounds):
        place = f"sound[{i}]" if len(sounds) > 1 else "sound"
        if first.setdefault(sound.name, i) != i:
            what = f"{sound.name!r} is already sound[{first[sound.name]}]" if sound.name else "is missing"
            faults.add(f"{place}.name", what, "give each of several sounds a name of its own")
        if sound.position and sound.line:
            faults.add(f"{place}.line", "stands beside a position", "leave one of them out")
        if (sound.on_s is None) != (sound.off_s is None):
            given, other = ("off_s", "on_s") if sound.on_s is None else ("on_s", "off_s")
            faults.add(f"{place}.{given}", f"stands without {other}", "write both or none")
        for key in ("on_s", "off_s"):
            second = getattr(sound, key)
            if second is not None and second > duration_s:
                faults.add(f"{place}.{key}", f"is {second:g}", f"the flight lasts {duration_s:g} s")
        if sound.on_s is not None and sound.on_s == sound.off_s:
            faults.add(f"{place}.off_s", f"is {sound.off_s:g}, as on_s", "write different seconds, or none")
    if music and music.playing > len(music.files):
        mend = f"there are {len(music.files)} pieces; 0: none plays"
        faults.add("music.playing", f"is {music.playing}", mend)


def _reason(sound: Sound) -> str:
    where = "everywhere"
    if sound.places:
        where = f"along a line of {len(sound.places)} points" if len(sound.places) > 1 else "at its place"
    named = f" {sound.name}" if sound.name else ""
    hours = f", from second {sound.on_s:g} to {sound.off_s:g}" if sound.on_s is not None else ""
    return f"the sound{named}, heard {where}{hours}"


def _first_s(sound: Sound) -> float:
    """When it is first heard: at 0 also where its hours go on past the end of the flight."""
    if sound.on_s is None or sound.off_s is None or sound.off_s < sound.on_s:
        return 0.0
    return sound.on_s

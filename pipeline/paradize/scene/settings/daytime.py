# ruff: noqa: RUF009 (the calls in the dataclasses make their fields)
"""How the light changes along the flight: keys of sun, moon, sky and haze; the moon's size; clouds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from paradize.scene.schema import number, source, sources, table, vector, whole
from paradize.scene.settings.environment import Ambient, Fog, Sun

MOST_KEYS = 100


@dataclass(frozen=True, kw_only=True)
class KeyMoon:
    azimuth_deg: float = number(
        160.0, low=-360.0, high=360.0, unit="degrees", meaning="compass direction of the moon"
    )
    elevation_deg: float = number(
        30.0, low=-90.0, high=90.0, unit="degrees", meaning="height of the moon above the horizon"
    )
    color: tuple[float, float, float] = vector(
        (0.62, 0.74, 1.0), size=3, low=0.0, high=100.0, meaning="linear RGB"
    )
    intensity: float = number(
        0.0, low=0.0, high=1e6, meaning="factor on color; 0 wherever the sun shines, and beside such keys"
    )


@dataclass(frozen=True, kw_only=True)
class DaytimeKey:
    """The light at one second of the flight."""

    at_s: float = number(low=0.0, high=86_400.0, unit="s", meaning="second of the flight")
    sun: Sun = table(Sun, Sun, meaning="The sun at that second. Its size is that of [sun].")
    moon: KeyMoon = table(KeyMoon, KeyMoon, meaning="The moon at that second.")
    ambient: Ambient = table(Ambient, Ambient, meaning="Light from all sides at that second.")
    fog: Fog = table(Fog, Fog, meaning="Fog at that second.")
    exposure: float = number(1.0, low=1e-6, high=1e6, meaning="factor on all light before tone mapping")
    faces: tuple[Path, ...] | None = sources(
        None,
        size=6,
        or_one=True,
        meaning="pictures as those of [sky], without sun, moon, stars and clouds; without it: those of [sky]",
    )
    faces_azimuth_deg: float = number(
        0.0,
        low=-360.0,
        high=360.0,
        unit="degrees",
        meaning="compass direction of the light in those pictures; they turn with the key's brighter light",
    )


@dataclass(frozen=True, kw_only=True)
class Moon:
    angular_diameter_deg: float = number(
        1.2, low=0.0, high=30.0, unit="degrees", meaning="apparent size of the moon's disc"
    )


@dataclass(frozen=True, kw_only=True)
class Clouds:
    picture: Path = source(
        meaning="clouds around the horizon: red, green and blue say how bright light from the right, the "
        "left and above makes them (sRGB), alpha how much of the sky they cover"
    )
    high_deg: float = number(
        30.0,
        low=0.1,
        high=90.0,
        unit="degrees",
        meaning="elevation of the upper edge; the lower is the horizon",
    )
    repeat: int = whole(1, low=1, high=1000, meaning="how often the picture repeats around the horizon")
    drift_repeats: int = whole(
        0,
        low=-1000,
        high=1000,
        meaning="by how many repeats the clouds drift clockwise in a flight; they end where they began",
    )

# ruff: noqa: RUF009 (the calls in the dataclasses make their fields)
"""Light, sky, shadows and water."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from paradize.scene.schema import FAR, number, point, source, sources, table, vector, whole
from paradize.scene.settings.relief import Relief


@dataclass(frozen=True, kw_only=True)
class Sun:
    azimuth_deg: float = number(
        200.0,
        low=-360.0,
        high=360.0,
        unit="degrees",
        meaning="compass direction of the sun: 0 is north (-Z), 90 east (+X)",
    )
    elevation_deg: float = number(
        35.0, low=-90.0, high=90.0, unit="degrees", meaning="height of the sun above the horizon"
    )
    color: tuple[float, float, float] = vector(
        (1.0, 0.9, 0.75), size=3, low=0.0, high=100.0, meaning="linear RGB"
    )
    intensity: float = number(3.0, low=0.0, high=1e6, meaning="factor on color")
    angular_diameter_deg: float = number(
        0.53, low=0.0, high=30.0, unit="degrees", meaning="apparent size of the sun's disc"
    )


@dataclass(frozen=True, kw_only=True)
class Ambient:
    color: tuple[float, float, float] = vector(
        (0.55, 0.7, 1.0), size=3, low=0.0, high=100.0, meaning="linear RGB of the light from all sides"
    )
    intensity: float = number(0.5, low=0.0, high=1e6, meaning="factor on color")


@dataclass(frozen=True, kw_only=True)
class Fog:
    color: tuple[float, float, float] = vector(
        (0.75, 0.85, 0.95), size=3, low=0.0, high=1e4, meaning="linear RGB of the fog"
    )
    density_per_m: float = number(
        0.0, low=0.0, high=100.0, unit="1/m", meaning="share of the light lost per metre; 0: no fog"
    )


@dataclass(frozen=True, kw_only=True)
class Wind:
    azimuth_deg: float = number(
        270.0,
        low=-360.0,
        high=360.0,
        unit="degrees",
        meaning="compass direction that it blows from: 0 is north (-Z), 90 east (+X)",
    )
    speed_m_per_s: float = number(
        6.0,
        low=0.0,
        high=100.0,
        unit="m/s",
        meaning="how fast gusts travel over the scene: the nearest speed with whole gusts in a flight",
    )
    gust_m: float = number(30.0, low=0.1, high=1e5, unit="m", meaning="from one gust to the next")


@dataclass(frozen=True, kw_only=True)
class Sky:
    faces: tuple[Path, ...] = sources(
        size=6,
        or_one=True,
        meaning="six pictures of a cube map in the order +X -X +Y -Y +Z -Z; or one panorama, twice as wide "
        "as high, with north (-Z) in its middle and east (+X) to the right of it: its sun, in column x and "
        "row y, stands at azimuth_deg 360 x / width - 180 and elevation_deg 90 - 180 y / height",
    )


@dataclass(frozen=True, kw_only=True)
class Shadow:
    size: int = whole(2048, low=16, high=16384, unit="texels", meaning="side of the shadow map")
    extent_m: float = number(
        100.0, low=1e-3, high=FAR, unit="m", meaning="side of the square around center that has shadows"
    )
    center: tuple[float, float, float] = point((0.0, 0.0, 0.0), meaning="middle of that square")
    blur_distance_m: float = number(
        50.0, low=0.0, high=FAR, unit="m", meaning="shadow edges farther from the camera are not softened"
    )


@dataclass(frozen=True, kw_only=True)
class LightShafts:
    density_per_m: float = number(
        0.03, low=0.0, high=1.0, unit="1/m", meaning="share of the light scattered per metre of air"
    )
    anisotropy: float = number(
        0.5,
        low=-0.9,
        high=0.9,
        meaning="0: scattered alike to all sides; above: the air is brighter towards the light",
    )
    range_m: float = number(
        40.0, low=0.1, high=FAR, unit="m", meaning="the air up to this distance from the camera scatters"
    )


@dataclass(frozen=True, kw_only=True)
class View:
    """A view rendered into a texture."""

    scale: float = number(
        0.5, low=1 / 16, high=2.0, meaning="resolution of this view as a share of the picture's"
    )


@dataclass(frozen=True, kw_only=True)
class Water:
    waves: Path = source(meaning="tileable height map of the waves")
    wave_strength: float = number(
        1.0, low=1e-6, high=100.0, unit="% of the width", meaning="height of full white"
    )
    wave_relief: Relief = table(Relief, Relief, meaning="How the picture becomes heights.")
    level_m: float = number(0.0, low=-FAR, high=FAR, unit="m", meaning="height of the surface")
    size_m: float = number(1000.0, low=1e-3, high=FAR, unit="m", meaning="side of the square of water")
    wave_repeat: float = number(
        40.0, low=1e-3, high=1e5, meaning="how often the waves repeat along it", formerly="tile"
    )
    scroll: tuple[float, float] = vector(
        (0.01, 0.006),
        size=2,
        low=-10.0,
        high=10.0,
        unit="tiles/s",
        meaning="speed of the waves along x and z: the nearest with whole tiles in a flight; "
        "below half a tile as it is",
    )
    reflection_distortion: float = number(
        0.02,
        low=0.0,
        high=10.0,
        unit="of the picture",
        meaning="how far waves move the mirror image",
        formerly="strength",
    )
    refraction_distortion: float = number(
        0.02,
        low=0.0,
        high=10.0,
        unit="of the picture",
        meaning="how far waves move the view below them",
        formerly="k",
    )
    deep_color: tuple[float, float, float] = vector(
        (0.003, 0.045, 0.107), size=3, low=0.0, high=100.0, meaning="linear RGB of deep water"
    )
    shallow_color: tuple[float, float, float] = vector(
        (0.05, 0.533, 0.527), size=3, low=0.0, high=100.0, meaning="linear RGB of shallow water"
    )
    absorption_per_m: tuple[float, float, float] = vector(
        (0.4, 0.08, 0.06),
        size=3,
        low=0.0,
        high=1e4,
        unit="1/m",
        meaning="share of red, green and blue lost per metre of water",
    )
    specular: float = number(1.0, low=0.0, high=10.0, meaning="intensity of highlights")
    smoothness: float = number(0.95, low=0.0, high=1.0, meaning="0: rough, 1: mirror")
    swash_height_m: float = number(
        0.1,
        low=0.0,
        high=100.0,
        unit="m",
        meaning="waves run up the beach to about this height above the water; 0: none, and no foam",
    )
    swash_waves: int = whole(30, low=1, high=4096, meaning="waves that run up the beach in a flight")
    wave_height_m: float = number(
        0.0,
        low=0.0,
        high=1000.0,
        unit="m",
        meaning="waves that lift the surface near the camera are at most so high from trough to crest; lower "
        "where water is shallow; 0: the surface is flat",
    )
    wave_length_m: float = number(
        9.0,
        low=0.1,
        high=1e4,
        unit="m",
        meaning="length of the longest of these waves; each fades out at twice its length from the camera",
    )
    ripple_height_m: float = number(
        0.0,
        low=0.0,
        high=0.2,
        unit="m",
        meaning="height, from trough to crest, of ripples round what stands in the water: round sections of "
        "objects that neither move nor sway; 0: none",
    )

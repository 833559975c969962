# ruff: noqa: RUF009 (the calls in the dataclasses make their fields)
"""The whole scene, its general settings, particles and waivers."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date

from paradize.scene.budget import METRICS
from paradize.scene.schema import (
    FAR,
    Limits,
    choice,
    code,
    day,
    flag,
    identifier,
    limits,
    number,
    one_of,
    point,
    table,
    tables,
    text,
    vector,
    whole,
    words,
)
from paradize.scene.settings.daytime import MOST_KEYS, Clouds, DaytimeKey, Moon
from paradize.scene.settings.environment import (
    Ambient,
    Fog,
    LightShafts,
    Shadow,
    Sky,
    Sun,
    View,
    Water,
    Wind,
)
from paradize.scene.settings.flight import Flight, FreeCamera
from paradize.scene.settings.lights import Light
from paradize.scene.settings.objects import SceneObject
from paradize.scene.settings.sound import MOST_SOUNDS, Music, Sound
from paradize.scene.settings.terrain import Terrain
from paradize.tiers import TIER_OPTIONS

SEVERITIES = ("error", "warning", "off")  # of a rule of `paradize check`


@dataclass(frozen=True, kw_only=True)
class Head:
    name: str = identifier(meaning="name of the scene: the default folder is build/assets/NAME")
    exposure: float = number(1.0, low=1e-6, high=1e6, meaning="factor on all light before tone mapping")
    viewport: tuple[int, int] = vector(
        (1280, 720),
        size=2,
        low=16,
        high=16384,
        unit="pixels",
        integers=True,
        meaning="size of the player's picture",
    )

    largest_viewport: tuple[int, int] | None = vector(
        None,
        size=2,
        low=16,
        high=16384,
        unit="pixels",
        integers=True,
        meaning="largest picture ever drawn; maps and meshes are as fine as it needs; without it: viewport",
    )
    lod_error_px: float = number(
        1.0,
        low=0.01,
        high=100.0,
        unit="pixels",
        meaning="largest error in the picture that a level of detail may show",
    )
    lod_error_deg: float = number(
        10.0,
        low=0.1,
        high=180.0,
        unit="degrees",
        meaning="how far a level of detail may turn a pixel's normal, for 99 % of the picture; 180: any",
    )
    lod_silhouette: float = number(
        0.004,
        low=0.0001,
        high=1.0,
        unit="of its box",
        meaning="share of the pixels around it that only a level of detail or only the finest covers; 1: any",
    )
    lod_flip: float = number(
        0.01,
        low=0.0001,
        high=1.0,
        unit="FLIP",
        meaning="change of the picture over the object's box by the switch to a level of detail; 1: any",
    )
    vram_mb: float | None = number(
        None,
        low=1.0,
        high=1e6,
        unit="MB",
        meaning="device memory for meshes and textures in the player; without it: no limit",
    )
    tier: str = choice(
        "balanced",
        among=TIER_OPTIONS,
        meaning="tier used if the command line names none; `auto` takes the cheapest inside the budget",
    )
    poster_s: float = number(
        0.0, low=0.0, high=86_400.0, unit="s", meaning="second of the flight that a single picture shows"
    )
    zstd: bool = flag(
        False, meaning="supercompress textures with Zstandard: smaller files, more work to load"
    )

    @property
    def largest(self) -> tuple[int, int]:
        """The largest picture, pixels."""
        return self.largest_viewport or self.viewport


@dataclass(frozen=True, kw_only=True)
class Particles:
    name: str = identifier(meaning="names the cloud")
    center: tuple[float, float, float] = point(meaning="middle of the cloud")
    radius_m: float = number(3.0, low=0.0, high=FAR, unit="m", meaning="radius of the cloud")
    count: int = whole(200, low=1, high=1_000_000, meaning="number of particles")
    size_m: tuple[float, float] = vector(
        (0.01, 0.03), size=2, low=1e-6, high=1e3, unit="m", rising=True, meaning="smallest and largest size"
    )
    life_per_s: tuple[float, float] = vector(
        (0.2, 0.6),
        size=2,
        low=1e-4,
        high=1e3,
        unit="1/s",
        rising=True,
        meaning="slowest and fastest loss of life: the nearest with whole lives in a flight",
    )
    threshold: float = number(
        0.02, low=0.0, high=1.0, meaning="below this life a particle is born again elsewhere"
    )
    color: tuple[float, float, float] = vector(
        (1.0, 0.95, 0.8), size=3, low=0.0, high=1e4, meaning="linear RGB; of a swarm what it reflects"
    )
    motion: str = choice(
        "drift",
        among=("drift", "swarm"),
        meaning="drift: sparkles that rise and fade; swarm: insects that fly around, each in the cloud, lit "
        "by the point lights that reach them and there while one of those is on",
    )
    wander_m: float = number(
        0.0, low=0.0, high=FAR, unit="m", meaning="how far a swarm strays from center as a whole"
    )


@dataclass(frozen=True, kw_only=True)
class Waiver:
    """Lets a finding of `paradize check` pass until a date. artifact, metric: None matches any."""

    rule: str = code(meaning="code of a rule of `paradize check`")
    artifact: str | None = text(None, meaning="only findings of this artifact")
    metric: str | None = one_of(None, known=METRICS, meaning="only findings about this metric")
    reason: str = text(meaning="why it may pass")
    until: date = day(meaning="last day of the waiver")


@dataclass(frozen=True, kw_only=True)
class Scene:
    head: Head = table(Head, key="scene", meaning="General settings.")
    sun: Sun = table(Sun, Sun, meaning="The sun, which casts the shadows.")
    ambient: Ambient = table(Ambient, Ambient, meaning="Light from all sides.")
    fog: Fog = table(Fog, Fog, meaning="Fog. By default there is none.")
    wind: Wind = table(Wind, Wind, meaning="The wind, which moves objects that sway or flutter.")
    sky: Sky | None = table(Sky, None, meaning="The sky, a cube map.")
    daytime: tuple[DaytimeKey, ...] = tables(
        DaytimeKey,
        most=MOST_KEYS,
        meaning="The light at one second of the flight, in place of [sun], [ambient], [fog] and exposure. "
        "Two or more; between them the light changes smoothly, and from the last to the first.",
    )
    moon: Moon = table(Moon, Moon, meaning="The moon of [[daytime]].")
    clouds: Clouds | None = table(Clouds, None, meaning="Clouds that drift, in the light of [[daytime]].")
    shadow: Shadow | None = table(
        Shadow, None, meaning="Shadows of the sun. Without this table there are none."
    )
    light_shafts: LightShafts | None = table(
        LightShafts,
        None,
        meaning="Light that the air scatters, with the shadows of [shadow] in it: god rays.",
    )
    reflection: View | None = table(View, None, meaning="The water's mirror image.")
    refraction: View | None = table(View, None, meaning="The view through the water.")
    terrain: Terrain | None = table(Terrain, None, meaning="The ground, from a heightmap.")
    water: Water | None = table(
        Water,
        None,
        meaning="The water. It needs [reflection] and [refraction] for mirror image and view below.",
    )
    objects: tuple[SceneObject, ...] = tables(
        SceneObject, key="object", meaning="A model. One table for each."
    )
    lights: tuple[Light, ...] = tables(
        Light,
        key="light",
        meaning="A lamp, or one at each instance of an object. It shines alike in all directions and throws "
        "no shadow.",
    )
    particles: tuple[Particles, ...] = tables(Particles, meaning="A cloud of glittering particles.")
    sounds: tuple[Sound, ...] = tables(
        Sound,
        key="sound",
        most=MOST_SOUNDS,
        lone=True,
        meaning="A looped sound: at a place, along a line, or everywhere. One table for each; a single "
        "`[sound]` is one.",
    )
    music: Music | None = table(Music, None, meaning="Pieces of music that a key switches.")
    flight: Flight = table(
        Flight, meaning="The camera's flight: a closed spline through eye and target waypoints."
    )
    free_camera: FreeCamera | None = table(
        FreeCamera, None, meaning="Where a steered camera may be. What it can see is baked as well."
    )
    budget: Limits = limits(METRICS, meaning="The largest errors that the scene accepts.")
    check: dict[str, str] = words(SEVERITIES, meaning="Severities of rules of `paradize check`.")
    waivers: tuple[Waiver, ...] = tables(
        Waiver, key="waiver", meaning="A finding of `paradize check` that may pass until a day."
    )

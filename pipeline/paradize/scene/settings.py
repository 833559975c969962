# ruff: noqa: RUF009 (the calls in the dataclasses make their fields)
"""Reads a scene from one TOML file into frozen settings. Each field has a default, unit, range and meaning;
reference.py writes FIELDS.md from them.

Axes: right-handed, Y up, metres. Angles in the file are degrees (`_deg`). Colours are linear RGB. Azimuth
turns clockwise seen from above, from north (-Z, row 0 of the heightmap) to east (+X): 0 = -Z, 90 = +X. Files
are in the folder of the TOML or below it. Does not import numpy, so that a bake with nothing to do stays
fast.

Limits of the file: 4 MiB (documents.TOML_BYTES), keys of 16 parts (a.b.c has three), 64 nested tables and
lists, whole numbers of 64 bits, 10,000 tables in an array unless declared otherwise. Reading stops after 100
faults (schema.MOST_FAULTS).
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

from paradize.documents import TOML_BYTES, parse_toml
from paradize.errors import SceneError
from paradize.files import read_file
from paradize.kinds import SCENE, expecting
from paradize.scene.budget import METRICS
from paradize.scene.schema import (
    Faults,
    Limits,
    choice,
    choices,
    code,
    day,
    flag,
    identifier,
    limits,
    named_tables,
    number,
    number_or,
    numbers,
    one_of,
    point,
    read_table,
    source,
    sources,
    table,
    tables,
    text,
    texts,
    vector,
    whole,
    words,
)
from paradize.scene.tiers import TIERS

FAR = 1e6  # metres; limit of lengths in a scene
Point = tuple[float, float, float]
SEVERITIES = ("error", "warning", "off")  # of a rule of `paradize check`

SIMPLIFIERS = ("paradize", "meshoptimizer", "fast-simplification", "openmesh")  # stages/lod.py
UNWRAPPERS = ("paradize", "xatlas")  # stages/unwrappers.py

# The derivative filters that a user may name. "auto" chooses one by the heights (stages/filters.py).
FILTERS = ("auto", "central", "scharr", "fourth", "eighth")


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
    tier: str = choice(
        "balanced",
        among=TIERS,
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
class Sky:
    faces: tuple[Path, ...] = sources(
        size=6, meaning="six pictures of a cube map in the order +X -X +Y -Y +Z -Z"
    )


@dataclass(frozen=True, kw_only=True)
class Shadow:
    size: int = whole(2048, low=16, high=16384, unit="texels", meaning="side of the shadow map")
    extent_m: float = number(
        100.0, low=1e-3, high=FAR, unit="m", meaning="side of the square around center that has shadows"
    )
    center: Point = point((0.0, 0.0, 0.0), meaning="middle of that square")
    blur_distance_m: float = number(
        50.0, low=0.0, high=FAR, unit="m", meaning="shadow edges farther from the camera are not softened"
    )


@dataclass(frozen=True, kw_only=True)
class View:
    """A view rendered into a texture."""

    scale: float = number(
        0.5, low=1 / 16, high=2.0, meaning="resolution of this view as a share of the picture's"
    )


@dataclass(frozen=True, kw_only=True)
class Relief:
    """How a picture becomes heights, and heights become slopes. The levels apply in the order of the
    fields, to values in 0..1."""

    black: float = number(0.0, low=-1e6, high=1e6, meaning="value of the picture that becomes height 0")
    white: float = number(
        1.0, low=-1e6, high=1e6, meaning="value that becomes height 1; must differ from black"
    )
    gamma: float = number(1.0, low=1e-3, high=1e6, meaning="above 1 lifts the middle heights")
    contrast: float = number(1.0, low=-1e6, high=1e6, meaning="factor on heights around one half")
    brightness: float = number(0.0, low=-1e6, high=1e6, meaning="added to the heights")
    invert: bool = flag(False, meaning="true: white is low")
    filter: str = choice(
        "auto", among=FILTERS, meaning="derivative filter of the slopes; auto looks at the heights"
    )
    destep: bool = flag(False, meaning="smooth the steps of an 8-bit picture, within half a step")


@dataclass(frozen=True, kw_only=True)
class Terrain:
    heightmap: Path = source(meaning="grey picture, .hgt or .asc of heights; each pixel is a vertex")
    size_m: tuple[float, float] = vector(
        size=2, low=1e-6, high=FAR, unit="m", meaning="x and z, from the first to the last pixel"
    )

    height_m: float | None = number(
        None,
        low=-FAR,
        high=FAR,
        unit="m",
        meaning="height of white above black; a file of metres (floats, signed integers, .hgt) needs none",
    )
    height_scale: float = number(1.0, low=-FAR, high=FAR, meaning="factor on the heights, also on metres")
    nodata: float | str = number_or(
        ("auto", "none"),
        low=-1e39,
        high=1e39,
        meaning="value of pixels without a height; auto: as the file says",
    )
    base_m: float = number(0.0, low=-FAR, high=FAR, unit="m", meaning="y of black")
    max_error_m: float = number(
        0.03,
        low=0.0,
        high=FAR,
        unit="m",
        meaning="largest vertical error of the mesh; 0: a vertex at every pixel",
    )
    patch_px: int = whole(
        128, low=8, high=256, unit="pixels", meaning="side of the finest cells of the patch tree"
    )
    quantise: bool = flag(False, meaning="16-bit vertices, inside max_error_m")
    tile_mb: float = number(64.0, low=0.01, high=64.0, unit="MB", meaning="largest size of a file of patches")
    sand_color: Path = source(meaning="tileable colour map of the ground")
    sand_repeat: float = number(1.0, low=1e-3, high=1e5, meaning="how often the sand repeats along x")
    sand_height: Path | None = source(
        None, meaning="heights of the sand; without it they come from sand_color"
    )
    sand_strength: float = number(
        0.0, low=0.0, high=100.0, unit="% of the width", meaning="height of full white; 0: no normal map"
    )
    sand_relief: Relief = table(Relief, Relief, meaning="How the picture becomes heights.")
    effect_color: Path | None = source(
        None, meaning="colour map over the whole terrain, shown below mix_low_m"
    )
    effect_height: Path | None = source(
        None, meaning="heights of the effect map; without it they come from effect_color"
    )
    effect_strength: float = number(
        1.0, low=0.0, high=100.0, unit="% of the width", meaning="height of full white; 0: no normal map"
    )
    effect_relief: Relief = table(Relief, Relief, meaning="How the picture becomes heights.")
    mix_low_m: float = number(
        0.0, low=-FAR, high=FAR, unit="m", meaning="below this height only the effect map shows"
    )
    mix_high_m: float = number(
        2.0, low=-FAR, high=FAR, unit="m", meaning="above this height only the sand shows"
    )
    specular: float = number(0.05, low=0.0, high=10.0, meaning="intensity of highlights")
    smoothness: float = number(0.2, low=0.0, high=1.0, meaning="0: rough, 1: mirror")
    wet_high_m: float = number(
        0.5, low=0.0, high=FAR, unit="m", meaning="sand is wet up to this height above the water"
    )
    wet_darkness: float = number(0.4, low=0.0, high=1.0, meaning="how much darker wet sand is")
    wet_smoothness: float = number(0.6, low=0.0, high=1.0, meaning="smoothness of wet sand")


@dataclass(frozen=True, kw_only=True)
class Water:
    waves: Path = source(meaning="tileable height map of the waves")
    wave_strength: float = number(
        1.0, low=1e-6, high=100.0, unit="% of the width", meaning="height of full white"
    )
    wave_relief: Relief = table(Relief, Relief, meaning="How the picture becomes heights.")
    level_m: float = number(0.0, low=-FAR, high=FAR, unit="m", meaning="height of the surface")
    size_m: float = number(1000.0, low=1e-3, high=FAR, unit="m", meaning="side of the square of water")
    tile: float = number(40.0, low=1e-3, high=1e5, meaning="how often the waves repeat along it")
    k: float = number(0.02, low=0.0, high=10.0, meaning="strength of refraction")
    scroll: tuple[float, float] = vector(
        (0.01, 0.006),
        size=2,
        low=-10.0,
        high=10.0,
        unit="tiles/s",
        meaning="speed of the waves along x and z",
    )
    strength: float = number(0.02, low=0.0, high=10.0, meaning="how far the du/dv map moves the reflection")
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


@dataclass(frozen=True, kw_only=True)
class ObjectMaterial:
    parallax_scale: float = number(
        0.0,
        low=0.0,
        high=1.0,
        unit="of the texture's width",
        meaning="depth of the height map for parallax; 0: none",
    )
    parallax_bias: float = number(
        0.0, low=-1.0, high=1.0, meaning="added to the depth, so that the surface rises or sinks"
    )
    specular: float = number(0.0, low=0.0, high=10.0, meaning="intensity of highlights; 0: no gloss map")
    smoothness: float = number(0.3, low=0.0, high=1.0, meaning="0: rough, 1: mirror")
    two_sided: bool = flag(False, meaning="draw back faces")
    alpha_cutoff: float = number(0.0, low=0.0, high=1.0, meaning="texels with less alpha are holes; 0: none")


@dataclass(frozen=True, kw_only=True)
class Instance:
    position: Point = point((0.0, 0.0, 0.0), meaning="position of the model's origin")
    yaw_deg: float = number(
        0.0, low=-3600.0, high=3600.0, unit="degrees", meaning="turn about the vertical axis"
    )
    scale: float = number(1.0, low=1e-6, high=1e6, meaning="size")


VIEWS = ("camera", "shadow", "reflection", "refraction")


@dataclass(frozen=True, kw_only=True)
class SceneObject:
    name: str = identifier(meaning="names the object's artifacts")
    mesh: Path = source(meaning="OBJ file")
    color: Path | None = source(
        None, meaning="colour map; without it the map_Kd that all its materials share"
    )
    alpha: Path | None = source(None, meaning="grey picture of the alpha; without it the alpha of color")
    lods: int = whole(4, low=1, high=8, meaning="number of levels of detail, the source included")
    max_error: float | None = number(
        None,
        low=0.0,
        high=1.0,
        unit="of the diagonal",
        meaning="largest error of a level; without it 0.1, or the largest of lod_errors",
    )

    lods_by: str = choice(
        "ratio",
        among=("ratio", "error", "sight"),
        meaning="levels by share of triangles, by error, or by what the flight can see",
    )
    lod_ratio: float = number(
        0.5, low=0.05, high=0.95, meaning="triangles of a level, as a share of the level before"
    )
    lod_errors: tuple[float, ...] = numbers(
        (),
        low=0.0,
        high=1.0,
        unit="of the diagonal",
        meaning='error of each level after the first, with lods_by = "error"',
    )
    simplifier: str = choice("paradize", among=SIMPLIFIERS, meaning="library that makes the levels")
    unwrapper: str = choice(
        "paradize", among=UNWRAPPERS, meaning="library that makes UVs for a mesh without them"
    )
    weld_m: float = number(
        0.0, low=0.0, high=FAR, unit="m", meaning="vertices closer than this are joined; 0: none"
    )
    crease_deg: float = number(
        45.0,
        low=0.0,
        high=180.0,
        unit="degrees",
        meaning="where normals are missing, faces at a larger angle meet in a sharp edge",
    )
    tangents: str = choice(
        "mikktspace",
        among=("face", "vertex", "mikktspace"),
        meaning="how tangent frames are made; face is the same as vertex",
    )
    quantise: bool = flag(False, meaning="16-bit vertices; the budget limits their error")
    views: tuple[str, ...] = choices(
        VIEWS, among=VIEWS, meaning="views that draw the object, if the scene has them"
    )
    wrap: str = choice("clamp", among=("clamp", "repeat"), meaning="whether its maps repeat")
    strength: float = number(
        1.0,
        low=0.0,
        high=100.0,
        unit="% of the width",
        meaning="height of full white of the bumps made from the colour; 0: no normal map",
    )
    bleed: float = number(
        0.125,
        low=0.0,
        high=1.0,
        unit="of the range",
        meaning="how much neighbours in the UV layout may bleed into a sample",
    )
    relief: Relief = table(Relief, Relief, meaning="How the picture becomes heights.")
    gloss_groups: tuple[str, ...] = texts((), meaning="groups or materials that shine; empty: all")
    materials: dict[str, ObjectMaterial] = named_tables(
        ObjectMaterial, key="material", meaning="A material of the OBJ, by its name."
    )
    instances: tuple[Instance, ...] = tables(
        Instance, least=1, key="instance", meaning="Where the object stands. One table for each copy."
    )


@dataclass(frozen=True, kw_only=True)
class Particles:
    name: str = identifier(meaning="names the cloud")
    center: Point = point(meaning="middle of the cloud")
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
        meaning="slowest and fastest loss of life",
    )
    threshold: float = number(
        0.02, low=0.0, high=1.0, meaning="below this life a particle is born again elsewhere"
    )
    color: tuple[float, float, float] = vector(
        (1.0, 0.95, 0.8), size=3, low=0.0, high=1e4, meaning="linear RGB"
    )


@dataclass(frozen=True, kw_only=True)
class Sound:
    file: Path = source(meaning="Ogg Vorbis file, played in a loop")
    volume: float = number(1.0, low=0.0, high=1.0, meaning="1: as recorded")


@dataclass(frozen=True, kw_only=True)
class EyePoint:
    position: Point = point(meaning="position of the camera")
    speed: float = number(1.0, low=0.05, high=20.0, unit="of the mean speed", meaning="speed here")
    roll_deg: float = number(0.0, low=-180.0, high=180.0, unit="degrees", meaning="roll of the camera here")


@dataclass(frozen=True, kw_only=True)
class TargetPoint:
    position: Point = point(meaning="point that the camera looks at")


@dataclass(frozen=True, kw_only=True)
class Flight:
    duration_s: float = number(
        240.0, low=0.1, high=86_400.0, unit="s", meaning="length of the flight, which is a loop"
    )
    fov_deg: float = number(50.0, low=1.0, high=170.0, unit="degrees", meaning="vertical field of view")
    near_m: float = number(0.1, low=1e-4, high=FAR, unit="m", meaning="near plane")
    far_m: float = number(2000.0, low=1e-3, high=10 * FAR, unit="m", meaning="far plane")
    eye: tuple[EyePoint, ...] = tables(
        EyePoint, least=3, most=1000, meaning="A waypoint of the camera. Three or more."
    )
    target: tuple[TargetPoint, ...] = tables(
        TargetPoint, least=3, most=1000, meaning="What the camera looks at at that waypoint."
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
class FreeCamera:
    """The box of the world in which a steered camera may move, and its least distance to any surface."""

    low: Point = point(meaning="lowest corner of the box in which a steered camera may move")
    high: Point = point(meaning="highest corner of the box")
    near_m: float = number(1.0, low=1e-4, high=FAR, unit="m", meaning="least distance to any surface")


@dataclass(frozen=True, kw_only=True)
class Scene:
    head: Head = table(Head, key="scene", meaning="General settings.")
    sun: Sun = table(Sun, Sun, meaning="The sun, which casts the shadows.")
    ambient: Ambient = table(Ambient, Ambient, meaning="Light from all sides.")
    fog: Fog = table(Fog, Fog, meaning="Fog. By default there is none.")
    sky: Sky | None = table(Sky, None, meaning="The sky, a cube map.")
    shadow: Shadow | None = table(
        Shadow, None, meaning="Shadows of the sun. Without this table there are none."
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
    particles: tuple[Particles, ...] = tables(Particles, meaning="A cloud of glittering particles.")
    sound: Sound | None = table(Sound, None, meaning="A looped sound.")
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


def _cross_checks(scene: Scene, faults: Faults) -> None:
    """Adds the faults that concern more than one field."""
    first: dict[str, int] = {}
    for i, item in enumerate(scene.objects):
        name = item.name
        if first.setdefault(name, i) != i:
            faults.add(f"object[{i}].name", f"{name!r} is already object[{first[name]}]", "rename one")
        if name in {"terrain", "sand", "effect", "water", "sky", "sound"}:
            faults.add(f"object[{i}].name", f"{name!r} names the scene's own artifacts", "rename it")
        if (item.lods_by == "error") != bool(item.lod_errors):
            mend = 'write lod_errors with lods_by = "error", and only there'
            faults.add(f"object[{i}].lod_errors", f"has {len(item.lod_errors)} numbers", mend)
        if not any(view == "camera" or getattr(scene, view) for view in item.views):
            mend = f"the scene has no [{item.views[0]}]; name camera, or a view that there is"
            faults.add(f"object[{i}].views", "draws it nowhere", mend)
    for k, (size, largest) in enumerate(zip(scene.head.viewport, scene.head.largest, strict=True)):
        if largest < size:
            mend = f"must not be below viewport[{k}] = {size}"
            faults.add(f"scene.largest_viewport[{k}]", f"is {largest}", mend)
    region = scene.free_camera
    for k in range(3 if region else 0):
        if region and region.low[k] > region.high[k]:
            mend = f"must not be above free_camera.high[{k}] = {region.high[k]:g}"
            faults.add(f"free_camera.low[{k}]", f"is {region.low[k]:g}", mend)
    sparkles: dict[str, int] = {}
    for i, cloud in enumerate(scene.particles):
        if sparkles.setdefault(cloud.name, i) != i:
            what = f"{cloud.name!r} is already particles[{sparkles[cloud.name]}]"
            faults.add(f"particles[{i}].name", what, "rename one")
    flight = scene.flight
    if len(flight.eye) != len(flight.target):
        counts = f"{len(flight.target)} target waypoints for {len(flight.eye)} eye waypoints"
        faults.add("flight.target", counts, "write one target for each eye waypoint")
    for i, waypoint in enumerate(flight.eye):
        after = (i + 1) % len(flight.eye)
        if waypoint.position == flight.eye[after].position:
            faults.add(
                f"flight.eye[{after}].position",
                f"is the same place as flight.eye[{i}]",
                "the camera cannot fly a path of no length; move one or take one out",
            )
    if flight.near_m >= flight.far_m:
        faults.add("flight.near_m", f"is {flight.near_m:g}", f"must be below far_m = {flight.far_m:g}")
    if scene.head.poster_s > flight.duration_s:
        mend = f"the flight lasts {flight.duration_s:g} s"
        faults.add("scene.poster_s", f"is {scene.head.poster_s:g}", mend)
    if scene.terrain and scene.terrain.mix_low_m > scene.terrain.mix_high_m:
        mend = f"must not be above mix_high_m = {scene.terrain.mix_high_m:g}"
        faults.add("terrain.mix_low_m", f"is {scene.terrain.mix_low_m:g}", mend)


def load_scene(path: Path) -> Scene:
    """Reads and checks a scene TOML; its source files must exist.

    Raises SceneError for one fault, GroupedError for several.
    """
    with expecting(SCENE, path):
        tree = _read_toml(path)
    faults = Faults(path)
    scene = read_table(Scene, tree, "", faults)
    if scene is not None:
        _cross_checks(scene, faults)
    faults.raise_if_any()
    assert scene is not None
    return scene


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        data = read_file(path, TOML_BYTES)
    except FileNotFoundError:
        raise SceneError("there is no such file", file=path) from None
    except OSError as error:
        raise SceneError(error.strerror or str(error), file=path) from None
    mend = "mend that line; `paradize new DIR` makes a scene to start from"
    tree = parse_toml(data, path, SceneError, mend=mend)
    if not tree:
        mend = "`paradize new DIR` makes a scene to start from"
        raise SceneError("holds no settings", file=path, mend=mend)
    return tree

# ruff: noqa: RUF009 (the calls in the dataclasses make their fields)
"""The scene: one TOML file -> frozen settings, each field with its default, unit and allowed range.

Axes: right-handed, Y up, metres. Angles are degrees in the file (`_deg`). Colours are linear RGB. Azimuth
turns clockwise seen from above, from north (-Z, row 0 of the heightmap) to east (+X): 0 = -Z, 90 = +X. Its
files lie beside the TOML or in folders below it. Knows no numpy: a bake with nothing to do stays fast.

Limits of the file itself: 4 MiB (documents.TOML_BYTES), keys of 16 parts (a.b.c has three), 64 tables and
lists inside one another, whole numbers of 64 bits, 10,000 tables in an array where nothing else is said;
after 100 faults (schema.MOST_FAULTS) the rest is not looked at.
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
    place,
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

FAR = 1e6  # metres: no length of a scene is larger
Place = tuple[float, float, float]
TIERS = ("fast", "balanced", "exact", "auto")  # the cheapest first; auto picks one of the others
SEVERITIES = ("error", "warning", "off")  # of a rule of `paradize check`

SIMPLIFIERS = ("paradize", "meshoptimizer", "fast-simplification", "openmesh")  # stages/lod.py
UNWRAPPERS = ("paradize", "xatlas")  # stages/unwrappers.py

# The derivative filters of normal maps that a user may name; "auto" looks at the heights and picks one of
# those in stages/filters.py.
FILTERS = ("auto", "central", "scharr", "fourth", "eighth")


@dataclass(frozen=True, kw_only=True)
class Head:
    name: str = identifier()
    exposure: float = number(1.0, low=1e-6, high=1e6)
    viewport: tuple[int, int] = vector((1280, 720), size=2, low=16, high=16384, unit="pixels", integers=True)
    # The largest picture that is ever drawn of it; what is baked is as fine as that needs. Else the viewport.
    largest_viewport: tuple[int, int] | None = vector(
        None, size=2, low=16, high=16384, unit="pixels", integers=True
    )
    lod_error_px: float = number(1.0, low=0.01, high=100.0, unit="pixels")
    tier: str = choice("balanced", among=TIERS)  # where the command line names none
    poster_s: float = number(0.0, low=0.0, high=86_400.0, unit="s")
    zstd: bool = flag(False)  # textures as Zstandard frames: smaller files, inflated while they load

    @property
    def largest(self) -> tuple[int, int]:
        """The largest picture, pixels."""
        return self.largest_viewport or self.viewport


@dataclass(frozen=True, kw_only=True)
class Sun:
    azimuth_deg: float = number(200.0, low=-360.0, high=360.0, unit="degrees")
    elevation_deg: float = number(35.0, low=-90.0, high=90.0, unit="degrees")
    color: tuple[float, float, float] = vector((1.0, 0.9, 0.75), size=3, low=0.0, high=100.0)
    intensity: float = number(3.0, low=0.0, high=1e6)
    angular_diameter_deg: float = number(0.53, low=0.0, high=30.0, unit="degrees")


@dataclass(frozen=True, kw_only=True)
class Ambient:
    color: tuple[float, float, float] = vector((0.55, 0.7, 1.0), size=3, low=0.0, high=100.0)
    intensity: float = number(0.5, low=0.0, high=1e6)


@dataclass(frozen=True, kw_only=True)
class Fog:
    color: tuple[float, float, float] = vector((0.75, 0.85, 0.95), size=3, low=0.0, high=1e4)
    density_per_m: float = number(0.0, low=0.0, high=100.0, unit="1/m")


@dataclass(frozen=True, kw_only=True)
class Sky:
    faces: tuple[Path, ...] = sources(size=6)  # +X -X +Y -Y +Z -Z


@dataclass(frozen=True, kw_only=True)
class Shadow:
    size: int = whole(2048, low=16, high=16384, unit="texels")
    extent_m: float = number(100.0, low=1e-3, high=FAR, unit="m")  # side of the square that the light sees
    center: Place = place((0.0, 0.0, 0.0))
    blur_distance_m: float = number(50.0, low=0.0, high=FAR, unit="m")


@dataclass(frozen=True, kw_only=True)
class View:
    """A view rendered into a texture; its resolution as a share of the window's."""

    scale: float = number(0.5, low=1 / 16, high=2.0)


@dataclass(frozen=True, kw_only=True)
class Relief:
    """How a picture becomes heights, and heights slopes. Levels apply in this order, to 0..1."""

    black: float = number(0.0, low=-1e6, high=1e6)  # what becomes 0
    white: float = number(1.0, low=-1e6, high=1e6)  # what becomes 1; another number than black
    gamma: float = number(1.0, low=1e-3, high=1e6)  # above 1 lifts the middle
    contrast: float = number(1.0, low=-1e6, high=1e6)  # about one half
    brightness: float = number(0.0, low=-1e6, high=1e6)  # added
    invert: bool = flag(False)
    filter: str = choice("auto", among=FILTERS)  # the derivative filter
    destep: bool = flag(False)  # smooth the steps of an 8-bit picture, within half a step


@dataclass(frozen=True, kw_only=True)
class Terrain:
    heightmap: Path = source()
    size_m: tuple[float, float] = vector(size=2, low=1e-6, high=FAR, unit="m")  # x, z: first to last pixel
    # White lies this far above black; floats, signed integers and .hgt are metres and need none.
    height_m: float | None = number(None, low=-FAR, high=FAR, unit="m")
    height_scale: float = number(1.0, low=-FAR, high=FAR)  # what heights are multiplied by, of metres too
    nodata: float | str = number_or(("auto", "none"), low=-1e39, high=1e39)  # means no height
    base_m: float = number(0.0, low=-FAR, high=FAR, unit="m")  # y of black
    max_error_m: float = number(0.03, low=0.0, high=FAR, unit="m")  # 0: every pixel becomes a vertex
    patch_px: int = whole(128, low=8, high=256, unit="pixels")  # side of the finest cells of the tree
    quantise: bool = flag(False)  # vertices as 16-bit codes of one lattice, inside max_error_m
    tile_mb: float = number(64.0, low=0.01, high=64.0, unit="MB")  # what a file of patches may hold
    sand_color: Path = source()
    sand_repeat: float = number(1.0, low=1e-3, high=1e5)  # nb: how often the sand lies along X
    sand_height: Path | None = source(None)
    sand_strength: float = number(0.0, low=0.0, high=100.0, unit="% of the width")  # 0: no sand normal map
    sand_relief: Relief = table(Relief, Relief)
    effect_color: Path | None = source(None)
    effect_height: Path | None = source(None)  # else the effect map's normals come from its colour
    effect_strength: float = number(1.0, low=0.0, high=100.0, unit="% of the width")
    effect_relief: Relief = table(Relief, Relief)
    mix_low_m: float = number(0.0, low=-FAR, high=FAR, unit="m")  # below: effect only
    mix_high_m: float = number(2.0, low=-FAR, high=FAR, unit="m")  # above: sand only
    specular: float = number(0.05, low=0.0, high=10.0)
    smoothness: float = number(0.2, low=0.0, high=1.0)
    wet_high_m: float = number(0.5, low=0.0, high=FAR, unit="m")  # sand is wet up to here above the water
    wet_darkness: float = number(0.4, low=0.0, high=1.0)
    wet_smoothness: float = number(0.6, low=0.0, high=1.0)


@dataclass(frozen=True, kw_only=True)
class Water:
    waves: Path = source()  # a tileable height map
    wave_strength: float = number(1.0, low=1e-6, high=100.0, unit="% of the width")
    wave_relief: Relief = table(Relief, Relief)
    level_m: float = number(0.0, low=-FAR, high=FAR, unit="m")
    size_m: float = number(1000.0, low=1e-3, high=FAR, unit="m")  # side of the square of water
    tile: float = number(40.0, low=1e-3, high=1e5)  # how often the waves lie along it
    k: float = number(0.02, low=0.0, high=10.0)  # refraction strength
    scroll: tuple[float, float] = vector((0.01, 0.006), size=2, low=-10.0, high=10.0, unit="tiles/s")
    strength: float = number(0.02, low=0.0, high=10.0)  # how far the du/dv map shakes the reflection
    deep_color: tuple[float, float, float] = vector((0.003, 0.045, 0.107), size=3, low=0.0, high=100.0)
    shallow_color: tuple[float, float, float] = vector((0.05, 0.533, 0.527), size=3, low=0.0, high=100.0)
    absorption_per_m: tuple[float, float, float] = vector(
        (0.4, 0.08, 0.06), size=3, low=0.0, high=1e4, unit="1/m"
    )
    specular: float = number(1.0, low=0.0, high=10.0)
    smoothness: float = number(0.95, low=0.0, high=1.0)


@dataclass(frozen=True, kw_only=True)
class ObjectMaterial:
    parallax_scale: float = number(0.0, low=0.0, high=1.0, unit="of the texture's width")
    parallax_bias: float = number(0.0, low=-1.0, high=1.0)
    specular: float = number(0.0, low=0.0, high=10.0)
    smoothness: float = number(0.3, low=0.0, high=1.0)
    two_sided: bool = flag(False)
    alpha_cutoff: float = number(0.0, low=0.0, high=1.0)


@dataclass(frozen=True, kw_only=True)
class Instance:
    position: Place = place((0.0, 0.0, 0.0))
    yaw_deg: float = number(0.0, low=-3600.0, high=3600.0, unit="degrees")
    scale: float = number(1.0, low=1e-6, high=1e6)


VIEWS = ("camera", "shadow", "reflection", "refraction")  # what a scene's pictures are drawn of


@dataclass(frozen=True, kw_only=True)
class SceneObject:
    name: str = identifier()
    mesh: Path = source()
    color: Path | None = source(None)  # else the map_Kd that all of the MTL's materials share
    alpha: Path | None = source(None)  # else the colour map's own alpha
    lods: int = whole(4, low=1, high=8)
    max_error: float | None = number(None, low=0.0, high=1.0, unit="of the diagonal")
    # Levels by a share of the triangles, by the error of each, or by what the flight can see of them.
    lods_by: str = choice("ratio", among=("ratio", "error", "sight"))
    lod_ratio: float = number(0.5, low=0.05, high=0.95)  # triangles of a level, of those of the one before
    lod_errors: tuple[float, ...] = numbers((), low=0.0, high=1.0, unit="of the diagonal")  # by error; rising
    simplifier: str = choice("paradize", among=SIMPLIFIERS)  # what makes the levels
    unwrapper: str = choice("paradize", among=UNWRAPPERS)  # what makes a UV layout where the mesh has none
    weld_m: float = number(0.0, low=0.0, high=FAR, unit="m")  # places this near are joined; 0: none
    crease_deg: float = number(45.0, low=0.0, high=180.0, unit="degrees")  # where normals are missing
    tangents: str = choice("mikktspace", among=("face", "vertex", "mikktspace"))  # face is vertex
    quantise: bool = flag(False)  # vertices as 16-bit codes; the budget says how far they may turn normals
    views: tuple[str, ...] = choices(VIEWS, among=VIEWS)  # those that draw it, of those that the scene has
    wrap: str = choice("clamp", among=("clamp", "repeat"))
    strength: float = number(
        1.0, low=0.0, high=100.0, unit="% of the width"
    )  # bumps from the colour; 0: none
    bleed: float = number(0.125, low=0.0, high=1.0, unit="of the range")  # what neighbours in the map may add
    relief: Relief = table(Relief, Relief)
    gloss_groups: tuple[str, ...] = texts(())  # only these groups or materials shine; empty: all that do
    materials: dict[str, ObjectMaterial] = named_tables(ObjectMaterial, key="material")
    instances: tuple[Instance, ...] = tables(Instance, least=1, key="instance")


@dataclass(frozen=True, kw_only=True)
class Particles:
    name: str = identifier()
    center: Place = place()
    radius_m: float = number(3.0, low=0.0, high=FAR, unit="m")
    count: int = whole(200, low=1, high=1_000_000)
    size_m: tuple[float, float] = vector((0.01, 0.03), size=2, low=1e-6, high=1e3, unit="m", rising=True)
    life_per_s: tuple[float, float] = vector((0.2, 0.6), size=2, low=1e-4, high=1e3, unit="1/s", rising=True)
    threshold: float = number(0.02, low=0.0, high=1.0)  # reborn elsewhere when its life is below
    color: tuple[float, float, float] = vector((1.0, 0.95, 0.8), size=3, low=0.0, high=1e4)


@dataclass(frozen=True, kw_only=True)
class Sound:
    file: Path = source()
    volume: float = number(1.0, low=0.0, high=1.0)


@dataclass(frozen=True, kw_only=True)
class EyePoint:
    position: Place = place()
    speed: float = number(1.0, low=0.05, high=20.0, unit="of the mean speed")
    roll_deg: float = number(0.0, low=-180.0, high=180.0, unit="degrees")


@dataclass(frozen=True, kw_only=True)
class TargetPoint:
    position: Place = place()


@dataclass(frozen=True, kw_only=True)
class Flight:
    duration_s: float = number(240.0, low=0.1, high=86_400.0, unit="s")
    fov_deg: float = number(50.0, low=1.0, high=170.0, unit="degrees")  # vertical
    near_m: float = number(0.1, low=1e-4, high=FAR, unit="m")
    far_m: float = number(2000.0, low=1e-3, high=10 * FAR, unit="m")
    eye: tuple[EyePoint, ...] = tables(EyePoint, least=3, most=1000)
    target: tuple[TargetPoint, ...] = tables(TargetPoint, least=3, most=1000)


@dataclass(frozen=True, kw_only=True)
class Waiver:
    """A finding of `paradize check` that does not fail it, up to that day. None: any artifact, any metric."""

    rule: str = code()
    artifact: str | None = text(None)
    metric: str | None = one_of(None, known=METRICS)
    reason: str = text()
    until: date = day()


@dataclass(frozen=True, kw_only=True)
class FreeCamera:
    """Where a steered camera may be: a box of the world, and how near it comes to any surface there."""

    low: Place = place()
    high: Place = place()
    near_m: float = number(1.0, low=1e-4, high=FAR, unit="m")


@dataclass(frozen=True, kw_only=True)
class Scene:
    head: Head = table(Head, key="scene")
    sun: Sun = table(Sun, Sun)
    ambient: Ambient = table(Ambient, Ambient)
    fog: Fog = table(Fog, Fog)
    sky: Sky | None = table(Sky, None)
    shadow: Shadow | None = table(Shadow, None)
    reflection: View | None = table(View, None)
    refraction: View | None = table(View, None)
    terrain: Terrain | None = table(Terrain, None)
    water: Water | None = table(Water, None)
    objects: tuple[SceneObject, ...] = tables(SceneObject, key="object")
    particles: tuple[Particles, ...] = tables(Particles)
    sound: Sound | None = table(Sound, None)
    flight: Flight = table(Flight)
    free_camera: FreeCamera | None = table(FreeCamera, None)
    budget: Limits = limits(METRICS)
    check: dict[str, str] = words(SEVERITIES)  # by a rule's code
    waivers: tuple[Waiver, ...] = tables(Waiver, key="waiver")


def _cross_checks(scene: Scene, faults: Faults) -> None:
    """What no single field can see."""
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
    for i, point in enumerate(flight.eye):
        after = (i + 1) % len(flight.eye)
        if point.position == flight.eye[after].position:
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
    """Reads and checks a scene TOML, sources beside it included.

    Raises SceneError, or GroupedError when more than one thing is wrong: every fault is told.
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

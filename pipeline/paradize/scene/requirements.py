"""Lists the artifacts that a scene requires, and for each the render passes that read it.

An artifact that no pass reads is not listed, so it is not baked: without water there is no du/dv map, without
parallax no height map, without highlights no gloss map. Does not import numpy.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from paradize.maps import DERIVED
from paradize.scene.baker_settings import (
    ColorSettings,
    CubemapSettings,
    MapSettings,
    MeshSettings,
    TileSettings,
)
from paradize.scene.flight import Flight, Vec, sightings_of, sine_cosine
from paradize.scene.placement import to_world
from paradize.scene.settings import VIEWS, Scene, SceneObject, Terrain, Water

# A bake provides what the player's finest quality reads (player/scene/quality.cpp; a test compares them):
# FINEST_LOD times lod_error_px, reflection and refraction at least FINEST_SCALE times the camera's picture, a
# shadow map FINEST_SHADOW times as wide.
FINEST_LOD, FINEST_SCALE, FINEST_SHADOW = 0.25, 1.0, 2
COARSEST_LOD = 3.0  # the player's coarsest quality: COARSEST_LOD times lod_error_px


@dataclass(frozen=True)
class Output:
    """One artifact of a job.

    artifact: its name. kind: as in scene.json; empty: it is not published. product: which of the job's
    products it is. reason: why it is required. passes: the player's render passes that read it; none: it is
    heard. many: the products <product>_1, <product>_2 ... belong to it too, as artifacts <artifact>_1 ...
    """

    artifact: str
    kind: str
    product: str
    reason: str
    passes: tuple[str, ...] = ()
    many: bool = False

    def expand(self, products: Container[str]) -> list[Output]:
        """Returns this output, and with `many` one for each numbered product that there is."""
        outputs = [self]
        while self.many and f"{self.product}_{len(outputs)}" in products:
            suffix = f"_{len(outputs)}"
            outputs.append(replace(self, artifact=self.artifact + suffix, product=self.product + suffix))
        return outputs


@dataclass(frozen=True)
class BakeJob:
    """A job that bakes some artifacts. baker: its name in the job registry (bakers/registry.py). sources:
    files by role. settings: as JSON. outputs: the artifacts."""

    name: str
    baker: str
    sources: dict[str, Path]
    settings: dict[str, Any]
    outputs: tuple[Output, ...]


@dataclass
class Requirements:
    """The jobs of a scene, in a fixed order."""

    jobs: list[BakeJob] = field(default_factory=list)

    def add(
        self, name: str, baker: str, sources: dict[str, Path], outputs: Sequence[Output], **settings: Any
    ) -> None:
        """Adds a job, unless it has no outputs."""
        if outputs:
            self.jobs.append(BakeJob(name, baker, sources, settings, tuple(outputs)))


@dataclass(frozen=True)
class MaterialColors:
    """Where an object's colour comes from: its colour map, or linear RGB by material name."""

    color_map: Path | None = None
    base_colors: dict[str, tuple[float, float, float]] = field(default_factory=dict)


def require(scene: Scene, colors: dict[str, MaterialColors]) -> Requirements:
    """Returns the jobs of a scene. colors: by object name."""
    required = Requirements()
    if scene.sky:
        faces = {f"face{i}": path for i, path in enumerate(scene.sky.faces)}
        readers = ("sky", *(name for name in ("terrain", "objects", "water") if getattr(scene, name)))
        output = Output(
            "sky",
            "cubemap",
            "sky",
            _all("the sky", *(["the water's mirror"] if scene.water else [])),
            readers,
        )
        required.add("sky", "cubemap", faces, [output], **asdict(CubemapSettings()))
    views = tuple(name for name in VIEWS if name == "camera" or getattr(scene, name))
    if scene.terrain:
        _terrain(required, scene.terrain, views[1:], scene_views(scene))
    if scene.water:
        _water(required, scene.water)
    quantise_limits = {
        metric: limit for metric, limit in scene.budget.hard.items() if metric.startswith("quantise_")
    }
    for item in scene.objects:
        path = _camera_views(scene) if item.lods_by == "sight" else None
        own = tuple(view for view in views if view in item.views)
        _object(required, item, colors[item.name], own, path, quantise_limits)
    if scene.sound:
        output = Output("sound", "sound", "sound", "the sound of the scene")
        required.add("sound", "sound", {"file": scene.sound.file}, [output])
    return required


def _color(
    required: Requirements,
    name: str,
    sources: dict[str, Path],
    wrap: str,
    reason: str,
    passes: tuple[str, ...],
    alpha_cutoff: float = 0.5,
) -> None:
    output = Output(f"{name}_color", "texture", "color", reason, passes)
    settings = ColorSettings(wrap=wrap, alpha_cutoff=alpha_cutoff)
    required.add(f"{name} colour", "color", sources, [output], **asdict(settings))


def _all(*what: str) -> str:
    """Joins texts as a list in English: one, two and three."""
    return " and ".join(part for part in (", ".join(what[:-1]), what[-1]) if part)


def _drawn(what: str, views: tuple[str, ...]) -> str:
    """Describes what these views draw of `what`."""
    by_view = {"camera": what, "shadow": "its shadow", "reflection": "its mirror image"}
    parts = [text for view, text in by_view.items() if view in views] or [
        "what is seen of it through the water"
    ]
    return _all(*parts) if "camera" in views else f"{what}: {_all(*parts)}"


def _terrain(required: Requirements, terrain: Terrain, views: tuple[str, ...], sight: dict[str, Any]) -> None:
    readers = ("terrain",)
    relief = terrain.effect_height or terrain.effect_color
    bumps = terrain.sand_strength > 0.0 or (relief is not None and terrain.effect_strength > 0.0)
    reason = _drawn("the terrain", ("camera", *views))
    required.add(
        "terrain",
        "terrain",
        {"heightmap": terrain.heightmap},
        [
            Output("terrain_mesh", "mesh", "mesh", reason, ("terrain", *views), many=True),
            Output("terrain_tree", "", "tree", "which parts of the terrain stand for which"),
        ],
        **asdict(
            TileSettings.of(
                terrain,
                tangents=bumps,
                sight=sight,
            )
        ),
    )
    _color(required, "sand", {"image": terrain.sand_color}, "repeat", "the terrain's sand pattern", readers)
    if terrain.sand_strength > 0.0:
        required.add(
            "sand maps",
            "maps",
            {"image": terrain.sand_height or terrain.sand_color},
            [Output("sand_normal", "texture", "normal", "the sand's grain in the light", readers)],
            **asdict(
                MapSettings.of(
                    terrain.sand_relief,
                    only=["normal"],
                    source="height" if terrain.sand_height else "color",
                    strength=terrain.sand_strength,
                    wrap="repeat",
                )
            ),
        )
    if terrain.effect_color:
        _color(
            required, "effect", {"image": terrain.effect_color}, "clamp", "the terrain's effect map", readers
        )
    if relief and terrain.effect_strength > 0.0:
        required.add(
            "effect maps",
            "maps",
            {"image": relief},
            [
                Output(
                    "effect_normal", "texture", "normal", "ripples, shells and starfish in the light", readers
                )
            ],
            **asdict(
                MapSettings.of(
                    terrain.effect_relief,
                    only=["normal"],
                    source="height" if terrain.effect_height else "color",
                    strength=terrain.effect_strength,
                    size_m=list(terrain.size_m),
                )
            ),
        )


def _water(required: Requirements, water: Water) -> None:
    required.add(
        "water maps",
        "maps",
        {"image": water.waves},
        [
            Output("water_normal", "texture", "normal", "the light on the waves", ("water",)),
            Output(
                "water_dudv", "texture", "dudv", "the waves that shake reflection and refraction", ("water",)
            ),
        ],
        **asdict(
            MapSettings.of(
                water.wave_relief,
                only=["normal", "dudv"],
                source="height",
                strength=water.wave_strength,
                wrap="repeat",
            )
        ),
    )


def _camera_views(scene: Scene) -> dict[str, Any]:
    """Returns the settings from which lods_from_path.py derives the nearest and farthest view of an
    object. error_px: the error that the player's finest quality accepts. far_error_px: the error that the
    scene accepts; it limits the coarsest levels."""
    return {
        "flight": asdict(scene.flight),
        "viewport": list(scene.head.largest),
        "error_px": FINEST_LOD * scene.head.lod_error_px,
        "far_error_px": scene.head.lod_error_px,
    }


def finest_scales(scene: Scene) -> dict[str, float]:
    """Returns the size of reflection and refraction as a share of the camera's picture, by view, in the
    player's finest quality."""
    views = {"reflection": scene.reflection, "refraction": scene.refraction}
    return {name: max(view.scale, FINEST_SCALE) for name, view in views.items() if view}


def finest_shadow_texel_m(scene: Scene) -> float | None:
    """Returns the width of a shadow map texel in the player's finest quality, metres; None without
    shadows."""
    return scene.shadow.extent_m / (FINEST_SHADOW * scene.shadow.size) if scene.shadow else None


def scene_views(scene: Scene) -> dict[str, Any]:
    """Returns the settings of the visibility query (visibility/query.py): all views of the flight and of
    the free camera."""
    level_m = scene.water.level_m if scene.water else 0.0
    views: dict[str, Any] = _camera_views(scene)
    return views | {
        "mirror_m": level_m if scene.reflection else None,
        "water_m": level_m if scene.water and scene.refraction else None,
        "shadow": {"extent_m": scene.shadow.extent_m, "center": list(scene.shadow.center)}
        if scene.shadow
        else None,
        "sun": sun_direction(scene.sun.azimuth_deg, scene.sun.elevation_deg),
        **({"region": asdict(scene.free_camera)} if scene.free_camera else {}),
    }


def sun_direction(azimuth_deg: float, elevation_deg: float) -> list[float]:
    """Returns the unit vector from the ground to the sun. azimuth_deg: from -Z towards +X."""
    sin_a, cos_a = sine_cosine(azimuth_deg)
    sin_e, cos_e = sine_cosine(elevation_deg)
    return [sin_a * cos_e, sin_e, -cos_a * cos_e]


def player_inputs(item: SceneObject, views: Sequence[str], painted: bool) -> dict[str, str]:
    """Returns what the player reads of an object in these views, and why: the attributes of its mesh (by glTF
    name) and its maps. painted: it has a colour map.

    The shadow view writes depth only: it reads positions, and the colour's alpha for materials with an alpha
    cutoff. Every other view shades. Normal maps and parallax need tangents; nothing else does.
    """
    name = item.name
    shaded = any(view != "shadow" for view in views)
    leaves = any(material.alpha_cutoff > 0.0 for material in item.materials.values())
    inputs = {"POSITION": _drawn(f"the object {name}", tuple(views))}
    if shaded:
        inputs["NORMAL"] = f"the light on {name}"
    if painted and (shaded or leaves):
        inputs["color"] = f"the object {name}" if shaded else f"the shape of {name}'s shadow"
    if painted and shaded:
        if item.strength > 0.0:
            inputs["normal"] = f"bumps on {name}"
        deep = [key for key, material in item.materials.items() if material.parallax_scale != 0.0]
        if deep:
            inputs["height"] = f"parallax of {name}'s {', '.join(deep)}"
        shiny = [key for key, material in item.materials.items() if material.specular > 0.0]
        if shiny:
            inputs["gloss"] = f"highlights on {name}'s {', '.join(shiny)}"
    if "normal" in inputs or "height" in inputs:
        inputs["TANGENT"] = "the frame of bumps and parallax"
    if "color" in inputs:
        inputs["TEXCOORD_0"] = f"where {name}'s maps lie"
    return inputs


def _object(
    required: Requirements,
    item: SceneObject,
    colors: MaterialColors,
    views: tuple[str, ...],
    sight: dict[str, Any] | None,
    quantise_limits: dict[str, float],
) -> None:
    name = item.name
    drawn = ("objects", *views[1:]) if "camera" in views else views
    shaded = tuple(name for name in drawn if name != "shadow")
    layout = {"layout": item.mesh} if item.wrap == "clamp" else {}
    inputs = player_inputs(item, views, colors.color_map is not None)
    required.add(
        f"{name} mesh",
        "mesh",
        {"mesh": item.mesh},
        [Output(f"{name}_mesh", "mesh", "mesh", inputs["POSITION"], drawn)],
        **asdict(
            MeshSettings.of(
                item,
                attributes=[key for key in inputs if key.isupper()],
                quantise=quantise_limits if item.quantise else None,
                sight=sight,
                instances=[asdict(instance) for instance in item.instances] if sight else [],
                atlas=colors.color_map is not None,  # a map needs a UV layout
                painted=True,  # overlapping UVs are the author's choice: the maps are painted for them
                base_colors={material: list(color) for material, color in colors.base_colors.items()},
            )
        ),
    )
    if colors.color_map is None or "color" not in inputs:
        return
    alpha = {"alpha": item.alpha} if item.alpha else {}
    cutoffs = [material.alpha_cutoff for material in item.materials.values() if material.alpha_cutoff > 0.0]
    sources = {"image": colors.color_map, **alpha, **layout}
    _color(required, name, sources, item.wrap, inputs["color"], drawn, min(cutoffs, default=0.5))
    maps = [Output(f"{name}_{key}", "texture", key, inputs[key], shaded) for key in DERIVED if key in inputs]
    required.add(
        f"{name} maps",
        "maps",
        {"image": colors.color_map, **layout},
        maps,
        **asdict(
            MapSettings.of(
                item.relief,
                only=[output.product for output in maps],
                source="color",
                strength=item.strength,
                wrap=item.wrap,
                gloss_groups=list(item.gloss_groups) if layout else [],
            )
        ),
    )


@dataclass(frozen=True)
class ObjectSighting:
    """How the flight sees an object, over all its instances. first_s: when it first comes into view,
    seconds; the end of the flight if it never does. pixel_m: metres of the object that the largest pixel
    covers at its farthest, seen face on, per metre of the mesh; None if it is never seen."""

    first_s: float
    pixel_m: float | None


def object_sightings(
    scene: Scene, flight: Flight, bounds: dict[str, tuple[Vec, float]]
) -> dict[str, ObjectSighting]:
    """Returns how the flight sees each object, by name. Reflection and refraction count too.

    bounds: center (metres, in the object's space) and radius (metres) by object name.
    """
    spheres: list[tuple[Vec, float]] = []
    owners: list[tuple[str, float]] = []
    for item in scene.objects:
        center, radius = bounds[item.name]
        for instance in item.instances:
            turn, scale = sine_cosine(instance.yaw_deg), instance.scale
            spheres.append((to_world(center, instance.position, turn, scale), scale * radius))
            owners.append((item.name, scale))
    width, height = scene.head.viewport
    sightings = {item.name: ObjectSighting(flight.duration_s, None) for item in scene.objects}
    seen = sightings_of(flight, scene.flight.fov_deg, width / height, spheres)
    sine, cosine = sine_cosine(0.5 * scene.flight.fov_deg)
    views = [scene.reflection, scene.refraction] if scene.water else []
    rows = height * min([1.0, *(view.scale for view in views if view)])
    for (owner, scale), sighting in zip(owners, seen, strict=True):
        if sighting.seen:
            before = sightings[owner]
            pixel_m = 2.0 * sighting.farthest_seen_m * (sine / cosine) / rows / scale
            first_s = min(before.first_s, sighting.first_seen_s)
            sightings[owner] = ObjectSighting(first_s, max(before.pixel_m or 0.0, pixel_m))
    return sightings

"""What a scene requires: which artifacts exist at all, because which pass reads them.

No water pass, no du/dv map; no parallax in any material, no height map; nothing that shines, no gloss map.
Each order names the pass that asked. What nothing reads is not here, so it is not baked. Knows no numpy.
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
from paradize.scene.flight import Flight, Vec, sight, sine_cosine
from paradize.scene.placement import placed
from paradize.scene.settings import VIEWS, Scene, SceneObject, Terrain, Water

# A bake asks for what the player's finest quality reads (player/scene/quality.cpp; a test compares them):
# this share of lod_error_px, water's pictures at least this large beside the camera's, a shadow map so many
# times as wide.
FINEST_LOD, FINEST_SCALE, FINEST_SHADOW = 0.25, 1.0, 2
COARSEST_LOD = 3.0  # and its coarsest quality: so many times lod_error_px


@dataclass(frozen=True)
class Output:
    """One artifact: its name, its kind (as in scene.json; none: it is not published), which of its order's
    products it is, why it is wanted, and the player's passes that read it (none: it is heard). many: also the
    products <product>_1, <product>_2 ..., as many as there are, as artifacts <artifact>_1 ..."""

    artifact: str
    kind: str
    product: str
    reason: str
    passes: tuple[str, ...] = ()
    many: bool = False

    def made(self, products: Container[str]) -> list[Output]:
        """A want for each of these products that it names: itself, and those that follow it."""
        found = [self]
        while self.many and f"{self.product}_{len(found)}" in products:
            tail = f"_{len(found)}"
            found.append(replace(self, artifact=self.artifact + tail, product=self.product + tail))
        return found


@dataclass(frozen=True)
class BakeJob:
    """One task that makes some artifacts: a maker (see registry.py), its sources and settings (JSON)."""

    name: str
    maker: str
    sources: dict[str, Path]
    settings: dict[str, Any]
    wants: tuple[Output, ...]


@dataclass
class Requirements:
    """Everything that a scene asks for, in a fixed order."""

    orders: list[BakeJob] = field(default_factory=list)

    def add(
        self, name: str, maker: str, sources: dict[str, Path], wants: Sequence[Output], **settings: Any
    ) -> None:
        """Orders the wanted artifacts; nothing where nothing is wanted."""
        if wants:
            self.orders.append(BakeJob(name, maker, sources, settings, tuple(wants)))


@dataclass(frozen=True)
class MaterialColors:
    """Where an object's colour comes from: its colour map, or its materials' own linear RGB by name."""

    color_map: Path | None = None
    base_colors: dict[str, tuple[float, float, float]] = field(default_factory=dict)


def require(scene: Scene, looks: dict[str, MaterialColors]) -> Requirements:
    """The scene's requirements. looks: by the object's name."""
    found = Requirements()
    if scene.sky:
        faces = {f"face{i}": path for i, path in enumerate(scene.sky.faces)}
        readers = ("sky", *(name for name in ("terrain", "objects", "water") if getattr(scene, name)))
        want = Output(
            "sky",
            "cubemap",
            "sky",
            _all("the sky", *(["the water's mirror"] if scene.water else [])),
            readers,
        )
        found.add("sky", "cubemap", faces, [want], **asdict(CubemapSettings()))
    views = tuple(name for name in VIEWS if name == "camera" or getattr(scene, name))
    if scene.terrain:
        _terrain(found, scene.terrain, views[1:], ground_sight(scene))
    if scene.water:
        _water(found, scene.water)
    accepted = {
        metric: limit for metric, limit in scene.budget.hard.items() if metric.startswith("quantise_")
    }
    for item in scene.objects:
        sight = _seen_by(scene) if item.lods_by == "sight" else None
        own = tuple(view for view in views if view in item.views)
        _object(found, item, looks[item.name], own, sight, accepted)
    if scene.sound:
        want = Output("sound", "sound", "sound", "the sound of the scene")
        found.add("sound", "sound", {"file": scene.sound.file}, [want])
    return found


def _color(
    found: Requirements,
    name: str,
    sources: dict[str, Path],
    wrap: str,
    reason: str,
    passes: tuple[str, ...],
    alpha_cutoff: float = 0.5,
) -> None:
    want = Output(f"{name}_color", "texture", "color", reason, passes)
    settings = ColorSettings(wrap=wrap, alpha_cutoff=alpha_cutoff)
    found.add(f"{name} colour", "color", sources, [want], **asdict(settings))


def _all(*what: str) -> str:
    """As a person lists them: one, two and three."""
    return " and ".join(part for part in (", ".join(what[:-1]), what[-1]) if part)


def _drawn(what: str, views: tuple[str, ...]) -> str:
    """What is drawn of a thing, in these views."""
    more = {"camera": what, "shadow": "its shadow", "reflection": "its mirror image"}
    told = [text for view, text in more.items() if view in views] or ["what is seen of it through the water"]
    return _all(*told) if "camera" in views else f"{what}: {_all(*told)}"


def _terrain(found: Requirements, terrain: Terrain, views: tuple[str, ...], sight: dict[str, Any]) -> None:
    ground = ("terrain",)
    relief = terrain.effect_height or terrain.effect_color
    bumps = terrain.sand_strength > 0.0 or (relief is not None and terrain.effect_strength > 0.0)
    why = _drawn("the terrain", ("camera", *views))
    found.add(
        "terrain",
        "terrain",
        {"heightmap": terrain.heightmap},
        [
            Output("terrain_mesh", "mesh", "mesh", why, ("terrain", *views), many=True),
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
    _color(found, "sand", {"image": terrain.sand_color}, "repeat", "the terrain's sand pattern", ground)
    if terrain.sand_strength > 0.0:
        found.add(
            "sand maps",
            "maps",
            {"image": terrain.sand_height or terrain.sand_color},
            [Output("sand_normal", "texture", "normal", "the sand's grain in the light", ground)],
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
        _color(found, "effect", {"image": terrain.effect_color}, "clamp", "the terrain's effect map", ground)
    if relief and terrain.effect_strength > 0.0:
        found.add(
            "effect maps",
            "maps",
            {"image": relief},
            [
                Output(
                    "effect_normal", "texture", "normal", "ripples, shells and starfish in the light", ground
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


def _water(found: Requirements, water: Water) -> None:
    found.add(
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


def _seen_by(scene: Scene) -> dict[str, Any]:
    """What decides how near and how far the flight sees a thing, for lods_from_path.py. error_px: what the
    player's finest quality accepts; far_error_px: what the scene accepts, from which coarse levels follow."""
    return {
        "flight": asdict(scene.flight),
        "viewport": list(scene.head.largest),
        "error_px": FINEST_LOD * scene.head.lod_error_px,
        "far_error_px": scene.head.lod_error_px,
    }


def finest_scales(scene: Scene) -> dict[str, float]:
    """Size of the water's pictures over the camera's, by view, in the player's finest quality."""
    views = {"reflection": scene.reflection, "refraction": scene.refraction}
    return {name: max(view.scale, FINEST_SCALE) for name, view in views.items() if view}


def finest_shadow_texel_m(scene: Scene) -> float | None:
    """Width of a texel of the shadow map in the player's finest quality; None without shadow."""
    return scene.shadow.extent_m / (FINEST_SHADOW * scene.shadow.size) if scene.shadow else None


def ground_sight(scene: Scene) -> dict[str, Any]:
    """What decides which parts of the terrain are ever seen, and how finely, for query.py."""
    level_m = scene.water.level_m if scene.water else 0.0
    seen: dict[str, Any] = _seen_by(scene)
    return seen | {
        "mirror_m": level_m if scene.reflection else None,
        "water_m": level_m if scene.water and scene.refraction else None,
        "shadow": {"extent_m": scene.shadow.extent_m, "center": list(scene.shadow.center)}
        if scene.shadow
        else None,
        "sun": sun_direction(scene.sun.azimuth_deg, scene.sun.elevation_deg),
        **({"region": asdict(scene.free_camera)} if scene.free_camera else {}),
    }


def sun_direction(azimuth_deg: float, elevation_deg: float) -> list[float]:
    """Unit vector from the ground to the sun; azimuth from -Z towards +X."""
    sin_a, cos_a = sine_cosine(azimuth_deg)
    sin_e, cos_e = sine_cosine(elevation_deg)
    return [sin_a * cos_e, sin_e, -cos_a * cos_e]


def read_of(item: SceneObject, views: Sequence[str], painted: bool) -> dict[str, str]:
    """What the player reads of an object that these views draw, and why: attributes of its mesh (glTF's
    names) and its maps. painted: it has a colour map.

    The light's view draws depth alone: it reads places and, of leaves, the colour's alpha; every other view
    shades. Bumps and parallax are told in a tangent frame, which nothing else reads.
    """
    name = item.name
    shaded = any(view != "shadow" for view in views)
    leaves = any(material.alpha_cutoff > 0.0 for material in item.materials.values())
    found = {"POSITION": _drawn(f"the object {name}", tuple(views))}
    if shaded:
        found["NORMAL"] = f"the light on {name}"
    if painted and (shaded or leaves):
        found["color"] = f"the object {name}" if shaded else f"the shape of {name}'s shadow"
    if painted and shaded:
        if item.strength > 0.0:
            found["normal"] = f"bumps on {name}"
        deep = [key for key, material in item.materials.items() if material.parallax_scale != 0.0]
        if deep:
            found["height"] = f"parallax of {name}'s {', '.join(deep)}"
        shiny = [key for key, material in item.materials.items() if material.specular > 0.0]
        if shiny:
            found["gloss"] = f"highlights on {name}'s {', '.join(shiny)}"
    if "normal" in found or "height" in found:
        found["TANGENT"] = "the frame of bumps and parallax"
    if "color" in found:
        found["TEXCOORD_0"] = f"where {name}'s maps lie"
    return found


def _object(
    found: Requirements,
    item: SceneObject,
    look: MaterialColors,
    views: tuple[str, ...],
    sight: dict[str, Any] | None,
    accepted: dict[str, float],
) -> None:
    name = item.name
    drawn = ("objects", *views[1:]) if "camera" in views else views
    shaded = tuple(name for name in drawn if name != "shadow")
    layout = {"layout": item.mesh} if item.wrap == "clamp" else {}
    read = read_of(item, views, look.color_map is not None)
    found.add(
        f"{name} mesh",
        "mesh",
        {"mesh": item.mesh},
        [Output(f"{name}_mesh", "mesh", "mesh", read["POSITION"], drawn)],
        **asdict(
            MeshSettings.of(
                item,
                attributes=[key for key in read if key.isupper()],
                quantise=accepted if item.quantise else None,
                sight=sight,
                instances=[asdict(instance) for instance in item.instances] if sight else [],
                atlas=look.color_map is not None,  # a map needs a UV layout
                painted=True,  # the maps of an object are: overlaps are its author's choice
                base_colors={material: list(color) for material, color in look.base_colors.items()},
            )
        ),
    )
    if look.color_map is None or "color" not in read:
        return
    alpha = {"alpha": item.alpha} if item.alpha else {}
    cutoffs = [material.alpha_cutoff for material in item.materials.values() if material.alpha_cutoff > 0.0]
    sources = {"image": look.color_map, **alpha, **layout}
    _color(found, name, sources, item.wrap, read["color"], drawn, min(cutoffs, default=0.5))
    maps = [Output(f"{name}_{key}", "texture", key, read[key], shaded) for key in DERIVED if key in read]
    found.add(
        f"{name} maps",
        "maps",
        {"image": look.color_map, **layout},
        maps,
        **asdict(
            MapSettings.of(
                item.relief,
                only=[want.product for want in maps],
                source="color",
                strength=item.strength,
                wrap=item.wrap,
                gloss_groups=list(item.gloss_groups) if layout else [],
            )
        ),
    )


@dataclass(frozen=True)
class ObjectSighting:
    """How the flight meets an object, all its instances: first_s: the second at which it is first in view,
    the end of the flight where it never is. pixel_m: how many metres of it the largest pixel covers, seen
    squarely at its farthest, per metre of the mesh; None where it is never seen."""

    first_s: float
    pixel_m: float | None


def meet(scene: Scene, flight: Flight, bounds: dict[str, tuple[Vec, float]]) -> dict[str, ObjectSighting]:
    """How the flight meets each object, by name; the mirror and what is seen through water count too.

    bounds: center (metres, in the object's space) and radius (metres) by the object's name.
    """
    spheres: list[tuple[Vec, float]] = []
    owners: list[tuple[str, float]] = []
    for item in scene.objects:
        center, radius = bounds[item.name]
        for instance in item.instances:
            turn, scale = sine_cosine(instance.yaw_deg), instance.scale
            spheres.append((placed(center, instance.position, turn, scale), scale * radius))
            owners.append((item.name, scale))
    width, height = scene.head.viewport
    found = {item.name: ObjectSighting(flight.duration_s, None) for item in scene.objects}
    sightings = sight(flight, scene.flight.fov_deg, width / height, spheres)
    sine, cosine = sine_cosine(0.5 * scene.flight.fov_deg)
    views = [scene.reflection, scene.refraction] if scene.water else []
    rows = height * min([1.0, *(view.scale for view in views if view)])
    for (owner, s), sighting in zip(owners, sightings, strict=True):
        if sighting.seen:
            was = found[owner]
            pixel_m = 2.0 * sighting.farthest_seen_m * (sine / cosine) / rows / s
            first_s = min(was.first_s, sighting.first_seen_s)
            found[owner] = ObjectSighting(first_s, max(was.pixel_m or 0.0, pixel_m))
    return found

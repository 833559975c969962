"""Lists the artifacts that a scene requires, and for each the render passes that read it.

An artifact that no pass reads is not listed, so it is not baked: without water there is no du/dv map, without
parallax no height map, without highlights no gloss map. Does not import numpy.
"""

from __future__ import annotations

from collections.abc import Collection, Container, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from paradize.map_table import AUTHORED, DERIVED
from paradize.placement import largest_scale, to_world
from paradize.scene.baker_settings import (
    AuthoredSettings,
    ColorSettings,
    CubemapSettings,
    MapSettings,
    MeshSettings,
    TileSettings,
)
from paradize.scene.flight import Flight, Vec, sightings_of, sine_cosine
from paradize.scene.map_sets import GLOSS_ROLES, OCCLUSION_ROLES, DrawnMaterial, MapSet, ObjectMaps, SceneMaps
from paradize.scene.placement import placed
from paradize.scene.settings import VIEWS, Scene, SceneObject, Terrain, Water

# A bake provides what the player's finest quality reads (player/scene/quality.cpp; a test compares them):
# FINEST_LOD times lod_error_px, reflection and refraction at least FINEST_SCALE times the camera's picture, a
# shadow map FINEST_SHADOW times as wide.
FINEST_LOD, FINEST_SCALE, FINEST_SHADOW = 0.25, 1.0, 2
BLACK = (0.0, 0.0, 0.0)
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
    files by role. settings: as JSON. outputs: the artifacts. objects: the names of those that use them."""

    name: str
    baker: str
    sources: dict[str, Path]
    settings: dict[str, Any]
    outputs: tuple[Output, ...]
    objects: tuple[str, ...] = ()


@dataclass
class Requirements:
    """The jobs of a scene, in a fixed order."""

    jobs: list[BakeJob] = field(default_factory=list)

    def add(
        self,
        name: str,
        baker: str,
        sources: dict[str, Path],
        outputs: Sequence[Output],
        objects: Iterable[str] = (),
        **settings: Any,
    ) -> None:
        """Adds a job, unless it has no outputs."""
        if outputs:
            self.jobs.append(BakeJob(name, baker, sources, settings, tuple(outputs), tuple(objects)))


def require(scene: Scene, maps: SceneMaps) -> Requirements:
    """Returns the jobs of a scene. maps: from build/map_sets.py."""
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
    drawn_in = _drawn_in(scene)
    left = list(maps.sets)
    for item in scene.objects:
        path = _camera_views(scene) if item.lods_by == "sight" else None
        _object(required, item, maps, drawn_in[item.name], path, quantise_limits)
        for one in [one for one in left if item.name in one.materials]:
            left.remove(one)  # a shared set comes with its first object
            _map_set(required, one, maps, drawn_in)
    if scene.sound:
        output = Output("sound", "sound", "sound", "the sound of the scene")
        required.add("sound", "sound", {"file": scene.sound.file}, [output])
    for job in required.jobs:
        for role in [role for role in ("mesh", "layout") if role in job.sources]:
            files = maps.beside.get(job.sources[role], ())
            job.sources.update({f"{role}, file {k + 2}": path for k, path in enumerate(files)})
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
    return " and ".join(part for part in (", ".join(what[:-1]), *what[-1:]) if part)


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


def _drawn_in(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Returns the views that draw each object, by its name."""
    views = tuple(name for name in VIEWS if name == "camera" or getattr(scene, name))
    return {item.name: tuple(view for view in views if view in item.views) for item in scene.objects}


def map_inputs(
    one: MapSet, users: Mapping[str, Sequence[str]], maps: SceneMaps, drawn_in: Mapping[str, tuple[str, ...]]
) -> dict[str, str]:
    """Returns the maps of a set that the player reads, and why. users: materials that use it, by object name.
    drawn_in: the views that draw an object, by its name.

    The shadow view writes depth only: it reads the colour's alpha for materials that it cuts out. Every other
    view shades.
    """
    shaded = {name: names for name, names in users.items() if _shades(drawn_in[name])}
    cut = {
        name: left
        for name, names in users.items()
        if (left := [key for key in names if maps.objects[name].drawn[key].alpha_mode != "opaque"])
    }
    of = _owners(one, shaded or users)
    inputs: dict[str, str] = {}
    has = one.pictures.keys()
    if ("color" in has or ("alpha" in has and not one.opaque)) and (shaded or cut):
        shown = f"the swatches of a palette on {of}" if one.palette else f"the object {of}"
        inputs["color"] = shown if shaded else f"the shape of {of}'s shadow"
    if not shaded:
        return inputs

    def having(*factors: str) -> str:
        """The materials that have one of these factors, after their objects."""

        def has_any(drawn: DrawnMaterial) -> bool:
            return any(getattr(drawn, factor) not in (0.0, BLACK) for factor in factors)

        found = {
            name: [key for key in names if has_any(maps.objects[name].drawn[key])]
            for name, names in shaded.items()
        }
        return _all(*(f"{name}'s {', '.join(keys)}" for name, keys in found.items() if keys))

    derived = one.derived if "color" in has else ()
    if {"normal", "height"} & has or ("normal" in derived and one.strength > 0.0):
        inputs["normal"] = f"bumps on {of}"
    if ("height" in has or "height" in derived) and (deep := having("parallax_scale")):
        inputs["height"] = f"parallax of {deep}"
    if (set(GLOSS_ROLES) & has or "gloss" in derived) and (shiny := having("specular", "metalness")):
        inputs["gloss"] = f"highlights on {shiny}"
    if ("occlusion" in has and having("occlusion_strength")) or ("metalness" in has and having("metalness")):
        inputs["occlusion"] = f"light from around and metal on {of}"
    if "emission" in has and (bright := having("emission")):
        inputs["emission"] = f"light that {bright} give off"
    return inputs


# Roles that each map of a set may be made of.
_MADE_OF = {
    "color": ("color", "alpha"),
    "normal": ("normal", "height"),
    "height": ("height",),
    "gloss": GLOSS_ROLES,
    "occlusion": OCCLUSION_ROLES,
    "emission": ("emission",),
}


def unread_pictures(scene: Scene, maps: SceneMaps) -> list[tuple[Path, str]]:
    """Returns the pictures of materials that no pass reads, so that they are not baked, and why."""
    drawn_in = _drawn_in(scene)
    found: list[tuple[Path, str]] = []
    for one in maps.sets:
        inputs = map_inputs(one, one.materials, maps, drawn_in)
        read = {role for key in inputs for role in _MADE_OF[key]}
        read -= {"height"} if "normal" in one.pictures and "height" not in inputs else set()
        read -= {"alpha"} if one.opaque else set()
        of = _owners(one, one.materials)
        for role, path in one.pictures.items():
            if role not in read:
                found.append((path, f"{role} of {of}: {_UNREAD.get(role, 'its factor is 0')}"))
    return found


_UNREAD = {
    "color": "no view shades it",
    "alpha": "its materials are opaque",
    "normal": "no view shades it",
    "height": "no parallax asks for it (parallax_scale), and a normal map gives the bumps",
}


def _shades(views: Sequence[str]) -> bool:
    return any(view != "shadow" for view in views)


def _owners(one: MapSet, users: Iterable[str]) -> str:
    """The objects that use a set, in words; with the materials where an object has other sets."""
    if one.name in one.materials:
        return _all(*users)
    return _all(*(f"{name} ({', '.join(one.materials[name])})" for name in users))


def mesh_inputs(
    item: SceneObject, known: ObjectMaps, views: Sequence[str], read: Iterable[str]
) -> dict[str, str]:
    """Returns the attributes of an object's mesh that the player reads in these views (by glTF name), and
    why. read: the maps of its materials that are read. Normal maps and parallax need tangents; nothing else
    does. Shadows read vertex colours only for their alpha."""
    inputs = {"POSITION": _drawn(f"the object {item.name}", tuple(views))}
    if _shades(views):
        inputs["NORMAL"] = f"the light on {item.name}"
    read = set(read)
    if {"normal", "height"} & read:
        inputs["TANGENT"] = "the frame of bumps and parallax"
    if read:
        inputs["TEXCOORD_0"] = f"where {item.name}'s maps lie"
    tinted = [
        name
        for name, drawn in known.drawn.items()
        if drawn.vertex_colors and (_shades(views) or drawn.alpha_mode != "opaque")
    ]
    if tinted:
        inputs["COLOR_0"] = f"the vertex colours of {item.name}'s {', '.join(tinted)}"
    return inputs


def _object(
    required: Requirements,
    item: SceneObject,
    maps: SceneMaps,
    views: tuple[str, ...],
    sight: dict[str, Any] | None,
    quantise_limits: dict[str, float],
) -> None:
    name = item.name
    sets = list(maps.of_object(name))
    read = [key for one, names in sets for key in map_inputs(one, {name: names}, maps, {name: views})]
    inputs = mesh_inputs(item, maps.objects[name], views, read)
    required.add(
        f"{name} mesh",
        "mesh",
        {"mesh": item.mesh},
        [Output(f"{name}_mesh", "mesh", "mesh", inputs["POSITION"], _passes(views))],
        [name],
        **asdict(
            MeshSettings.of(
                item,
                attributes=list(inputs),
                quantise=quantise_limits if item.quantise else None,
                sight=sight,
                instances=[placed(instance) for instance in item.instances] if sight else [],
                atlas=bool(sets),  # a map needs a UV layout
                painted=True,  # overlapping UVs are the author's choice: the maps are painted for them
                base_colors=_base_colors(maps.objects[name]),
            )
        ),
    )


def _base_colors(known: ObjectMaps) -> dict[str, list[float]]:
    """Returns the colours that the GLB holds, by material; materials with a colour map are white by
    default."""
    return {
        name: list(drawn.color)
        for name, drawn in known.drawn.items()
        if drawn.color != (1.0, 1.0, 1.0) or not (name in known.sets and "color" in known.sets[name].pictures)
    }


def _passes(views: tuple[str, ...]) -> tuple[str, ...]:
    return ("objects", *views[1:]) if "camera" in views else views


def _map_set(
    required: Requirements, one: MapSet, maps: SceneMaps, drawn_in: Mapping[str, tuple[str, ...]]
) -> None:
    """Adds the jobs of a map set."""
    name, inputs = one.name, map_inputs(one, one.materials, maps, drawn_in)
    drawn = tuple(dict.fromkeys(view for user in one.materials for view in _passes(drawn_in[user])))
    shaded = tuple(view for view in drawn if view != "shadow")
    layout = {"layout": one.layout} if one.layout else {}
    has = one.pictures
    common: dict[str, Any] = {"wrap": one.wrap, "layout_materials": list(one.layout_materials)}
    plain = common | {"uncompressed": True} if one.tiny else common

    def add(what: str, baker: str, sources: dict[str, Path], keys: Iterable[str], **settings: Any) -> None:
        outputs = [
            Output(f"{name}_{key}", "texture", key, inputs[key], drawn if key == "color" else shaded)
            for key in keys
        ]
        required.add(f"{name} {what}", baker, sources | layout, outputs, one.materials, **settings)

    def add_maps(what: str, picture: Path, source: str, keys: Sequence[str], strength: float) -> None:
        groups = list(one.gloss_groups)
        maps = MapSettings.of(
            one.relief, only=list(keys), source=source, strength=strength, gloss_groups=groups, **common
        )
        add(what, "maps", {"image": picture}, keys, **asdict(maps))

    if "color" in inputs:
        sources = {role: has[role] for role in ("color", "alpha") if role in has}
        sources["image"] = sources.pop("color") if "color" in has else has["alpha"]  # white with this alpha
        if one.opaque:
            sources.pop("alpha", None)
        read = _fields(one.authored, ["alpha"])
        colors = ColorSettings(
            alpha_cutoff=one.alpha_cutoff,
            opaque=one.opaque,
            alpha_channel=read["channels"].get("alpha", "luminance"),
            alpha_inverted="alpha" in read["inverted"],
            white="color" not in has,
            **plain,
        )
        add("colour", "color", sources, ["color"], **asdict(colors))
    roles = {key: [role for role in _MADE_OF[key] if role in has] for key in AUTHORED if key in inputs}
    if "normal" in inputs and "normal" not in has and "height" in has:
        roles["normal"] = []  # made of the heights
        add_maps("bumps", has["height"], "height", ["normal"], one.height_strength)
    elif "normal" in roles:
        roles["normal"] = ["normal"] if "normal" in has else []
    drawn_maps = [key for key, own in roles.items() if own]
    if drawn_maps:
        own = [role for key in drawn_maps for role in roles[key]]
        own += ["normal"] if "gloss" in drawn_maps and "normal" in has and "normal" not in own else []
        authored = AuthoredSettings(only=drawn_maps, **_fields(one.authored, own), **common)
        add("drawn maps", "authored", {role: has[role] for role in own}, drawn_maps, **asdict(authored))
    if "color" in inputs and "color" in has:
        made = [key for key in DERIVED if key in inputs and key in one.derived and not roles.get(key)]
        if "height" in has and "normal" not in has:
            made = [key for key in made if key != "normal"]
        add_maps("maps", has["color"], "color", made, one.strength)
    if "emission" in inputs:
        emission = ColorSettings(product="emission", **common)
        add("emission", "color", {"image": has["emission"]}, ["emission"], **asdict(emission))


def _fields(authored: Iterable[tuple[str, Any]], roles: Collection[str]) -> dict[str, Any]:
    """Returns fields of AuthoredSettings for pictures of these roles."""
    fields = dict(authored)
    fields["channels"] = {role: channel for role, channel in fields.get("channels", ()) if role in roles}
    fields["inverted"] = [role for role in fields.get("inverted", ()) if role in roles]
    return fields


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
        for instance in map(placed, item.instances):
            scale = largest_scale(instance)
            spheres.append((to_world(center, instance), scale * radius))
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

"""Builds the manifest, which becomes scene.json, from a scene, its flight and its artifacts."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from math import sqrt
from pathlib import Path
from typing import Any

from paradize.artifact import PUBLISHED, Artifact
from paradize.build.light_sets import add_light_sets, light_entries
from paradize.errors import FormatError
from paradize.formats.glb.document import glb_document
from paradize.formats.scene.manifest import FORMAT, VERSION
from paradize.formats.scene.schema import MATERIAL_MAPS
from paradize.map_table import MAPS, SECOND, maps_of
from paradize.material import REPEATED
from paradize.scene.daytime import key_skies, poster_key, standing_light
from paradize.scene.finest_views import sun_direction
from paradize.scene.flight import PI, Flight, Vec
from paradize.scene.map_sets import DrawnMaterial, MapSet, ObjectMaps, SceneMaps
from paradize.scene.motion import motion_json
from paradize.scene.placement import placed
from paradize.scene.settings import (
    KeyMoon,
    Music,
    NeededSound,
    Scene,
    SceneObject,
    Sound,
    Sun,
    Waiver,
    sound_files,
)
from paradize.scene.sightings import ObjectSighting

# Streaming order: the sky, then the ground, then objects; colour before relief.
_BY_RANK = sorted(MAPS, key=lambda name: MAPS[name].stream_rank)
_STREAMING = ("cubemap", "mesh", *_BY_RANK, "sound")


@dataclass(frozen=True)
class MeshFacts:
    """Facts of a GLB that the manifest states: bounding box (metres) of the finest level; (node, error in
    metres) of each level, finest first; linear base colours by material name. switch_m: of each level the
    error by which a player selects it, metres, at least its own (build/measurements/lods_seen.py).
    farthest: the largest coordinate of any level as the file has it, from the mesh's own origin."""

    low: Vec
    high: Vec
    lods: tuple[tuple[str, float], ...]
    materials: dict[str, Vec]
    switch_m: tuple[float, ...]
    farthest: float = 0.0

    @property
    def center(self) -> Vec:
        x, y, z = (0.5 * (a + b) for a, b in zip(self.low, self.high, strict=True))
        return x, y, z

    @property
    def radius_m(self) -> float:
        square = 0.0
        for a, b in zip(self.low, self.high, strict=True):
            square += 0.25 * (b - a) * (b - a)
        return sqrt(square)


def mesh_facts(glb: bytes, name: str) -> MeshFacts:
    """Reads the JSON chunk of a GLB. Raises FormatError if Paradize did not write it."""
    try:
        tree, _ = glb_document(glb, name)
        nodes = tree["nodes"]
        levels = [
            [
                tree["accessors"][primitive["attributes"]["POSITION"]]
                for primitive in tree["meshes"][node["mesh"]]["primitives"]
            ]
            for node in nodes
        ]
        accessors = levels[0]
        farthest = max(
            abs(float(bound)) for level in levels for a in level for bound in (*a["min"], *a["max"])
        )
        step = nodes[0].get("scale", [1.0, 1.0, 1.0])  # quantised values become metres
        origin = nodes[0].get("translation", [0.0, 0.0, 0.0])
        low = tuple(origin[k] + step[k] * min(float(a["min"][k]) for a in accessors) for k in range(3))
        high = tuple(origin[k] + step[k] * max(float(a["max"][k]) for a in accessors) for k in range(3))
        lods = tuple((str(node["name"]), float(node["extras"]["error_m"])) for node in nodes)
        materials = {str(material["name"]): _base_color(material) for material in tree.get("materials", [])}
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise FormatError(f"is not a mesh that Paradize wrote: {error}", file=name) from None
    switch_m = tuple(error_m for _, error_m in lods)
    return MeshFacts(
        (low[0], low[1], low[2]), (high[0], high[1], high[2]), lods, materials, switch_m, farthest
    )


def _base_color(material: dict[str, Any]) -> Vec:
    r, g, b, _ = material.get("pbrMetallicRoughness", {}).get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
    return float(r), float(g), float(b)


def build_manifest(
    scene: Scene,
    *,
    maps: SceneMaps,
    owners: dict[str, tuple[str, ...]],
    flight: Flight,
    flight_errors: dict[str, float],
    artifacts: dict[str, Artifact],
    facts: dict[str, MeshFacts],
    sightings: dict[str, ObjectSighting],
    gutters: dict[tuple[str, str], dict[str, Any]],
    constants: dict[str, list[float]],
    pixels: dict[str, float],
    terrain_tables: dict[str, Any] | None,
) -> tuple[dict[str, Any], list[str]]:
    """Returns the manifest and warnings. owners: the objects that use an artifact, by its name. artifacts,
    facts: by artifact name. sightings, pixels (from nearest_view.nearest_pixel_m): by object name. gutters:
    by (object, map set), from gutter_limits.measure_gutters. constants: the values of textures that are not
    published. terrain_tables: the terrain's tables and when each of its tiles is first needed, from
    registry.make_terrain."""
    sounds = sound_files(scene.sounds, scene.music)
    begins_s = _tiles(terrain_tables) | {sound.artifact: sound.first_s for sound in sounds.values()}
    begins_s |= {sky.name: sky.first_s for sky in key_skies(scene)}
    standing = standing_light(scene)
    entries = {}
    for name, artifact in artifacts.items():
        users = [user for each in (name, *artifact.also) for user in owners.get(each, ())]
        first_s = min((sightings[user].first_s for user in users), default=begins_s.get(name, 0.0))
        seen = [user for user in users if name in facts and user in pixels]
        levels = (
            _with_pixel_errors(artifact.levels, facts[name], pixels[seen[0]]) if seen else artifact.levels
        )
        entries[name] = replace(artifact, first_needed_s=first_s, levels=levels).to_json(PUBLISHED)
    named = {each: name for name, artifact in artifacts.items() for each in (name, *artifact.also)}
    head = scene.head
    lights, glow = light_entries(scene)
    optional: dict[str, Any] = {} if head.vram_mb is None else {"vram_mb": head.vram_mb}
    optional |= {"lights": lights, "light_sets": []} if lights else {}
    optional |= {"light_shafts": _plain(scene.light_shafts)} if scene.light_shafts else {}
    manifest = optional | {
        "format": FORMAT,
        "version": VERSION,
        "name": head.name,
        "exposure": standing.head.exposure,
        "viewport": list(head.viewport),
        "largest_viewport": list(head.largest),
        "free_camera": _plain(scene.free_camera) if scene.free_camera else None,
        "lod_error_px": head.lod_error_px,
        "poster_s": head.poster_s,
        "artifacts": entries,
        "streaming": sorted(entries, key=lambda name: _rank(name, entries)),
        "budget": _plain(scene.budget),
        "check": {"severity": scene.check, "waivers": [_waiver(item, named) for item in scene.waivers]}
        | {"tried": {name: artifact.tried for name, artifact in artifacts.items() if artifact.tried}},
        "sun": {
            "direction": sun_direction(standing.sun.azimuth_deg, standing.sun.elevation_deg),
            "color": list(standing.sun.color),
            "intensity": standing.sun.intensity,
            "angular_diameter_rad": scene.sun.angular_diameter_deg * (PI / 180.0),
        },
        "ambient": _plain(standing.ambient),
        "fog": _plain(standing.fog),
        "daytime": _daytime(scene),
        "wind": _wind(scene),
        "sky": _sky(scene),
        "shadow": _plain(scene.shadow) if scene.shadow else None,
        "reflection": _plain(scene.reflection) if scene.reflection else None,
        "refraction": _plain(scene.refraction) if scene.refraction else None,
        "terrain": _terrain(scene, named, terrain_tables),
        "water": _water(scene),
        "objects": [
            _object(item, maps, named, facts[f"{item.name}_mesh"], gutters, constants)
            for item in scene.objects
        ],
        "particles": [_plain(item) for item in scene.particles],
        "sounds": [_sound(sound, sounds[sound.file].artifact) for sound in scene.sounds],
        "music": _music(scene.music, sounds) if scene.music else None,
        "flight": flight.as_json() | {"errors": flight_errors},
    }
    warnings = [text for entry in manifest["objects"] for text in pixel_lit(entry)]
    return manifest, warnings + (add_light_sets(manifest, glow) if lights else [])


def pixel_lit(entry: dict[str, Any]) -> list[str]:
    """Warns of materials of an object that ask for light at the vertices and get it in each pixel."""
    warnings = []
    for name, of in entry["materials"].items():
        maps = {*of["maps"].items(), *of.get("second", {}).get("maps", {}).items()}
        beside = sorted({f"its {role} map" for role, artifact in maps if artifact and role != "color"})
        beside += [f"{key} {of[key]:g}" for key in ("specular", "metalness") if of[key]]
        beside += ["emission"] if any(of["emission"]) else []
        if of["vertex_lit"] and beside:
            made = " (strength = 0 of the object: no normal map is made from its colour)"
            warnings.append(
                f"object {entry['name']}: material {name!r}: vertex_lit does nothing beside "
                f"{', '.join(beside)}; leave it out, or what stands beside it"
                f"{made if of['maps']['normal'] else ''}"
            )
    return warnings


def _with_pixel_errors(
    levels: list[dict[str, float]], facts: MeshFacts, pixel_m: float
) -> list[dict[str, float]]:
    """Returns a mesh's levels with their errors in pixels. pixel_m: metres that a pixel covers at the
    flight's nearest view."""
    if len(levels) != len(facts.lods):
        return levels
    return [
        level | {"error_px": float(f"{error_m / pixel_m:.6g}")}
        for level, (_, error_m) in zip(levels, facts.lods, strict=True)
    ]


def _waiver(waiver: Waiver, named: dict[str, str]) -> dict[str, Any]:
    """named: by the name of an artifact, that of the equal one that is published."""
    artifact = named.get(waiver.artifact, waiver.artifact) if waiver.artifact else None
    return _plain(waiver) | {"artifact": artifact, "until": waiver.until.isoformat()}


def _plain(settings: Any) -> dict[str, Any]:
    return {
        key: list(value) if isinstance(value, tuple) else value for key, value in asdict(settings).items()
    }


def _rank(name: str, entries: dict[str, dict[str, Any]]) -> tuple[float, int, int, str]:
    stem, _, tail = name.rpartition("_")
    kind = tail if tail in _STREAMING else entries[name]["kind"]
    after_ground = 0 if stem in {"", "terrain", "terrain_mesh", "sand", "effect", "water", "clouds"} else 1
    return entries[name]["first_needed_s"], _STREAMING.index(kind), after_ground, name


def _sky(scene: Scene) -> dict[str, str] | None:
    """Returns the sky of a fixed moment: that of the key nearest to the poster, or the only one."""
    skies = key_skies(scene)
    if not scene.daytime:
        return {"cubemap": skies[0].name} if skies else None
    shown = scene.daytime.index(poster_key(scene))
    return {"cubemap": next(sky.name for sky in skies if shown in sky.keys)}


def _daytime(scene: Scene) -> dict[str, Any] | None:
    if not scene.daytime:
        return None
    names = {key: sky.name for sky in key_skies(scene) for key in sky.keys}
    clouds = scene.clouds
    return {
        "keys": [
            {
                "at_s": key.at_s,
                "sun": _sky_light(key.sun),
                "moon": _sky_light(key.moon),
                "ambient": _plain(key.ambient),
                "fog": _plain(key.fog),
                "exposure": key.exposure,
                "cubemap": names[i],
                "cubemap_azimuth_rad": key.faces_azimuth_deg * (PI / 180.0),
            }
            for i, key in enumerate(scene.daytime)
        ],
        "moon_diameter_rad": scene.moon.angular_diameter_deg * (PI / 180.0),
        "clouds": {
            "color": "clouds_color",
            "high_rad": clouds.high_deg * (PI / 180.0),
            "repeat": clouds.repeat,
            "drift_repeats": clouds.drift_repeats,
        }
        if clouds
        else None,
    }


def _sky_light(light: Sun | KeyMoon) -> dict[str, Any]:
    return {
        "azimuth_rad": light.azimuth_deg * (PI / 180.0),
        "elevation_rad": light.elevation_deg * (PI / 180.0),
        "color": list(light.color),
        "intensity": light.intensity,
    }


def _tiles(terrain_tables: dict[str, Any] | None) -> dict[str, float]:
    """Returns the terrain's tiles in order, and when each is first needed, seconds."""
    seconds = terrain_tables["first_s"] if terrain_tables else []
    return {f"terrain_mesh_{k}" if k else "terrain_mesh": second for k, second in enumerate(seconds)}


def _terrain(
    scene: Scene, named: dict[str, str], terrain_tables: dict[str, Any] | None
) -> dict[str, Any] | None:
    terrain = scene.terrain
    if terrain is None or terrain_tables is None:
        return None
    tables: dict[str, Any] = terrain_tables["tables"]
    return {
        "tiles": list(_tiles(terrain_tables)),
        **{
            f"{stem}_{key}": named.get(f"{stem}_{key}")
            for stem in ("sand", "effect")
            for key in maps_of("ground")
        },
        "sand_repeat": terrain.sand_repeat,
        "mix_low_m": terrain.mix_low_m,
        "mix_high_m": terrain.mix_high_m,
        "specular": terrain.specular,
        "smoothness": terrain.smoothness,
        "wet_high_m": terrain.wet_high_m,
        "wet_darkness": terrain.wet_darkness,
        "wet_smoothness": terrain.wet_smoothness,
        "size_m": list(terrain.size_m),
    } | tables


def _water(scene: Scene) -> dict[str, Any] | None:
    water = scene.water
    if water is None:
        return None
    settings = _plain(water)
    settings["scroll_per_s"] = settings.pop("scroll")
    return {key: f"water_{key}" for key in maps_of("water")} | {
        key: value
        for key, value in settings.items()
        if key not in {"waves", "wave_strength", "wave_relief", "ripple_height_m"}
    }


def _object(
    item: SceneObject,
    maps: SceneMaps,
    named: dict[str, str],
    facts: MeshFacts,
    gutters: dict[tuple[str, str], dict[str, Any]],
    constants: dict[str, list[float]],
) -> dict[str, Any]:
    known = maps.objects[item.name]
    return {
        "name": item.name,
        "views": list(item.views),
        "mesh": f"{item.name}_mesh",
        "center": list(facts.center),
        "radius_m": facts.radius_m,
        "lods": [
            {"node": node, "error_m": error_m}
            for (node, _), error_m in zip(facts.lods, facts.switch_m, strict=True)
        ],
        "materials": {
            name: _material(item, name, known, named, gutters, constants) for name in facts.materials
        },
        "sway": _sway(item),
        "motion": motion_json(item.motion),
        "instances": [placed(instance) for instance in item.instances],
    }


def _sway(item: SceneObject) -> dict[str, float] | None:
    if item.sway_m == item.flutter_m == 0.0:
        return None
    return {"lean_m": item.sway_m, "flutter_m": item.flutter_m}


def _wind(scene: Scene) -> dict[str, Any] | None:
    """Returns the wind: where it blows to, along X and Z; `null` where nothing moves in it."""
    if not any(_sway(item) for item in scene.objects):
        return None
    x, _, z = sun_direction(scene.wind.azimuth_deg, 0.0)
    wind = scene.wind
    return {"direction": [-x, -z], "speed_m_per_s": wind.speed_m_per_s, "gust_m": wind.gust_m}


def _sound(sound: Sound, artifact: str) -> dict[str, Any]:
    hours = {"on_s": sound.on_s, "off_s": sound.off_s, "fade_s": sound.fade_s}
    return {
        "name": sound.name,
        "artifact": artifact,
        "volume": sound.volume,
        "places": [list(place) for place in sound.places],
        "radius_m": sound.radius_m,
        "falloff": sound.falloff,
        "hours": None if sound.on_s is None else hours,
    }


def _music(music: Music, files: dict[Path, NeededSound]) -> dict[str, Any]:
    names = [files[path].artifact for path in music.files]
    return {"artifacts": names, "volume": music.volume, "playing": music.playing}


def _material(
    item: SceneObject,
    name: str,
    known: ObjectMaps,
    named: dict[str, str],
    gutters: dict[tuple[str, str], dict[str, Any]],
    constants: dict[str, list[float]],
) -> dict[str, Any]:
    map_set = known.sets.get(name)
    measured = gutters.get((item.name, map_set.name)) if map_set else None
    drawn = known.drawn.get(name, DrawnMaterial())
    other = known.second.get(name)
    for made in filter(None, (map_set, other)):
        drawn = _with_constants(drawn, {key: constants.get(f"{made.name}_{key}") for key in MATERIAL_MAPS})
    second: dict[str, Any] = {}
    if other and other.wrap:
        found = {key: named.get(f"{other.name}_{key}") for key in SECOND}
        second = {"second": {"maps": found, "wrap": list(other.wrap)}} if any(found.values()) else {}
    return (
        _plain(drawn)
        | second
        | {
            "maps": {key: named.get(f"{map_set.name}_{key}") if map_set else None for key in MATERIAL_MAPS},
            "wrap": _wrap(map_set, measured),
            "parallax_limit": measured["limits"][name] if measured else None,
        }
    )


def _wrap(map_set: MapSet | None, gutters: dict[str, Any] | None) -> list[str] | None:
    """Returns a material's `wrap`. gutters: of the maps that follow a UV layout."""
    if map_set and map_set.wrap:
        return list(map_set.wrap)
    return list(REPEATED) if gutters and gutters.get("repeat") else None


def _with_constants(drawn: DrawnMaterial, constants: dict[str, list[float] | None]) -> DrawnMaterial:
    """Returns a material whose factors hold the maps that are no textures, because all texels are equal."""
    if gloss := constants.get("gloss"):
        specular, smoothness = drawn.specular * gloss[0], drawn.smoothness * gloss[1]
        drawn = replace(drawn, specular=specular, smoothness=smoothness)
    if (occlusion := constants.get("occlusion")) and len(occlusion) > 1:
        drawn = replace(drawn, metalness=drawn.metalness * occlusion[1])
    if light := constants.get("emission"):
        r, g, b = (factor * value for factor, value in zip(drawn.emission, light, strict=True))
        drawn = replace(drawn, emission=(r, g, b))
    return drawn

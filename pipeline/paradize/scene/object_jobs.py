"""The jobs of objects: their meshes and their materials' maps. Does not import numpy."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from paradize.map_table import AUTHORED, DERIVED
from paradize.scene.baker_settings import (
    AuthoredSettings,
    CastSettings,
    ColorSettings,
    MapSettings,
    MeshSettings,
)
from paradize.scene.jobs import Output, Requirements
from paradize.scene.map_sets import MapSet, ObjectMaps, SceneMaps
from paradize.scene.motion import stands
from paradize.scene.pass_inputs import MADE_OF, map_inputs, mesh_inputs
from paradize.scene.settings import Head, SceneObject

_LOD_SIZE_PX = 256.0  # without lod_size_px


def add_object(
    required: Requirements,
    item: SceneObject,
    maps: SceneMaps,
    views: tuple[str, ...],
    flight_views: dict[str, Any] | None,
    size: dict[str, Any] | None,
    quantise_limits: dict[str, float],
) -> None:
    """Adds the job of an object's mesh. views: those that draw it. flight_views: from camera_views; None: its
    levels of detail do not follow the flight. size: from screen_size; None: they are not by how they look."""
    name = item.name
    sets = list(maps.of_object(name))
    read: dict[bool, list[str]] = {False: [], True: []}  # by MapSet.second
    for one, names in sets:
        read[one.second] += map_inputs(one, {name: names}, maps, {name: views})
    inputs = mesh_inputs(item, maps.objects[name], views, read[False], read[True])
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
                flight_views=flight_views,
                screen_size=size,
                instances=stands(item) if flight_views else [],
                atlas=bool(sets),  # a map needs a UV layout
                painted=True,  # overlapping UVs are the author's choice: the maps are painted for them
                base_colors=_base_colors(maps.objects[name]),
            )
        ),
    )


def screen_size(head: Head, item: SceneObject, known: ObjectMaps) -> dict[str, Any]:
    """Returns the screen size of MeshSettings."""
    limits = {"normal_deg": head.lod_error_deg, "silhouette": head.lod_silhouette, "flip": head.lod_flip}
    return {"size_px": _LOD_SIZE_PX if item.lod_size_px is None else item.lod_size_px, **limits} | {
        "two_sided": sorted(name for name, drawn in known.drawn.items() if drawn.two_sided)
    }


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


def add_map_set(
    required: Requirements, one: MapSet, maps: SceneMaps, drawn_in: Mapping[str, tuple[str, ...]]
) -> None:
    """Adds the jobs of a map set."""
    name, inputs = one.name, map_inputs(one, one.materials, maps, drawn_in)
    drawn = tuple(dict.fromkeys(view for user in one.materials for view in _passes(drawn_in[user])))
    shaded = tuple(view for view in drawn if view != "shadow")
    layout = {"layout": one.layout} if one.layout else {}
    has = one.pictures
    common: dict[str, Any] = {"wrap": _filtered(one), "layout_materials": list(one.layout_materials)}
    plain = common | {"uncompressed": True} if one.tiny else common

    def add(what: str, baker: str, sources: dict[str, Path], keys: Iterable[str], **settings: Any) -> None:
        outputs = [
            Output(f"{name}_{key}", "texture", key, inputs[key], drawn if key == "color" else shaded)
            for key in keys
        ]
        required.add(f"{name} {what}", baker, sources | layout, outputs, one.materials, **settings)

    def maps_of(source: str, keys: Sequence[str]) -> dict[str, Any]:
        """Settings of maps that are made of the picture `source`, "color" or "height"."""
        strength = one.strength if source == "color" else one.height_strength
        shiny = [] if "gloss" not in keys else list(one.gloss_groups)
        return asdict(
            MapSettings.of(
                one.relief, only=list(keys), source=source, strength=strength, gloss_groups=shiny, **common
            )
        )

    def add_maps(what: str, source: str, keys: Sequence[str]) -> None:
        add(what, "maps", {"image": has[source]}, keys, **maps_of(source, keys))

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
    roles = {key: [role for role in MADE_OF[key] if role in has] for key in AUTHORED if key in inputs}
    if "normal" in inputs and "normal" not in has and "height" in has:
        roles["normal"] = []  # made of the heights
        add_maps("bumps", "height", ["normal"])
    elif "normal" in roles:
        roles["normal"] = ["normal"] if "normal" in has else []
    cast = one.casts_occlusion and "occlusion" in roles
    drawn_maps = [key for key, own in roles.items() if own or (cast and key == "occlusion")]
    made = [key for key in DERIVED if key in inputs and key in one.derived and not roles.get(key)]
    made = made if "color" in inputs and "color" in has else []
    elsewhere = bool({"normal", "height"} & has.keys())  # what the normals are made of, instead of the colour
    if elsewhere:
        made = [key for key in made if key != "normal"]
    shiny = elsewhere and "gloss" in made and "normal" in inputs
    if shiny:  # beside these normals, which its mips widen by
        made.remove("gloss")
        drawn_maps.append("gloss")
        roles["gloss"] = []
    if drawn_maps:
        own = [role for key in drawn_maps for role in roles[key]]
        own += ["normal"] if "gloss" in drawn_maps and "normal" in has and "normal" not in own else []
        sources, bumps, brightness = {role: has[role] for role in own}, None, None
        if "gloss" in drawn_maps and "normal" in inputs and "normal" not in has:
            source = "height" if "height" in has else "color"
            sources["bumps"], bumps = has[source], maps_of(source, ["normal"])
        if shiny:
            sources["brightness"], brightness = has["color"], maps_of("color", ["gloss"])
        fields_of = _fields(one.authored, own, cast=cast)
        authored = AuthoredSettings(
            only=drawn_maps, bumps=bumps, brightness=brightness, **fields_of, **common
        )
        add("drawn maps", "authored", sources, drawn_maps, **asdict(authored))
    if made:
        add_maps("maps", "color", made)
    if "emission" in inputs:
        emission = ColorSettings(product="emission", **plain)
        add("emission", "color", {"image": has["emission"]}, ["emission"], **asdict(emission))


def _filtered(one: MapSet) -> str | tuple[str, str]:
    """Returns whether filters read the opposite edge of a set's maps, as bakers take it. They see a mirrored
    map as clamped: beyond its edge lie the same texels again."""
    u, v = ("repeat" if way == "repeat" else "clamp" for way in one.wrap or ("clamp", "clamp"))
    return u if u == v else (u, v)


def _fields(
    authored: Iterable[tuple[str, Any]], roles: Collection[str], *, cast: bool = False
) -> dict[str, Any]:
    """Returns fields of AuthoredSettings for pictures of these roles. cast: with those of occlusion that is
    cast from the mesh."""
    kept = {key: value for key, value in authored if cast or key not in _CAST}
    kept["channels"] = {role: channel for role, channel in kept.get("channels", ()) if role in roles}
    kept["inverted"] = [role for role in kept.get("inverted", ()) if role in roles]
    return kept


_CAST = {"occlusion_cast", *(one.name for one in fields(CastSettings))}

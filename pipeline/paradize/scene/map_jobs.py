"""The jobs of a map set: one for its colour, and one for each way in which its other maps are made. Does not
import numpy."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from paradize.map_table import AUTHORED, DERIVED
from paradize.scene.baker_settings import AuthoredSettings, CastSettings, ColorSettings, MapSettings
from paradize.scene.jobs import Output, Requirements
from paradize.scene.map_sets import MapSet, SceneMaps
from paradize.scene.pass_inputs import MADE_OF, drawing_passes, map_inputs


@dataclass(frozen=True)
class _MapOrigins:
    """How the maps of a set are made, but for colour and emission. of_heights, authored, of_color: the maps
    by way. pictures: the roles of the pictures that each authored map is made of; none: occlusion that is
    cast from the mesh, or gloss of the colour beside normals that are not. gloss_of_color: the latter."""

    of_heights: tuple[str, ...]
    authored: tuple[str, ...]
    of_color: tuple[str, ...]
    pictures: Mapping[str, tuple[str, ...]]
    gloss_of_color: bool


def _map_origins(map_set: MapSet, inputs: Collection[str]) -> _MapOrigins:
    """inputs: the maps that passes read."""
    has = map_set.pictures
    pictures = {key: tuple(role for role in MADE_OF[key] if role in has) for key in AUTHORED if key in inputs}
    of_heights: tuple[str, ...] = ()
    if "normal" in pictures:
        pictures["normal"] = ("normal",) if "normal" in has else ()
        of_heights = ("normal",) if "height" in has and "normal" not in has else ()
    authored = [
        key for key, own in pictures.items() if own or (key == "occlusion" and map_set.casts_occlusion)
    ]
    of_color = [key for key in DERIVED if key in inputs and key in map_set.derived and not pictures.get(key)]
    if "color" not in inputs or "color" not in has:
        of_color = []
    gloss_of_color = False
    if "normal" in has or "height" in has:
        of_color = [key for key in of_color if key != "normal"]
        gloss_of_color = "gloss" in of_color and "normal" in inputs
    if gloss_of_color:  # its mips widen by the normals
        of_color.remove("gloss")
        authored.append("gloss")
        pictures["gloss"] = ()
    return _MapOrigins(of_heights, tuple(authored), tuple(of_color), pictures, gloss_of_color)


def add_map_set(
    required: Requirements, map_set: MapSet, maps: SceneMaps, drawn_in: Mapping[str, tuple[str, ...]]
) -> None:
    """Adds the jobs of a map set. drawn_in: the views that draw each object."""
    inputs = map_inputs(map_set, map_set.materials, maps, drawn_in)
    drawn = tuple(
        dict.fromkeys(view for user in map_set.materials for view in drawing_passes(drawn_in[user]))
    )
    shaded = tuple(view for view in drawn if view != "shadow")
    layout = {"layout": map_set.layout} if map_set.layout else {}

    def add(
        what: str, baker: str, sources: Mapping[str, Path], keys: Sequence[str], settings: Mapping[str, Any]
    ) -> None:
        outputs = [
            Output(f"{map_set.name}_{key}", "texture", key, inputs[key], drawn if key == "color" else shaded)
            for key in keys
        ]
        required.add(
            f"{map_set.name} {what}", baker, {**sources, **layout}, outputs, map_set.materials, **settings
        )

    origins = _map_origins(map_set, inputs)
    if "color" in inputs:
        add("colour", "color", _color_sources(map_set), ["color"], _color_settings(map_set))
    if origins.of_heights:
        heights = {"image": map_set.pictures["height"]}
        add(
            "bumps", "maps", heights, origins.of_heights, _map_settings(map_set, "height", origins.of_heights)
        )
    if origins.authored:
        sources, settings = _authored_maps(map_set, origins, with_normals="normal" in inputs)
        add("authored maps", "authored", sources, origins.authored, settings)
    if origins.of_color:
        color = {"image": map_set.pictures["color"]}
        add("maps", "maps", color, origins.of_color, _map_settings(map_set, "color", origins.of_color))
    if "emission" in inputs:
        srgb = "emission" in map_set.srgb
        emission = asdict(ColorSettings(product="emission", srgb=srgb, **_plain(map_set)))
        add("emission", "color", {"image": map_set.pictures["emission"]}, ["emission"], emission)


def _common(map_set: MapSet) -> dict[str, Any]:
    """The settings of all bakers of maps."""
    return {"wrap": _filtered(map_set), "layout_materials": list(map_set.layout_materials)}


def _plain(map_set: MapSet) -> dict[str, Any]:
    """The settings of bakers of colours."""
    return _common(map_set) | ({"uncompressed": True} if map_set.tiny else {})


def _color_sources(map_set: MapSet) -> dict[str, Path]:
    """Without a colour map: white, with the picture of alpha."""
    alpha = {"alpha": map_set.pictures["alpha"]} if "alpha" in map_set.pictures and not map_set.opaque else {}
    return {**alpha, "image": map_set.pictures["color" if "color" in map_set.pictures else "alpha"]}


def _color_settings(map_set: MapSet) -> dict[str, Any]:
    read = _fields(map_set.authored, ["alpha"])
    settings = ColorSettings(
        alpha_cutoff=map_set.alpha_cutoff,
        opaque=map_set.opaque,
        alpha_channel=read["channels"].get("alpha", "luminance"),
        alpha_inverted="alpha" in read["inverted"],
        white="color" not in map_set.pictures,
        srgb="color" in map_set.srgb,
        **_plain(map_set),
    )
    return asdict(settings)


def _map_settings(map_set: MapSet, source: str, keys: Sequence[str]) -> dict[str, Any]:
    """Settings of maps that are made of the picture `source`, "color" or "height"."""
    settings = MapSettings.of(
        map_set.relief,
        only=list(keys),
        source=source,
        strength=map_set.strength if source == "color" else map_set.height_strength,
        gloss_groups=list(map_set.gloss_groups) if "gloss" in keys else [],
        **_common(map_set),
    )
    return asdict(settings)


def _authored_maps(
    map_set: MapSet, origins: _MapOrigins, *, with_normals: bool
) -> tuple[dict[str, Path], dict[str, Any]]:
    """The sources and the settings of the authored maps. with_normals: whether normals are read."""
    has = map_set.pictures
    roles = [role for key in origins.authored for role in origins.pictures[key]]
    if "gloss" in origins.authored and "normal" in has and "normal" not in roles:
        roles.append("normal")
    sources, bumps, brightness = {role: has[role] for role in roles}, None, None
    if "gloss" in origins.authored and with_normals and "normal" not in has:
        source = "height" if "height" in has else "color"
        sources["bumps"], bumps = has[source], _map_settings(map_set, source, ["normal"])
    if origins.gloss_of_color:
        sources["brightness"], brightness = has["color"], _map_settings(map_set, "color", ["gloss"])
    cast = map_set.casts_occlusion and "occlusion" in origins.authored
    fields_of = _fields(map_set.authored, roles, cast=cast)
    settings = AuthoredSettings(
        only=list(origins.authored), bumps=bumps, brightness=brightness, **fields_of, **_common(map_set)
    )
    return sources, asdict(settings)


def _filtered(map_set: MapSet) -> str | tuple[str, str]:
    """Returns whether filters read the opposite edge of a set's maps, as bakers take it. They see a mirrored
    map as clamped: beyond its edge lie the same texels again."""
    u, v = ("repeat" if way == "repeat" else "clamp" for way in map_set.wrap or ("clamp", "clamp"))
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


_CAST = {"occlusion_cast", *(field.name for field in fields(CastSettings))}

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


def _map_origins(one: MapSet, inputs: Collection[str]) -> _MapOrigins:
    """inputs: the maps that passes read."""
    has = one.pictures
    pictures = {key: tuple(role for role in MADE_OF[key] if role in has) for key in AUTHORED if key in inputs}
    of_heights: tuple[str, ...] = ()
    if "normal" in pictures:
        pictures["normal"] = ("normal",) if "normal" in has else ()
        of_heights = ("normal",) if "height" in has and "normal" not in has else ()
    authored = [key for key, own in pictures.items() if own or (key == "occlusion" and one.casts_occlusion)]
    of_color = [key for key in DERIVED if key in inputs and key in one.derived and not pictures.get(key)]
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
    required: Requirements, one: MapSet, maps: SceneMaps, drawn_in: Mapping[str, tuple[str, ...]]
) -> None:
    """Adds the jobs of a map set. drawn_in: the views that draw each object."""
    inputs = map_inputs(one, one.materials, maps, drawn_in)
    drawn = tuple(dict.fromkeys(view for user in one.materials for view in drawing_passes(drawn_in[user])))
    shaded = tuple(view for view in drawn if view != "shadow")
    layout = {"layout": one.layout} if one.layout else {}

    def add(
        what: str, baker: str, sources: Mapping[str, Path], keys: Sequence[str], settings: Mapping[str, Any]
    ) -> None:
        outputs = [
            Output(f"{one.name}_{key}", "texture", key, inputs[key], drawn if key == "color" else shaded)
            for key in keys
        ]
        required.add(f"{one.name} {what}", baker, {**sources, **layout}, outputs, one.materials, **settings)

    origins = _map_origins(one, inputs)
    if "color" in inputs:
        add("colour", "color", _color_sources(one), ["color"], _color_settings(one))
    if origins.of_heights:
        heights = {"image": one.pictures["height"]}
        add("bumps", "maps", heights, origins.of_heights, _map_settings(one, "height", origins.of_heights))
    if origins.authored:
        sources, settings = _authored_maps(one, origins, with_normals="normal" in inputs)
        add("authored maps", "authored", sources, origins.authored, settings)
    if origins.of_color:
        color = {"image": one.pictures["color"]}
        add("maps", "maps", color, origins.of_color, _map_settings(one, "color", origins.of_color))
    if "emission" in inputs:
        emission = asdict(ColorSettings(product="emission", **_plain(one)))
        add("emission", "color", {"image": one.pictures["emission"]}, ["emission"], emission)


def _common(one: MapSet) -> dict[str, Any]:
    """The settings of all bakers of maps."""
    return {"wrap": _filtered(one), "layout_materials": list(one.layout_materials)}


def _plain(one: MapSet) -> dict[str, Any]:
    """The settings of bakers of colours."""
    return _common(one) | ({"uncompressed": True} if one.tiny else {})


def _color_sources(one: MapSet) -> dict[str, Path]:
    """Without a colour map: white, with the picture of alpha."""
    alpha = {"alpha": one.pictures["alpha"]} if "alpha" in one.pictures and not one.opaque else {}
    return {**alpha, "image": one.pictures["color" if "color" in one.pictures else "alpha"]}


def _color_settings(one: MapSet) -> dict[str, Any]:
    read = _fields(one.authored, ["alpha"])
    settings = ColorSettings(
        alpha_cutoff=one.alpha_cutoff,
        opaque=one.opaque,
        alpha_channel=read["channels"].get("alpha", "luminance"),
        alpha_inverted="alpha" in read["inverted"],
        white="color" not in one.pictures,
        **_plain(one),
    )
    return asdict(settings)


def _map_settings(one: MapSet, source: str, keys: Sequence[str]) -> dict[str, Any]:
    """Settings of maps that are made of the picture `source`, "color" or "height"."""
    settings = MapSettings.of(
        one.relief,
        only=list(keys),
        source=source,
        strength=one.strength if source == "color" else one.height_strength,
        gloss_groups=list(one.gloss_groups) if "gloss" in keys else [],
        **_common(one),
    )
    return asdict(settings)


def _authored_maps(
    one: MapSet, origins: _MapOrigins, *, with_normals: bool
) -> tuple[dict[str, Path], dict[str, Any]]:
    """The sources and the settings of the authored maps. with_normals: whether normals are read."""
    has = one.pictures
    roles = [role for key in origins.authored for role in origins.pictures[key]]
    if "gloss" in origins.authored and "normal" in has and "normal" not in roles:
        roles.append("normal")
    sources, bumps, brightness = {role: has[role] for role in roles}, None, None
    if "gloss" in origins.authored and with_normals and "normal" not in has:
        source = "height" if "height" in has else "color"
        sources["bumps"], bumps = has[source], _map_settings(one, source, ["normal"])
    if origins.gloss_of_color:
        sources["brightness"], brightness = has["color"], _map_settings(one, "color", ["gloss"])
    cast = one.casts_occlusion and "occlusion" in origins.authored
    fields_of = _fields(one.authored, roles, cast=cast)
    settings = AuthoredSettings(
        only=list(origins.authored), bumps=bumps, brightness=brightness, **fields_of, **_common(one)
    )
    return sources, asdict(settings)


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

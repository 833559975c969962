"""Which maps and which attributes of a mesh the player reads, and why, in words. Does not import numpy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from paradize.map_table import maps_of
from paradize.player_limits import VIEWS
from paradize.scene.map_sets import GLOSS_ROLES, OCCLUSION_ROLES, DrawnMaterial, MapSet, ObjectMaps, SceneMaps
from paradize.scene.settings import Scene, SceneObject

BLACK = (0.0, 0.0, 0.0)


_NAMED = 4  # objects, and materials of one, that a reason names


def drawing_passes(views: tuple[str, ...]) -> tuple[str, ...]:
    """The passes that draw an object. views: those that the object is drawn in, the camera's first."""
    return ("objects", *views[1:]) if "camera" in views else views


def listed(*what: str, most: int | None = None) -> str:
    """Joins texts as a list in English: one, two and three. most: of them that are named, and then how many
    more there are."""
    if most is not None and len(what) > most + 1:
        what = (*what[:most], f"{len(what) - most} more")
    return " and ".join(part for part in (", ".join(what[:-1]), *what[-1:]) if part)


def seen_in(what: str, views: tuple[str, ...]) -> str:
    """Describes what these views draw of `what`."""
    by_view = {"camera": what, "shadow": "its shadow", "reflection": "its mirror image"}
    parts = [text for view, text in by_view.items() if view in views] or [
        "what is seen of it through the water"
    ]
    return listed(*parts) if "camera" in views else f"{what}: {listed(*parts)}"


def views_of(scene: Scene) -> tuple[str, ...]:
    """Returns the views that the scene draws."""
    return tuple(name for name in VIEWS if name == "camera" or getattr(scene, name))


def views_of_objects(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Returns the views that draw each object, by its name."""
    views = views_of(scene)
    return {item.name: tuple(view for view in views if view in item.views) for item in scene.objects}


def map_inputs(
    map_set: MapSet,
    users: Mapping[str, Sequence[str]],
    maps: SceneMaps,
    drawn_in: Mapping[str, tuple[str, ...]],
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
    of = _owners(map_set, shaded or users)
    inputs: dict[str, str] = {}
    has = map_set.pictures.keys()
    if ("color" in has or ("alpha" in has and not map_set.opaque)) and (shaded or cut):
        shown = f"the swatches of a palette on {of}" if map_set.palette else f"the object {of}"
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
        owners = (f"{name}'s {_few(keys)}" for name, keys in found.items() if keys)
        return listed(*owners, most=_NAMED)

    derived = map_set.derived if "color" in has else ()
    if {"normal", "height"} & has or ("normal" in derived and map_set.strength > 0.0):
        inputs["normal"] = f"bumps on {of}"
    if ("height" in has or "height" in derived) and (deep := having("parallax_scale")):
        inputs["height"] = f"parallax of {deep}"
    if (set(GLOSS_ROLES) & has or "gloss" in derived) and (shiny := having("specular", "metalness")):
        inputs["gloss"] = f"highlights on {shiny}"
    metal = "metalness" in has and having("metalness")
    if map_set.casts_occlusion and having("occlusion_strength"):
        beside = " and metal" if metal else ""
        inputs["occlusion"] = f"light from around{beside} on {of}; the occlusion is cast from the mesh"
    elif ("occlusion" in has and having("occlusion_strength")) or metal:
        inputs["occlusion"] = f"light from around and metal on {of}"
    if "emission" in has and (bright := having("emission")):
        inputs["emission"] = f"light that {bright} give off"
    return inputs


# Roles of pictures that each map of a set may be made of; others are derived from the colour.
MADE_OF = dict.fromkeys(maps_of("object"), ()) | {
    "color": ("color", "alpha"),
    "normal": ("normal", "height"),
    "height": ("height",),
    "gloss": GLOSS_ROLES,
    "occlusion": OCCLUSION_ROLES,
    "emission": ("emission",),
}


def unread_pictures(scene: Scene, maps: SceneMaps) -> list[tuple[Path, str]]:
    """Returns the pictures of materials that no pass reads, so that they are not baked, and why."""
    drawn_in = views_of_objects(scene)
    found: list[tuple[Path, str]] = []
    for map_set in maps.sets:
        inputs = map_inputs(map_set, map_set.materials, maps, drawn_in)
        read = {role for key in inputs for role in MADE_OF[key]}
        read -= {"height"} if "normal" in map_set.pictures and "height" not in inputs else set()
        read -= {"alpha"} if map_set.opaque else set()
        of = _owners(map_set, map_set.materials)
        for role, path in map_set.pictures.items():
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


def _owners(map_set: MapSet, users: Iterable[str]) -> str:
    """The objects that use a set, in words; with the materials where an object has other sets."""
    whole = map_set.name in map_set.materials
    return listed(
        *(name if whole else f"{name} ({_few(map_set.materials[name])})" for name in users), most=_NAMED
    )


def _few(names: Sequence[str]) -> str:
    """The first of some names, and how many more there are."""
    more = len(names) - _NAMED
    return ", ".join(names) if more <= 1 else f"{', '.join(names[:_NAMED])} and {more} more"


def mesh_inputs(
    item: SceneObject,
    known: ObjectMaps,
    views: Sequence[str],
    read: Iterable[str],
    second: Iterable[str] = (),
) -> dict[str, str]:
    """Returns the attributes of an object's mesh that the player reads in these views (by glTF name), and
    why. read: the maps of its materials that are read; second: those on second texture coordinates. Normal
    maps and parallax need tangents; nothing else does. Shadows read vertex colours only for their alpha."""
    inputs = {"POSITION": seen_in(f"the object {item.name}", tuple(views))}
    if _shades(views):
        inputs["NORMAL"] = f"the light on {item.name}"
    read, second = set(read), set(second)
    if {"normal", "height"} & (read | second):
        inputs["TANGENT"] = "the frame of bumps and parallax"
    if read:
        inputs["TEXCOORD_0"] = f"where {item.name}'s maps lie"
    if second:
        inputs["TEXCOORD_1"] = f"where {item.name}'s maps of {listed(*sorted(second))} lie"
    if item.sway_m > 0.0 or item.flutter_m > 0.0:
        inputs["_SWAY"] = f"how {item.name} moves in the wind"
    tinted = [
        name
        for name, drawn in known.drawn.items()
        if drawn.vertex_colors and (_shades(views) or drawn.alpha_mode != "opaque")
    ]
    if tinted:
        inputs["COLOR_0"] = f"the vertex colours of {item.name}'s {', '.join(tinted)}"
    return inputs

"""Joins what a model says of a material with what the scene says: the scene wins, field by field."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from paradize.build.materials.model_facts import MaterialFacts
from paradize.material import MapSource, Material, Picture, Wrap
from paradize.scene.baker_settings import CastSettings
from paradize.scene.map_sets import GLOSS_ROLES, NO_COVERAGE, DrawnMaterial
from paradize.scene.settings import ObjectMaterial, SceneObject

# Fields of a scene's material that name pictures, by role.
PICTURES = {
    **{role: role for role in ("color", "alpha", "normal", "height", "roughness")},
    **{role: role for role in ("metalness", "occlusion", "emission")},
    "smoothness": "smoothness_map",
    "specular": "specular_map",
}
# glTF packs these into the channels of one picture.
_PACKED = {"occlusion": "r", "roughness": "g", "metalness": "b"}
PLASTIC = 0.5  # `specular` in scene.json of what reflects 4 % seen straight on
ROUGH = 0.3  # smoothness where nobody says one
LEAF = 0.55  # translucency of what looks like foliage


def joined(item: SceneObject, name: str, facts: MaterialFacts | None) -> Material:
    """Returns the model's material with the pictures of the scene; factors of the maps that they replace do
    not count. facts: None where the model is not known."""
    material = facts.material if facts else Material(name)
    table = item.materials.get(name, ObjectMaterial())
    given: dict[str, Path] = {}
    for role in ("color", "alpha"):
        if path := getattr(item, role):
            given[role] = path
    given |= {role: path for role, key in PICTURES.items() if (path := getattr(table, key))}
    maps = dict(material.maps)
    if "color" in given:
        maps.pop("alpha", None)
        material = replace(material, color=(1.0, 1.0, 1.0))
    if "color" in given or "emission" in given:
        material = replace(material, unlit=False)
    if "roughness" in given or "smoothness" in given:
        maps = {role: source for role, source in maps.items() if role not in ("roughness", "smoothness")}
        material = replace(material, roughness=None, smoothness=1.0)
    if "metalness" in given:
        material = replace(material, metalness=None)
    if "specular" in given:
        material = replace(material, specular=None)
    if "occlusion" in given:
        material = replace(material, occlusion_strength=1.0)
    packed = [role for role in _PACKED if role in given]
    for role, path in given.items():
        shared = role in _PACKED and sum(given[other] == path for other in packed) > 1
        channel: Any = _PACKED[role] if shared else "rgb" if role in _COLORED else "luminance"
        maps[role] = MapSource(Picture(path, name=path.name), channel)
    if "emission" in given and material.emission == (0.0, 0.0, 0.0):
        material = replace(material, emission=(1.0, 1.0, 1.0))
    if "normal" in given:
        material = replace(material, green_down=None, normal_scale=1.0)
    if table.green != "auto":
        material = replace(material, green_down=table.green == "down")
    return replace(material, maps=maps, second=tuple(role for role in material.second if role not in given))


_COLORED = ("color", "normal", "emission")


def is_authored(material: Material) -> bool:
    """Whether a material brings authored maps, so that none are made of its colour."""
    return bool({"normal", "roughness", "smoothness"} & material.maps.keys())


def drawn(
    material: Material, table: ObjectMaterial, facts: MaterialFacts | None, *, gloss: bool
) -> DrawnMaterial:
    """Returns how a material is drawn. gloss: whether it has an authored gloss map, which holds its
    factors."""
    maps = material.maps
    specular, smoothness = 0.0, ROUGH
    if gloss:
        specular = PLASTIC * max(1.0, material.specular or 0.0)  # the map holds up to 1
        smoothness = material.smoothness if "smoothness" in maps else 1.0
    elif material.roughness is not None or material.specular is not None:
        specular = PLASTIC * (1.0 if material.specular is None else material.specular)
        smoothness = ROUGH if material.roughness is None else 1.0 - material.roughness
    metalness = material.metalness or 0.0
    if "metalness" in maps:
        metalness = 1.0  # the map holds the factor
    mode, cutoff = alpha_of(material, table, facts)
    two_sided = bool(material.two_sided if table.two_sided is None else table.two_sided)
    metalness = metalness if table.metalness_factor is None else table.metalness_factor
    is_leaf = two_sided and mode == "mask" and metalness == 0.0 and facts is not None and facts.green
    translucency = LEAF if is_leaf else 0.0
    return DrawnMaterial(
        color=material.color,
        opacity=material.opacity,
        metalness=metalness,
        emission=material.emission,
        specular=specular if table.specular is None else table.specular,
        smoothness=smoothness if table.smoothness is None else table.smoothness,
        occlusion_strength=1.0 if "occlusion" in maps else material.occlusion_strength,
        parallax_scale=table.parallax_scale,
        parallax_bias=table.parallax_bias,
        two_sided=two_sided,
        translucency=translucency if table.translucency is None else table.translucency,
        alpha_mode=mode,
        alpha_cutoff=cutoff,
        nearest=_is_nearest(material) if table.filter == "auto" else table.filter == "nearest",
        unlit=material.unlit,
        vertex_lit=table.vertex_lit,
    )


def _is_nearest(material: Material) -> bool:
    return material.leading is not None and material.leading.nearest


def wrap_of(item: SceneObject, table: ObjectMaterial, material: Material) -> tuple[Wrap, Wrap] | None:
    """Returns what lies beyond the edges of a material's maps along u and v, by the scene, else by the model;
    None where nobody says it."""
    words: Any = (table.wrap, table.wrap) if isinstance(table.wrap, str) else table.wrap
    said = (material.leading.wrap if material.leading else None) or (None, None)
    ways: list[Any] = [
        word if word != "auto" else item.wrap if item.wrap != "auto" else by_model
        for word, by_model in zip(words, said, strict=True)
    ]
    if ways == [None, None]:
        return None
    return ways[0] or "repeat", ways[1] or "repeat"


def alpha_of(material: Material, table: ObjectMaterial, facts: MaterialFacts | None) -> tuple[Any, float]:
    """Returns what alpha does ("opaque", "mask" or "blend") and the cutoff of a mask, else 0."""
    mode: str | None = None
    if table.alpha_mode != "auto":
        mode = table.alpha_mode
    elif table.alpha_cutoff is not None:
        mode = "mask" if table.alpha_cutoff > 0.0 else "opaque"
    elif material.alpha_mode is not None:
        mode = material.alpha_mode
        if facts and facts.solid and material.opacity == 1.0 and material.alpha_cutoff <= 1.0:
            mode = "opaque"  # exporters call all materials of a model blended that has one of glass
    if mode is None:
        mode = facts.alpha if facts and {"color", "alpha"} & material.maps.keys() else "opaque"
        mode = "opaque" if mode in NO_COVERAGE else mode
        mode = "blend" if mode == "opaque" and material.opacity < 1.0 else mode
    cutoff = material.alpha_cutoff if table.alpha_cutoff is None else table.alpha_cutoff
    return mode, cutoff if mode == "mask" else 0.0


def is_guessed(material: Material, table: ObjectMaterial) -> bool:
    """Whether nobody says what the alpha of a material does."""
    return table.alpha_mode == "auto" and table.alpha_cutoff is None and material.alpha_mode is None


def authored_fields(material: Material) -> tuple[tuple[str, Any], ...]:
    """Returns the fields of AuthoredSettings (scene/baker_settings.py) that differ from the default, of the
    maps that the material has."""
    maps = material.maps
    roles = [role for role in sorted(maps) if role not in ("color", "emission")]
    channels = {
        role: maps[role].channel for role in roles if role != "normal" and maps[role].channel != "rgb"
    }
    found: dict[str, Any] = {
        "channels": tuple(channels.items()),
        "inverted": tuple(role for role in roles if maps[role].inverted),
    }
    if "normal" in maps:
        found |= {"green_down": material.green_down, "normal_scale": material.normal_scale}
    if maps.keys() & set(GLOSS_ROLES):
        mapped = maps.keys() & {"roughness", "smoothness"}
        rough = material.roughness
        found["roughness"] = (1.0 if mapped else 1.0 - ROUGH) if rough is None else rough
        found["specular"] = 1.0 if material.specular is None else min(material.specular, 1.0)
    if "metalness" in maps:
        found["metalness"] = 1.0 if material.metalness is None else material.metalness
    if "occlusion" in maps:
        found["occlusion_strength"] = material.occlusion_strength
    return tuple(found.items())


def cast_fields(
    item: SceneObject, material: Material, facts: MaterialFacts | None, see_through: tuple[str, ...]
) -> dict[str, Any]:
    """Returns the fields of AuthoredSettings (scene/baker_settings.py) of a material whose occlusion is to be
    cast from the mesh; none where it brings its own, no light falls on it, or it has no UVs. see_through:
    materials of the object that hold back no light."""
    if item.occlusion != "mesh" or facts is None or facts.uvs is None:
        return {}
    if "occlusion" in material.maps or material.unlit:
        return {}
    cast = asdict(CastSettings.of(item, see_through=see_through))
    return {"occlusion_cast": True, **cast}

"""Materials of a GLB without pictures: the factors of glTF 2.0.

Sources: The Khronos Group, "glTF 2.0 Specification", 2021, section 3.9; extensions KHR_materials_unlit,
KHR_materials_emissive_strength and KHR_materials_specular.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from paradize.formats.glb.layout import SPECULAR, STRENGTH, UNLIT
from paradize.material import Material

_MODES = {"mask": "MASK", "blend": "BLEND"}
_NAMED = 3  # materials in a warning


def plain_material(name: str, base_color: Sequence[float] | None) -> dict[str, Any]:
    """The entry of a material of which no more than its colour is known; None: not even that."""
    if base_color is None:
        return {"name": name}
    factor = [_share(value) for value in base_color]
    return {"name": name, "pbrMetallicRoughness": {"baseColorFactor": [*factor, 1.0], "metallicFactor": 0.0}}


def material_entry(name: str, material: Material) -> dict[str, Any]:
    """The entry of a material without its pictures. Where a picture says which parts give off light or are
    metal, none are."""
    color = material.emission if material.unlit else material.color
    look: dict[str, Any] = {
        "baseColorFactor": [*(_share(value) for value in color), _share(material.opacity)]
    }
    entry: dict[str, Any] = {"name": name, "pbrMetallicRoughness": look}
    extensions: dict[str, Any] = {}
    look["metallicFactor"] = 0.0 if "metalness" in material.maps else _share(material.metalness or 0.0)
    if material.roughness is not None:
        look["roughnessFactor"] = _share(material.roughness)
    if material.unlit:
        extensions[UNLIT] = {}
    else:
        specular = 1.0 if material.specular is None else material.specular
        if specular > 1.0:
            extensions[SPECULAR] = {"specularColorFactor": [specular] * 3}
        elif specular < 1.0:
            extensions[SPECULAR] = {"specularFactor": _share(specular)}
        strongest = 0.0 if "emission" in material.maps else max(material.emission)
        if strongest > 0.0:
            entry["emissiveFactor"] = [value / max(1.0, strongest) for value in material.emission]
        if strongest > 1.0:
            extensions[STRENGTH] = {"emissiveStrength": strongest}
    if extensions:
        entry["extensions"] = extensions
    if material.alpha_mode in _MODES:
        entry["alphaMode"] = _MODES[material.alpha_mode]
    if material.alpha_mode == "mask":
        entry["alphaCutoff"] = material.alpha_cutoff
    if material.two_sided:
        entry["doubleSided"] = True
    return entry


def extensions_of(entries: Iterable[Mapping[str, Any]]) -> list[str]:
    """The extensions that these entries use, sorted."""
    return sorted({name for entry in entries for name in entry.get("extensions", ())})


def left_out(materials: Mapping[str, Material], used: Collection[str]) -> str | None:
    """Which pictures of the used materials material_entry leaves out, in a clause; None: there are none."""
    bare = [name for name in dict.fromkeys(used) if name in materials and materials[name].maps]
    if not bare:
        return None
    roles = list(dict.fromkeys(role for name in bare for role in materials[name].maps))
    more = f" and {len(bare) - _NAMED} more materials" if len(bare) > _NAMED else ""
    named = ", ".join(repr(name) for name in bare[:_NAMED])
    plural = "s" if len(roles) > 1 else ""
    return f"the picture{plural} of {', '.join(roles)} of {named}{more}"


def _share(value: float) -> float:
    return min(max(float(value), 0.0), 1.0)

"""Materials of a glTF model, and how each places its pictures on the mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import Any

from paradize.angles import PI, sine_cosine
from paradize.errors import one_line
from paradize.material import (
    MAX_EMISSION,
    MAX_NORMAL_SCALE,
    PLASTIC_REFLECTANCE,
    REPEATED,
    SECOND_ROLES,
    AlphaMode,
    Channel,
    MapSource,
    Material,
    Placed,
    Reflected,
)
from paradize.readers.gltf.document import Document
from paradize.readers.gltf.pictures import Pictures
from paradize.readers.gltf.texture_transform import TextureTransform
from paradize.readers.metal import metal_of
from paradize.readers.placed import placed_on
from paradize.readers.record import DEFAULT_NAME

_TRANSFORM = "KHR_texture_transform"
_GLOSSINESS = "KHR_materials_pbrSpecularGlossiness"
_STRENGTH = "KHR_materials_emissive_strength"
_TRANSMISSION, _VOLUME = "KHR_materials_transmission", "KHR_materials_volume"
_STRONGEST = 1e6  # colour of a reflection
_CLEAREST = 0.92  # of the light goes through glass: its two sides reflect 4 % each
_MAX_NAME = 120
_MODES: dict[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}
# Maps in the order in which they decide the texture coordinates, and the channel of each.
_CHANNELS: dict[str, Channel] = {
    "color": "rgb", "alpha": "a", "normal": "rgb", "roughness": "g", "metalness": "b", "smoothness": "a",
    "emission": "rgb", "specular": "a", "occlusion": "r",
}  # fmt: skip


_SRGB = ("color", "emission")  # glTF 2.0, 3.9.2: what a picture says of its colours does not count

EqualSets = Callable[[int, int, int], bool]


@dataclass(frozen=True)
class PlacedMaterial:
    """A material with the placement of its maps, and that of those on second texture coordinates; None where
    it has no such maps."""

    material: Material
    placement: TextureTransform | None = None
    second: TextureTransform | None = None


def default_material() -> PlacedMaterial:
    """The material of primitives without one: glTF's default."""
    return PlacedMaterial(
        Material(DEFAULT_NAME, alpha_mode="opaque", two_sided=False, roughness=1.0, metalness=1.0)
    )


def read_materials(document: Document, pictures: Pictures, equal_sets: EqualSets) -> list[PlacedMaterial]:
    """All materials of a document, by their number. Names are made unique. equal_sets: whether two sets of
    texture coordinates, by number, are the same wherever a material is."""
    taken = {DEFAULT_NAME: 1}  # and the next number behind each name
    found = []
    for index in range(len(document.table("materials"))):
        entry, place = document.item("materials", index, "/materials"), f"/materials/{index}"
        said = entry.get("name")
        name = one_line(said)[:_MAX_NAME].strip() if isinstance(said, str) else ""
        name = name or f"material_{index}"
        base, k = name, taken.get(name, 0)
        while name in taken:
            name, k = f"{base}_{k}", k + 1
        taken[base], taken[name] = max(k, 1), 1
        reader = _Reader(document, pictures, entry, place, partial(equal_sets, index))
        found.append(reader.read(name))
    return found


class _Reader:
    """Reads one material."""

    def __init__(
        self,
        document: Document,
        pictures: Pictures,
        entry: dict[str, Any],
        place: str,
        equal_sets: Callable[[int, int], bool],
    ) -> None:
        self.document, self.pictures, self.entry, self.place = document, pictures, entry, place
        self.equal_sets = equal_sets
        self.maps: dict[str, MapSource] = {}
        self.placements: dict[str, TextureTransform] = {}

    def read(self, name: str) -> PlacedMaterial:
        document, entry, place = self.document, self.entry, self.place
        said = document.get(entry, place, "alphaMode", str, "OPAQUE")
        if said not in _MODES:
            raise document.fault(f"{said[:20]!r}, expected OPAQUE, MASK or BLEND", f"{place}/alphaMode")
        cutoff = document.number(entry, place, "alphaCutoff", 0.5)
        hidden = said == "MASK" and cutoff > 1.0
        if hidden:
            document.warn(f"alphaCutoff {cutoff:g}: nothing of the material is opaque enough to show", place)
        material = Material(
            name,
            alpha_mode=_MODES[said],
            alpha_cutoff=min(cutoff, 1.0),
            two_sided=document.get(entry, place, "doubleSided", bool, False),
            green_down=False,
        )
        base = document.get(entry, place, "pbrMetallicRoughness", dict, None)
        gloss = document.extension(entry, place, _GLOSSINESS)
        if gloss is not None and not base:
            material = self._glossiness(material, gloss)
        else:
            if gloss is not None:
                document.warn(f"extension {_GLOSSINESS}: its metallic-roughness form is read instead", place)
            material = self._metallic(material, base or {})
        material = self._transmission(material)
        normal = self._maps(("normal",), entry, place, "normalTexture")
        scale = document.number(
            normal, f"{place}/normalTexture", "scale", 1.0, -MAX_NORMAL_SCALE, MAX_NORMAL_SCALE
        )
        occlusion = self._maps(("occlusion",), entry, place, "occlusionTexture")
        strength = document.share(occlusion, f"{place}/occlusionTexture", "strength")
        self._maps(("emission",), entry, place, "emissiveTexture")
        factor = document.floats(entry, place, "emissiveFactor", 3, (0.0, 0.0, 0.0))
        more = document.extension(entry, place, _STRENGTH) or {}
        times = document.number(more, f"{place}/extensions/{_STRENGTH}", "emissiveStrength", 1.0)
        # glTF allows factors of up to 1; exporters older than emissiveStrength write bright ones as more.
        r, g, b = document.within(
            tuple(c * times for c in factor), f"{place}/emissiveFactor", 0.0, MAX_EMISSION
        )
        material = replace(
            material,
            normal_scale=scale,
            occlusion_strength=strength,
            emission=(r, g, b),
            specular=self._specular(),
        )
        if document.extension(entry, place, "KHR_materials_unlit") is not None:
            material = self._unlit(material)
        if hidden:
            material = replace(material, opacity=0.0)
        material = replace(material, reflected=self._reflected(material))
        first, second, on_second = self._placed(name)
        return PlacedMaterial(replace(material, maps=dict(self.maps), second=on_second), first, second)

    def _unlit(self, material: Material) -> Material:
        """A material that no light changes gives off its colour, and reflects nothing."""
        color = self.maps.get("color")
        self.maps = {} if color is None else {"color": color, "emission": color}
        self.placements = {role: self.placements[role] for role in self.maps if role in self.placements}
        if color is not None and "color" in self.placements:
            self.placements["emission"] = self.placements["color"]
        return replace(
            material,
            color=(0.0, 0.0, 0.0),
            emission=material.color,
            specular=0.0,
            metalness=0.0,
            roughness=1.0,
            unlit=True,
            reflected=None,
        )

    def _metallic(self, material: Material, base: dict[str, Any]) -> Material:
        document, place = self.document, f"{self.place}/pbrMetallicRoughness"
        r, g, b, a = document.shares(base, place, "baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        self._maps(self._color_roles(material), base, place, "baseColorTexture")
        self._maps(("roughness", "metalness"), base, place, "metallicRoughnessTexture")
        return replace(
            material,
            color=(r, g, b),
            opacity=1.0 if material.alpha_mode == "opaque" else a,
            metalness=document.share(base, place, "metallicFactor"),
            roughness=document.share(base, place, "roughnessFactor"),
        )

    def _glossiness(self, material: Material, gloss: dict[str, Any]) -> Material:
        """The older model of light, as near as metalness and roughness come to it."""
        document, place = self.document, f"{self.place}/extensions/{_GLOSSINESS}"
        r, g, b, a = document.shares(gloss, place, "diffuseFactor", (1.0, 1.0, 1.0, 1.0))
        self._maps(self._color_roles(material), gloss, place, "diffuseTexture")
        picture = self._maps(("smoothness",), gloss, place, "specularGlossinessTexture")
        specular = document.shares(gloss, place, "specularFactor", (1.0, 1.0, 1.0))
        smooth = document.share(gloss, place, "glossinessFactor")
        document.warn(f"extension {_GLOSSINESS} is converted to metalness and roughness")
        color, metalness, reflected = (r, g, b), 0.0, None
        mapped = "smoothness" in self.maps
        if mapped:
            red, green, blue = specular
            source = replace(self.maps["smoothness"], channel="rgb", srgb=True)
            reflected = Reflected(source, (red, green, blue))
        elif not picture:
            colors, metal = metal_of(color, specular)
            (r, g, b), metalness = colors.tolist(), float(metal)
        opacity = 1.0 if material.alpha_mode == "opaque" else a
        return replace(
            material,
            color=(r, g, b),
            opacity=opacity,
            metalness=metalness,
            roughness=1.0 if mapped else 1.0 - smooth,
            smoothness=smooth if mapped else 1.0,
            reflected=reflected,
        )

    def _reflected(self, material: Material) -> Reflected | None:
        """The colour of what is reflected, where it lies as the first map does; None, and a warning, where
        not."""
        first = next((role for role in _CHANNELS if role in self.maps), "")
        if not material.reflected or self._is_same(self.placements["smoothness"], self.placements[first]):
            return material.reflected
        what = f"specularGlossinessTexture lies elsewhere than the map of {first}, and its colour is left out"
        mend = "metal is drawn as no metal; convert the model to metallic-roughness"
        self.document.warn(f"{what}: {mend}", f"{self.place}/extensions/{_GLOSSINESS}")
        return None

    def _transmission(self, material: Material) -> Material:
        """A material that light goes through is blended, as dense as its colour is dark."""
        document, place = self.document, f"{self.place}/extensions/{_TRANSMISSION}"
        glass = document.extension(self.entry, self.place, _TRANSMISSION) or {}
        through = document.share(glass, place, "transmissionFactor", 0.0)
        if through == 0.0 or material.alpha_mode != "opaque":
            return material
        if "transmissionTexture" in glass:
            document.warn(f"extension {_TRANSMISSION} is left out where a texture says how much")
            return material
        document.warn(f"extension {_TRANSMISSION}: what shines through is neither bent, blurred nor tinted")
        r, g, b = (c * left for c, left in zip(material.color, self._absorption(), strict=True))
        dielectric = 1.0 if "metalness" in self.maps else 1.0 - (material.metalness or 0.0)
        opacity = 1.0 - _CLEAREST * through * dielectric * (r + g + b) / 3.0
        return replace(material, color=(r, g, b), alpha_mode="blend", opacity=opacity)

    def _absorption(self) -> tuple[float, ...]:
        """The share of each colour that the volume behind a surface lets through, along its thickness."""
        document, place = self.document, f"{self.place}/extensions/{_VOLUME}"
        volume = document.extension(self.entry, self.place, _VOLUME) or {}
        thickness = document.number(volume, place, "thicknessFactor", 0.0)
        distance = document.number(volume, place, "attenuationDistance", inf)
        color = document.shares(volume, place, "attenuationColor", (1.0, 1.0, 1.0))
        if thickness == 0.0 or distance == 0.0:
            return (1.0, 1.0, 1.0)
        return tuple(value ** (thickness / distance) for value in color)

    def _color_roles(self, material: Material) -> tuple[str, ...]:
        """The maps that the picture of a material's colour gives."""
        return ("color",) if material.alpha_mode == "opaque" else ("color", "alpha")

    def _specular(self) -> float:
        """Intensity of the reflection, 1: 4 % at normal incidence, at most 25."""
        document, place = self.document, self.place
        reflected = PLASTIC_REFLECTANCE
        glass = document.extension(self.entry, place, "KHR_materials_ior")
        if glass is not None:
            inner = f"{place}/extensions/KHR_materials_ior"
            if document.get(glass, inner, "ior", float, 1.5) == 0.0:  # as converters write a mirror
                reflected = 1.0
            else:
                ior = document.number(glass, inner, "ior", 1.5, 1.0)
                reflected = ((ior - 1.0) / (ior + 1.0)) ** 2
        shine = document.extension(self.entry, place, "KHR_materials_specular")
        if shine is not None:
            inner = f"{place}/extensions/KHR_materials_specular"
            r, g, b = document.floats(shine, inner, "specularColorFactor", 3, (1.0, 1.0, 1.0))
            r, g, b = document.within((r, g, b), f"{inner}/specularColorFactor", 0.0, inf)
            if max(r, g, b) > min(r, g, b) or "specularColorTexture" in shine:
                document.warn("extension KHR_materials_specular: its tint is left out")
            reflected = min(reflected * min((r + g + b) / 3.0, _STRONGEST), 1.0)
            reflected *= document.share(shine, inner, "specularFactor")
            self._maps(("specular",), shine, inner, "specularTexture")
        return reflected / PLASTIC_REFLECTANCE

    def _maps(self, roles: tuple[str, ...], table: dict[str, Any], place: str, key: str) -> dict[str, Any]:
        """Adds the maps of the texture info at `key` of a table, if it names a texture that can be read.
        Returns the texture info; empty: there is none."""
        document = self.document
        info: dict[str, Any] = document.get(table, place, key, dict, {})
        place = f"{place}/{key}"
        if not info:
            return info
        source = self.pictures.source(document.get(info, place, "index", int), f"{place}/index")
        if source is None:
            return info
        coordinates = document.whole(info, place, "texCoord", 0, 0)
        moved = document.extension(info, place, _TRANSFORM)
        matrix = TextureTransform().matrix
        if moved is not None:
            inner = f"{place}/extensions/{_TRANSFORM}"
            coordinates = document.whole(moved, inner, "texCoord", 0, coordinates)
            x, y = document.floats(moved, inner, "offset", 2, (0.0, 0.0))
            sx, sy = document.floats(moved, inner, "scale", 2, (1.0, 1.0))
            turn = document.get(moved, inner, "rotation", float, 0.0)
            sine, cosine = sine_cosine(turn % (2.0 * PI) * (180.0 / PI))
            matrix = (cosine * sx, sine * sy, x, -sine * sx, cosine * sy, y)
        for role in roles:
            self.maps[role] = replace(source, channel=_CHANNELS[role], srgb=role in _SRGB)
            self.placements[role] = TextureTransform(coordinates, matrix)
        return info

    def _placed(self, name: str) -> tuple[TextureTransform | None, TextureTransform | None, tuple[str, ...]]:
        """The placement of the material's first map; that of the first map that lies elsewhere and may; and
        the roles that lie there. Maps of a third placement are left out."""
        roles = [role for role in _CHANNELS if role in self.maps]
        if not roles:
            return None, None, ()
        first = self.placements[roles[0]]
        others = [role for role in roles if not self._is_same(self.placements[role], first)]
        able = [role for role in others if self._may_lie_elsewhere(role, others)]
        anew = {role: found for role in others if (found := self._drawn_anew(role, roles[0]))}
        # second coordinates cost no picture, and are all there is for what cannot be drawn anew
        able.sort(key=anew.__contains__)
        second = self.placements[able[0]] if able else None
        on_second = [role for role in able if second and self._is_same(self.placements[role], second)]
        for role in anew.keys() - set(on_second):
            self.maps[role] = replace(self.maps[role], placed=anew[role])
        left_out = [role for role in others if role not in on_second and role not in anew]
        for role in left_out:
            del self.maps[role]
        if left_out:
            of = "its maps of" if len(left_out) > 1 else "its map of"
            texts = [f"{role} ({self.placements[role]})" for role in left_out]
            what = f"material {name!r}: {of} {', '.join(texts)} left out"
            where = f"where that of {roles[0]} does ({first})"
            where += f" or that of {on_second[0]} ({second})" if on_second else ""
            self.document.warn(f"{what}; maps lie {where}", self.place)
        return first, second, tuple(on_second)

    def _drawn_anew(self, role: str, leading: str) -> Placed | None:
        """How a map is drawn anew for the coordinates of the leading one; None where it cannot be."""
        found = self.placements[role].relative_to(self.placements[leading])
        if found is None or (role == "normal" and min(found[0]) <= 0.0):
            return None
        wraps = (self.maps[role].wrap or REPEATED, self.maps[leading].wrap or REPEATED)
        return placed_on(*found, None, wraps)

    def _may_lie_elsewhere(self, role: str, others: list[str]) -> bool:
        """Whether a map may lie on second texture coordinates. What gloss is made of lies in one place."""
        split = role in ("roughness", "smoothness") and "specular" in self.maps and "specular" not in others
        return role in SECOND_ROLES and not split

    def _is_same(self, one: TextureTransform, other: TextureTransform) -> bool:
        return one == other or (
            one.matrix == other.matrix and self.equal_sets(one.coordinates, other.coordinates)
        )

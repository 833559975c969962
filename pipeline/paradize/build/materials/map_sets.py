"""Finds the map sets of a scene: from its tables `[object.material.NAME]`, the `color` and `alpha` of its
objects, and the materials of their models.

Materials of one object share a set if their pictures and settings are equal. Sets whose maps follow no UV
layout are shared between objects, too; pictures are compared by their bytes.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from paradize.build.materials.drawn_materials import (
    authored_fields,
    cast_fields,
    drawn,
    is_authored,
    is_guessed,
    joined,
    wrap_of,
)
from paradize.build.materials.model_facts import MaterialFacts, ModelFacts
from paradize.build.materials.model_reader import ModelReader
from paradize.build.materials.udim import MEND, named_as_tile, udim_fault
from paradize.build.options import BuildOptions
from paradize.documents import toml_key
from paradize.errors import GroupedError, ParadizeError, SceneError
from paradize.files import resolved
from paradize.kinds import is_gltf
from paradize.material import REPEATED, Material, Wrap, repeating, uv_width
from paradize.scene.map_sets import (
    GLOSS_ROLES,
    KIT,
    MADE_OF_COLOR,
    NO_COVERAGE,
    PALETTE,
    DrawnMaterial,
    MapSet,
    ObjectMaps,
    SceneMaps,
)
from paradize.scene.settings import ObjectMaterial, Scene, SceneObject
from paradize.store.file_hashes import FileHashCache

_WORTH = 2  # halvings after which four bytes a texel are less than the blocks of the whole picture
_MOST_NAME = 80  # characters of a set's name
_COMPARED = (
    "layout", "wrap", "palette", "derived", "relief", "strength", "height_strength", "gloss_groups", "bleed",
    "authored", "second", "srgb",
)  # fmt: skip


@dataclass
class FoundMaps:
    """The result of find_map_sets. libraries: the files that were read for it. missing: files that were
    looked for but do not exist. warnings: what was guessed. inside: names for messages of pictures that the
    store keeps a copy of, by the copy's path."""

    maps: SceneMaps
    libraries: list[Path] = field(default_factory=list)
    missing: list[Path] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    inside: dict[str, str] = field(default_factory=dict)


def find_map_sets(
    scene: Scene,
    scene_path: Path,
    hash_cache: FileHashCache | None = None,
    tried_libraries: list[Path] | None = None,
    options: BuildOptions | None = None,
) -> FoundMaps:
    """Returns the map sets of a scene. tried_libraries: takes the material files, also of objects that fail.
    Raises a ParadizeError, or GroupedError, for models that cannot be read and for UDIM tiles."""
    found = FoundMaps(SceneMaps((), {}))
    hash_cache = hash_cache or FileHashCache()
    models = ModelReader(resolved(scene_path).parent, hash_cache, options or BuildOptions(jobs=1))
    read_models = models.read(scene.objects)
    facts_of = [(item, read.facts) for item, read in zip(scene.objects, read_models, strict=True)]
    finder = _Finder(hash_cache, scene_path, _kits(facts_of, hash_cache))
    errors: list[ParadizeError] = []
    beside: dict[Path, tuple[Path, ...]] = {}
    for i, (item, read) in enumerate(zip(scene.objects, read_models, strict=True)):
        if tried_libraries is not None:
            tried_libraries += read.tried
        if read.facts is None and item.color is None and read.error:
            errors.append(read.error)
            continue
        if read.facts:
            found.libraries += read.facts.libraries
            beside[item.mesh] = read.facts.libraries[1:]
            found.missing += read.facts.missing
            pictures = [
                by.picture
                for material in read.facts.materials.values()
                for by in material.material.maps.values()
            ]
            for picture in pictures:
                if picture.model:
                    found.inside.setdefault(str(picture.file), f"{item.mesh}: picture {picture.name!r}")
        try:
            finder.add(i, item, read.facts)
        except ParadizeError as error:
            errors.append(error)
    if errors:
        raise GroupedError(errors) if len(errors) > 1 else errors[0]
    sets = {key: finder.finished(key) for key in finder.sets}
    objects = {
        name: ObjectMaps(
            drawn,
            *({material: sets[key] for material, key in own.items()} for own in (keys, finder.second[name])),
        )
        for name, (drawn, keys) in finder.objects.items()
    }
    found.maps = SceneMaps(tuple(sets.values()), objects, beside)
    found.warnings = finder.warnings
    return found


def _kits(models: Iterable[tuple[SceneObject, ModelFacts | None]], hash_cache: FileHashCache) -> set[str]:
    """Returns the SHA-256 of the colour maps of kits: pictures of which several models show little but
    swatches."""
    users: dict[str, set[Path]] = {}
    for item, facts in models:
        for name, material in facts.materials.items() if facts else ():
            picture = joined(item, name, material).picture("color")
            if picture is not None and material.palette >= KIT:
                users.setdefault(hash_cache.sha256(picture), set()).add(item.mesh)
    return {sha256 for sha256, meshes in users.items() if len(meshes) > 1}


class _Finder:
    """kits: of _kits. sets: by key, without their names, which stand in `names`. objects: by name, how their
    materials are drawn, and the keys of their sets by material; second: the keys of those on second texture
    coordinates. shrinks: how often a palette can be halved, by key."""

    def __init__(self, hash_cache: FileHashCache, scene_path: Path, kits: Collection[str]) -> None:
        self.hash_cache, self.scene_path, self.kits = hash_cache, scene_path, kits
        self.sets: dict[Any, MapSet] = {}
        self.names: dict[Any, str] = {}
        self.shrinks: dict[Any, int] = {}
        self.objects: dict[str, tuple[dict[str, DrawnMaterial], dict[str, Any]]] = {}
        self.second: dict[str, dict[str, Any]] = {}
        self.warnings: list[str] = []

    def add(self, index: int, item: SceneObject, facts: ModelFacts | None) -> None:
        """Adds an object's materials and map sets. facts: of its model; None where it cannot be read, which
        the job of the mesh says."""
        replaced = item.color is not None or any(material.color for material in item.materials.values())
        if what := udim_fault({}, (), facts.missing if facts and not replaced else ()):
            what = f"{item.mesh.name}: {what}"
            raise SceneError(what, file=self.scene_path, place=f"object[{index}].mesh", mend=MEND)
        known = facts.materials if facts else {}
        names = list(known) or list(item.materials) or [""]
        materials = {name: joined(item, name, known.get(name)) for name in names}
        # a glTF file says by its maps what is bumpy
        authored = is_gltf(item.mesh) or any(is_authored(material) for material in materials.values())
        drawn_materials: dict[str, DrawnMaterial] = {}
        keys: dict[str, Any] = {}
        second: dict[str, Any] = {}
        for name, material in materials.items():
            table = item.materials.get(name, ObjectMaterial())
            gloss = bool(material.maps.keys() & set(GLOSS_ROLES))
            drawn_material = drawn(material, table, known.get(name), gloss=gloss)
            drawn_material = replace(drawn_material, vertex_colors=facts is not None and facts.colors)
            drawn_materials[name] = drawn_material
            if material.maps and is_guessed(material, table):
                why_not = NO_COVERAGE.get(known[name].alpha if name in known else "")
                if why_not or drawn_material.alpha_mode != "opaque":
                    self._warn_of_alpha(item, name, drawn_material, why_not)
            if drawn_material.translucency > 0.0 and table.translucency is None:
                self.warnings.append(
                    f"{item.mesh}: material {name!r}: two-sided, mostly green and with holes, so that it is "
                    f"taken as leaves: {drawn_material.translucency:g} of the light from behind passes "
                    f"through ([object.material.{toml_key(name)}] translucency = 0 for a fence)"
                )
        see_through = tuple(name for name, of in drawn_materials.items() if of.alpha_mode != "opaque")
        for name, material in materials.items():
            table = item.materials.get(name, ObjectMaterial())
            cast = cast_fields(item, material, known.get(name), see_through)
            if not material.maps and not cast:
                continue
            self._refuse_udim(index, item, name, material, known.get(name))
            shrink = known[name].shrink if name in known else 0
            first, others = material.parts()
            if first.maps or cast:
                made, key = self._set(item, first, table, known.get(name), authored=authored, cast=cast)
                keys[name] = self._used(key, made, item, name, shrink)
            if others.maps:
                made, key = self._second_set(others)
                second[name] = self._used(key, made, item, name, 0)
        if item.occlusion == "mesh":
            self._warn_of_occlusion(item, materials, known, keys)
        self.objects[item.name], self.second[item.name] = (drawn_materials, keys), second
        for of, tail in ((keys, ""), (second, "_second")):
            own = list(dict.fromkeys(of.values()))
            for key in own:
                if key not in self.names:
                    users = self.sets[key].materials[item.name]
                    plain = item.name if len(own) == 1 else _stem(item.name, users)
                    self.names[key] = _unique(plain + tail, self.names.values())

    def _used(self, key: Any, made: MapSet, item: SceneObject, material: str, shrink: int) -> Any:
        """Notes that a material uses a set; returns the key. shrink: of the material."""
        self.shrinks[key] = min(shrink, self.shrinks.get(key, shrink))
        before = self.sets.get(key, made)
        users = {item.name: (*before.materials.get(item.name, ()), material)}
        self.sets[key] = replace(before, materials={**before.materials, **users})
        return key

    def finished(self, key: Any) -> MapSet:
        """Returns a set with its name, and with what follows from the materials that use it."""
        map_set = self.sets[key]
        users = [
            self.objects[name][0][material] for name, own in map_set.materials.items() for material in own
        ]
        # of the picture's alpha, which the material's opacity multiplies before it is compared
        cutoffs = [
            by.alpha_cutoff / max(by.opacity, by.alpha_cutoff) for by in users if by.alpha_cutoff > 0.0
        ]
        blended = any(by.alpha_mode == "blend" for by in users)
        ((first, own),) = list(map_set.materials.items())[:1]
        whole = len(own) == len(self.objects[first][0])
        return replace(
            map_set,
            name=self.names[key],
            layout_materials=own if map_set.layout and not whole else (),
            tiny=map_set.palette and self.shrinks[key] >= _WORTH,
            opaque=all(by.alpha_mode == "opaque" for by in users),
            alpha_cutoff=min(cutoffs, default=0.0 if blended else map_set.alpha_cutoff),
        )

    def _warn_of_alpha(self, item: SceneObject, name: str, of: DrawnMaterial, why_not: str | None) -> None:
        how = f"a mask with cutoff {of.alpha_cutoff:g}" if of.alpha_mode == "mask" else of.alpha_mode
        how = f"opaque, since {why_not}" if why_not else "blended" if how == "blend" else how
        self.warnings.append(
            f"{item.mesh}: material {name!r}: nothing says what its alpha does; taken as {how} "
            f"([object.material.{toml_key(name)}] alpha_mode says otherwise)"
        )

    def _warn_of_occlusion(
        self,
        item: SceneObject,
        materials: Mapping[str, Material],
        known: Mapping[str, MaterialFacts],
        keys: Mapping[str, Any],
    ) -> None:
        """Warns of materials that get no occlusion cast from the mesh."""
        for name, material in materials.items():
            if not known or "occlusion" in material.maps or material.unlit:
                continue
            if name in keys and self.sets[keys[name]].casts_occlusion:
                continue
            wrap = self.sets[keys[name]].wrap if name in keys else None
            why = f"its maps are wrapped ({', '.join(wrap or REPEATED)}); its UVs are no layout of them"
            if name in known and known[name].uvs is None:
                why = "it has no texture coordinates; `paradize mesh --atlas` makes a GLB with some"
            elif name in keys and self.sets[keys[name]].palette:
                why = "its UVs show swatches of a palette, so that a texel has no place of its own"
            elif name in known and known[name].repeats:
                why = repeating(uv_width(known[name].uvs))
            self.warnings.append(f"{item.mesh}: material {name!r}: no occlusion is cast: {why}")

    def _warn_of_samplers(self, item: SceneObject, material: Material) -> None:
        """Warns of maps that the model wraps in another way than the material's leading map."""
        leading = material.leading
        drawn_as = leading.wrap or REPEATED if leading else REPEATED
        ways = {role: source.wrap or drawn_as for role, source in material.maps.items()}
        if others := sorted(role for role, way in ways.items() if way != drawn_as):
            said = "; ".join(f"{role}: {', '.join(ways[role])}" for role in others)
            self.warnings.append(
                f"{item.mesh}: material {material.name!r}: all its maps are wrapped as one "
                f"({', '.join(drawn_as)} along u and v), but the model says otherwise of {said}"
            )

    def _refuse_udim(
        self, index: int, item: SceneObject, name: str, material: Material, facts: MaterialFacts | None
    ) -> None:
        """Raises SceneError for a material whose pictures are tiles of several."""
        tiles = facts.tiles if facts else ()
        if what := udim_fault(material.maps, tiles, ()):
            place = f"object[{index}].material.{name}"
            raise SceneError(f"{item.mesh.name}: {what}", file=self.scene_path, place=place, mend=MEND)
        if what := named_as_tile(material.maps, tiles):
            self.warnings.append(f"{item.mesh}: material {name!r}: {what}")

    def _set(
        self,
        item: SceneObject,
        material: Material,
        table: ObjectMaterial,
        facts: MaterialFacts | None,
        *,
        authored: bool,
        cast: dict[str, Any],
    ) -> tuple[MapSet, Any]:
        """Returns the set of a material without its name and users, and what tells it from others. authored:
        no bumps are made of its colour unless the scene gives their strength. cast: of cast_fields."""
        given = item.wrap != "auto" or table.wrap != "auto"
        flat = material.maps.keys() <= _FLAT or material.unlit
        palette = facts is not None and not given and flat and self._is_palette(material, facts)
        said = wrap_of(item, table, material)
        wrap: tuple[Wrap, Wrap] | None = said or REPEATED
        if not (given and wrap == REPEATED):
            # UVs in one tile beside the map may be its layout, unless the tile would not be drawn
            exact = palette or wrap != REPEATED
            wide = facts is not None and (facts.outside if exact else facts.repeats if cast else facts.tiled)
            if not wide:
                wrap = None
            elif not given:
                self._warn_of_samplers(item, material)
        layout = item.mesh if wrap is None and not palette else None
        strength = (0.0 if authored else 1.0) if item.strength is None else item.strength
        derived = [key for key in MADE_OF_COLOR if key != "gloss" or table.specular is not None]
        asked = {"strength": item.strength, "specular": table.specular}
        if palette and any(asked.values()) and not material.unlit:
            named = " and ".join(f"{key} = {value:g}" for key, value in asked.items() if value)
            self.warnings.append(
                f"{item.mesh}: material {material.name!r}: no map is made of the colour ({named}): "
                "its triangles show swatches or gradients of a palette "
                '(wrap = "clamp" or "repeat" says that it is none)'
            )
        if palette or material.unlit:
            derived = []
        bump_m, width_m = material.bump_m, facts.width_m if facts else None
        map_set = MapSet(
            name="",
            materials={},
            pictures={role: source.picture.file for role, source in material.maps.items()},
            srgb=tuple(role for role, source in material.maps.items() if source.srgb),
            layout=layout,
            wrap=wrap,
            palette=palette,
            derived=tuple(derived),
            relief=item.relief,
            strength=strength,
            height_strength=100.0 * bump_m / width_m if bump_m is not None and width_m else 1.0,
            gloss_groups=item.gloss_groups if layout else (),
            bleed=item.bleed,
            authored=authored_fields(material) + (tuple(cast.items()) if layout else ()),
        )
        return map_set, self._key(map_set, material, item.name if layout else "")

    def _is_palette(self, material: Material, facts: MaterialFacts) -> bool:
        picture = material.picture("color")
        if picture is None or facts.palette < KIT:
            return False
        return facts.palette >= PALETTE or self.hash_cache.sha256(picture) in self.kits

    def _second_set(self, material: Material) -> tuple[MapSet, Any]:
        """Returns the set of a material's maps on second texture coordinates, as _set does. They follow no
        layout: their gutters stay as they were drawn."""
        map_set = MapSet(
            name="",
            materials={},
            pictures={role: source.picture.file for role, source in material.maps.items()},
            srgb=tuple(role for role, source in material.maps.items() if source.srgb),
            wrap=(material.leading.wrap if material.leading else None) or REPEATED,
            derived=(),
            strength=0.0,
            authored=authored_fields(material),
            second=True,
        )
        return map_set, self._key(map_set, material, "")

    def _key(self, map_set: MapSet, material: Material, owner: str) -> Any:
        """The key of a material's map set: equal sets have equal keys. owner: the object whose layout it
        follows."""
        content = tuple(
            (role, self.hash_cache.sha256(source.picture.file), source.channel, source.inverted)
            for role, source in sorted(material.maps.items())
        )
        return owner, content, tuple(getattr(map_set, key) for key in _COMPARED)


_FLAT = {"color", "alpha"}


def _stem(item: str, materials: tuple[str, ...]) -> str:
    """Returns the name of a set of some of an object's materials, as an identifier."""
    words = re.sub(r"[^a-z0-9]+", "_", materials[0].lower()).strip("_") or "material"
    return f"{item}_{words}"[:_MOST_NAME]


def _unique(name: str, taken: Collection[str]) -> str:
    number, unique = 2, name
    while unique in taken:
        unique, number = f"{name}_{number}", number + 1
    return unique

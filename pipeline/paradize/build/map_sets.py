"""Finds the map sets of a scene: from its tables `[object.material.NAME]`, the `color` and `alpha` of its
objects, and the materials of their models.

Materials of one object share a set if their pictures and settings are equal. Sets whose maps follow no UV
layout are shared between objects, too; pictures are compared by their bytes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from paradize.build.model_facts import ModelFacts
from paradize.build.model_reader import ModelReader
from paradize.build.options import BuildOptions
from paradize.errors import GroupedError, ParadizeError, SceneError
from paradize.files import resolved
from paradize.material import MapSource, Material, Picture
from paradize.scene.map_sets import DrawnMaterial, MapSet, ObjectMaps, SceneMaps
from paradize.scene.settings import ObjectMaterial, Scene, SceneObject
from paradize.store.file_hashes import FileHashCache

_MOST_NAME = 80  # characters of a set's name


@dataclass
class FoundMaps:
    """What find_map_sets returns. libraries: the files that were read for it. missing: files that were looked
    for but do not exist."""

    maps: SceneMaps
    libraries: list[Path] = field(default_factory=list)
    missing: list[Path] = field(default_factory=list)


def find_map_sets(
    scene: Scene,
    scene_path: Path,
    hash_cache: FileHashCache | None = None,
    tried_libraries: list[Path] | None = None,
    options: BuildOptions | None = None,
) -> FoundMaps:
    """Returns the map sets of a scene. tried_libraries: takes the material files, also of objects that fail.
    Raises a ParadizeError, or GroupedError, for models that cannot be read."""
    found = FoundMaps(SceneMaps((), {}))
    hash_cache = hash_cache or FileHashCache()
    models = ModelReader(resolved(scene_path).parent, hash_cache, options or BuildOptions(jobs=1))
    finder = _Finder(hash_cache)
    errors: list[ParadizeError] = []
    beside: dict[Path, tuple[Path, ...]] = {}
    for i, (item, read) in enumerate(zip(scene.objects, models.read(scene.objects), strict=True)):
        if tried_libraries is not None:
            tried_libraries += read.tried
        if read.facts is None and item.color is None and read.error:
            errors.append(read.error)
            continue
        if read.facts:
            found.libraries += read.facts.libraries
            beside[item.mesh] = read.facts.libraries[1:]
            found.missing += read.facts.missing
        try:
            finder.add(item, read.facts)
        except ParadizeError as error:
            errors.append(error)
            continue
        count = len(set(finder.objects[item.name][1].values()))
        if count > 1:
            what = f"{count} colour maps are named by the materials of {item.mesh.name}; one is needed"
            mend = "name one in the scene, or join them into one atlas"
            errors.append(SceneError(what, file=scene_path, place=f"object[{i}].color", mend=mend))
    if errors:
        raise GroupedError(errors) if len(errors) > 1 else errors[0]
    sets = {key: finder.finished(key) for key in finder.sets}
    objects = {
        name: ObjectMaps(drawn, {material: sets[key] for material, key in keys.items()})
        for name, (drawn, keys) in finder.objects.items()
    }
    found.maps = SceneMaps(tuple(sets.values()), objects, beside)
    return found


class _Finder:
    """sets: by key, without their names, which stand in `names`. objects: by name, how their materials are
    drawn, and the keys of their sets by material."""

    def __init__(self, hash_cache: FileHashCache) -> None:
        self.hash_cache = hash_cache
        self.sets: dict[Any, MapSet] = {}
        self.names: dict[Any, str] = {}
        self.objects: dict[str, tuple[dict[str, DrawnMaterial], dict[str, Any]]] = {}

    def add(self, item: SceneObject, facts: ModelFacts | None) -> None:
        """Adds an object's materials and map sets. facts: of its model; None where it cannot be read, which
        the job of the mesh says."""
        materials = _materials(item, facts)
        authored = any({"normal", "roughness", "smoothness"} & one.maps.keys() for one in materials.values())
        drawn: dict[str, DrawnMaterial] = {}
        keys: dict[str, Any] = {}
        for name, material in materials.items():
            table = item.materials.get(name, ObjectMaterial())
            drawn[name] = replace(
                _drawn(material, table),
                vertex_colors=material.vertex_colors and facts is not None and facts.colors,
            )
            if material.maps:
                one, key = self._set(item, material, derive=not authored)
                known = self.sets.get(key, one)
                users = {item.name: (*known.materials.get(item.name, ()), name)}
                self.sets[key] = replace(known, materials={**known.materials, **users})
                keys[name] = key
        self.objects[item.name] = drawn, keys
        own = list(dict.fromkeys(keys.values()))
        for key in own:
            if key not in self.names:
                plain = item.name if len(own) == 1 else _stem(item.name, self.sets[key].materials[item.name])
                self.names[key] = _unique(plain, self.names.values())

    def finished(self, key: Any) -> MapSet:
        """Returns a set with its name, and with what follows from the materials that use it."""
        one = self.sets[key]
        users = [self.objects[name][0][material] for name, own in one.materials.items() for material in own]
        cutoffs = [drawn.alpha_cutoff for drawn in users if drawn.alpha_cutoff > 0.0]
        return replace(one, name=self.names[key], alpha_cutoff=min(cutoffs, default=one.alpha_cutoff))

    def _set(self, item: SceneObject, material: Material, *, derive: bool) -> tuple[MapSet, Any]:
        """Returns the set of a material without its name and users, and what tells it from others."""
        pictures = {role: source.picture.file for role, source in material.maps.items()}
        one = MapSet(
            name="",
            materials={},
            pictures=pictures,
            layout=item.mesh if item.wrap == "clamp" else None,
            wrap="clamp" if item.wrap == "clamp" else "repeat",
            derived=("normal", "height", "gloss") if derive else (),
            relief=item.relief,
            strength=item.strength,
            gloss_groups=item.gloss_groups if item.wrap == "clamp" else (),
            bleed=item.bleed,
        )
        content = tuple(
            (role, self.hash_cache.sha256(source.picture.file), source.channel, source.inverted)
            for role, source in sorted(material.maps.items())
        )
        owner = item.name if one.layout else ""
        return one, (owner, content, tuple(getattr(one, key) for key in _COMPARED))


_COMPARED = ("wrap", "palette", "derived", "relief", "strength", "gloss_groups", "bleed")


def _materials(item: SceneObject, facts: ModelFacts | None) -> dict[str, Material]:
    """Returns the materials of an object's mesh, with the pictures that the scene gives it."""
    if facts:
        known = {name: one.material for name, one in facts.materials.items()}
    else:
        known = {name: Material(name) for name in item.materials or ("",)}
    known = {
        name: replace(one, maps={role: by for role, by in one.maps.items() if role == "color"})
        for name, one in known.items()
    }
    given = {role: path for role in ("color", "alpha") if (path := getattr(item, role))}
    if "color" in given:
        known = {name: _painted(one) for name, one in known.items()}
    sources = {role: MapSource(Picture(path, name=path.name)) for role, path in given.items()}
    return {name: replace(one, maps={**one.maps, **sources}) for name, one in known.items()}


def _painted(material: Material) -> Material:
    """Returns a material whose colour a map of the scene replaces."""
    maps = {role: source for role, source in material.maps.items() if role not in ("color", "alpha")}
    return replace(material, color=(1.0, 1.0, 1.0), maps=maps)


def _drawn(material: Material, table: ObjectMaterial) -> DrawnMaterial:
    """Returns how a material is drawn. table: of the scene."""
    return DrawnMaterial(
        color=material.color,
        specular=table.specular,
        smoothness=table.smoothness,
        parallax_scale=table.parallax_scale,
        parallax_bias=table.parallax_bias,
        two_sided=table.two_sided,
        alpha_mode="mask" if table.alpha_cutoff > 0.0 else "opaque",
        alpha_cutoff=table.alpha_cutoff,
    )


def _stem(item: str, materials: tuple[str, ...]) -> str:
    """Returns the name of a set of some of an object's materials, as an identifier."""
    words = re.sub(r"[^a-z0-9]+", "_", materials[0].lower()).strip("_") or "material"
    return f"{item}_{words}"[:_MOST_NAME]


def _unique(name: str, taken: Any) -> str:
    number, unique = 2, name
    while unique in taken:
        unique, number = f"{name}_{number}", number + 1
    return unique

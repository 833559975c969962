"""The map sets of a scene: which materials share which maps, and how each material is drawn.

build/materials/map_sets.py finds them. Does not import numpy.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from paradize.map_table import DERIVED, maps_of
from paradize.material import AlphaMode, Wrap
from paradize.scene.settings import Relief

Vec3 = tuple[float, float, float]
PALETTE = 0.99  # of the surface shows swatches, where the picture is a palette
KIT = 0.95  # the same where several models show one picture: the sheet of a kit, with something drawn on it
# Words for alpha of a colour map that is no coverage, and why. The material is opaque then.
HIDDEN, PAINTED, VARIED = "hidden", "painted", "varied"
NO_COVERAGE = {
    HIDDEN: "it would hide everything",
    PAINTED: "the colours where it is 0 have detail of their own",
    VARIED: "it varies and is hardly anywhere 0 or 1, as heights or gloss do",
}
# The sources of the gloss map and the occlusion map.
GLOSS_ROLES = ("roughness", "smoothness", "specular")
OCCLUSION_ROLES = ("occlusion", "metalness")
# The maps of an object that may be made of its colour map.
MADE_OF_COLOR = tuple(name for name in DERIVED if name in maps_of("object"))


@dataclass(frozen=True)
class DrawnMaterial:
    """How the player draws a material of an object; the fields are those of scene.json (FORMAT.md). Factors
    multiply what the maps hold."""

    color: Vec3 = (1.0, 1.0, 1.0)
    opacity: float = 1.0
    metalness: float = 0.0
    emission: Vec3 = (0.0, 0.0, 0.0)
    specular: float = 0.0
    smoothness: float = 0.3
    occlusion_strength: float = 1.0
    parallax_scale: float = 0.0
    parallax_bias: float = 0.0
    two_sided: bool = False
    translucency: float = 0.0
    alpha_mode: AlphaMode = "opaque"
    alpha_cutoff: float = 0.0
    vertex_colors: bool = False
    nearest: bool = False
    unlit: bool = False
    vertex_lit: bool = False


@dataclass(frozen=True)
class MapSet:
    """The maps of one or more materials that are made of the same pictures with the same settings.

    name: its artifacts are `<name>_<map>`. materials: those that use it, by object name. pictures: files by
    role (material.Material.maps). layout: the model whose UV layout the maps follow, and its materials whose
    triangles lie on them (none: all); None: UVs leave the maps, or show a palette. wrap: what samplers read
    beyond the edges, along u and v; None: the UVs stay inside. palette: the triangles show
    swatches: points or lines of the colour map, or plain parts of it; tiny: it can be made so small without a
    change that blocks would cost more than they save.
    derived: the maps that may be made of the colour map. relief, strength, gloss_groups, bleed: as of the
    object; height_strength: the strength of `height`, which is a picture. authored: fields of
    AuthoredSettings (scene/baker_settings.py), as pairs. opaque: no material reads alpha. alpha_cutoff: the
    least of its masks; 0: they are all blended or opaque. second: its maps, of map_table.SECOND, lie on the
    mesh's second texture coordinates (TEXCOORD_1). srgb: roles, as of material.MapSource.
    """

    name: str
    materials: Mapping[str, tuple[str, ...]]
    pictures: Mapping[str, Path] = field(default_factory=dict)
    layout: Path | None = None
    layout_materials: tuple[str, ...] = ()
    wrap: tuple[Wrap, Wrap] | None = None
    palette: bool = False
    tiny: bool = False
    derived: tuple[str, ...] = MADE_OF_COLOR
    relief: Relief = field(default_factory=Relief)
    strength: float = 1.0
    height_strength: float = 1.0
    gloss_groups: tuple[str, ...] = ()
    bleed: float = 0.125
    authored: tuple[tuple[str, Any], ...] = ()
    opaque: bool = False
    alpha_cutoff: float = 0.5
    second: bool = False
    srgb: tuple[str, ...] = ()

    @property
    def casts_occlusion(self) -> bool:
        """Whether its occlusion is cast from the mesh."""
        return bool(dict(self.authored).get("occlusion_cast"))


@dataclass(frozen=True)
class ObjectMaps:
    """The materials of an object. drawn: by name; of a model that cannot be read, those that the scene names.
    sets: by name, the map sets of those that have maps. second: of those that have maps on second texture
    coordinates."""

    drawn: Mapping[str, DrawnMaterial] = field(default_factory=dict)
    sets: Mapping[str, MapSet] = field(default_factory=dict)
    second: Mapping[str, MapSet] = field(default_factory=dict)


@dataclass(frozen=True)
class SceneMaps:
    """The map sets of a scene, in the order of its objects. objects: by name. beside: the files beside a
    model that its mesh is made of (buffers of a glTF, material files of an OBJ), by the model."""

    sets: tuple[MapSet, ...]
    objects: Mapping[str, ObjectMaps]
    beside: Mapping[Path, tuple[Path, ...]] = field(default_factory=dict)

    def of_object(self, name: str) -> Iterator[tuple[MapSet, tuple[str, ...]]]:
        """The map sets that an object uses, each with the materials that use it."""
        for map_set in self.sets:
            if name in map_set.materials:
                yield map_set, map_set.materials[name]

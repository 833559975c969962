"""Reads the facts of a model that decide its map sets: its materials, where their UVs lie, and what their
colour maps show there. Runs in a worker; results are kept in the store, so that a bake without changes reads
no model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from paradize.errors import ParadizeError
from paradize.material import OVERHANG, REPEATED, MapSource, Material, Picture, uv_width
from paradize.scene.map_sets import NO_COVERAGE

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from paradize.data import Mesh

_ROUNDING = 1e-4  # of a tile
_MOST_TILES = 100


@dataclass(frozen=True)
class MaterialFacts:
    """A material of a model. material: without bytes of pictures. uvs: the least and the largest of its
    texture coordinates (u, v, u, v), in tiles; None without any. width_m: metres that a tile covers. tiles:
    those of its triangles, if each lies in one; else none. palette: the share of its surface that shows
    swatches of the colour map, 0 below scene.map_sets.KIT; shrink: how often that can be halved without a
    change of their colours. alpha: "mask" or "blend", guessed of the alpha that its triangles show; "opaque"
    where they show none, a word of scene.map_sets.NO_COVERAGE where the colour map's own is no
    coverage. green: whether they show alpha and mostly green. solid: whether nothing in its maps, nor in
    its vertices' colours, has an alpha below 1."""

    material: Material
    uvs: tuple[float, float, float, float] | None
    width_m: float | None
    tiles: tuple[tuple[int, int], ...]
    palette: float
    shrink: int
    alpha: str
    green: bool = False
    solid: bool = False

    @property
    def tiled(self) -> bool:
        """Whether its UVs are wider than a tile."""
        return uv_width(self.uvs) > 1.0 + _ROUNDING

    @property
    def repeats(self) -> bool:
        """Whether its UVs are so wide that a texel has no place of its own."""
        return uv_width(self.uvs) > 1.0 + OVERHANG

    @property
    def outside(self) -> bool:
        """Whether its UVs leave 0..1."""
        low_u, low_v, high_u, high_v = self.uvs or (0.0, 0.0, 1.0, 1.0)
        return min(low_u, low_v) < -_ROUNDING or max(high_u, high_v) > 1.0 + _ROUNDING


@dataclass(frozen=True)
class ModelFacts:
    """materials: by name, in the order of the mesh. colors: whether it has vertex colours other than white.
    libraries: files that were read, the model among them, and pictures that were drawn anew. missing: files
    that it names and that do not exist."""

    materials: Mapping[str, MaterialFacts]
    colors: bool
    libraries: tuple[Path, ...]
    missing: tuple[Path, ...]


def read_model_facts(
    path: Path, root: Path, pictures: Mapping[str, Mapping[str, Path]], all_of: Mapping[str, Path]
) -> dict[str, Any]:
    """Reads a model, in a worker. pictures: those that the scene names ("color" and "alpha"), by material;
    all_of: those of all other materials.

    Returns {"facts": ModelFacts, "data": {(material, role): bytes of a picture inside the model's file}}, or
    {"error", "tried"}: the error of a model that cannot be read, and the files beside it that were read.
    """
    from paradize.build.materials.metal_pictures import with_metal_pictures
    from paradize.build.materials.placed_pictures import with_placed_pictures
    from paradize.build.materials.shown_colors import is_green, is_solid, shown_colors
    from paradize.readers.model import read_model

    tried: list[Path] = []
    try:
        read = read_model(path, root, tried)
    except ParadizeError as error:
        return {"error": error, "tried": tried}
    materials: dict[str, MaterialFacts] = {}
    data: dict[tuple[str, str], bytes] = {}
    decoded: dict[Any, npt.NDArray[np.float32] | None] = {}
    redrawn: dict[Path, None] = {}
    for name in dict.fromkeys(group.material for group in read.mesh.groups):
        material = read.materials.get(name, Material(name))
        redrawn |= {source.picture.file: None for source in material.maps.values() if source.placed}
        if material.reflected:
            converted = (material.reflected.source, material.maps.get("color"))
            redrawn |= {source.picture.file: None for source in converted if source}
        try:
            material = with_metal_pictures(with_placed_pictures(material))
        except ParadizeError as error:
            return {"error": error, "tried": tried}
        mesh = read.mesh.of_materials([name])
        own = {role: source.picture for role, source in material.maps.items()}
        given = {**all_of, **pictures.get(name, {})}
        if "color" in given:
            own.pop("alpha", None)
        own |= {role: Picture(file) for role, file in given.items()}
        palette, shrink, alpha = 0.0, 0, "opaque"
        wrap = (material.leading.wrap if material.leading else None) or REPEATED
        if "color" in own:
            palette, shrink, alpha = shown_colors(mesh, own["color"], decoded, wrap)
        if "alpha" in own:
            source = MapSource(own["alpha"], "luminance")
            if "alpha" in material.maps and "alpha" not in given:
                source = material.maps["alpha"]
            alpha = shown_colors(mesh, own["alpha"], decoded, wrap, alpha_map=source)[2]
        solid = mesh.colors is None or bool((mesh.colors[:, 3] >= 1.0).all())
        if "alpha" in own:
            solid = solid and is_solid(own["alpha"], decoded, source)
        elif "color" in own:
            solid = solid and is_solid(own["color"], decoded)
        masked = alpha not in ("opaque", *NO_COVERAGE) or material.alpha_mode == "mask"
        green = masked and "color" in own and is_green(mesh, own["color"], decoded, wrap)
        sources = {}
        for role, by in material.maps.items():
            if by.picture.data is not None:
                data[name, role] = by.picture.data
            sources[role] = replace(by, picture=replace(by.picture, data=None))
        uvs, width_m, tiles = _uv_tiles(mesh)
        materials[name] = MaterialFacts(
            material=replace(material, maps=sources),
            uvs=uvs,
            width_m=width_m,
            tiles=tiles,
            palette=palette,
            shrink=shrink,
            alpha=alpha,
            green=green,
            solid=solid,
        )
    libraries = tuple(dict.fromkeys([path, *read.libraries, *redrawn]))
    colors = read.mesh.colors is not None and bool((read.mesh.colors != 1.0).any())
    facts = ModelFacts(materials, colors, libraries, tuple(read.absent))
    return {"facts": facts, "data": data}


def tiles_of(mesh: Mesh) -> tuple[tuple[int, int], ...]:
    """The tiles that UVs lie in, if each triangle lies in one; else none."""
    return _uv_tiles(mesh)[2]


def _uv_tiles(mesh: Mesh) -> tuple[Any, float | None, tuple[tuple[int, int], ...]]:
    """Returns MaterialFacts' uvs, width_m and tiles."""
    import numpy as np

    from paradize.build.materials.shown_colors import areas_of
    from paradize.vectors import doubled_areas_2d

    if mesh.uvs is None or not len(mesh.triangles):
        return None, None, ()
    corners = mesh.uvs[mesh.triangles].astype(np.float64)
    low, high = corners.min(axis=1), corners.max(axis=1)
    covered = float(np.abs(doubled_areas_2d(corners)).sum())
    width_m = float(np.sqrt(areas_of(mesh).sum() / covered)) if covered > 0.0 else None
    first = np.floor(low + _ROUNDING)
    last = np.maximum(first, np.ceil(high - _ROUNDING) - 1)
    tiles: tuple[tuple[int, int], ...] = ()
    if (first == last).all():
        found = np.unique(first, axis=0)
        if len(found) <= _MOST_TILES:
            tiles = tuple((int(u), int(v)) for u, v in found)
    least, most = low.min(axis=0).tolist(), high.max(axis=0).tolist()
    return (*least, *most), width_m, tiles


def to_json(facts: ModelFacts) -> dict[str, Any]:
    """The facts as the store keeps them."""
    materials = {}
    for name, material in facts.materials.items():
        maps = {
            role: asdict(source) | {"picture": _picture_to_json(source.picture)}
            for role, source in material.material.maps.items()
        }
        fields = asdict(replace(material.material, maps={})) | {"maps": maps}
        materials[name] = asdict(replace(material, material=Material(name))) | {"material": fields}
    return {
        "materials": materials,
        "colors": facts.colors,
        "libraries": [str(path) for path in facts.libraries],
        "missing": [str(path) for path in facts.missing],
    }


def _picture_to_json(picture: Picture) -> list[str | None]:
    return [str(picture.file), picture.name, str(picture.model) if picture.model else None]


def _picture_from_json(file: str, name: str, model: str | None) -> Picture:
    return Picture(Path(file), None, name, Path(model) if model else None)


def from_json(tree: Mapping[str, Any]) -> ModelFacts:
    """The facts that to_json returned."""
    materials = {}
    for name, fields in tree["materials"].items():
        known = dict(fields["material"])
        maps = {
            role: MapSource(
                **by
                | {"picture": _picture_from_json(*by["picture"])}
                | {"wrap": by["wrap"] and tuple(by["wrap"])}
            )
            for role, by in known.pop("maps").items()
        }
        known = {key: tuple(value) if isinstance(value, list) else value for key, value in known.items()}
        materials[name] = MaterialFacts(
            material=Material(**known, maps=maps),
            uvs=fields["uvs"] and tuple(fields["uvs"]),
            width_m=fields["width_m"],
            tiles=tuple((u, v) for u, v in fields["tiles"]),
            palette=fields["palette"],
            shrink=fields["shrink"],
            alpha=fields["alpha"],
            green=fields["green"],
            solid=fields["solid"],
        )
    return ModelFacts(
        materials,
        tree["colors"],
        tuple(Path(path) for path in tree["libraries"]),
        tuple(Path(path) for path in tree["missing"]),
    )

"""Copies a model into the folder of a new scene, and measures it."""

from __future__ import annotations

import glob
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import sqrt
from pathlib import Path

from paradize import player_limits
from paradize.build.materials.model_facts import tiles_of
from paradize.build.materials.udim import MEND, udim_fault
from paradize.documents import toml_text
from paradize.errors import SourceError
from paradize.files import read_parts, resolved
from paradize.kinds import MODEL, expecting, is_gltf
from paradize.material import Material
from paradize.new.instances import instance_of, moved, sizes_of, table_text, why_not
from paradize.new.shapes import Shape, bounds, least_floor
from paradize.new.views import Sun, sun_of
from paradize.readers.gltf.document import Document
from paradize.readers.gltf.extensions import check_extensions
from paradize.readers.gltf.nodes import Nodes
from paradize.readers.gltf.read import nothing_shown, read_document
from paradize.readers.gltf.split import (
    InstancedMesh,
    document_of,
    document_without,
    gltf_text,
    instanced_meshes,
)
from paradize.readers.gltf.views import read_views
from paradize.readers.model import read_model
from paradize.readers.names import require_utf8_name, root_of
from paradize.readers.record import Model as ReadModel
from paradize.readers.record import Vec3, Views
from paradize.scene.schema import FARTHEST as SCENE_FARTHEST_M
from paradize.scene.settings import RESERVED
from paradize.stages.validate import validate_mesh

LEAST_M, MOST_M = 0.05, 500.0  # a model with a radius outside these is scaled towards one metre
SMALLEST, LARGEST = 1e-8, 1e9  # limits of a model's radius; of one object of it: player_limits.LARGEST_M
FARTHEST = 1e9  # limit of a model's distance from 0, in radii
PICTURES = {".png", ".jpg", ".jpeg", ".tga", ".tif", ".tiff", ".exr"}
# The end of a colour map's name, behind the model's.
_COLOR = re.compile(r"^$|colou?r|albedo|diff|tex|(?<![a-z])d(?![a-z])", re.IGNORECASE)
_MOST_SPLIT = 64  # instanced meshes that become objects


@dataclass(frozen=True)
class Part:
    """An object of the scene. mesh, table: its mesh and its file of instances, seen from the scene's folder;
    table: empty where it stands once. cutouts: materials with holes."""

    name: str
    mesh: str
    cutouts: tuple[str, ...]
    table: str = ""


@dataclass
class Model:
    """The objects made from the model, and its size in the units of the file. floor: how far above its foot
    its lowest floor lies. least_z: not of glTF, whose up is Y. faces_back: whether its front looks along -Z,
    as that of a VRM 0 avatar. position: where the scene shows its origin."""

    parts: list[Part] = field(default_factory=list)
    center: Vec3 = (0.0, 0.0, 0.0)
    foot: float = 0.0
    floor: float | None = None
    least_z: float | None = None
    faces_back: bool = False
    radius: float = 1.0
    position: Vec3 = (0.0, 0.0, 0.0)
    sun: Sun = field(default_factory=Sun)
    views: Views | None = None
    taken: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _copies: list[_Copies] = field(default_factory=list)

    @property
    def scale(self) -> float:
        """The scale at which the scene shows it, five digits."""
        if LEAST_M <= self.radius <= MOST_M:
            return 1.0
        low, high = player_limits.SCALES
        return float(f"{min(max(1.0 / self.radius, low), high):.5g}")

    def write_instances(self, folder: Path) -> None:
        """Writes the meshes that stand at many places, and where. A mesh is as large as its largest copy, so
        that no scale leaves its range."""
        for copy in self._copies:
            places = [moved(matrix, self.scale, self.position) for matrix in copy.mesh.matrices]
            size = max(sizes_of(found for place in places if (found := instance_of(place))))
            (folder / copy.part.mesh).write_bytes(gltf_text(copy.document, copy.binary, size))
            text = table_text(found for place in places if (found := instance_of(place, size)))
            (folder / copy.part.table).write_text(text, encoding="utf-8")


@dataclass(frozen=True)
class _Copies:
    part: Part
    mesh: InstancedMesh
    document: Document
    binary: str


@dataclass(frozen=True)
class _Read:
    """A part of a model. document: of a glTF. mesh: where it stands at many places."""

    model: ReadModel
    document: Document | None = None
    mesh: InstancedMesh | None = None


def identifier(text: str, otherwise: str) -> str:
    """A name that a scene accepts: a-z, 0-9 and _, a letter first, at most 40."""
    kept = "".join(c if c.isascii() and c.isalnum() else "_" for c in text.lower()).strip("_")[:40]
    if kept and not kept[0].isalpha():
        kept = f"{otherwise}_{kept}"[:40]
    return kept or otherwise


def copy_model(source: Path, aside: Path) -> Model:
    """Copies the model and its files into aside/model, and measures it. The files may lie in the folder above
    the model's, as where pictures have one beside it; the copies then lie in folders of the same names.
    Meshes that a glTF shows at many places are parts of their own, which Model.write_instances writes."""
    require_utf8_name(source)
    model = Model()
    own = resolved(source).parent
    reads = _parts(source, model, root_of(source))
    split = any(entry.mesh for entry in reads)
    files = set() if split else {resolved(source)}
    for entry in reads:
        _refuse_udim(source, entry.model)
        maps = {path for material in entry.model.materials.values() for path in _pictures_of(material)}
        files |= {resolved(path) for path in (*entry.model.libraries, *entry.model.unread, *maps)}
    root = own if all(path.is_relative_to(own) for path in files) else own.parent
    folder, place = aside / "model", own.relative_to(root)
    if root != own:
        model.notes.append(f"{source}: some of its files lie in {root}, and are copied with it")
    for path in files - ({resolved(source)} if split else set()):
        target = folder / path.relative_to(root)
        target.parent.mkdir(parents=True, exist_ok=True)
        if not (target.exists() and target.samefile(path)):
            with target.open("wb") as copy:
                copy.writelines(read_parts(path))
    _measure(model, source, reads)
    if split:
        (folder / place).mkdir(parents=True, exist_ok=True)
        _add_parts(model, source, reads, aside, folder / place)
    else:
        _turn(model, reads[0].document)
        file = (place / resolved(source).name).as_posix()
        model.parts = [_part(source, _object_name(source.stem), file, reads[0].model)]
    return model


def _turn(model: Model, document: Document | None) -> None:
    """Turns an avatar of VRM 0, which looks along -Z, where it has no cameras or lights of its own. VRM 1 and
    all other glTF look along +Z."""
    lit = model.views is not None and (model.views.cameras or model.views.lights)
    if document and not lit and "VRM" in document.get(document.tree, "", "extensions", dict, {}):
        model.faces_back = True
        model.taken.append("the avatar looks along -Z, as VRM 0 has it: the scene turns it (yaw_deg)")


def _measure(model: Model, source: Path, reads: Sequence[_Read]) -> None:
    """Fills in the size, the sun and the notes. Raises SourceError for what a scene cannot show."""
    shapes = [Shape.of(entry.model.mesh, *([entry.mesh.matrices] if entry.mesh else [])) for entry in reads]
    low, high = (ends.tolist() for ends in bounds(shapes))
    half = [0.5 * (b - a) for a, b in zip(low, high, strict=True)]
    model.center = (low[0] + half[0], low[1] + half[1], low[2] + half[2])
    model.foot, model.floor = low[1], least_floor(shapes)
    model.least_z = None if is_gltf(source) else low[2]
    model.radius = sqrt(sum(h * h for h in half))
    model.sun = sun_of(model.views)
    if model.views:
        model.notes += model.views.notes
        model.notes += [f"{source}: {note}" for note in model.sun.notes]
    if not SMALLEST <= model.radius <= LARGEST:
        what = f"its radius is {model.radius:g}; a scene can show {SMALLEST:g} to {LARGEST:g}"
        raise SourceError(what, file=source, mend="scale the model")
    _refuse_large(source, reads)
    away = max(abs(c) for c in model.center)
    limit = min(FARTHEST * model.radius, SCENE_FARTHEST_M / model.scale)
    if away > limit:
        what = f"it lies {away:g} from the origin, limit {limit:g} of a radius of {model.radius:g}"
        raise SourceError(what, file=source, mend="move the model nearer to the origin")
    read = reads[0].model
    if not is_gltf(source):
        model.notes += _plain(source, read)


def _refuse_large(source: Path, reads: Sequence[_Read]) -> None:
    """Raises SourceError for a mesh that the player does not take. A scale of its object does not help,
    because the player judges the mesh; those of many places are written at the size that is shown."""
    limit = player_limits.LARGEST_M
    for entry in reads:
        if entry.mesh:
            continue
        low, high = (ends.tolist() for ends in bounds([Shape.of(entry.model.mesh)]))
        radius = 0.5 * sqrt(sum((b - a) * (b - a) for a, b in zip(low, high, strict=True)))
        if radius > limit:
            what = f"its radius is {radius:g} metres; the player shows meshes of up to {limit:g}"
            raise SourceError(what, file=source, mend="scale the model down in the program that made it")
        coordinate = float(abs(entry.model.mesh.positions).max())
        if coordinate > limit:
            what = f"a coordinate is {coordinate:g} metres; the player takes up to {limit:g}"
            raise SourceError(what, file=source, mend="scale the model down, or move it nearer to its origin")


def _parts(source: Path, model: Model, root: Path) -> list[_Read]:
    """Reads a model, with notes and views: the meshes that stand at many places each alone, after the rest,
    which may be nothing. root: the folder that its files must lie in."""
    if not is_gltf(source):
        read = read_model(source, root)
        model.notes, model.views = list(read.warnings), read.views
        return [_Read(read)]
    with expecting(MODEL, source):
        document = Document(source)
        check_extensions(document)
        most = player_limits.MOST_INSTANCES - 1  # one for the rest
        chosen = _chosen(instanced_meshes(document, root, most), model, source)
        rest = document_without(document, chosen) if chosen else document
        found: list[_Read] = []
        notes = [*document.warnings]
        of_all = [(rest, None), *((document_of(document, mesh), mesh) for mesh in chosen)]
        for part, mesh in of_all:
            shown = read_document(part, root)
            notes += part.warnings
            found += [_Read(shown, part, mesh)] if shown else []
        if not found:
            raise nothing_shown(rest)
        nodes = Nodes(document)
        model.views = read_views(document, nodes, nodes.shown())
        model.notes += dict.fromkeys(notes)
        return found


def _chosen(meshes: Iterable[InstancedMesh], model: Model, source: Path) -> list[InstancedMesh]:
    """Returns the meshes whose copies can be instances; notes why others cannot."""
    chosen: list[InstancedMesh] = []
    for mesh in meshes:
        why = why_not(mesh.matrices)
        if not mesh.matrices:
            why = f"a scene has at most {player_limits.MOST_INSTANCES} instances"
        elif len(chosen) == _MOST_SPLIT:
            why = f"at most {_MOST_SPLIT} meshes become objects of their own"
        if why is None:
            chosen.append(mesh)
        else:
            what = f"the {mesh.count} copies of {mesh} are no instances: {why}"
            model.notes.append(f"{source}: {what}")
    return chosen


def _add_parts(model: Model, source: Path, reads: Sequence[_Read], aside: Path, folder: Path) -> None:
    """Adds the objects of a model whose instanced meshes stand alone. Writes the rest, and the bytes that all
    share, into `folder`."""
    place, binary = folder.relative_to(aside).as_posix(), ""
    names: set[str] = set()
    for entry in reads:
        assert entry.document
        if entry.document.binary is not None and not binary:
            binary = _free(folder, source.stem, ".bin")
            (folder / binary).write_bytes(entry.document.binary)
        if entry.mesh is None:
            file = _free(folder, source.stem, ".gltf")
            (folder / file).write_bytes(gltf_text(entry.document, binary))
            model.parts.append(_part(source, _object_name(source.stem), file, entry.model, place))
        else:
            name = _object_name(entry.mesh.name or f"{source.stem} copies", names)
            (mesh, table) = (_free(folder, name, suffix) for suffix in (".gltf", ".csv"))
            part = replace(_part(source, name, mesh, entry.model, place), table=f"{place}/{table}")
            model.parts.append(part)
            model._copies.append(_Copies(part, entry.mesh, entry.document, binary))
            what = f"{len(entry.mesh.matrices)} copies of {entry.mesh}"
            model.taken.append(f"{what} are instances of the object {name}, listed in {part.table}")
        names.add(model.parts[-1].name)


def _part(source: Path, name: str, file: str, read: ReadModel, place: str = "model") -> Part:
    """An object of the scene, made of what was read of `source`."""
    used = dict.fromkeys(group.material for group in read.mesh.groups)
    cutouts = [material for material in used if _is_cut(read.materials.get(material))]
    if cutouts:  # a bake refuses settings of materials that its mesh lacks
        baked = {group.material for group in validate_mesh(read.mesh, source)[0].groups}
        cutouts = [material for material in cutouts if material in baked]
    return Part(name, f"{place}/{file}", tuple(cutouts))


def _object_name(text: str, taken: Iterable[str] = ()) -> str:
    """A name for an object, other than those that are taken."""
    name = identifier(text, "model")
    name = f"{name}_model"[:40] if name in RESERVED else name
    number = 1
    while name in taken:
        number += 1
        name = f"{identifier(text, 'model')[:36]}_{number}"
    return name


def _free(folder: Path, stem: str, suffix: str) -> str:
    """The name of a file that is not there yet."""
    while (folder / f"{stem}{suffix}").exists():
        stem += "_"
    return f"{stem}{suffix}"


def _refuse_udim(source: Path, read: ReadModel) -> None:
    """Raises SourceError for a model whose pictures are UDIM tiles."""
    if what := udim_fault({}, (), read.absent):  # no material has what does not exist
        raise SourceError(what, file=source, mend=MEND)
    for name in dict.fromkeys(group.material for group in read.mesh.groups):
        maps = read.materials[name].maps if name in read.materials else {}
        if what := udim_fault(maps, tiles_of(read.mesh.of_materials([name])), ()):
            raise SourceError(what, file=source, place=f"material {name!r}", mend=MEND)


def _is_cut(material: Material | None) -> bool:
    """Whether a picture cuts holes into a material, so that its back faces show."""
    return material is not None and "alpha" in material.maps and material.two_sided is None


def _plain(source: Path, read: ReadModel) -> list[str]:
    """Says how a model whose materials name no picture is shown, and which one may be its colour map. One
    with a material file may be meant so, unless such a picture is there."""
    bare = not read.libraries and not read.materials
    if not bare and (read.absent or read.unread or any(one.maps for one in read.materials.values())):
        return []
    shown = f"it is drawn {'white' if read.mesh.colors is None else 'in its vertex colours'}"
    if read.mesh.uvs is None:
        return [f"{source}: has neither materials nor texture coordinates, so {shown}"] if bare else []
    near = sorted(source.parent.glob(f"{glob.escape(source.stem)}*"))
    near = [path for path in near if path.suffix.lower() in PICTURES]
    likely = (path.name for path in near if _COLOR.search(path.stem[len(source.stem) :]))
    picture = next(likely, "PICTURE" if bare else None)
    if picture is None:
        return []
    why = f"has no material file, so {shown}"
    if not bare:
        why = "its materials name no picture, so it is drawn in plain colours"
    write = f"copy {picture} beside scene.toml and write color = {toml_text(picture)} under [[object]]"
    return [f"{source}: {why}; for a colour map {write}"]


def _pictures_of(material: Material) -> list[Path]:
    return [source.picture.file for source in material.maps.values()]

"""Reads a glTF model into one mesh with its materials: what its default scene shows, at rest."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from paradize.errors import SourceError, one_line
from paradize.placement import IDENTITY
from paradize.readers.gltf.accessors import Accessors
from paradize.readers.gltf.assemble import Part, joined, place_part
from paradize.readers.gltf.buffers import Buffers
from paradize.readers.gltf.document import Document
from paradize.readers.gltf.extensions import check_extensions
from paradize.readers.gltf.materials import PlacedMaterial, default_material, read_materials
from paradize.readers.gltf.nodes import Matrix, Nodes
from paradize.readers.gltf.pictures import Pictures
from paradize.readers.gltf.primitives import Primitive, read_primitive
from paradize.readers.gltf.skins import default_weights, joints_of, morphed, vertex_matrices
from paradize.readers.gltf.split import has_instances
from paradize.readers.gltf.views import read_views
from paradize.readers.names import root_of
from paradize.readers.record import DEFAULT_NAME, Model

_MAX_NAME = 120
_NEW_DRAWS = "makes a scene that bakes one and draws it at all places"


def read_gltf(path: Path, root: Path | None = None, on_library: list[Path] | None = None) -> Model:
    """Reads a `.glb` or `.gltf` and the files that it names, which must lie inside `root` (default:
    root_of). on_library: a list to which each file beside is appended before it is read.

    Raises SourceError, with a JSON pointer, for a file that does not follow the format where it matters to
    the surface, that needs an extension which is not read, or that shows no triangles.
    """
    document = Document(path)
    check_extensions(document)
    if has_instances(document):  # `new` itself reads documents
        document.copies_mend = f"`paradize new FOLDER --from FILE` {_NEW_DRAWS}"
    read = read_document(document, root_of(path) if root is None else root, on_library)
    if read is None:
        raise nothing_shown(document)
    return read


def nothing_shown(document: Document) -> SourceError:
    """The error for a document that shows no triangles, with what is left out of it."""
    notes = [text.removeprefix(f"{document.file}: ") for text in document.warnings]
    shown = f" ({'; '.join(notes[:3])})" if notes else ""
    return document.fault(f"shows no triangles{shown}", "", "export the model with its surface")


def read_document(document: Document, root: Path, on_library: list[Path] | None = None) -> Model | None:
    """Reads what the scene of a document shows, as read_gltf does; None where it shows no triangles."""
    reader = _Reader(document, root, on_library)
    parts = reader.parts()
    if not parts:
        return None
    mesh, source, smoothing = joined(document, parts)
    views = read_views(document, reader.nodes, reader.nodes.shown())
    used = {group.material for group in mesh.groups}
    counts = {
        "faces": len(mesh.triangles),
        "triangles": len(mesh.triangles),
        "vertices": len(mesh.positions),
        "positions_in_file": sum(len(part.positions) for part in parts),
        "positions_unused": 0,
    }
    materials = {material.material.name: material.material for material in reader.materials}
    if DEFAULT_NAME in used:
        materials[DEFAULT_NAME] = default_material().material
    return Model(
        mesh,
        source,
        materials,
        document.warnings,
        counts,
        smoothing,
        libraries=reader.buffers.libraries,
        absent=reader.pictures.absent,
        unread=reader.pictures.unread,
        views=views,
    )


class _Reader:
    """Collects what a document shows."""

    def __init__(self, document: Document, root: Path, on_library: list[Path] | None) -> None:
        self.document = document
        self.buffers = Buffers(document, root, on_library)
        self.accessors = Accessors(document, self.buffers)
        self.pictures = Pictures(document, self.buffers)
        self._used: dict[int, list[dict[str, Any]]] | None = None
        self._equal: dict[tuple[int, int], bool] = {}
        self.nodes = Nodes(document)
        self.materials = read_materials(document, self.pictures, self._are_equal_sets)
        self._primitives: dict[tuple[int, int, tuple[float, ...]], Primitive | None] = {}

    def parts(self) -> list[Part]:
        """The parts of the scene, in the order of its nodes."""
        document = self.document
        if document.table("animations"):
            document.warn("its animations are left out; the model is read at rest")
        out: list[Part] = []
        for node in self.nodes.shown():
            entry, place = document.item("nodes", node, ""), f"/nodes/{node}"
            mesh = document.get(entry, place, "mesh", int, None)
            if mesh is None:
                continue
            skin = document.get(entry, place, "skin", int, None)
            if skin is not None:
                document.warn("its skins are read at rest, as their joints stand")
                joints = joints_of(document, self.accessors, self.nodes, skin, f"{place}/skin")
                out += self._mesh(mesh, node, [self.nodes.world[node]], joints)
            else:
                out += self._mesh(mesh, node, self.nodes.instances(node, self.accessors), [])
        if not document.table("nodes"):
            for mesh in range(len(document.table("meshes"))):
                out += self._mesh(mesh, -1, [IDENTITY], [])
        if self.nodes.copies:
            document.warn(
                f"EXT_mesh_gpu_instancing: {self.nodes.copies} copies become triangles of one mesh, each "
                f"baked and stored; `paradize new FOLDER --from FILE` {_NEW_DRAWS}"
            )
        return out

    def _mesh(self, mesh: int, node: int, matrices: Any, joints: list[Matrix]) -> list[Part]:
        """The parts of a mesh for each of its matrices. node: -1 without one."""
        document, place = self.document, f"/meshes/{mesh}"
        entry = document.item("meshes", mesh, f"/nodes/{node}/mesh")
        weights = default_weights(document, node, mesh)
        name = self._name(node, entry)
        read: list[tuple[Primitive, PlacedMaterial, str]] = []
        for k, primitive in enumerate(document.get(entry, place, "primitives", list)):
            where = f"{place}/primitives/{k}"
            key = (mesh, k, weights)
            if key not in self._primitives:
                mesh_part = read_primitive(document, self.accessors, primitive, where, len(weights))
                if mesh_part is not None and "targets" in primitive:
                    document.warn("morph targets are read at their default weights")
                    mesh_part = morphed(mesh_part, weights)
                self._primitives[key] = mesh_part
            found = self._primitives[key]
            if found is not None and len(found.triangles):
                read.append((found, self._material(found.material, where), where))
        parts = []
        for matrix in matrices:
            for found, material, where in read:
                own = vertex_matrices(document, found, joints, where) if joints else None
                stand = matrix if own is None else own
                parts.append(place_part(document, found, stand, material, name, where))
        return parts

    def _material(self, number: int | None, where: str) -> PlacedMaterial:
        if number is None:
            return default_material()
        self.document.item("materials", number, f"{where}/material")
        return self.materials[number]

    def _are_equal_sets(self, material: int, a: int, b: int) -> bool:
        """Whether two sets of texture coordinates are the same wherever a material is, as exporters write
        them that fill both."""
        equal = False
        for primitive in self._users().get(material, ()):
            attributes = primitive.get("attributes")
            sets = attributes if isinstance(attributes, dict) else {}
            first, second = (sets.get(f"TEXCOORD_{k}") for k in (a, b))
            if not (isinstance(first, int) and isinstance(second, int)):
                return False
            equal = first == second or ("extensions" not in primitive and self._are_equal(first, second))
            if not equal:
                return False
        return equal

    def _users(self) -> dict[int, list[dict[str, Any]]]:
        """The primitives of each material, by number."""
        if self._used is None:
            self._used = {}
            for mesh in self.document.table("meshes"):
                primitives = mesh.get("primitives") if isinstance(mesh, dict) else None
                for primitive in primitives if isinstance(primitives, list) else ():
                    if isinstance(primitive, dict) and isinstance(number := primitive.get("material"), int):
                        self._used.setdefault(number, []).append(primitive)
        return self._used

    def _are_equal(self, a: int, b: int) -> bool:
        if (a, b) not in self._equal:
            self._equal[a, b] = self._compare(a, b)
        return self._equal[a, b]

    def _compare(self, a: int, b: int) -> bool:
        try:
            first, second = (self.accessors.floats(number, f"/accessors/{number}", (2,)) for number in (a, b))
        except SourceError:  # whoever draws with it says so
            return False
        return bool(np.array_equal(first, second))

    def _name(self, node: int, mesh: dict[str, Any]) -> str:
        owners = ([] if node < 0 else [self.document.item("nodes", node, "")]) + [mesh]
        names = [owner.get("name") for owner in owners]
        return next((one_line(n)[:_MAX_NAME] for n in names if isinstance(n, str) and n), DEFAULT_NAME)

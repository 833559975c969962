"""Takes meshes that stand at many places (EXT_mesh_gpu_instancing) out of a glTF model. Each becomes a
document of its own that shows it once; another one shows the rest. All have the bytes of the model."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from paradize.errors import one_line
from paradize.readers.gltf.accessors import Accessors
from paradize.readers.gltf.buffers import Buffers
from paradize.readers.gltf.document import Document
from paradize.readers.gltf.nodes import INSTANCING, Matrix, Nodes

_MAX_NAME = 80
_LEFT_OUT = ("animations", "cameras", "scene", "skins")  # what a mesh alone needs nothing of
_NAMED = ("extensionsRequired", "extensionsUsed")


@dataclass(frozen=True)
class InstancedMesh:
    """A mesh of a model. name: of its node, else its own; empty without one. nodes: those that show it.
    count: of its copies. matrices: where they stand, without those of size 0; none where they are too many.
    """

    name: str
    mesh: int
    nodes: tuple[int, ...]
    count: int
    matrices: tuple[Matrix, ...]

    def __str__(self) -> str:
        return repr(self.name) if self.name else f"mesh {self.mesh}"


def instanced_meshes(document: Document, root: Path, most: int) -> list[InstancedMesh]:
    """Returns the meshes that the scene shows at two or more places by EXT_mesh_gpu_instancing, in the order
    of its nodes. Nodes with the same mesh and the same weights of morph targets are together. most: copies
    that may have matrices, over all meshes."""
    if not has_instances(document):
        return []
    nodes, accessors = Nodes(document), Accessors(document, Buffers(document, root))
    found: dict[tuple[int, str], list[int]] = {}
    for index in nodes.shown():
        entry, place = document.item("nodes", index, ""), f"/nodes/{index}"
        mesh = document.get(entry, place, "mesh", int, None)
        if mesh is not None and _is_instanced(entry) and "skin" not in entry:
            found.setdefault((mesh, json.dumps(entry.get("weights"))), []).append(index)
    meshes = []
    for (mesh, _), shown in found.items():
        count = sum(nodes.count(index, accessors) for index in shown)
        if count < 2:
            continue
        matrices: list[Matrix] = []
        if count <= most:
            most -= count
            matrices = [matrix for index in shown for matrix in nodes.instances(index, accessors)]
        owners = [
            *(document.item("nodes", index, "") for index in shown),
            document.item("meshes", mesh, f"/nodes/{shown[0]}/mesh"),
        ]
        names = [owner.get("name") for owner in owners]
        name = next((one_line(n)[:_MAX_NAME] for n in names if isinstance(n, str) and n), "")
        seen = tuple(m for m in matrices if any((*m[0:3], *m[4:7], *m[8:11])))
        if seen or not matrices:
            meshes.append(InstancedMesh(name, mesh, tuple(shown), count, seen))
    return meshes


def has_instances(document: Document) -> bool:
    """Whether a node stands at many places by EXT_mesh_gpu_instancing."""
    return any(map(_is_instanced, document.table("nodes")))


def _is_instanced(node: object) -> bool:
    extensions = node.get("extensions") if isinstance(node, dict) else None
    return isinstance(extensions, dict) and INSTANCING in extensions


def document_without(document: Document, meshes: Sequence[InstancedMesh]) -> Document:
    """Returns the document without these meshes. It may show nothing."""
    gone = {index for mesh in meshes for index in mesh.nodes}
    nodes = [_bare(node) if k in gone else node for k, node in enumerate(document.table("nodes"))]
    return document.with_tree(_unused(document.tree | {"nodes": nodes}))


def document_of(document: Document, instanced: InstancedMesh) -> Document:
    """Returns a document that shows a mesh once, in its own space."""
    tree = {key: value for key, value in document.tree.items() if key not in _LEFT_OUT}
    shown = document.item("nodes", instanced.nodes[0], "")
    node = {key: shown[key] for key in ("name", "weights") if key in shown} | {"mesh": 0}
    meshes = [document.item("meshes", instanced.mesh, f"/nodes/{instanced.nodes[0]}/mesh")]
    return document.with_tree(_unused(tree | {"nodes": [node], "meshes": meshes, "scenes": [{"nodes": [0]}]}))


def _bare(node: dict[str, Any]) -> dict[str, Any]:
    """A node without its mesh."""
    kept = {key: value for key, value in node.items() if key not in ("mesh", "weights", "extensions")}
    extensions = {key: value for key, value in node["extensions"].items() if key != INSTANCING}
    return kept | ({"extensions": extensions} if extensions else {})


def _unused(tree: dict[str, Any]) -> dict[str, Any]:
    """A tree that names EXT_mesh_gpu_instancing only if a node has it."""
    if any(map(_is_instanced, tree["nodes"])):
        return tree
    kept = {key: [n for n in tree.get(key, []) if n != INSTANCING] for key in _NAMED}
    return {key: value for key, value in (tree | kept).items() if key not in _NAMED or value}


def gltf_text(document: Document, binary: str, size: float = 1.0) -> bytes:
    """Returns the text of a `.gltf`. binary: the file beside that holds the BIN chunk, where there is one.
    size: of a document of document_of, what its node is scaled by."""
    tree = dict(document.tree)
    if size != 1.0:
        tree["nodes"] = [tree["nodes"][0] | {"scale": [size] * 3}]
    buffers = document.table("buffers")
    if document.binary is not None and buffers and "uri" not in buffers[0]:
        tree["buffers"] = [buffers[0] | {"uri": quote(binary)}, *buffers[1:]]
    return json.dumps(tree, separators=(",", ":")).encode()

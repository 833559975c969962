"""A GLB of encode_glb without what a scene does not read: finer levels of detail, attributes."""

from __future__ import annotations

import json
from collections.abc import Collection
from typing import Any

from paradize.formats.glb.layout import QUANTIZATION
from paradize.formats.glb.reader import Reader
from paradize.formats.glb.writer import joined


def cut_glb(
    data: bytes, *, finer: int = 0, attributes: Collection[str] | None = None, file: object = None
) -> bytes:
    """The same mesh without its `finer` finest levels (the next one becomes `lod0`), and with these of its
    attributes alone (glTF's names; None: all). Levels keep their errors, which are against what level 0 was.

    Raises FormatError for a GLB that is not ours, ValueError where no level would be left.
    """
    reader = Reader(data, file)
    tree, binary = reader.document, reader.binary
    if not 0 <= finer < len(tree["nodes"]):
        raise ValueError(f"{finer} levels of {len(tree['nodes'])} cannot be left out")
    nodes, meshes = tree["nodes"][finer:], tree["meshes"][finer:]
    for mesh in meshes:
        for primitive in mesh["primitives"]:
            primitive["attributes"] = {
                key: accessor
                for key, accessor in primitive["attributes"].items()
                if attributes is None or key in attributes
            }
    used = sorted({index for mesh in meshes for index in _accessors(mesh)})
    views = sorted({tree["accessors"][index]["bufferView"] for index in used})
    moved = bytearray()
    kept_views = []
    for index in views:  # in the order of the file: the coarsest level first
        view = tree["bufferViews"][index]
        moved += b"\0" * (-len(moved) % 16)
        start = view["byteOffset"]
        kept_views.append(view | {"byteOffset": len(moved)})
        moved += binary[start : start + view["byteLength"]]
    new_view = {index: k for k, index in enumerate(views)}
    new_accessor = {index: k for k, index in enumerate(used)}
    for k, (node, mesh) in enumerate(zip(nodes, meshes, strict=True)):
        node |= {"name": f"lod{k}", "mesh": k}
        node.pop("extensions", None)
        mesh["name"] = f"lod{k}"
        for primitive in mesh["primitives"]:
            primitive["indices"] = new_accessor[primitive["indices"]]
            primitive["attributes"] = {
                key: new_accessor[index] for key, index in primitive["attributes"].items()
            }
    extensions = [QUANTIZATION] if QUANTIZATION in tree.get("extensionsRequired", []) else []
    if len(nodes) > 1:
        extensions.append("MSFT_lod")
        nodes[0]["extensions"] = {"MSFT_lod": {"ids": list(range(1, len(nodes)))}}
    tree.pop("extensionsUsed", None)
    told: dict[str, Any] = {"asset": tree.pop("asset")}
    if "extensionsRequired" in tree:
        told["extensionsRequired"] = tree.pop("extensionsRequired")
    if extensions:
        told["extensionsUsed"] = extensions
    told |= tree | {
        "nodes": nodes,
        "meshes": meshes,
        "accessors": [
            tree["accessors"][index] | {"bufferView": new_view[tree["accessors"][index]["bufferView"]]}
            for index in used
        ],
        "bufferViews": kept_views,
        "buffers": [{"byteLength": len(moved)}],
    }
    text = json.dumps(told, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
    return joined(text, moved)


def _accessors(mesh: dict[str, Any]) -> list[int]:
    return [
        index
        for primitive in mesh["primitives"]
        for index in (primitive["indices"], *primitive["attributes"].values())
    ]

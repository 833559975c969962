"""Removes the levels of detail and attributes of a GLB that the scene does not need."""

from __future__ import annotations

import json
from collections.abc import Collection
from typing import Any

from paradize.formats.glb.layout import QUANTIZATION
from paradize.formats.glb.measures import measured_entries
from paradize.formats.glb.reader import Reader, read_level
from paradize.formats.glb.writer import join_chunks


def cut_glb(
    data: bytes,
    *,
    finer: int = 0,
    coarser: int = 0,
    attributes: Collection[str] | None = None,
    file: object = None,
) -> bytes:
    """Returns the same mesh without its `finer` finest levels (the next one becomes `lod0`) and its `coarser`
    coarsest, and with only these attributes (glTF names; None: all). Levels keep their errors, which are
    relative to the original level 0.

    Raises FormatError for a GLB that we did not write, ValueError where no level would remain.
    """
    reader = Reader(data, file)
    tree, binary = reader.document, reader.binary
    count = len(tree["nodes"])
    if finer < 0 or coarser < 0 or finer + coarser >= count:
        raise ValueError(f"cannot remove {finer + coarser} of {count} levels")
    kept = slice(finer, count - coarser)
    nodes, meshes = tree["nodes"][kept], tree["meshes"][kept]
    for mesh in meshes:
        for primitive in mesh["primitives"]:
            primitive["attributes"] = {
                key: accessor
                for key, accessor in primitive["attributes"].items()
                if attributes is None or key in attributes
            }
    tree["materials"] = measured_entries(tree["materials"], read_level(reader, count - coarser - 1))
    used = sorted({index for mesh in meshes for index in _accessors(mesh)})
    views = sorted({tree["accessors"][index]["bufferView"] for index in used})
    new_binary = bytearray()
    new_views = []
    for index in views:  # in the order of the file: the coarsest level first
        view = tree["bufferViews"][index]
        new_binary += b"\0" * (-len(new_binary) % 16)
        start = view["byteOffset"]
        new_views.append(view | {"byteOffset": len(new_binary)})
        new_binary += binary[start : start + view["byteLength"]]
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
    document: dict[str, Any] = {"asset": tree.pop("asset")}
    if "extensionsRequired" in tree:
        document["extensionsRequired"] = tree.pop("extensionsRequired")
    if extensions:
        document["extensionsUsed"] = extensions
    document |= tree | {
        "nodes": nodes,
        "meshes": meshes,
        "accessors": [
            tree["accessors"][index] | {"bufferView": new_view[tree["accessors"][index]["bufferView"]]}
            for index in used
        ],
        "bufferViews": new_views,
        "buffers": [{"byteLength": len(new_binary)}],
    }
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
    return join_chunks(text, new_binary)


def _accessors(mesh: dict[str, Any]) -> list[int]:
    return [
        index
        for primitive in mesh["primitives"]
        for index in (primitive["indices"], *primitive["attributes"].values())
    ]

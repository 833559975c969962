"""Writes meshes as GLB (binary glTF 2.0), with levels of detail; reader.py reads them back.

Source: The Khronos Group, "glTF 2.0 Specification", 2021; MSFT_lod: Microsoft, vendor extension, 2017.
FORMAT.md describes the bytes.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import Lod, Mesh, rounded
from paradize.errors import BakeError
from paradize.formats.glb.layout import ATTRIBUTES, QUANTIZATION, SHAPES, SHARES
from paradize.formats.glb.materials import extensions_of, material_entry, plain_material
from paradize.formats.glb.measures import measured_entries
from paradize.formats.glb.writer import Writer, join_chunks, node_transform

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from paradize.material import Material

_MAX_BYTES = (1 << 32) - 128  # minus headers and padding


def encode_glb(
    lods: Sequence[Lod],
    name: str,
    base_colors: Mapping[str, Sequence[float]] | None = None,
    described: Mapping[str, Material] | None = None,
) -> bytes:
    """Writes levels of detail. In `lods` the finest level is first; in the binary chunk the coarsest.

    Each level becomes a node `lod<k>` with a mesh of one primitive per group. The node's extras hold
    error_max and error_rms (fractions of the diagonal of level 0's bounding box), error_m (metres: the
    largest error_max or uv_shift_p99 of this level and all finer ones) and the level's other errors. All
    levels are quantised on one grid, or none is; all have one origin, the translation of the nodes.
    base_colors: linear RGB by material name, clamped to 0..1; default white. described: materials by name,
    whose factors are written instead; pictures are none.

    Raises BakeError for arrays that do not fit each other, values that are not finite, and more than 4 GiB.
    """
    if not lods:
        raise BakeError("a mesh file needs at least one level of detail", file=name)
    for index, lod in enumerate(lods):
        _check_mesh(lod.mesh, f"{name}: lod{index}")
        _check_quantised(lod, lods[0], f"{name}: lod{index}")
        if lod.mesh.origin != lods[0].mesh.origin:
            raise BakeError("all levels must have one origin", file=f"{name}: lod{index}")
    first = lods[0].mesh.positions
    size = [float(first[:, axis].max()) - float(first[:, axis].min()) for axis in range(3)]
    diagonal = float(np.sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2]))
    writer = Writer()
    materials: dict[str, int] = {}
    for lod in lods:
        for group in lod.mesh.all_groups:
            materials.setdefault(group.material, len(materials))
    meshes: list[dict[str, Any]] = [{} for _ in lods]
    for index in reversed(range(len(lods))):
        meshes[index] = _append_level(writer, lods[index], f"lod{index}", materials)
    nodes: list[dict[str, Any]] = []
    error_so_far = 0.0
    for index, lod in enumerate(lods):
        # A texture that slides is as visible as a surface that moves as far.
        error_so_far = max(error_so_far, lod.error_max, lod.errors.get("uv_shift_p99", 0.0))
        errors = {"error_max": lod.error_max, "error_rms": lod.error_rms, "error_m": error_so_far * diagonal}
        extras_of_node = {key: rounded(value) for key, value in (errors | dict(lod.errors)).items()}
        transform = node_transform(lod.mesh.origin, lod.quantised.grid if lod.quantised else None)
        nodes.append({"name": f"lod{index}", "mesh": index, **transform, "extras": extras_of_node})
    document: dict[str, Any] = {"asset": {"version": "2.0", "generator": "paradize"}}
    entries = [
        material_entry(material, described[material])
        if described and material in described
        else plain_material(material, (base_colors or {}).get(material))
        for material in materials
    ]
    extensions = [QUANTIZATION] if lods[0].quantised is not None else []
    if extensions:
        document["extensionsRequired"] = extensions
    extensions = extensions + extensions_of(entries)
    if len(lods) > 1:
        extensions = [*extensions, "MSFT_lod"]
        nodes[0]["extensions"] = {"MSFT_lod": {"ids": list(range(1, len(lods)))}}
    if extensions:
        document["extensionsUsed"] = extensions
    document |= {
        "scene": 0,
        "scenes": [{"name": name, "nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": measured_entries(entries, lods[-1]),
        "accessors": writer.accessors,
        "bufferViews": writer.views,
        "buffers": [{"byteLength": len(writer.binary)}],
    }
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode(
        "utf-8",
        "replace",  # names may contain bytes that are not UTF-8
    )
    if len(text) + len(writer.binary) > _MAX_BYTES:
        total = len(text) + len(writer.binary)
        raise BakeError(f"{total} bytes, limit of the format {_MAX_BYTES}", file=name, mend="split the mesh")
    return join_chunks(text, writer.binary)


def _check_mesh(mesh: Mesh, name: str) -> None:
    count = len(mesh.positions)
    if count == 0 or len(mesh.triangles) == 0:
        raise BakeError("no triangles to write", file=name)
    if int(mesh.triangles.max()) >= count:
        raise BakeError(f"index {int(mesh.triangles.max())} of {count} vertices", file=name)
    for key, attribute, shape in ATTRIBUTES:
        values = getattr(mesh, attribute)
        if values is None:
            continue
        if values.shape != (count, SHAPES[shape]) or values.dtype != np.float32:
            raise BakeError(f"{attribute} is {values.dtype} {values.shape}", file=name)
        if not np.isfinite(values).all():
            first = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
            raise BakeError(f"{attribute} is not finite", file=name, place=f"vertex {first}")
        if key in SHARES and (values.min() < 0 or values.max() > 1):
            raise BakeError(f"{attribute} leave 0 to 1", file=name)
    first = 0
    for group in mesh.all_groups:
        if group.first != first or group.count <= 0:
            raise BakeError(f"group {group.name!r} starts at triangle {group.first}, not {first}", file=name)
        first += group.count
    if first != len(mesh.triangles):
        raise BakeError(f"groups cover {first} of {len(mesh.triangles)} triangles", file=name)


def _check_quantised(lod: Lod, first: Lod, name: str) -> None:
    if (lod.quantised is None) != (first.quantised is None):
        raise BakeError("all levels must be quantised, or none", file=name)
    if lod.quantised is None or first.quantised is None:
        return
    if lod.quantised.grid != first.quantised.grid:
        raise BakeError("all levels must have one quantisation grid", file=name)
    for _, attribute, _ in ATTRIBUTES:
        values, integers = getattr(lod.mesh, attribute), getattr(lod.quantised, attribute)
        if (values is None) != (integers is None) or (values is not None and values.shape != integers.shape):
            raise BakeError(f"the quantised {attribute} do not fit the mesh", file=name)


def _append_level(writer: Writer, lod: Lod, name: str, materials: Mapping[str, int]) -> dict[str, Any]:
    """Appends the vertices and indices of a level to the binary chunk. Returns the level's entry of `meshes`:
    a primitive for each group; they share the vertices, and each has its own index accessor."""
    attributes = writer.vertices(lod.mesh, lod.quantised)
    view, component, size = writer.indices(lod.mesh)
    primitives = []
    for group in lod.mesh.all_groups:
        offset = group.first * 3 * size
        accessor = writer.accessor(view, component, group.count * 3, "SCALAR", byteOffset=offset)
        primitives.append(
            {
                "attributes": attributes,
                "indices": accessor,
                "material": materials[group.material],
                "extras": {"name": group.name},
            }
        )
    return {"name": name, "primitives": primitives}

"""GLB (binary glTF 2.0) meshes: encode_glb writes levels of detail, decode_glb reads back what encode_glb
writes.

Source: The Khronos Group, "glTF 2.0 Specification", 2021; MSFT_lod: Microsoft, vendor extension, 2017. The
byte layout is told in FORMAT.md.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import Group, Lod, Mesh, six
from paradize.errors import BakeError
from paradize.formats.glb.layout import ATTRIBUTES, QUANTIZATION, SHAPES
from paradize.formats.glb.reader import decode_glb, verify_glb
from paradize.formats.glb.writer import Writer, joined, placement

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["decode_glb", "encode_glb", "verify_glb"]

_MAX_BYTES = (1 << 32) - 128  # room for headers and padding


def _material(name: str, base_color: Sequence[float] | None) -> dict[str, Any]:
    if base_color is None:
        return {"name": name}
    factor = [min(max(float(value), 0.0), 1.0) for value in base_color]
    return {"name": name, "pbrMetallicRoughness": {"baseColorFactor": [*factor, 1.0], "metallicFactor": 0.0}}


def encode_glb(
    lods: Sequence[Lod],
    name: str,
    extras: Mapping[str, object] | None = None,
    base_colors: Mapping[str, Sequence[float]] | None = None,
) -> bytes:
    """Writes levels of detail, the finest first in `lods`, the coarsest first in the binary chunk.

    Every level becomes node `lod<k>` with a mesh of one primitive per group; node extras hold error_max and
    error_rms (fractions of level 0's bounding-box diagonal), error_m (metres: the largest error_max or
    uv_shift_p99 of the level and of finer ones) and the level's other errors. All levels have codes, of one
    lattice, or none has, and one origin, which is the nodes' translation. `extras` land in the asset.
    base_colors: linear RGB by material name, clamped to 0..1; white where absent. Raises BakeError on arrays
    that do not fit each other, values that are not finite, or more than 4 GiB.
    """
    if not lods:
        raise BakeError("a mesh file needs one level of detail at least", file=name)
    for at, lod in enumerate(lods):
        _require_sound(lod.mesh, f"{name}: lod{at}")
        _require_codes(lod, lods[0], f"{name}: lod{at}")
        if lod.mesh.origin != lods[0].mesh.origin:
            raise BakeError("levels have one origin", file=f"{name}: lod{at}")
    first = lods[0].mesh.positions
    size = [float(first[:, axis].max()) - float(first[:, axis].min()) for axis in range(3)]
    diagonal = float(np.sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2]))
    writer = Writer()
    materials: dict[str, int] = {}
    for lod in lods:
        for group in _groups(lod.mesh):
            materials.setdefault(group.material, len(materials))
    meshes: list[dict[str, Any]] = [{} for _ in lods]
    for at in reversed(range(len(lods))):
        meshes[at] = _mesh(writer, lods[at], f"lod{at}", materials)
    nodes: list[dict[str, Any]] = []
    off = 0.0
    for at, lod in enumerate(lods):
        # A texture that slid is seen like a surface that moved as far.
        off = max(off, lod.error_max, lod.errors.get("uv_shift_p99", 0.0))
        errors = {"error_max": lod.error_max, "error_rms": lod.error_rms, "error_m": off * diagonal}
        told = {key: six(value) for key, value in (errors | dict(lod.errors)).items()}
        place = placement(lod.mesh.origin, lod.codes.lattice if lod.codes else None)
        nodes.append({"name": f"lod{at}", "mesh": at, **place, "extras": told})
    document: dict[str, Any] = {"asset": {"version": "2.0", "generator": "paradize"}}
    if extras:
        document["asset"]["extras"] = dict(extras)
    used = [QUANTIZATION] if lods[0].codes is not None else []
    if used:
        document["extensionsRequired"] = used
    if len(lods) > 1:
        used = [*used, "MSFT_lod"]
        nodes[0]["extensions"] = {"MSFT_lod": {"ids": list(range(1, len(lods)))}}
    if used:
        document["extensionsUsed"] = used
    document |= {
        "scene": 0,
        "scenes": [{"name": name, "nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [_material(material, (base_colors or {}).get(material)) for material in materials],
        "accessors": writer.accessors,
        "bufferViews": writer.views,
        "buffers": [{"byteLength": len(writer.binary)}],
    }
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode(
        "utf-8",
        "replace",  # names may come from files whose names are no text
    )
    if len(text) + len(writer.binary) > _MAX_BYTES:
        total = len(text) + len(writer.binary)
        raise BakeError(f"{total} bytes, limit of the format {_MAX_BYTES}", file=name, mend="split the mesh")
    return joined(text, writer.binary)


def _groups(mesh: Mesh) -> tuple[Group, ...]:
    return mesh.groups or (Group("default", "default", 0, len(mesh.triangles)),)


def _require_sound(mesh: Mesh, name: str) -> None:
    count = len(mesh.positions)
    if count == 0 or len(mesh.triangles) == 0:
        raise BakeError("no triangles to write", file=name)
    if int(mesh.triangles.max()) >= count:
        raise BakeError(f"index {int(mesh.triangles.max())} of {count} vertices", file=name)
    for _, attribute, shape in ATTRIBUTES:
        values = getattr(mesh, attribute)
        if values is None:
            continue
        if values.shape != (count, SHAPES[shape]) or values.dtype != np.float32:
            raise BakeError(f"{attribute} is {values.dtype} {values.shape}", file=name)
        if not np.isfinite(values).all():
            at = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
            raise BakeError(f"{attribute} is not finite", file=name, place=f"vertex {at}")
    if mesh.colors is not None and (mesh.colors.min() < 0 or mesh.colors.max() > 1):
        raise BakeError("colors leave 0 to 1", file=name)
    at = 0
    for group in _groups(mesh):
        if group.first != at or group.count <= 0:
            raise BakeError(f"group {group.name!r} starts at triangle {group.first}, not {at}", file=name)
        at += group.count
    if at != len(mesh.triangles):
        raise BakeError(f"groups cover {at} of {len(mesh.triangles)} triangles", file=name)


def _require_codes(lod: Lod, first: Lod, name: str) -> None:
    if (lod.codes is None) != (first.codes is None):
        raise BakeError("levels have codes or none has", file=name)
    if lod.codes is None or first.codes is None:
        return
    if lod.codes.lattice != first.codes.lattice:
        raise BakeError("levels lie on one lattice", file=name)
    for _, attribute, _ in ATTRIBUTES:
        values, coded = getattr(lod.mesh, attribute), getattr(lod.codes, attribute)
        if (values is None) != (coded is None) or (values is not None and values.shape != coded.shape):
            raise BakeError(f"the codes of {attribute} do not fit the mesh", file=name)


def _mesh(writer: Writer, lod: Lod, name: str, materials: Mapping[str, int]) -> dict[str, Any]:
    """Appends one level's vertices and indices; primitives share the vertices, each has its own index
    accessor."""
    attributes = writer.vertices(lod.mesh, lod.codes)
    view, component, size = writer.indices(lod.mesh)
    primitives = []
    for group in _groups(lod.mesh):
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

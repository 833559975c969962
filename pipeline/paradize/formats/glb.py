"""GLB (binary glTF 2.0) meshes: encode_glb writes levels of detail, decode_glb reads back what encode_glb
writes.

Source: The Khronos Group, "glTF 2.0 Specification", 2021; MSFT_lod: Microsoft, vendor extension, 2017. The
byte layout is told in FORMAT.md.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import Group, Lod, Mesh
from paradize.errors import BakeError
from paradize.formats.glb_layout import ATTRIBUTES, BIN, CHUNK, FLOAT, HEADER, JSON, MAGIC, SHAPES, U16, U32
from paradize.formats.glb_reader import decode_glb

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["decode_glb", "encode_glb"]

_ARRAY, _ELEMENTS = 34962, 34963
_MAX_BYTES = (1 << 32) - 64
_MAX_U16_VERTICES = 65535  # index 65535 is kept free: it restarts primitives


@dataclass
class _Writer:
    """The binary chunk and the tables that describe it, growing together."""

    binary: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def view(self, data: bytes, target: int) -> int:
        self.binary += b"\0" * (-len(self.binary) % 16)
        self.views.append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), "target": target}
        )
        self.binary += data
        return len(self.views) - 1

    def accessor(self, view: int, component: int, count: int, shape: str, **more: object) -> int:
        entry = {"bufferView": view, "componentType": component, "count": count, "type": shape, **more}
        self.accessors.append(entry)
        return len(self.accessors) - 1


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
    error_rms (fractions of level 0's bounding-box diagonal) and error_m (error_max in metres). `extras`
    land in the asset. base_colors: linear RGB by material name, clamped to 0..1; white where absent. Raises
    BakeError on arrays that do not fit each other, values that are not finite, or more than 4 GiB.
    """
    if not lods:
        raise BakeError("a mesh file needs one level of detail at least", file=name)
    for at, lod in enumerate(lods):
        _require_sound(lod.mesh, f"{name}: lod{at}")
    first = lods[0].mesh.positions.astype(np.float64)
    size = [float(first[:, axis].max() - first[:, axis].min()) for axis in range(3)]
    diagonal = float(np.sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2]))
    writer = _Writer()
    materials: dict[str, int] = {}
    for lod in lods:
        for group in _groups(lod.mesh):
            materials.setdefault(group.material, len(materials))
    meshes: list[dict[str, Any]] = [{} for _ in lods]
    for at in reversed(range(len(lods))):
        meshes[at] = _mesh(writer, lods[at].mesh, f"lod{at}", materials)
    nodes: list[dict[str, Any]] = []
    for at, lod in enumerate(lods):
        errors = {"error_max": lod.error_max, "error_rms": lod.error_rms, "error_m": lod.error_max * diagonal}
        told = {key: float(f"{value:.6g}") for key, value in errors.items()}
        nodes.append({"name": f"lod{at}", "mesh": at, "extras": told})
    document: dict[str, Any] = {"asset": {"version": "2.0", "generator": "paradize"}}
    if extras:
        document["asset"]["extras"] = dict(extras)
    if len(lods) > 1:
        document["extensionsUsed"] = ["MSFT_lod"]
        nodes[0]["extensions"] = {"MSFT_lod": {"ids": list(range(1, len(lods)))}}
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
    # Spaces bring the binary chunk's data to a multiple of 16 in the file, so that it is mapped aligned.
    text += b" " * (-(len(text) + HEADER.size + 2 * CHUNK.size) % 16)
    binary = bytes(writer.binary) + b"\0" * (-len(writer.binary) % 4)
    total = HEADER.size + CHUNK.size * 2 + len(text) + len(binary)
    if total > _MAX_BYTES:
        raise BakeError(f"{total} bytes, limit of the format {_MAX_BYTES}", file=name, mend="split the mesh")
    return b"".join(
        (
            HEADER.pack(MAGIC, 2, total),
            CHUNK.pack(len(text), JSON),
            text,
            CHUNK.pack(len(binary), BIN),
            binary,
        )
    )


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


def _mesh(writer: _Writer, mesh: Mesh, name: str, materials: Mapping[str, int]) -> dict[str, Any]:
    """Appends one level's vertices and indices; primitives share the vertices, each has its own index
    accessor."""
    count = len(mesh.positions)
    attributes = {}
    for key, attribute, shape in ATTRIBUTES:
        values = getattr(mesh, attribute)
        if values is None:
            continue
        view = writer.view(np.ascontiguousarray(values, "<f4").tobytes(), _ARRAY)
        bounds = {}
        if key == "POSITION":
            bounds = {
                "min": [float(x) for x in values.min(axis=0)],
                "max": [float(x) for x in values.max(axis=0)],
            }
        attributes[key] = writer.accessor(view, FLOAT, count, shape, **bounds)
    component, dtype = (U16, "<u2") if count <= _MAX_U16_VERTICES else (U32, "<u4")
    indices = np.ascontiguousarray(mesh.triangles, dtype)
    view = writer.view(indices.tobytes(), _ELEMENTS)
    primitives = []
    for group in _groups(mesh):
        offset = group.first * 3 * indices.itemsize
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

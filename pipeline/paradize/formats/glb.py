"""GLB (binary glTF 2.0) meshes: encode_glb writes levels of detail, decode_glb reads back what encode_glb
writes.

Source: The Khronos Group, "glTF 2.0 Specification", 2021; MSFT_lod: Microsoft, vendor extension, 2017. The
byte layout is told in FORMAT.md.

The reader is strict: it refuses what the writer would not have written, and it compares every offset,
length and count with the file before it uses them.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import Group, Lod, Mesh
from paradize.errors import BakeError, FormatError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy.typing as npt

MAGIC = b"glTF"
_HEADER = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")
_JSON, _BIN = b"JSON", b"BIN\0"
_FLOAT, _U16, _U32 = 5126, 5123, 5125
_ARRAY, _ELEMENTS = 34962, 34963
_SHAPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
# glTF name, field of Mesh, type, in the order of the file.
_ATTRIBUTES = (
    ("POSITION", "positions", "VEC3"),
    ("NORMAL", "normals", "VEC3"),
    ("TANGENT", "tangents", "VEC4"),
    ("TEXCOORD_0", "uvs", "VEC2"),
    ("TEXCOORD_1", "uvs1", "VEC2"),
)
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
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
    # Spaces bring the binary chunk's data to a multiple of 16 in the file, so that it is mapped aligned.
    text += b" " * (-(len(text) + _HEADER.size + 2 * _CHUNK.size) % 16)
    binary = bytes(writer.binary) + b"\0" * (-len(writer.binary) % 4)
    total = _HEADER.size + _CHUNK.size * 2 + len(text) + len(binary)
    if total > _MAX_BYTES:
        raise BakeError(f"{total} bytes, limit of the format {_MAX_BYTES}", file=name, mend="split the mesh")
    return b"".join(
        (
            _HEADER.pack(MAGIC, 2, total),
            _CHUNK.pack(len(text), _JSON),
            text,
            _CHUNK.pack(len(binary), _BIN),
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
    for _, attribute, shape in _ATTRIBUTES:
        values = getattr(mesh, attribute)
        if values is None:
            continue
        if values.shape != (count, _SHAPES[shape]) or values.dtype != np.float32:
            raise BakeError(f"{attribute} is {values.dtype} {values.shape}", file=name)
        if not np.isfinite(values).all():
            at = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
            raise BakeError(f"{attribute} is not finite", file=name, place=f"vertex {at}")
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
    for key, attribute, shape in _ATTRIBUTES:
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
        attributes[key] = writer.accessor(view, _FLOAT, count, shape, **bounds)
    component, dtype = (_U16, "<u2") if count <= _MAX_U16_VERTICES else (_U32, "<u4")
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


class _Reader:
    """Typed access to a GLB's JSON; every fault names the place as a JSON pointer or a byte offset."""

    def __init__(self, data: bytes, file: object) -> None:
        self.file = file
        self.document, self.binary = self._chunks(data)

    def fault(self, what: str, place: str) -> FormatError:
        return FormatError(what, file=self.file, place=place, mend="bake the mesh again")

    def _chunks(self, data: bytes) -> tuple[dict[str, Any], memoryview]:
        if len(data) < _HEADER.size:
            raise self.fault(f"{len(data)} bytes, the header has {_HEADER.size}", f"byte {len(data)}")
        magic, version, total = _HEADER.unpack_from(data)
        if magic != MAGIC:
            raise self.fault(f"not a GLB: magic {magic!r}", "byte 0")
        if version != 2:
            raise self.fault(f"GLB version {version}, expected 2", "byte 4")
        if total != len(data):
            raise self.fault(f"the header says {total} bytes, the file has {len(data)}", "byte 8")
        at = _HEADER.size
        chunks = []
        for kind in (_JSON, _BIN):
            if at + _CHUNK.size > len(data):
                raise self.fault(f"no room for the {kind!r} chunk", f"byte {at}")
            length, found = _CHUNK.unpack_from(data, at)
            if found != kind:
                raise self.fault(f"chunk {found!r}, expected {kind!r}", f"byte {at + 4}")
            at += _CHUNK.size
            if length % 4 or at + length > len(data):
                raise self.fault(f"chunk of {length} bytes, {len(data) - at} left", f"byte {at - 8}")
            chunks.append(memoryview(data)[at : at + length])
            at += length
        if at != len(data):
            raise self.fault(f"{len(data) - at} bytes after the last chunk", f"byte {at}")
        try:
            document = json.loads(
                bytes(chunks[0]), parse_constant=_refuse_constant, object_pairs_hook=_unique_keys
            )
        except (RecursionError, ValueError) as error:
            raise self.fault(f"the JSON chunk cannot be read: {str(error)[:120]}", "byte 20") from error
        if not isinstance(document, dict):
            raise self.fault("the JSON chunk is not an object", "byte 20")
        return document, chunks[1]

    def get(self, owner: object, where: str, key: str, kind: type, default: object = ...) -> Any:
        if not isinstance(owner, dict):
            raise self.fault("not an object", where)
        value = owner.get(key, default)
        if value is ...:
            raise self.fault("missing", f"{where}/{key}")
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise self.fault(f"{str(value)[:40]!r}, expected {kind.__name__}", f"{where}/{key}")
        return value

    def item(self, table: str, index: object, where: str) -> dict[str, Any]:
        entries = self.get(self.document, "", table, list)
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(entries):
            raise self.fault(f"{str(index)[:40]} of {len(entries)} {table}", where)
        if not isinstance(entries[index], dict):
            raise self.fault("not an object", f"/{table}/{index}")
        found: dict[str, Any] = entries[index]
        return found

    def accessor(
        self, index: object, where: str, shape: str, components: tuple[int, ...]
    ) -> npt.NDArray[Any]:
        """The values of one accessor, without a copy."""
        entry = self.item("accessors", index, where)
        here = f"/accessors/{index}"
        if self.get(entry, here, "type", str) != shape:
            raise self.fault(f"{str(entry['type'])[:40]!r}, expected {shape}", f"{here}/type")
        component = self.get(entry, here, "componentType", int)
        if component not in components:
            raise self.fault(f"{component}, expected one of {components}", f"{here}/componentType")
        if "sparse" in entry or entry.get("normalized", False):
            raise self.fault("sparse and normalized accessors are not ours", here)
        count = self.get(entry, here, "count", int)
        offset = self.get(entry, here, "byteOffset", int, 0)
        view_index = self.get(entry, here, "bufferView", int)
        view = self.item("bufferViews", view_index, f"{here}/bufferView")
        there = f"/bufferViews/{view_index}"
        if self.get(view, there, "buffer", int) != 0:
            raise self.fault("only the GLB's own buffer is used", f"{there}/buffer")
        if "byteStride" in view:
            raise self.fault("our views are tightly packed", f"{there}/byteStride")
        start = self.get(view, there, "byteOffset", int, 0)
        length = self.get(view, there, "byteLength", int)
        if start < 0 or start % 4 or length < 1 or start + length > len(self.binary):
            raise self.fault(f"bytes {start} to {start + length} of {len(self.binary)}", there)
        dtype = np.dtype({_FLOAT: "<f4", _U16: "<u2", _U32: "<u4"}[component])
        width = _SHAPES[shape]
        need = count * width * dtype.itemsize
        if count < 1 or offset < 0 or offset % dtype.itemsize or offset + need > length:
            raise self.fault(f"{count} items at {offset} in a view of {length} bytes", here)
        flat = np.frombuffer(self.binary, dtype, count * width, start + offset)
        return flat if width == 1 else flat.reshape(count, width)


def _refuse_constant(name: str) -> object:
    raise ValueError(f"{name} is not JSON")


def _unique_keys(pairs: list[tuple[str, object]]) -> dict[str, object]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("an object holds a key twice")
    return found


def decode_glb(data: bytes, file: object = None) -> list[Lod]:
    """Reads every level of detail, the finest first. Arrays are copies in native order.

    Raises FormatError, with the byte offset or the JSON pointer of the place, on anything that encode_glb
    does not write: bad chunks, tables that do not fit each other, ranges beyond the file, indices beyond
    the vertices, values that are not finite, bounds that are not those of the positions.
    """
    reader = _Reader(data, file)
    asset = reader.get(reader.document, "", "asset", dict)
    if asset.get("version") != "2.0":
        raise reader.fault(
            f"glTF version {str(asset.get('version'))[:20]!r}, expected '2.0'", "/asset/version"
        )
    buffers = reader.get(reader.document, "", "buffers", list)
    if len(buffers) != 1 or "uri" in buffers[0]:
        raise reader.fault("one buffer without uri expected", "/buffers")
    declared = reader.get(buffers[0], "/buffers/0", "byteLength", int)
    if not len(reader.binary) - 3 <= declared <= len(reader.binary):
        raise reader.fault(f"{declared}, the chunk has {len(reader.binary)}", "/buffers/0/byteLength")
    scenes = reader.get(reader.document, "", "scenes", list)
    if len(scenes) != 1 or reader.get(scenes[0], "/scenes/0", "nodes", list) != [0]:
        raise reader.fault("one scene with node 0 expected", "/scenes")
    nodes = reader.get(reader.document, "", "nodes", list)
    root = reader.item("nodes", 0, "/scenes/0/nodes")
    ids: list[object] = []
    if "extensions" in root:
        extensions = reader.get(root, "/nodes/0", "extensions", dict)
        lod = reader.get(extensions, "/nodes/0/extensions", "MSFT_lod", dict)
        ids = reader.get(lod, "/nodes/0/extensions/MSFT_lod", "ids", list)
    if ids != list(range(1, len(nodes))):
        raise reader.fault(
            f"levels {str(ids)[:40]} of {len(nodes)} nodes, expected each once", "/nodes/0/extensions"
        )
    return [_read_level(reader, at) for at in range(len(nodes))]


def _read_level(reader: _Reader, at: int) -> Lod:
    where = f"/nodes/{at}"
    node = reader.item("nodes", at, where)
    if reader.get(node, where, "name", str) != f"lod{at}":
        raise reader.fault(f"{node['name'][:40]!r}, expected 'lod{at}'", f"{where}/name")
    extras = reader.get(node, where, "extras", dict)
    errors = []
    for key in ("error_max", "error_rms"):
        value = extras.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < float("inf"):
            raise reader.fault(f"{str(value)[:40]}, expected a number from 0", f"{where}/extras/{key}")
        errors.append(float(value))
    mesh_index = reader.get(node, where, "mesh", int)
    entry = reader.item("meshes", mesh_index, f"{where}/mesh")
    here = f"/meshes/{mesh_index}"
    primitives = reader.get(entry, here, "primitives", list)
    if not primitives:
        raise reader.fault("no primitives", f"{here}/primitives")
    arrays: dict[str, Any] = {}
    shared = reader.get(primitives[0], f"{here}/primitives/0", "attributes", dict)
    known = {key: (attribute, shape) for key, attribute, shape in _ATTRIBUTES}
    if "POSITION" not in shared or not shared.keys() <= known.keys():
        raise reader.fault(f"attributes {sorted(shared)!r:.80}", f"{here}/primitives/0/attributes")
    for key, index in shared.items():
        attribute, shape = known[key]
        place = f"{here}/primitives/0/attributes/{key}"
        values = reader.accessor(index, place, shape, (_FLOAT,)).astype(np.float32)
        if not np.isfinite(values).all():
            vertex = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
            raise reader.fault(f"{key} of vertex {vertex} is not finite", f"/accessors/{index}")
        arrays[attribute] = values
    count = len(arrays["positions"])
    for attribute, values in arrays.items():
        if len(values) != count:
            raise reader.fault(f"{len(values)} {attribute} for {count} vertices", here)
    _check_bounds(reader, shared["POSITION"], arrays["positions"])
    parts, groups, first = [], [], 0
    for number, primitive in enumerate(primitives):
        place = f"{here}/primitives/{number}"
        if reader.get(primitive, place, "attributes", dict) != shared:
            raise reader.fault("primitives of a level share their attributes", f"{place}/attributes")
        if reader.get(primitive, place, "mode", int, 4) != 4:
            raise reader.fault("only triangles are ours", f"{place}/mode")
        indices = reader.accessor(primitive.get("indices"), f"{place}/indices", "SCALAR", (_U16, _U32))
        if len(indices) % 3:
            raise reader.fault(f"{len(indices)} indices are not whole triangles", f"{place}/indices")
        if int(indices.max()) >= count:
            raise reader.fault(f"index {int(indices.max())} of {count} vertices", f"{place}/indices")
        material = reader.item("materials", primitive.get("material"), f"{place}/material")
        name = reader.get(reader.get(primitive, place, "extras", dict), f"{place}/extras", "name", str)
        groups.append(
            Group(
                name,
                reader.get(material, f"/materials/{primitive['material']}", "name", str),
                first,
                len(indices) // 3,
            )
        )
        parts.append(indices.astype(np.uint32).reshape(-1, 3))
        first += len(indices) // 3
    return Lod(Mesh(**arrays, triangles=np.concatenate(parts), groups=tuple(groups)), errors[0], errors[1])


def _check_bounds(reader: _Reader, index: int, positions: npt.NDArray[np.float32]) -> None:
    entry = reader.item("accessors", index, "")
    for key, values in (("min", positions.min(axis=0)), ("max", positions.max(axis=0))):
        told = reader.get(entry, f"/accessors/{index}", key, list)
        if told != [float(x) for x in values]:
            raise reader.fault("not the bounds of the positions", f"/accessors/{index}/{key}")

"""The strict reader of `glb.py`: it refuses what the writer would not have written, and it compares every
offset, length and count with the file before it uses them."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Group, Lod, Mesh
from paradize.errors import FormatError
from paradize.formats.glb_layout import ATTRIBUTES, BIN, CHUNK, FLOAT, HEADER, JSON, MAGIC, SHAPES, U16, U32


class _Reader:
    """Typed access to a GLB's JSON; every fault names the place as a JSON pointer or a byte offset."""

    def __init__(self, data: bytes, file: object) -> None:
        self.file = file
        self.document, self.binary = self._chunks(data)

    def fault(self, what: str, place: str) -> FormatError:
        return FormatError(what, file=self.file, place=place, mend="bake the mesh again")

    def _chunks(self, data: bytes) -> tuple[dict[str, Any], memoryview]:
        if len(data) < HEADER.size:
            raise self.fault(f"{len(data)} bytes, the header has {HEADER.size}", f"byte {len(data)}")
        magic, version, total = HEADER.unpack_from(data)
        if magic != MAGIC:
            raise self.fault(f"not a GLB: magic {magic!r}", "byte 0")
        if version != 2:
            raise self.fault(f"GLB version {version}, expected 2", "byte 4")
        if total != len(data):
            raise self.fault(f"the header says {total} bytes, the file has {len(data)}", "byte 8")
        at = HEADER.size
        chunks = []
        for kind in (JSON, BIN):
            if at + CHUNK.size > len(data):
                raise self.fault(f"no room for the {kind!r} chunk", f"byte {at}")
            length, found = CHUNK.unpack_from(data, at)
            if found != kind:
                raise self.fault(f"chunk {found!r}, expected {kind!r}", f"byte {at + 4}")
            at += CHUNK.size
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
        dtype = np.dtype({FLOAT: "<f4", U16: "<u2", U32: "<u4"}[component])
        width = SHAPES[shape]
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
    if len(buffers) != 1:
        raise reader.fault("one buffer expected", "/buffers")
    declared = reader.get(buffers[0], "/buffers/0", "byteLength", int)
    if "uri" in buffers[0]:
        raise reader.fault("a buffer without uri expected", "/buffers/0")
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
    known = {key: (attribute, shape) for key, attribute, shape in ATTRIBUTES}
    if "POSITION" not in shared or not shared.keys() <= known.keys():
        raise reader.fault(f"attributes {sorted(shared)!r:.80}", f"{here}/primitives/0/attributes")
    for key, index in shared.items():
        attribute, shape = known[key]
        place = f"{here}/primitives/0/attributes/{key}"
        values = reader.accessor(index, place, shape, (FLOAT,)).astype(np.float32)
        if not np.isfinite(values).all():
            vertex = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
            raise reader.fault(f"{key} of vertex {vertex} is not finite", f"/accessors/{index}")
        if key == "COLOR_0" and (values.min() < 0 or values.max() > 1):
            raise reader.fault("colours leave 0 to 1", f"/accessors/{index}")
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
        indices = reader.accessor(primitive.get("indices"), f"{place}/indices", "SCALAR", (U16, U32))
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
        if first * 6 > len(reader.binary):  # else a small file could ask for endless triangles
            raise reader.fault(f"{first} triangles of {len(reader.binary)} bytes", place)
    return Lod(Mesh(**arrays, triangles=np.concatenate(parts), groups=tuple(groups)), errors[0], errors[1])


def _check_bounds(reader: _Reader, index: int, positions: npt.NDArray[np.float32]) -> None:
    entry = reader.item("accessors", index, "")
    for key, values in (("min", positions.min(axis=0)), ("max", positions.max(axis=0))):
        told = reader.get(entry, f"/accessors/{index}", key, list)
        if told != [float(x) for x in values]:
            raise reader.fault("not the bounds of the positions", f"/accessors/{index}/{key}")

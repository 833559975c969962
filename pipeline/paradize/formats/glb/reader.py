"""The strict reader of `glb.py`: it refuses what the writer would not have written, and it compares every
offset, length and count with the file before it uses them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import ORIGIN, Group, Lod, Mesh, QuantizationGrid, QuantizedValues, Vec3
from paradize.documents import parse_json
from paradize.errors import FormatError
from paradize.formats.glb.codes import apart, decoded
from paradize.formats.glb.layout import (
    ATTRIBUTES,
    BIN,
    CHUNK,
    CODED,
    DTYPES,
    FLOAT,
    HEADER,
    JSON,
    MAGIC,
    QUANTIZATION,
    SHAPES,
    U16,
    U32,
)


class Reader:
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
            document = parse_json(chunks[0])
        except FormatError as error:
            raise self.fault(f"the JSON chunk cannot be read: {error}", "byte 20") from None
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
        self, index: object, where: str, shape: str, components: tuple[int, ...], normalized: bool = False
    ) -> npt.NDArray[Any]:
        """The values of one accessor, without a copy. normalized: what it must be, of codes."""
        entry = self.item("accessors", index, where)
        here = f"/accessors/{index}"
        if self.get(entry, here, "type", str) != shape:
            raise self.fault(f"{str(entry['type'])[:40]!r}, expected {shape}", f"{here}/type")
        component = self.get(entry, here, "componentType", int)
        if component not in components:
            raise self.fault(f"{component}, expected one of {components}", f"{here}/componentType")
        if "sparse" in entry:
            raise self.fault("sparse accessors are not ours", here)
        if self.get(entry, here, "normalized", bool, False) != (normalized and component != FLOAT):
            raise self.fault("normalized where it is not, or not where it is", f"{here}/normalized")
        count = self.get(entry, here, "count", int)
        offset = self.get(entry, here, "byteOffset", int, 0)
        view_index = self.get(entry, here, "bufferView", int)
        view = self.item("bufferViews", view_index, f"{here}/bufferView")
        there = f"/bufferViews/{view_index}"
        if self.get(view, there, "buffer", int) != 0:
            raise self.fault("only the GLB's own buffer is used", f"{there}/buffer")
        start = self.get(view, there, "byteOffset", int, 0)
        length = self.get(view, there, "byteLength", int)
        if start < 0 or start % 4 or length < 1 or start + length > len(self.binary):
            raise self.fault(f"bytes {start} to {start + length} of {len(self.binary)}", there)
        dtype = np.dtype(DTYPES[component])
        width = SHAPES[shape]
        packed = width * dtype.itemsize
        stride = packed if width == 1 else -(-packed // 4) * 4
        if ("byteStride" in view) != (stride != packed) or view.get("byteStride", stride) != stride:
            what = "tightly packed" if stride == packed else f"padded to {stride} bytes a row"
            raise self.fault(f"our views are {what}", f"{there}/byteStride")
        need = count * stride
        if count < 1 or offset < 0 or offset % dtype.itemsize or offset + need > length:
            raise self.fault(f"{count} items at {offset} in a view of {length} bytes", here)
        raw = self.binary[start + offset : start + offset + need]
        if width == 1:
            return np.frombuffer(raw, dtype)
        return np.ndarray((count, width), dtype, raw, 0, (stride, dtype.itemsize))


def decode_glb(data: bytes, file: object = None) -> list[Lod]:
    """Reads every level of detail, the finest first. Arrays are copies in native order.

    Raises FormatError, with the byte offset or the JSON pointer of the place, on anything that encode_glb
    does not write: bad chunks, tables that do not fit each other, ranges beyond the file, indices beyond
    the vertices, values that are not finite, bounds that are not those of the positions.
    """
    return list(_levels(Reader(data, file)))


def verify_glb(data: bytes, file: object = None) -> None:
    """Raises what decode_glb does, and holds one level at a time."""
    for _ in _levels(Reader(data, file)):
        pass


def _levels(reader: Reader) -> Iterator[Lod]:
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
    for key, names in (
        ("extensionsRequired", (QUANTIZATION,)),
        ("extensionsUsed", (QUANTIZATION, "MSFT_lod")),
    ):
        listed = reader.get(reader.document, "", key, list, [])
        if any(name not in names for name in listed):
            raise reader.fault(f"{str(listed)[:80]}, expected of {', '.join(names)}", f"/{key}")
    lattices, origins = set(), set()
    for at in range(len(nodes)):
        level = _read_level(reader, at)
        lattices.add(level.codes.lattice if level.codes else None)
        origins.add(level.mesh.origin)
        yield level
        del level
    if len(lattices) > 1 or len(origins) > 1:
        raise reader.fault("levels of one mesh have one translation and one scale", "/nodes")
    if (QUANTIZATION in reader.document.get("extensionsRequired", [])) != (lattices != {None}):
        raise reader.fault(f"{QUANTIZATION} is required where there are codes", "/extensionsRequired")


def lattice_of(reader: Reader, node: dict[str, Any], where: str, coded: bool) -> QuantizationGrid | None:
    """The lattice that a node of codes states; a node of floats states none."""
    if not coded:
        _refuse(reader, node, where, "translation", "scale", "rotation", "matrix")
        return None
    scale = _numbers(reader, node, where, "scale", 2.0**-126)
    return QuantizationGrid(scale, _numbers(reader, node, where, "translation", -1e39))


def _origin_of(reader: Reader, node: dict[str, Any], where: str) -> Vec3:
    """Where a node of floats stands."""
    _refuse(reader, node, where, "scale", "rotation", "matrix")
    return _numbers(reader, node, where, "translation", -1e39) if "translation" in node else ORIGIN


def _refuse(reader: Reader, node: dict[str, Any], where: str, *keys: str) -> None:
    for key in keys:
        if key in node:
            raise reader.fault("a node of floats has none", f"{where}/{key}")


def _numbers(reader: Reader, node: dict[str, Any], where: str, key: str, low: float) -> Vec3:
    values = reader.get(node, where, key, list)
    if len(values) != 3 or not all(
        isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= 1e39
        for value in values
    ):
        raise reader.fault(f"{str(values)[:80]}, expected three numbers", f"{where}/{key}")
    return float(values[0]), float(values[1]), float(values[2])


def _read_level(reader: Reader, at: int) -> Lod:
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
    more = {key: value for key, value in extras.items() if key not in ("error_max", "error_rms", "error_m")}
    for key, value in more.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < float("inf"):
            raise reader.fault(f"{str(value)[:40]}, expected a number", f"{where}/extras/{key}")
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
        components, normalized = CODED[key]
        values = reader.accessor(index, place, shape, (FLOAT, *components), normalized)
        if values.dtype.kind == "i" and int(values.min()) < -np.iinfo(values.dtype).max:
            raise reader.fault(f"a code of {int(values.min())}", f"/accessors/{index}")
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            vertex = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
            raise reader.fault(f"{key} of vertex {vertex} is not finite", f"/accessors/{index}")
        if key == "COLOR_0" and values.dtype.kind == "f" and (values.min() < 0 or values.max() > 1):
            raise reader.fault("colours leave 0 to 1", f"/accessors/{index}")
        arrays[attribute] = np.ascontiguousarray(values, values.dtype.newbyteorder("="))
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
    codes = None
    if arrays["positions"].dtype == np.float32:
        origin = _origin_of(reader, node, where)
    else:
        stated = lattice_of(reader, node, where, coded=True)
        assert stated is not None
        origin, lattice = apart(stated)
        codes = QuantizedValues(lattice, **arrays)
        arrays = decoded(codes)
        if not np.isfinite(arrays["positions"]).all():
            raise reader.fault("places beyond the largest float", where)
    if codes is None and any(values.dtype != np.float32 for values in arrays.values()):
        raise reader.fault("codes beside positions that are floats", here)
    mesh = Mesh(**arrays, triangles=np.concatenate(parts), groups=tuple(groups), origin=origin)
    return Lod(mesh, errors[0], errors[1], more, codes)


def _check_bounds(reader: Reader, index: int, positions: npt.NDArray[Any]) -> None:
    entry = reader.item("accessors", index, "")
    for key, values in (("min", positions.min(axis=0)), ("max", positions.max(axis=0))):
        told = reader.get(entry, f"/accessors/{index}", key, list)
        if told != [float(x) for x in values]:
            raise reader.fault("not the bounds of the positions", f"/accessors/{index}/{key}")

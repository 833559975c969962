"""A strict GLB reader. It refuses everything that the writer would not write, and compares all offsets,
lengths and counts with the file before it uses them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import ORIGIN, Group, Lod, Mesh, QuantisationGrid, QuantisedValues, Vec3
from paradize.documents import json_kind, parse_json
from paradize.errors import FormatError
from paradize.formats.glb.layout import (
    ATTRIBUTES,
    BIN,
    CHUNK,
    DTYPES,
    FLOAT,
    HEADER,
    JSON,
    MAGIC,
    MATERIAL_EXTENSIONS,
    QUANTISED_TYPES,
    QUANTIZATION,
    SHAPES,
    SHARES,
    U16,
    U32,
)
from paradize.formats.glb.measures import MAX_UV_PER_M
from paradize.formats.glb.quantised import decoded, split_origin


class Reader:
    """Typed access to the JSON of a GLB. Each fault names its place: a JSON pointer or a byte offset."""

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
        offset = HEADER.size
        chunks = []
        for kind in (JSON, BIN):
            if offset + CHUNK.size > len(data):
                raise self.fault(f"the file ends before the {kind!r} chunk", f"byte {offset}")
            length, actual = CHUNK.unpack_from(data, offset)
            if actual != kind:
                raise self.fault(f"chunk {actual!r}, expected {kind!r}", f"byte {offset + 4}")
            offset += CHUNK.size
            if length % 4 or offset + length > len(data):
                raise self.fault(f"chunk of {length} bytes, {len(data) - offset} left", f"byte {offset - 8}")
            chunks.append(memoryview(data)[offset : offset + length])
            offset += length
        if offset != len(data):
            raise self.fault(f"{len(data) - offset} bytes after the last chunk", f"byte {offset}")
        try:
            document = parse_json(chunks[0])
        except FormatError as error:
            raise self.fault(f"the JSON chunk cannot be read: {error}", "byte 20") from None
        if not isinstance(document, dict):
            raise self.fault(f"the JSON chunk is {json_kind(document)}, not an object", "byte 20")
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
        entry: dict[str, Any] = entries[index]
        return entry

    def accessor(
        self, index: object, where: str, shape: str, components: tuple[int, ...], normalized: bool = False
    ) -> npt.NDArray[Any]:
        """The values of an accessor, without a copy. normalized: the expected flag of integer components."""
        entry = self.item("accessors", index, where)
        pointer = f"/accessors/{index}"
        if self.get(entry, pointer, "type", str) != shape:
            raise self.fault(f"{str(entry['type'])[:40]!r}, expected {shape}", f"{pointer}/type")
        component = self.get(entry, pointer, "componentType", int)
        if component not in components:
            raise self.fault(f"{component}, expected one of {components}", f"{pointer}/componentType")
        if "sparse" in entry:
            raise self.fault("sparse accessors are not supported", pointer)
        if self.get(entry, pointer, "normalized", bool, False) != (normalized and component != FLOAT):
            raise self.fault("wrong value of `normalized`", f"{pointer}/normalized")
        count = self.get(entry, pointer, "count", int)
        offset = self.get(entry, pointer, "byteOffset", int, 0)
        view_index = self.get(entry, pointer, "bufferView", int)
        view = self.item("bufferViews", view_index, f"{pointer}/bufferView")
        view_pointer = f"/bufferViews/{view_index}"
        if self.get(view, view_pointer, "buffer", int) != 0:
            raise self.fault("only the GLB's own buffer is used", f"{view_pointer}/buffer")
        start = self.get(view, view_pointer, "byteOffset", int, 0)
        length = self.get(view, view_pointer, "byteLength", int)
        if start < 0 or start % 4 or length < 1 or start + length > len(self.binary):
            raise self.fault(f"bytes {start} to {start + length} of {len(self.binary)}", view_pointer)
        dtype = np.dtype(DTYPES[component])
        width = SHAPES[shape]
        packed = width * dtype.itemsize
        stride = packed if width == 1 else -(-packed // 4) * 4
        if ("byteStride" in view) != (stride != packed) or view.get("byteStride", stride) != stride:
            what = "tightly packed" if stride == packed else f"padded to {stride} bytes a row"
            raise self.fault(f"expected a view that is {what}", f"{view_pointer}/byteStride")
        need = count * stride
        if count < 1 or offset < 0 or offset % dtype.itemsize or offset + need > length:
            raise self.fault(f"{count} items at {offset} in a view of {length} bytes", pointer)
        raw = self.binary[start + offset : start + offset + need]
        if width == 1:
            return np.frombuffer(raw, dtype)
        return np.ndarray((count, width), dtype, raw, 0, (stride, dtype.itemsize))


def decode_glb(data: bytes, file: object = None) -> list[Lod]:
    """Reads all levels of detail, the finest first. Arrays are copies in native byte order.

    Raises FormatError, with a byte offset or JSON pointer, for everything that encode_glb does not write:
    wrong chunks, inconsistent tables, ranges outside the file, indices out of range, values that are not
    finite, wrong bounds.
    """
    return list(_levels(Reader(data, file)))


def verify_glb(data: bytes, file: object) -> None:
    """Raises as decode_glb, with only one level in memory at a time."""
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
        ("extensionsUsed", (QUANTIZATION, "MSFT_lod", *MATERIAL_EXTENSIONS)),
    ):
        listed = reader.get(reader.document, "", key, list, [])
        if any(name not in names for name in listed):
            raise reader.fault(f"{str(listed)[:80]}, expected of {', '.join(names)}", f"/{key}")
    grids, origins = set(), set()
    for index in range(len(nodes)):
        level = read_level(reader, index)
        grids.add(level.quantised.grid if level.quantised else None)
        origins.add(level.mesh.origin)
        if index + 1 == len(nodes):
            _check_measures(reader, level)
        yield level
        del level
    if len(grids) > 1 or len(origins) > 1:
        raise reader.fault("all levels must have one translation and one scale", "/nodes")
    if (QUANTIZATION in reader.document.get("extensionsRequired", [])) != (grids != {None}):
        raise reader.fault(
            f"{QUANTIZATION} is required exactly where vertices are quantised", "/extensionsRequired"
        )


def _check_measures(reader: Reader, coarsest: Lod) -> None:
    """Checks the form of what materials say of this level; a rule of `check` holds it against the level."""
    drawn = {group.material for group in coarsest.mesh.all_groups}
    coordinates = (("uv_per_m", coarsest.mesh.uvs), ("uv1_per_m", coarsest.mesh.uvs1))
    for index in range(len(reader.get(reader.document, "", "materials", list))):
        pointer = f"/materials/{index}"
        entry = reader.item("materials", index, pointer)
        if reader.get(entry, pointer, "name", str) not in drawn:
            if "extras" in entry:
                raise reader.fault("the coarsest level does not draw this material", f"{pointer}/extras")
            continue
        extras = reader.get(entry, pointer, "extras", dict)
        _numbers(reader, extras, f"{pointer}/extras", "center", -1e39)
        keys = ["center", *(key for key, values in coordinates if values is not None)]
        if sorted(extras) != sorted(keys):
            raise reader.fault(f"members {sorted(extras)!r:.80}, expected {keys}", f"{pointer}/extras")
        for key in keys[1:]:
            value = extras[key]
            if (
                isinstance(value, bool)
                or not isinstance(value, int | float)
                or not 0 <= value <= MAX_UV_PER_M
            ):
                raise reader.fault(f"{str(value)[:40]}, expected a number from 0", f"{pointer}/extras/{key}")


def grid_of(reader: Reader, node: dict[str, Any], pointer: str, coded: bool) -> QuantisationGrid | None:
    """The quantisation grid that a node declares; None for a node with float vertices, which declares
    none."""
    if not coded:
        _refuse(reader, node, pointer, "translation", "scale", "rotation", "matrix")
        return None
    scale = _numbers(reader, node, pointer, "scale", 2.0**-126)
    return QuantisationGrid(scale, _numbers(reader, node, pointer, "translation", -1e39))


def _origin_of(reader: Reader, node: dict[str, Any], where: str) -> Vec3:
    """The origin of a node with float vertices."""
    _refuse(reader, node, where, "scale", "rotation", "matrix")
    return _numbers(reader, node, where, "translation", -1e39) if "translation" in node else ORIGIN


def _refuse(reader: Reader, node: dict[str, Any], where: str, *keys: str) -> None:
    for key in keys:
        if key in node:
            raise reader.fault("not allowed for float vertices", f"{where}/{key}")


def _numbers(reader: Reader, node: dict[str, Any], where: str, key: str, low: float) -> Vec3:
    values = reader.get(node, where, key, list)
    if len(values) != 3 or not all(
        isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= 1e39
        for value in values
    ):
        raise reader.fault(f"{str(values)[:80]}, expected three numbers", f"{where}/{key}")
    return float(values[0]), float(values[1]), float(values[2])


def read_level(reader: Reader, number: int) -> Lod:
    """One level of detail; 0 is the finest."""
    pointer = f"/nodes/{number}"
    node = reader.item("nodes", number, pointer)
    if reader.get(node, pointer, "name", str) != f"lod{number}":
        raise reader.fault(f"{node['name'][:40]!r}, expected 'lod{number}'", f"{pointer}/name")
    error_max, error_rms, other_errors = _errors_of(reader, node, pointer)
    mesh_index = reader.get(node, pointer, "mesh", int)
    entry = reader.item("meshes", mesh_index, f"{pointer}/mesh")
    mesh_pointer = f"/meshes/{mesh_index}"
    primitives = reader.get(entry, mesh_pointer, "primitives", list)
    if not primitives:
        raise reader.fault("no primitives", f"{mesh_pointer}/primitives")
    shared = reader.get(primitives[0], f"{mesh_pointer}/primitives/0", "attributes", dict)
    arrays = _read_attributes(reader, shared, mesh_pointer)
    triangles, groups = _read_primitives(reader, primitives, shared, len(arrays["positions"]), mesh_pointer)
    quantised = None
    if arrays["positions"].dtype == np.float32:
        origin = _origin_of(reader, node, pointer)
    else:
        declared = grid_of(reader, node, pointer, coded=True)
        assert declared is not None
        origin, grid = split_origin(declared)
        quantised = QuantisedValues(grid, **arrays)
        arrays = decoded(quantised)
        if not np.isfinite(arrays["positions"]).all():
            raise reader.fault("positions exceed float32", pointer)
    if quantised is None and any(values.dtype != np.float32 for values in arrays.values()):
        raise reader.fault("quantised attributes beside float positions", mesh_pointer)
    mesh = Mesh(**arrays, triangles=triangles, groups=groups, origin=origin)
    return Lod(mesh, error_max, error_rms, other_errors, quantised)


def _errors_of(reader: Reader, node: dict[str, Any], pointer: str) -> tuple[float, float, dict[str, Any]]:
    """error_max, error_rms and the other errors of a level's node."""
    extras = reader.get(node, pointer, "extras", dict)
    errors = []
    for key in ("error_max", "error_rms"):
        value = extras.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < float("inf"):
            raise reader.fault(f"{str(value)[:40]}, expected a number from 0", f"{pointer}/extras/{key}")
        errors.append(float(value))
    others = {key: value for key, value in extras.items() if key not in ("error_max", "error_rms", "error_m")}
    for key, value in others.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < float("inf"):
            raise reader.fault(f"{str(value)[:40]}, expected a number", f"{pointer}/extras/{key}")
    return errors[0], errors[1], others


def _read_attributes(reader: Reader, shared: dict[str, Any], pointer: str) -> dict[str, Any]:
    """The vertex attributes of a mesh by the names of Mesh, as they are stored. pointer: of the mesh."""
    arrays: dict[str, Any] = {}
    known = {key: (attribute, shape) for key, attribute, shape in ATTRIBUTES}
    if "POSITION" not in shared or not shared.keys() <= known.keys():
        raise reader.fault(f"attributes {sorted(shared)!r:.80}", f"{pointer}/primitives/0/attributes")
    for key, index in shared.items():
        attribute, shape = known[key]
        path = f"{pointer}/primitives/0/attributes/{key}"
        components, normalized = QUANTISED_TYPES[key]
        values = reader.accessor(index, path, shape, (FLOAT, *components), normalized)
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            vertex = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
            raise reader.fault(f"{key} of vertex {vertex} is not finite", f"/accessors/{index}")
        if key in SHARES and values.dtype.kind == "f" and (values.min() < 0 or values.max() > 1):
            raise reader.fault(f"values of {key} leave 0 to 1", f"/accessors/{index}")
        arrays[attribute] = np.ascontiguousarray(values, values.dtype.newbyteorder("="))
    count = len(arrays["positions"])
    for attribute, values in arrays.items():
        if len(values) != count:
            raise reader.fault(f"{len(values)} {attribute} for {count} vertices", pointer)
    _check_bounds(reader, shared["POSITION"], arrays["positions"])
    return arrays


def _read_primitives(
    reader: Reader, primitives: list[Any], shared: dict[str, Any], vertices: int, pointer: str
) -> tuple[npt.NDArray[np.uint32], tuple[Group, ...]]:
    """The triangles (n, 3) of a mesh's primitives, one group each. shared: the attributes that all have;
    pointer: of the mesh."""
    parts, groups, first = [], [], 0
    for number, primitive in enumerate(primitives):
        path = f"{pointer}/primitives/{number}"
        if reader.get(primitive, path, "attributes", dict) != shared:
            raise reader.fault("all primitives of a level must share their attributes", f"{path}/attributes")
        if reader.get(primitive, path, "mode", int, 4) != 4:
            raise reader.fault("expected triangles", f"{path}/mode")
        indices = reader.accessor(primitive.get("indices"), f"{path}/indices", "SCALAR", (U16, U32))
        if len(indices) % 3:
            raise reader.fault(f"{len(indices)} indices are not whole triangles", f"{path}/indices")
        if int(indices.max()) >= vertices:
            raise reader.fault(f"index {int(indices.max())} of {vertices} vertices", f"{path}/indices")
        material = reader.item("materials", primitive.get("material"), f"{path}/material")
        extras = reader.get(primitive, path, "extras", dict)
        name = reader.get(extras, f"{path}/extras", "name", str)
        material_name = reader.get(material, f"/materials/{primitive['material']}", "name", str)
        groups.append(Group(name, material_name, first, len(indices) // 3))
        parts.append(indices.astype(np.uint32).reshape(-1, 3))
        first += len(indices) // 3
        if first * 6 > len(reader.binary):  # a small file must not make the reader allocate endless triangles
            raise reader.fault(f"{first} triangles of {len(reader.binary)} bytes", path)
    return np.concatenate(parts), tuple(groups)


def _check_bounds(reader: Reader, index: int, positions: npt.NDArray[Any]) -> None:
    entry = reader.item("accessors", index, "")
    for key, values in (("min", positions.min(axis=0)), ("max", positions.max(axis=0))):
        declared = reader.get(entry, f"/accessors/{index}", key, list)
        if declared != [float(x) for x in values]:
            raise reader.fault("not the bounds of the positions", f"/accessors/{index}/{key}")
